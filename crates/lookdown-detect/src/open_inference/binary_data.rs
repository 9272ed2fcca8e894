//! Tensors as bytes: numbers little-endian and row-major, an element of `BYTES` after its length in
//! four bytes, little-endian (extension `binary_tensor_data`).

use std::num::TryFromIntError;

use bytes::{Buf, BufMut, Bytes};

/// Bytes of the length before an element of `BYTES`.
pub(super) const LENGTH_BYTES: usize = 4;

/// Returns the `count` elements of a tensor of `BYTES`, which are parts of `bytes`.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
pub fn elements(bytes: &Bytes, count: usize) -> Result<Vec<Bytes>, String> {
    let mut rest = bytes.clone();
    let mut elements = Vec::new();
    while rest.has_remaining() {
        if elements.len() == count {
            let sent = rest.len();
            return Err(format!(
                "{sent} bytes follow the {count} elements that its shape needs"
            ));
        }
        let sent = rest.len();
        let length = rest.try_get_u32_le().map_err(|_| {
            format!(
                "{sent} bytes follow element {}: each begins with its length in four bytes, \
                 little-endian",
                elements.len()
            )
        })?;
        let length = length as usize;
        if rest.len() < length {
            let sent = rest.len();
            return Err(format!(
                "its length is {length}, but {sent} bytes follow: send each element after its \
                 length in four bytes, little-endian"
            ));
        }
        elements.push(rest.split_to(length));
    }
    let sent = elements.len();
    if sent < count {
        return Err(format!(
            "it has {sent} elements, but its shape needs {count}: send each after its length in \
             four bytes, little-endian"
        ));
    }
    Ok(elements)
}

/// Appends an element of `BYTES` after its length.
///
/// # Errors
/// Returns an error if the length exceeds four bytes.
pub fn put_element(content: &[u8], bytes: &mut Vec<u8>) -> Result<(), TryFromIntError> {
    bytes.put_u32_le(content.len().try_into()?);
    bytes.put_slice(content);
    Ok(())
}

/// Returns `count` numbers of `FP32`, finite or not.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
pub fn floats(bytes: &[u8], count: usize) -> Result<Vec<f32>, String> {
    let sent = bytes.len();
    if Some(sent) != count.checked_mul(size_of::<f32>()) {
        return Err(format!(
            "it has {sent} bytes, but its shape needs {count} numbers of 4 bytes each"
        ));
    }
    let words = bytes.as_chunks().0.iter();
    Ok(words.map(|&word| f32::from_le_bytes(word)).collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn element(content: &[u8]) -> Bytes {
        let mut bytes = Vec::new();
        put_element(content, &mut bytes).unwrap();
        bytes.into()
    }

    proptest! {
        #[test]
        fn an_element_survives_a_round_trip(content in prop::collection::vec(any::<u8>(), 0..300)) {
            let twice = [element(&content), element(&content)].concat().into();
            prop_assert_eq!(elements(&twice, 2).unwrap(), [content.clone(), content]);
        }

        #[test]
        fn any_bytes_give_an_element_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let bytes = Bytes::from(bytes);
            for count in 0..3 {
                if let Ok(contents) = elements(&bytes, count) {
                    let written: Vec<_> = contents.iter().flat_map(|content| element(content)).collect();
                    prop_assert_eq!(&written[..], &bytes);
                    prop_assert_eq!(contents.len(), count);
                }
            }
        }

        #[test]
        fn any_bytes_give_numbers_or_an_error(
            bytes in prop::collection::vec(any::<u8>(), 0..40), count in any::<usize>(), few in 0_usize..12,
        ) {
            for count in [count, few] {
                if let Ok(numbers) = floats(&bytes, count) {
                    prop_assert_eq!(numbers.len(), count);
                }
            }
        }

        #[test]
        fn finite_numbers_survive_a_round_trip(
            sent in prop::collection::vec(prop::num::f32::NORMAL | prop::num::f32::ZERO, 0..20),
        ) {
            let bytes: Vec<_> = sent.iter().flat_map(|number| number.to_le_bytes()).collect();
            prop_assert_eq!(floats(&bytes, sent.len()).unwrap(), sent);
        }
    }

    #[test]
    fn a_truncated_element_is_refused_with_both_lengths() {
        let error = elements(&Bytes::from_static(b"\x09\0\0\0abc"), 1).unwrap_err();
        assert!(
            error.contains("its length is 9, but 3 bytes follow"),
            "{error}"
        );
    }
}

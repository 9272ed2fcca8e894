//! The values of a tensor that is read: a part of the JSON, or bytes after it.
//!
//! Tensors in JSON: lists, flat or nested like the shape. Elements are converted one by one, as a
//! tree of JSON values takes many times the memory.
//!
//! Tensors as bytes: numbers little-endian and row-major, an element of `BYTES` after its length in
//! four bytes, little-endian (extension `binary_tensor_data`).

use std::{borrow::Cow, fmt, num::TryFromIntError};

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use bytes::{Buf, BufMut, Bytes};
use serde::{
    Serialize,
    de::{DeserializeSeed, Deserializer, Error, SeqAccess, Visitor},
};
use serde_json::value::RawValue;
use strum::{Display, EnumString, IntoStaticStr};

use super::{BINARY_SIZE, HEAD_LENGTH};

/// The values of a tensor as they were sent.
#[derive(Debug)]
pub enum TensorData<'a> {
    /// In the JSON.
    Json(&'a str),
    /// After the JSON.
    Binary(Bytes),
}

impl<'a> TensorData<'a> {
    /// Returns the values of a tensor. With `binary_size`, they are the next bytes of `behind`, the
    /// bytes after the JSON.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn take(
        data: Option<&'a RawValue>,
        binary_size: Option<usize>,
        behind: &mut Bytes,
    ) -> Result<Self, String> {
        match (data, binary_size) {
            (Some(data), None) => Ok(Self::Json(data.get())),
            (None, Some(size)) if size <= behind.len() => Ok(Self::Binary(behind.split_to(size))),
            (None, Some(size)) => {
                let left = behind.len();
                Err(format!(
                    "its {BINARY_SIZE} is {size}, and {left} bytes are left after the JSON, whose \
                     length is said by {HEAD_LENGTH}"
                ))
            }
            (Some(_), Some(_)) => Err(format!(
                "it has data as well as {BINARY_SIZE}: send it once"
            )),
            (None, None) => Err(format!("it has neither data nor {BINARY_SIZE}")),
        }
    }

    /// Returns the largest memory that the elements of a tensor of `BYTES` need besides the
    /// message, in bytes, before they are read.
    pub fn unpacked_bytes(&self) -> usize {
        match self {
            Self::Json(text) => bytes_at_most(text),
            // The values are a part of the message.
            Self::Binary(_) => 0,
        }
    }

    /// Returns the `count` elements of a tensor of `BYTES`.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn elements(self, count: usize) -> Result<Vec<Bytes>, String> {
        match self {
            Self::Json(text) => byte_elements(text, count),
            Self::Binary(bytes) => binary_elements(&bytes, count),
        }
    }

    /// Returns `count` numbers of `FP32`. As bytes, they may be not finite.
    ///
    /// # Errors
    /// The end of a sentence: what was sent, and what is needed.
    pub fn floats(self, count: usize) -> Result<Vec<f32>, String> {
        match self {
            Self::Json(text) => json_floats(text, count),
            Self::Binary(bytes) => binary_floats(&bytes, count),
        }
    }
}

/// Returns the number of elements of a shape; `None` if it exceeds the address space.
pub fn element_count(shape: impl IntoIterator<Item = usize>) -> Option<usize> {
    shape.into_iter().try_fold(1_usize, usize::checked_mul)
}

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Most bytes that [`byte_elements`] returns for data of this length: three of four letters.
fn bytes_at_most(json: &str) -> usize {
    // With the quotes and the separator around it, each element has at least three letters more
    // than are decoded.
    json.len() / 4 * 3
}

/// Most numbers that [`TensorData::floats`] returns for data of this length: each has a digit and a
/// separator.
fn numbers_at_most(json: &str, count: usize) -> usize {
    count.min(json.len() / 2)
}

/// Returns the `count` elements of a tensor of `BYTES`, each encoded in base64.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
fn byte_elements(json: &str, count: usize) -> Result<Vec<Bytes>, String> {
    let mut texts = Texts {
        count,
        values: Vec::new(),
    };
    read(json, &mut texts)?;
    let sent = texts.values.len();
    if sent != count {
        return Err(format!(
            "its data have {sent} elements, but its shape needs {count}: send strings in base64"
        ));
    }
    let bytes = texts.values.iter().map(|text| BASE64.decode(&**text));
    let bytes = bytes.map(|bytes| bytes.map(Bytes::from));
    let bytes = bytes.collect::<Result<_, _>>();
    bytes.map_err(|error| format!("its data are not base64: {error}"))
}

/// Returns `count` finite numbers of `FP32`.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
fn json_floats(json: &str, count: usize) -> Result<Vec<f32>, String> {
    let mut numbers = Numbers {
        count,
        values: Vec::with_capacity(numbers_at_most(json, count)),
    };
    read(json, &mut numbers)?;
    let values = numbers.values;
    if values.len() == count {
        Ok(values)
    } else {
        let sent = values.len();
        Err(format!(
            "it has {sent} numbers, but its shape needs {count}"
        ))
    }
}

/// Receives the elements of a list one by one.
trait Elements<'de> {
    fn number(&mut self, _number: f64) -> Result<(), String> {
        Err("it holds a number: send a string in base64".to_owned())
    }

    fn text(&mut self, _text: Cow<'de, str>) -> Result<(), String> {
        Err("it holds a string: send numbers".to_owned())
    }
}

struct Texts<'de> {
    count: usize,
    values: Vec<Cow<'de, str>>,
}

impl<'de> Elements<'de> for Texts<'de> {
    fn text(&mut self, text: Cow<'de, str>) -> Result<(), String> {
        if self.values.len() < self.count {
            self.values.push(text);
            return Ok(());
        }
        let count = self.count;
        Err(format!(
            "it has more elements than the {count} that its shape needs"
        ))
    }
}

struct Numbers {
    count: usize,
    values: Vec<f32>,
}

impl Elements<'_> for Numbers {
    fn number(&mut self, number: f64) -> Result<(), String> {
        if self.values.len() == self.count {
            let count = self.count;
            return Err(format!(
                "it has more numbers than the {count} that its shape needs"
            ));
        }
        #[expect(clippy::cast_possible_truncation, reason = "FP32 is the target format")]
        let value = number as f32;
        if !value.is_finite() {
            return Err(format!("it holds {number}, which is out of range for FP32"));
        }
        self.values.push(value);
        Ok(())
    }
}

fn read<'de>(json: &'de str, elements: &mut impl Elements<'de>) -> Result<(), String> {
    let mut reader = serde_json::Deserializer::from_str(json);
    if !json.trim_start().starts_with('[') {
        return Err("its data are not a list".to_owned());
    }
    // The position is not useful: the data are one line of many.
    let without_position = |error: serde_json::Error| {
        let error = error.to_string();
        let error = error
            .rsplit_once(" at line ")
            .map_or(&*error, |(error, _)| error);
        format!("its data cannot be used: {error}")
    };
    Reading(elements)
        .deserialize(&mut reader)
        .map_err(without_position)
}

struct Reading<'a, E>(&'a mut E);

impl<'de, E: Elements<'de>> DeserializeSeed<'de> for Reading<'_, E> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de, E: Elements<'de>> Visitor<'de> for Reading<'_, E> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        while list.next_element_seed(Reading(&mut *self.0))?.is_some() {}
        Ok(())
    }

    fn visit_u64<F: Error>(self, number: u64) -> Result<(), F> {
        self.visit_f64(number as f64)
    }

    fn visit_i64<F: Error>(self, number: i64) -> Result<(), F> {
        self.visit_f64(number as f64)
    }

    fn visit_f64<F: Error>(self, number: f64) -> Result<(), F> {
        self.0.number(number).map_err(F::custom)
    }

    fn visit_borrowed_str<F: Error>(self, text: &'de str) -> Result<(), F> {
        self.0.text(Cow::Borrowed(text)).map_err(F::custom)
    }

    fn visit_str<F: Error>(self, text: &str) -> Result<(), F> {
        let text = Cow::Owned(text.to_owned());
        self.0.text(text).map_err(F::custom)
    }
}

/// The element type of a tensor, as far as it is used here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumString, IntoStaticStr)]
#[cfg_attr(test, derive(strum::VariantArray))]
#[serde(rename_all = "UPPERCASE")]
#[strum(serialize_all = "UPPERCASE")]
pub enum Datatype {
    /// Text or any bytes.
    Bytes,
    /// 32-bit floating-point numbers, IEEE 754.
    Fp32,
    /// 32-bit signed integers.
    Int32,
}

impl Datatype {
    /// Returns the name, as the protocol writes it.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Bytes of the length before an element of `BYTES`.
pub(super) const LENGTH_BYTES: usize = 4;

/// Returns the `count` elements of a tensor of `BYTES`, which are parts of `bytes`.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
fn binary_elements(bytes: &Bytes, count: usize) -> Result<Vec<Bytes>, String> {
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
pub(super) fn put_element(content: &[u8], bytes: &mut Vec<u8>) -> Result<(), TryFromIntError> {
    bytes.put_u32_le(content.len().try_into()?);
    bytes.put_slice(content);
    Ok(())
}

/// Returns `count` numbers of `FP32`, finite or not.
///
/// # Errors
/// The end of a sentence: what was sent, and what is needed.
fn binary_floats(bytes: &[u8], count: usize) -> Result<Vec<f32>, String> {
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
    use base64::engine::general_purpose::STANDARD_NO_PAD;
    use proptest::prelude::*;

    use super::*;
    use strum::VariantArray;

    #[test]
    fn lists_are_flat_or_nested() {
        for json in ["[1,2.5,3,4]", "[[1,2.5],[3,4]]", " [[[1],[2.5]],[[3],[4]]]"] {
            let read = json_floats(json, 4).unwrap();
            assert_eq!(read, [1.0, 2.5, 3.0, 4.0], "{json}");
        }
    }

    #[test]
    fn data_that_do_not_fit_the_shape_are_refused() {
        for (json, count, part) in [
            ("[1,2]", 3, "it has 2 numbers, but its shape needs 3"),
            ("[1,2,3]", 2, "more numbers than the 2"),
            ("[\"a\"]", 1, "holds a string"),
            ("[true]", 1, "boolean"),
            ("{\"a\":1}", 1, "not a list"),
            ("7", 1, "not a list"),
        ] {
            let error = json_floats(json, count).unwrap_err();
            assert!(
                error.contains(part) && !error.contains("at line"),
                "{json}: {error}"
            );
        }
        let error = json_floats("[1e39]", 1).unwrap_err();
        assert!(error.contains("out of range for FP32"), "{error}");
    }

    #[test]
    fn frames_are_base64_with_or_without_padding() {
        for json in ["[\"AP8B\"]", "[[\"AP8B\"]]", "[\"\\u0041P8B\"]"] {
            assert_eq!(
                byte_elements(json, 1).unwrap(),
                [&b"\0\xff\x01"[..]],
                "{json}"
            );
        }
        assert_eq!(
            byte_elements("[\"AP8=\", \"AA==\"]", 2),
            byte_elements("[[\"AP8\"], [\"AA\"]]", 2)
        );
        for (json, part) in [
            ("[]", "0 elements, but its shape needs 1"),
            ("[\"AA==\",\"AA==\"]", "more elements than the 1"),
            ("[\"a b\"]", "not base64"),
            ("[7]", "holds a number"),
            ("\"AA==\"", "not a list"),
        ] {
            let error = byte_elements(json, 1).unwrap_err();
            assert!(error.contains(part), "{json}: {error}");
        }
    }

    proptest! {
        #[test]
        fn any_text_gives_a_list_or_an_error(json in "[\\[\\]{},:\"0-9a-e.+\\- ]{0,40}", count in 0_usize..5) {
            let length = json_floats(&json, count).map(|read| read.len());
            prop_assert!(length.is_err() || length == Ok(count));
            let _ = byte_elements(&json, count);
        }

        #[test]
        fn data_take_no_more_memory_than_their_length_implies(
            bytes in prop::collection::vec(any::<u8>(), 1..40), count in 1_usize..5,
        ) {
            for json in [BASE64.encode(&bytes), STANDARD_NO_PAD.encode(&bytes)] {
                let json = format!("{:?}", vec![json; count]).replace(", ", ",");
                let decoded = byte_elements(&json, count).unwrap().into_iter();
                let capacity: usize = decoded.map(|bytes| bytes.try_into_mut().unwrap().capacity()).sum();
                prop_assert!(capacity <= bytes_at_most(&json), "{capacity}");
            }
            let digits: Vec<_> = bytes.iter().map(|byte| byte % 10).collect();
            let json = format!("{digits:?}").replace(' ', "");
            let read = json_floats(&json, digits.len()).unwrap();
            prop_assert_eq!(numbers_at_most(&json, usize::MAX), digits.len());
            prop_assert_eq!(read.capacity(), digits.len());
        }
    }

    #[test]
    fn a_datatype_is_written_as_it_is_named() {
        for &datatype in Datatype::VARIANTS {
            let name = datatype.to_string();
            assert_eq!(serde_json::to_value(datatype).unwrap(), name);
            assert_eq!(name.parse(), Ok(datatype));
        }
        assert!("FP16".parse::<Datatype>().is_err());
    }

    fn element(content: &[u8]) -> Bytes {
        let mut bytes = Vec::new();
        put_element(content, &mut bytes).unwrap();
        bytes.into()
    }

    proptest! {
        #[test]
        fn an_element_survives_a_round_trip(content in prop::collection::vec(any::<u8>(), 0..300)) {
            let twice = [element(&content), element(&content)].concat().into();
            prop_assert_eq!(binary_elements(&twice, 2).unwrap(), [content.clone(), content]);
        }

        #[test]
        fn any_bytes_give_an_element_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let bytes = Bytes::from(bytes);
            for count in 0..3 {
                if let Ok(contents) = binary_elements(&bytes, count) {
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
                if let Ok(numbers) = binary_floats(&bytes, count) {
                    prop_assert_eq!(numbers.len(), count);
                }
            }
        }

        #[test]
        fn finite_numbers_survive_a_round_trip(
            sent in prop::collection::vec(prop::num::f32::NORMAL | prop::num::f32::ZERO, 0..20),
        ) {
            let bytes: Vec<_> = sent.iter().flat_map(|number| number.to_le_bytes()).collect();
            prop_assert_eq!(binary_floats(&bytes, sent.len()).unwrap(), sent);
        }
    }

    #[test]
    fn a_truncated_element_is_refused_with_both_lengths() {
        let error = binary_elements(&Bytes::from_static(b"\x09\0\0\0abc"), 1).unwrap_err();
        assert!(
            error.contains("its length is 9, but 3 bytes follow"),
            "{error}"
        );
    }
}

use proptest::prelude::*;

use super::*;

/// A field with bytes: its tag, its length, its content.
fn field(number: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![number << 3 | 2];
    let mut len = content.len();
    while len > 0x7f {
        bytes.push(u8::try_from(len & 0x7f).unwrap() | 0x80);
        len >>= 7;
    }
    bytes.push(u8::try_from(len).unwrap());
    bytes.extend_from_slice(content);
    bytes
}

/// A model whose graph has a tensor with these fields.
fn with_tensor(tensor: &[u8]) -> Vec<u8> {
    field(7, &field(5, tensor))
}

#[test]
fn a_tensor_with_inline_values_is_accepted() {
    check(&with_tensor(&[0x08, 0x03, 0x08, 0x04])).unwrap();
    check(&with_tensor(&[0x70, 0x00])).unwrap();
}

#[test]
fn either_sign_of_external_data_is_refused() {
    let by_location = with_tensor(&[0x70, 0x01]);
    let by_entry = with_tensor(&field(13, b"location"));
    for model in [by_location, by_entry] {
        assert!(check(&model).unwrap_err().contains("in other files"));
    }
}

#[test]
fn packed_dimensions_are_read_and_their_product_is_limited() {
    // 2^14 by 2^15, and 2^15 by 2^15.
    check(&with_tensor(&field(
        1,
        &[0x80, 0x80, 0x01, 0x80, 0x80, 0x02],
    )))
    .unwrap();
    let absurd = with_tensor(&field(1, &[0x80, 0x80, 0x02, 0x80, 0x80, 0x02]));
    assert!(
        check(&absurd)
            .unwrap_err()
            .contains("more than 536870912 values")
    );
    let negative = [&[0x08][..], &[0xff; 9], &[0x01]].concat();
    assert!(
        check(&with_tensor(&negative))
            .unwrap_err()
            .contains("more than")
    );
}

#[test]
fn nested_graphs_have_a_depth_limit() {
    let nested = |depth| {
        let graph = (0..depth).fold(Vec::new(), |inner: Vec<u8>, _| {
            // A graph with a node whose attribute contains the inner graph.
            field(1, &field(5, &field(6, &inner)))
        });
        field(7, &graph)
    };
    check(&nested(10)).unwrap();
    assert!(check(&nested(100)).unwrap_err().contains("nested"));
}

proptest! {
    #[test]
    fn any_bytes_are_checked(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = check(&bytes);
        let _ = check(&with_tensor(&bytes));
    }
}

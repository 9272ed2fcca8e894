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

/// A node with these inputs and outputs, and a graph in an attribute.
fn node(inputs: &[&str], outputs: &[&str], branch: &[u8]) -> Vec<u8> {
    let mut node = Vec::new();
    for (number, names) in [(1, inputs), (2, outputs)] {
        for name in names {
            node.extend(field(number, name.as_bytes()));
        }
    }
    node.extend(field(5, &field(6, branch)));
    field(1, &node)
}

/// A constant with a name.
fn constant(name: &str) -> Vec<u8> {
    field(5, &field(8, name.as_bytes()))
}

fn model(parts: &[Vec<u8>]) -> Vec<u8> {
    field(7, &parts.concat())
}

#[test]
fn cut_drops_what_the_outputs_do_not_need() {
    let first = node(&["image", "used"], &["boxes"], &[]);
    let last = node(&["boxes", "unused"], &["kept_by_nms"], &[]);
    let constants = [constant("used"), constant("unused")];
    let before = model(&[
        first.clone(),
        last,
        constants[0].clone(),
        constants[1].clone(),
        field(12, &field(1, b"kept_by_nms")),
    ]);
    let declared = [
        &field(1, b"boxes")[..],
        &field(2, &[0x0a, 0x02, 0x08, 0x01]),
    ]
    .concat();
    let after = model(&[first, constants[0].clone(), field(12, &declared)]);
    assert_eq!(cut(&before, &["boxes"]).unwrap(), after);
}

#[test]
fn cut_keeps_what_a_graph_in_a_node_reads() {
    let outside = node(&["image"], &["outside"], &[]);
    let branch = node(&["outside", "constant"], &["inside"], &[]);
    let choice = node(&["condition"], &["boxes"], &branch);
    let parts = [outside, choice, constant("constant")];
    let result = cut(&model(&parts), &["boxes"]).unwrap();
    for part in parts {
        assert!(result.windows(part.len()).any(|bytes| bytes == part));
    }
}

#[test]
fn cut_keeps_fields_that_it_does_not_know() {
    let unknown = [0xf8, 0x07, 0x05];
    let graph = [&node(&[], &["boxes"], &[])[..], &unknown].concat();
    let result = cut(&[&unknown[..], &field(7, &graph)].concat(), &["boxes"]).unwrap();
    let count = result.windows(3).filter(|bytes| *bytes == unknown).count();
    assert_eq!(count, 2);
}

#[test]
fn cut_names_an_output_that_no_node_has() {
    let before = model(&[node(&[], &["dets"], &[])]);
    assert!(cut(&before, &["1442"]).unwrap_err().contains("\"1442\""));
}

proptest! {
    #[test]
    fn cut_of_any_bytes_returns(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = cut(&field(7, &bytes), &["boxes"]);
    }
}

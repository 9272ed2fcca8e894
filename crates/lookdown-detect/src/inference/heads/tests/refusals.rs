//! Models and manifests that do not fit, and their error messages.

use super::{decode, head};
use crate::inference::heads::{Head, OutputShape, TensorView};
use lookdown_imaging::NetworkInput;

fn refusal(manifest: &str, outputs: &[(&str, &[i64])]) -> String {
    let outputs: Vec<OutputShape<'_>> = outputs
        .iter()
        .map(|&(name, shape)| OutputShape { name, shape })
        .collect();
    head(manifest).check(&outputs, (640, 320)).unwrap_err()
}

const YOLOX: &str = "head = 'yolox'\nperson_class = 0";

#[test]
fn a_wrong_shape_is_named_with_what_is_needed() {
    let sentence = refusal(YOLOX, &[("output", &[-1, 8400, 85])]);
    assert_eq!(
        sentence,
        "its output \"output\" is [?, 8400, 85]; [views, 4200, columns (at least 6)] is needed \
         for an input of 640×320 pixels (is [output] in the manifest right for this model?)"
    );
}

#[test]
fn outputs_that_disagree_with_one_another_are_refused() {
    let boxes: (&str, &[i64]) = ("boxes", &[1, 100, 4]);
    let sentence = refusal("head = 'boxes_scores'", &[boxes, ("scores", &[1, 90])]);
    assert!(
        sentence.contains("\"scores\" is [1, 90]; [views, 100 candidates] is needed"),
        "{sentence}"
    );
}

#[test]
fn a_missing_output_is_named_with_the_existing_outputs() {
    let outputs: [(&str, &[i64]); 2] = [("a", &[1, 2, 4]), ("b", &[1, 2])];
    let sentence = refusal("head = 'boxes_scores'\nboxes = 'a'", &outputs);
    assert_eq!(
        sentence,
        "it has no output \"scores\", only \"a\", \"b\"; name the right one in the manifest's \
         [output]"
    );
    assert!(refusal(YOLOX, &outputs).contains("select one with `name`"));
}

#[test]
fn ambiguous_boxes_and_scores_must_be_named() {
    let outputs: [(&str, &[i64]); 2] = [("dets", &[1, 300, 4]), ("labels", &[1, 300, 4])];
    let detr = "head = 'detr'\nperson_class = 0";
    for ambiguous in [
        &outputs[..],
        &[outputs[0], ("labels", &[1, 300, -1])],
        &[
            outputs[0],
            ("labels", &[1, 300, 80]),
            ("hidden", &[1, 300, -1]),
        ],
        &[
            outputs[0],
            ("labels", &[1, 300, 80]),
            ("hidden", &[1, 300, 256]),
        ],
    ] {
        assert!(refusal(detr, ambiguous).contains("cannot be distinguished by shape"));
    }
    let named = head(&format!("{detr}\nboxes = 'dets'\nscores = 'labels'"));
    let declared = outputs.map(|(name, shape)| OutputShape { name, shape });
    assert_eq!(named.check(&declared, (64, 64)), Ok(()));
}

#[test]
fn a_map_that_does_not_divide_the_input_is_refused() {
    let yolo = "head = 'yolo_v2'\nperson_class = 0\nanchors = [[1, 1], [2, 2]]";
    for shape in [[1, 12, 10, 19], [1, 12, 9, 20], [1, 13, 10, 20]] {
        assert_eq!(
            refusal(yolo, &[("grid", &shape)]),
            format!(
                "its output \"grid\" is {shape:?}; [views, 2 × channels (at least 6), rows \
                 (dividing 320), columns (dividing 640)] is needed for an input of 640×320 pixels \
                 (is [output] in the manifest right for this model?)"
            )
        );
    }
}

#[test]
fn outputs_of_unknown_axes_are_accepted_until_a_run() {
    let head = head("head = 'boxes_scores'");
    let declared = ["boxes", "scores"].map(|name| OutputShape { name, shape: &[] });
    assert_eq!(head.check(&declared, (64, 64)), Ok(()));
    let tensors = ["boxes", "scores"].map(|name| TensorView {
        name,
        shape: &[],
        values: &[0.0],
    });
    let input = NetworkInput::plain(64, 64);
    let error = head.decode(&tensors, 1, &input, 0.1).unwrap_err();
    assert!(error.to_string().contains("\"boxes\" is []"), "{error}");
}

#[test]
fn scores_may_have_an_axis_of_one_class() {
    let head = head("head = 'boxes_scores'");
    let shapes: [&[i64]; 2] = [&[-1, 10, 1], &[-1, 10, 2]];
    let [one, two] = shapes.map(|shape| {
        let boxes = OutputShape {
            name: "boxes",
            shape: &[-1, 10, 4],
        };
        let name = "scores";
        head.check(&[boxes, OutputShape { name, shape }], (64, 64))
    });
    assert_eq!(one, Ok(()));
    assert!(two.unwrap_err().contains("[views, 10 candidates, 1]"));
}

#[test]
fn seven_columns_must_be_listed() {
    let sentence = refusal(
        "head = 'end_to_end'\nperson_class = 0",
        &[("output", &[-1, 100, 7])],
    );
    assert!(
        sentence.contains("has rows of 7; list their content"),
        "{sentence}"
    );
}

#[test]
fn a_manifest_that_contradicts_itself_is_refused() {
    let map: [(&str, &[i64]); 1] = [("map", &[1, 6, 10, 20])];
    for (manifest, said) in [
        (
            "head = 'yolo_v2'\nperson_class = 0\nanchors = [[1, -1]]",
            "`anchors` in the manifest's [output] contains -1",
        ),
        (
            "head = 'end_to_end'\nperson_class = 0\ncolumns = ['score', 'score']",
            "lacks \"x_min\"",
        ),
    ] {
        let sentence = refusal(manifest, &map);
        assert!(sentence.contains(said), "{sentence}");
    }
}

#[test]
fn unknown_heads_and_fields_are_refused() {
    for manifest in [
        "head = 'yolo_v99'",
        "head = 'boxes_scores'\nscore = 'scores'",
        "head = 'yolox'\nperson_class = 0\nstride = [8]",
        "head = 'yolox'\nperson_class = 0\nstrides = [0]",
        "head = 'yolox'",
        "person_class = 0",
    ] {
        assert!(toml::from_str::<Head>(manifest).is_err(), "{manifest}");
    }
}

#[test]
fn logits_declared_as_scores_are_refused_with_the_remedy() {
    let values = [0.0, 0.0, 0.0, 0.0, 1.0, 3.5];
    let yolox = head("head = 'yolox'\nperson_class = 0\nstrides = [100]");
    let error = decode(&yolox, &[("output", &[1, 1, 6], &values)], 0.5).unwrap_err();
    let sentence = error.to_string();
    assert!(sentence.contains("hold 3.5"), "{sentence}");
    assert!(sentence.contains("`score_activation`"), "{sentence}");
}

#[test]
fn values_that_do_not_match_their_shape_are_refused() {
    for shape in [&[1, 1, 7][..], &[usize::MAX, 2, 6]] {
        let error = decode(&head(YOLOX), &[("output", shape, &[0.0; 6])], 0.5).unwrap_err();
        assert!(error.to_string().contains("6 values for the shape"));
    }
}

#[test]
fn a_batch_of_another_size_is_refused() {
    let error = decode(
        &Head::default(),
        &[("boxes", &[2, 0, 4], &[]), ("scores", &[2, 0], &[])],
        0.5,
    )
    .unwrap_err();
    let sentence = error.to_string();
    assert!(
        sentence.contains("is [2, 0, 4]; [1 views, candidates, 4]"),
        "{sentence}"
    );
}

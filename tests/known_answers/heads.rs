//! Output heads against a reference implementation in another language
//! (`tests/fixtures/heads/make_head_vectors.py`).

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

use lookdown_detect::inference::heads::{Head, OutputShape, TensorView};
use lookdown_imaging::NetworkInput;
use serde::Deserialize;

/// Both sides compute in 64-bit floats from the same 32-bit values, so only the order of a few
/// roundings differs. Unit: pixels, for boxes up to some hundred pixels.
const SIDE_TOLERANCE: f64 = 1e-9;
const SCORE_TOLERANCE: f64 = 1e-12;

#[derive(Deserialize)]
struct Fixture {
    head: Head,
    width: u32,
    height: u32,
    views: usize,
    floor: f64,
    outputs: Vec<Output>,
    /// Per view, in the network's order: `x_min, y_min, x_max, y_max, score`.
    persons: Vec<Vec<[f64; 5]>>,
    non_finite: usize,
}

#[derive(Deserialize)]
struct Output {
    name: String,
    shape: Vec<usize>,
    /// `null` represents NaN.
    values: Vec<Option<f32>>,
}

/// The cases by name.
static FIXTURES: LazyLock<BTreeMap<String, Fixture>> = LazyLock::new(|| {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/fixtures/heads/heads.json"
    );
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
});

fn check(name: &str) {
    let fixture = &FIXTURES[name];
    let values: Vec<Vec<f32>> = fixture
        .outputs
        .iter()
        .map(|output| {
            output
                .values
                .iter()
                .map(|v| v.unwrap_or(f32::NAN))
                .collect()
        })
        .collect();
    let outputs: Vec<TensorView<'_>> = fixture
        .outputs
        .iter()
        .zip(&values)
        .map(|(output, values)| TensorView {
            name: &output.name,
            shape: &output.shape,
            values,
        })
        .collect();

    let input = NetworkInput::plain(fixture.width, fixture.height);
    let found = fixture
        .head
        .decode(&outputs, fixture.views, &input, fixture.floor)
        .unwrap();

    assert_eq!(found.non_finite, fixture.non_finite, "{name}");
    assert_eq!(found.per_view.len(), fixture.views, "{name}");
    for (found, wanted) in found.per_view.iter().zip(&fixture.persons) {
        assert_eq!(found.len(), wanted.len(), "{name}");
        for (found, wanted) in found.iter().zip(wanted) {
            for (side, wanted) in found.bbox.corners().iter().zip(wanted) {
                assert!(
                    (side - wanted).abs() <= SIDE_TOLERANCE,
                    "{name}: {found:?} for {wanted:?}"
                );
            }
            assert!(
                (found.score - wanted[4]).abs() <= SCORE_TOLERANCE,
                "{name}: {found:?} for {wanted:?}"
            );
        }
    }
}

macro_rules! agree {
    ($($test:ident: $name:literal)*) => {
        $(#[test]
        fn $test() {
            check($name);
        })*

        #[test]
        fn every_case_is_tested() {
            assert!(FIXTURES.keys().eq(&BTreeSet::from([$($name),*])));
        }
    };
}

agree! {
    boxes_and_scores_agree_with_the_reference: "boxes_scores"
    yolo_v2_of_the_papers_size_agrees_with_the_reference: "yolo_v2_voc"
    yolo_v2_over_an_oblong_input_agrees_with_the_reference: "yolo_v2_small"
    raw_yolox_agrees_with_the_reference: "yolox"
    decoded_yolox_agrees_with_the_reference: "yolox_decoded"
    nanodet_plus_agrees_with_the_reference: "nanodet_plus"
    nanodet_g_agrees_with_the_reference: "nanodet_g"
    yolo_v8_agrees_with_the_reference: "yolo_v8"
    transposed_yolo_v8_agrees_with_the_reference: "yolo_v8_cells_first"
    sigmoid_detr_agrees_with_the_reference: "detr_sigmoid"
    softmax_detr_agrees_with_the_reference: "detr_softmax"
    rows_of_six_columns_agree_with_the_reference: "end_to_end_six"
    rows_of_seven_columns_agree_with_the_reference: "end_to_end_seven"
}

/// The outputs as declared by a model with a free batch axis.
fn declared(fixture: &Fixture) -> Vec<Vec<i64>> {
    let dimensions = |output: &Output| {
        let mut shape: Vec<i64> = output
            .shape
            .iter()
            .map(|&dimension| i64::try_from(dimension).unwrap())
            .collect();
        shape[0] = -1;
        shape
    };
    fixture.outputs.iter().map(dimensions).collect()
}

fn check_declared(fixture: &Fixture, shapes: &[Vec<i64>]) -> Result<(), String> {
    let outputs: Vec<OutputShape<'_>> = fixture
        .outputs
        .iter()
        .zip(shapes)
        .map(|(output, shape)| OutputShape {
            name: &output.name,
            shape,
        })
        .collect();
    fixture
        .head
        .check(&outputs, (fixture.width, fixture.height))
}

#[test]
fn every_head_accepts_its_model_with_an_open_batch_axis() {
    for (name, fixture) in &*FIXTURES {
        assert_eq!(
            check_declared(fixture, &declared(fixture)),
            Ok(()),
            "{name}"
        );
    }
}

#[test]
fn every_head_refuses_outputs_with_an_additional_axis() {
    let fixtures = FIXTURES.iter();
    for (name, fixture) in fixtures.filter(|(name, _)| *name != "end_to_end_seven") {
        let mut shapes = declared(fixture);
        for shape in &mut shapes {
            shape.push(1);
        }
        assert!(check_declared(fixture, &shapes).is_err(), "{name}");
    }
}

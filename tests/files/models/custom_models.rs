//! Custom models: effects of a manifest and an ONNX file on the network input and the detections.

use lookdown_detect::inference::{Detector, HeadOutput, Layout, OnnxDetector};
use lookdown_imaging::{Frame, Letterbox, NetworkInput, ViewBatch};

use crate::models::folder::{fixture, library, load, options};

/// Runs the detector on views of one color each.
fn detect(detector: &mut OnnxDetector, colors: &[[u8; 3]]) -> HeadOutput {
    let input: NetworkInput = detector.input().clone();
    let mut batch = ViewBatch::default();
    let views = batch.prepare(colors.len(), &input);
    for (slot, color) in views.zip(colors) {
        let pixels = color.repeat((input.width * input.height) as usize);
        let frame = Frame::new(input.width, input.height, pixels).unwrap();
        Letterbox::new(input.width, input.height, &input).render(&frame, &input, slot);
    }
    detector.detect(&batch).unwrap()
}

/// The score of the only box in each view, in hundredths.
fn scores(found: &HeadOutput) -> Vec<i32> {
    let scores = found.per_view.iter().map(|view| {
        assert!(view.len() <= 1, "{view:?}");
        view.first().map_or(0.0, |found| found.score)
    });
    #[expect(clippy::cast_possible_truncation, reason = "0 to 100")]
    scores.map(|score| (score * 100.0).round() as i32).collect()
}

const RED: [u8; 3] = [255, 0, 0];
const DARK_RED: [u8; 3] = [102, 0, 0];
const BLUE: [u8; 3] = [0, 0, 204];

#[test]
fn a_model_without_a_manifest_gets_plain_rgb() {
    let mut detector = load("any_batch", "").unwrap();
    let found = detect(&mut detector, &[RED, DARK_RED, BLUE]);
    assert_eq!(scores(&found), [100, 40, 0]);
    let [x_min, y_min, x_max, y_max] = found.per_view[0][0].bbox.corners();
    assert_eq!([x_min, y_min, x_max, y_max], [4.0, 6.0, 20.0, 30.0]);
    assert_eq!((detector.input().width, detector.input().height), (48, 32));
}

#[test]
fn planes_and_scaling_follow_the_manifest() {
    let mut swapped = load("any_batch", "[input]\nchannel_order = \"bgr\"").unwrap();
    assert_eq!(scores(&detect(&mut swapped, &[RED, BLUE])), [0, 80]);
    let more = "[input]\nscale = [0.5, 1.0, 1.0]\noffset = [25.5, 0.0, 0.0]";
    let mut scaled = load("any_batch", more).unwrap();
    assert_eq!(scores(&detect(&mut scaled, &[RED, BLUE])), [60, 10]);
    let more = "[input]\nmean = [51.0, 0.0, 0.0]\nstd = [2.0, 1.0, 1.0]";
    let mut standardised = load("any_batch", more).unwrap();
    assert_eq!(
        scores(&detect(&mut standardised, &[RED, DARK_RED])),
        [40, 10]
    );
}

#[test]
fn a_model_with_a_fixed_batch_gets_all_views() {
    let colors = [RED, DARK_RED, BLUE, RED, DARK_RED];
    let mut pairs = load("pairs", "").unwrap();
    assert_eq!(scores(&detect(&mut pairs, &colors)), [100, 40, 0, 100, 40]);
    assert_eq!(pairs.description.views_per_run.unwrap().get(), 2);
    let mut threes = load("any_batch", "[input]\nbatch = 3").unwrap();
    assert_eq!(scores(&detect(&mut threes, &colors)), [100, 40, 0, 100, 40]);
    assert!(detect(&mut threes, &[]).per_view.is_empty());
}

#[test]
fn a_model_with_planes_last_gets_the_same_input() {
    let mut detector = load("planes_last", "").unwrap();
    assert_eq!(detector.description.layout, Layout::Nhwc);
    assert_eq!(scores(&detect(&mut detector, &[DARK_RED, RED])), [40, 100]);
}

#[test]
fn a_model_of_any_size_gets_the_configured_size() {
    let more = "[input]\nwidth = 96\nheight = 64\nstride = 32";
    let mut detector = load("any_size", more).unwrap();
    assert_eq!((detector.input().width, detector.input().height), (96, 64));
    assert_eq!(scores(&detect(&mut detector, &[DARK_RED])), [40]);
}

#[test]
fn metadata_of_the_onnx_file_is_used_as_default() {
    let detector = OnnxDetector::load(&library(), &fixture("with_metadata"), &options()).unwrap();
    let description = &detector.description;
    assert_eq!((detector.input().width, detector.input().height), (96, 64));
    assert_eq!(description.license.as_deref(), Some("AGPL-3.0 License"));
    assert_eq!(detector.name(), "with_metadata");
    // The key of manifests of earlier versions.
    let other = load("with_metadata", "licence = \"MIT\"\n[input]\nwidth = 64\n").unwrap();
    assert_eq!((other.input().width, other.input().height), (64, 64));
    assert_eq!(other.description.license.as_deref(), Some("MIT"));
}

#[test]
fn outputs_are_found_by_the_names_in_the_manifest() {
    let more = "[output]\nhead = \"boxes_scores\"\nboxes = \"dets\"\nscores = \"confidence\"";
    let mut detector = load("other_names", more).unwrap();
    assert_eq!(scores(&detect(&mut detector, &[DARK_RED])), [40]);
}

#[test]
fn nan_scores_are_dropped_and_counted() {
    let mut detector = load("not_finite", "").unwrap();
    let found = detect(&mut detector, &[RED, BLUE]);
    assert_eq!((scores(&found), found.non_finite), (vec![0, 0], 2));
}

#[test]
fn a_revision_changes_with_settings_but_not_with_comments() {
    let revision = |onnx, more| load(onnx, more).unwrap().revision().to_owned();
    let plain = revision("any_batch", "");
    assert_eq!(
        plain,
        revision("any_batch", "# the same\nsource = \"me\"\n")
    );
    let others = [
        revision("any_batch", "[input]\nchannel_order = \"bgr\""),
        revision(
            "any_batch",
            "[output]\nhead = \"boxes_scores\"\nboxes = \"boxes\"\n[input]\nscale = [2, 1, 1]",
        ),
        revision("pairs", ""),
    ];
    assert!(!others.contains(&plain), "{others:?}");
}

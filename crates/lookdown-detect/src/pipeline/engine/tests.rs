use super::*;
use bytes::Bytes;
use lookdown_lens::geometry::{FloorVotes, OrientedBox, Posture};
use nalgebra::{Point2, Vector2};

use crate::inference::{Device, InferenceError};
use crate::pipeline::test_support::{
    BlobDetector, calibration, engine, frame_with_bar, frame_with_disc, job,
};

fn engine_with_lobby() -> Engine {
    engine(BlobDetector::default(), Some(calibration("")))
}

#[test]
fn a_blob_is_found_at_its_position_in_every_profile() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    for profile in ["paper", "fast", "balanced", "quality", "direct"] {
        let job = job(
            image.clone(),
            &[("profile", profile), ("calibration", "lobby")],
        );
        let report = engine.detect(&job).unwrap().report;
        let best = report
            .persons
            .first()
            .unwrap_or_else(|| panic!("{profile} found nothing"));
        let [x, y] = best.bbox.center();
        assert!(
            (x - 420.0).abs() < 6.0 && (y - 300.0).abs() < 6.0,
            "{profile}: {x}, {y}"
        );
        assert!(
            (best.bbox.width() - 40.0).abs() < 14.0,
            "{profile}: {}",
            best.bbox.width()
        );
        assert!(best.views >= 1);
        // To the right of the center, 120 of 300 pixels out: 36° off axis.
        let bearing = best.bearing.unwrap();
        assert!((bearing.off_axis.to_degrees() - 36.0).abs() < 2.0);
        assert!(bearing.azimuth.sin().abs() < 0.06);
        let floor = best.floor.expect("the height is known");
        assert!(
            floor.x_m > 1.0 && floor.y_m.abs() < 0.3,
            "{profile}: {floor:?}"
        );
    }
}

#[test]
fn a_report_names_its_camera_calibration_and_model() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let named = engine
        .detect(&job(
            image.clone(),
            &[("calibration", "lobby"), ("camera", "north")],
        ))
        .unwrap()
        .report;
    assert_eq!(named.camera, "north");
    assert_eq!(named.calibration.id, "lobby");
    assert!(named.calibration.assumed_circle.is_none() && named.warnings.is_empty());
    assert_eq!((named.views.inferred, named.batch_count), (10, 3));
    assert_eq!(named.model.name, "blob");

    let assumed = engine.detect(&job(image, &[])).unwrap().report;
    let circle = assumed.calibration.assumed_circle.unwrap();
    let revision = format!("{:.0}-{:.0}-{:.0}", circle.cx, circle.cy, circle.radius);
    assert_eq!(assumed.calibration.revision, revision);
    assert_eq!(assumed.camera, "assumed");
    assert_eq!(assumed.warnings[0].code, WarningCode::LensAssumed);
    assert_eq!(assumed.persons[0].floor, None);
}

/// An engine whose network for people on the floor is another one than that of the views.
fn engine_with_floor() -> Engine {
    let mut engine = engine_with_lobby();
    engine.options.default_models = DefaultModels::for_device(Device::Cpu);
    engine
}

/// Returns the report of a frame with a blob by a network for people on the floor that gives the
/// blob this posture, if any.
fn report_with_floor(posture: Option<Posture>, image: Bytes) -> DetectionReport {
    let engine = engine_with_floor();
    let detector = BlobDetector {
        name: "nanodet_g_floor_416",
        tells_postures: true,
        posture,
        ..BlobDetector::default()
    };
    let model = Model::new(Box::new(detector));
    engine.models.put(Arc::new(model)).unwrap();
    let named = [
        ("calibration", "lobby"),
        ("profile", "fast"),
        ("floor", "true"),
    ];
    let report = engine.detect(&job(image, &named)).unwrap().report;
    assert_eq!(report.model.name, "nanodet_g_floor_416");
    report
}

#[test]
fn the_network_for_the_floor_tells_who_lies() {
    // Few views show the blob.
    let reports = [None, Some(Posture::Lying)]
        .map(|posture| report_with_floor(posture, frame_with_disc(600, [530.0, 300.0], 20.0)));
    let [upright, lying] = reports.each_ref().map(|report| &report.persons[0]);
    // A crop for the network that knows people on the floor.
    let [without, with] = reports.each_ref().map(|report| report.views.inferred);
    assert_eq!(with, without + 1);
    assert_eq!(upright.floor_votes, Some(FloorVotes::default()));
    assert!(lying.floor_votes.unwrap().lying > 0.3, "{lying:?}");
    assert_ne!(lying.posture, upright.posture);
    assert_ne!(upright.posture.0, Posture::Lying);
}

#[test]
fn the_box_of_who_lies_follows_the_body() {
    let body = Vector2::new(10.0, 43.0);
    let image = || frame_with_bar(600, [400.0, 330.0], body.into(), 10.0);
    let reports = [None, Some(Posture::Lying)].map(|posture| report_with_floor(posture, image()));
    let [upright, lying] = reports.each_ref().map(|report| &report.persons[0]);
    let along = |person: &Person| person.oriented_box.up.dot(&body.normalize()).abs();
    assert!(along(upright) < 0.6 && along(lying) > 0.97, "{lying:?}");
    let OrientedBox { width, height, .. } = lying.oriented_box;
    assert!((95.0..125.0).contains(&height) && width < 50.0, "{lying:?}");
    // The middle is on the floor, and there is no height.
    assert!(
        (lying.foot - Point2::new(400.0, 330.0)).norm() < 5.0,
        "{lying:?}"
    );
    assert!(upright.height.is_some() && lying.height.is_none());
}

#[test]
fn a_missing_network_for_the_floor_is_named() {
    let engine = engine_with_floor();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let error = engine
        .detect(&job(image, &[("floor", "true")]))
        .unwrap_err();
    assert!(error.to_string().contains("model.also_load"), "{error}");
}

#[test]
fn balanced_and_quality_have_crops() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let report = |profile| {
        let named = [("calibration", "lobby"), ("profile", profile)];
        engine.detect(&job(image.clone(), &named)).unwrap().report
    };
    let (balanced, quality) = (report("balanced"), report("quality"));
    // Eight wide views, a crop of the blob and one at the nadir; `quality` mirrors both.
    assert_eq!((balanced.views.inferred, quality.views.inferred), (10, 12));
    // A mirrored crop shares the vote of its original.
    assert_eq!(quality.persons[0].views, balanced.persons[0].views);
}

#[test]
fn crops_make_boxes_exact_and_oriented_boxes_agree() {
    let engine = engine_with_lobby();
    let places = [[420.0, 300.0], [300.0, 450.0], [200.0, 190.0]];
    let profiles = ["balanced", "quality"];
    for (at, profile) in places.into_iter().zip(profiles.into_iter().cycle()) {
        let image = frame_with_disc(600, at, 20.0);
        let named = [("calibration", "lobby"), ("profile", profile)];
        let report = engine.detect(&job(image, &named)).unwrap().report;
        let person = &report.persons[0];
        let sides = [person.bbox.width(), person.bbox.height()];
        assert!(
            sides.iter().all(|side| (side - 40.0).abs() < 4.0),
            "{sides:?}"
        );
        let oriented = &person.oriented_box;
        let diagonal = oriented.width.hypot(oriented.height);
        assert!(
            (diagonal - sides[0].hypot(sides[1])).abs() < 0.5,
            "{oriented:?}"
        );
        let center = oriented.center - nalgebra::Point2::from(person.bbox.center());
        assert!(center.norm() < 0.5, "{oriented:?}");
    }
}

#[test]
fn detail_views_run_only_where_something_may_be() {
    let engine = engine_with_lobby();
    // The middles of the detail views lie 72° off the axis.
    for (off_axis, expected) in [(30.0_f64, 0..=0), (72.0, 1..=2)] {
        let x = 300.0 + 190.9859 * off_axis.to_radians();
        let image = frame_with_disc(600, [x, 300.0], 16.0);
        let named = [("calibration", "lobby"), ("profile", "balanced")];
        let report = engine.detect(&job(image, &named)).unwrap().report;
        assert_eq!(report.persons.len(), 1, "at {off_axis}°");
        let details = 8 - report.views.not_needed;
        assert!(expected.contains(&details), "{details} at {off_axis}°");
        assert_eq!(report.views.inferred, 8 + details + 2);
    }
}

#[test]
fn an_empty_room_has_no_crops_but_that_at_the_nadir() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 0.0);
    let views = |profile| {
        let named = [("calibration", "lobby"), ("profile", profile)];
        let report = engine.detect(&job(image.clone(), &named)).unwrap().report;
        assert!(report.persons.is_empty());
        report.views.inferred
    };
    assert_eq!(
        (views("fast"), views("balanced"), views("quality")),
        (5, 9, 10)
    );
}

#[test]
fn views_without_motion_skip_inference() {
    let engine = engine_with_lobby();
    let report = |disc: [f64; 2], more: &[(&str, &str)]| {
        let named = [("calibration", "lobby"), ("motion", "true")];
        let named: Vec<_> = named.iter().chain(more).copied().collect();
        let image = frame_with_disc(600, disc, 20.0);
        engine.detect(&job(image, &named)).unwrap().report
    };
    let first = report([420.0, 300.0], &[]);
    assert_eq!((first.views.inferred, first.views.unchanged), (10, 0));
    let same = report([420.0, 300.0], &[]);
    assert_eq!((same.views.inferred, same.views.unchanged), (0, 10));
    assert_eq!(same.persons[0].bbox, first.persons[0].bbox);
    assert_eq!(same.batch_count, 0);

    let moved = report([420.0, 330.0], &[]);
    // The views on the other side of the camera.
    assert!(
        moved.views.inferred > 0 && moved.views.unchanged > 2,
        "{:?}",
        moved.views
    );
    let [x, y] = moved.persons[0].bbox.center();
    assert!((x - 420.0).abs() < 6.0 && (y - 330.0).abs() < 6.0);
    assert_eq!(moved.persons.len(), 1);

    // Another camera and the views of another profile are not in the motion cache.
    let other = report([420.0, 330.0], &[("camera", "north")]);
    assert_eq!(other.views.unchanged, 0);
    let other = report([420.0, 330.0], &[("profile", "fast")]);
    assert_eq!(other.views.unchanged, 0);
}

#[test]
fn detail_views_without_motion_skip_inference() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [540.0, 300.0], 16.0);
    let named = [("calibration", "lobby"), ("motion", "true")];
    let views = || {
        engine
            .detect(&job(image.clone(), &named))
            .unwrap()
            .report
            .views
    };
    let (first, same) = (views(), views());
    assert!(first.not_needed < 8, "{first:?}");
    assert_eq!((same.inferred, same.unchanged), (0, first.inferred));
}

#[test]
fn the_threshold_applies_to_reported_scores() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let scores = |threshold: f64| {
        let threshold = threshold.to_string();
        let named = [("calibration", "lobby"), ("score_threshold", &*threshold)];
        let report = engine.detect(&job(image.clone(), &named)).unwrap().report;
        let scores: Vec<_> = report.persons.iter().map(|person| person.score).collect();
        scores
    };
    let best = scores(0.1)[0];
    assert_eq!(scores(best - 1e-9), [best]);
    assert!(scores(best + 1e-9).is_empty());
}

#[test]
fn an_assumed_lens_and_the_true_calibration_agree() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [300.0, 180.0], 25.0);
    let named = engine
        .detect(&job(image.clone(), &[("calibration", "lobby")]))
        .unwrap()
        .report;
    let assumed = engine.detect(&job(image, &[])).unwrap().report;
    assert!(named.persons[0].bbox.iou(&assumed.persons[0].bbox) > 0.9);
}

#[test]
fn a_scaled_frame_is_accepted_and_another_aspect_is_refused() {
    let engine = engine_with_lobby();
    let larger = frame_with_disc(900, [630.0, 450.0], 30.0);
    let report = engine
        .detect(&job(larger, &[("calibration", "lobby")]))
        .unwrap()
        .report;
    assert!((report.persons[0].bbox.center()[0] - 630.0).abs() < 8.0);

    let wide = Frame::new(800, 600, vec![90; 800 * 600 * 3]).unwrap();
    let wide = lookdown_imaging::annotate::encode_png(&wide).unwrap();
    let error = engine
        .detect(&job(wide.into(), &[("calibration", "lobby")]))
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "image: the frame is 800×600 pixels, but calibration \"lobby\" was made for 600×600, \
         which is a different aspect ratio: send an uncropped frame or name another calibration"
    );
}

#[test]
fn unknown_names_and_tiny_frames_are_refused() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(64, [30.0, 30.0], 5.0);
    let refusal = |parameters: &[(&str, &str)]| {
        engine
            .detect(&job(image.clone(), parameters))
            .unwrap_err()
            .to_string()
    };
    assert!(
        refusal(&[("calibration", "yard")])
            .starts_with("calibration: there is no calibration \"yard\"")
    );
    assert_eq!(
        refusal(&[("model", "yolo")]),
        "model: \"yolo\" is not loaded; use one of blob, or leave it out"
    );
    let tiny = frame_with_disc(16, [8.0, 8.0], 2.0);
    let error = engine.detect(&job(tiny, &[])).unwrap_err().to_string();
    assert!(
        error.starts_with("image: the frame is 16×16 pixels"),
        "{error}"
    );
}

#[test]
fn a_failed_inference_is_internal_and_the_next_frame_works() {
    let mut failures = vec![InferenceError::Run("out of memory".to_owned())];
    let detector = BlobDetector {
        before: Box::new(move || failures.pop().map_or(Ok(()), Err)),
        ..BlobDetector::default()
    };
    let engine = engine(detector, None);
    let image = frame_with_disc(200, [60.0, 100.0], 12.0);
    let error = engine.detect(&job(image.clone(), &[])).unwrap_err();
    assert!(matches!(error, PipelineError::Internal(_)));
    assert!(
        !error.to_string().contains("memory"),
        "the response must not contain the cause: {error}"
    );
    assert_eq!(
        engine
            .detect(&job(image, &[]))
            .unwrap()
            .report
            .persons
            .len(),
        1
    );
}

#[test]
fn stages_are_disjoint_and_within_the_total() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let timings = engine.detect(&job(image, &[])).unwrap().report.timings;
    let sum = timings.decode
        + timings.calibrate
        + timings.queue
        + timings.remap
        + timings.inference
        + timings.refine;
    assert!(sum <= timings.total, "{timings:?}");
    assert!(
        timings.decode > std::time::Duration::ZERO && timings.remap > std::time::Duration::ZERO
    );
}

#[test]
fn other_refinements_of_an_observation_need_no_inference() {
    let engine = engine_with_lobby();
    let image = frame_with_disc(600, [420.0, 300.0], 20.0);
    let job = job(image, &[("calibration", "lobby")]);
    let observation = engine.observe(&job).unwrap();
    let parameters = |refinement| RefinementParameters {
        refinement,
        ..job.parameters.refinement
    };
    let fused = engine.persons(
        &observation,
        &parameters(crate::detection::Refinement::Fusion),
    );
    let soft = engine.persons(
        &observation,
        &parameters(crate::detection::Refinement::SoftNmsGaussian),
    );
    assert!(fused[0].views > 1, "several views see the blob");
    assert!(
        soft.iter().all(|person| person.views == 1),
        "soft-NMS selects boxes and does not average them"
    );
}

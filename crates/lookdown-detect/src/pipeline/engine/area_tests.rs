//! Tests of zones and masks in the report of a frame.

use super::*;
use crate::pipeline::test_support::{BlobDetector, calibration, engine, frame_with_disc, job};

/// Runs detection on a frame with a disc of 20 pixels at `center`. The frame is `scale` times as
/// large as the calibration's image; the disc is in pixels of the calibration's image.
fn detected(engine: &Engine, areas: &str, profile: &str, scale: u32, center: [f64; 2]) -> Detected {
    let factor = f64::from(scale);
    let image = frame_with_disc(600 * scale, center.map(|at| at * factor), 20.0 * factor);
    let mut job = job(image, &[("profile", profile)]);
    job.calibration = Some(calibration(areas));
    engine.detect(&job).unwrap()
}

/// Zones around a person to the right of the image centre, where feet point left. The disc's box
/// and the person extend from about 400 to 440, with the foot at 400.
const ZONES: &str = r#", "zones": [
    {"name": "foot", "frame_px": [[380, 280], [410, 280], [410, 320], [380, 320]]},
    {"name": "box-centre", "frame_px": [[411, 280], [450, 280], [450, 320], [411, 320]]},
    {"name": "floor-at-foot", "floor_m": [[1.4, -0.5], [1.95, -0.5], [1.95, 0.5], [1.4, 0.5]]},
    {"name": "floor-at-centre", "floor_m": [[2.0, -0.5], [2.5, -0.5], [2.5, 0.5], [2.0, 0.5]]}]"#;

#[test]
fn a_person_is_in_the_zones_of_its_foot_only() {
    let engine = engine(BlobDetector::default(), None);
    for scale in [1, 2] {
        let report = detected(&engine, ZONES, "balanced", scale, [420.0, 300.0]).report;
        assert_eq!(report.persons.len(), 1);
        let person = &report.persons[0];
        let zones = person.zones.as_deref().unwrap();
        let foot = person.oriented_box.foot();
        assert_eq!(
            zones,
            ["foot", "floor-at-foot"],
            "{foot} {:?}",
            person.floor
        );
        let counts: Vec<_> = report
            .zones
            .iter()
            .map(|zone| (zone.name.as_str(), zone.persons))
            .collect();
        assert_eq!(
            counts,
            [
                ("foot", 1),
                ("box-centre", 0),
                ("floor-at-foot", 1),
                ("floor-at-centre", 0)
            ]
        );
    }
}

#[test]
fn a_report_without_zones_has_no_zone_fields() {
    let engine = engine(BlobDetector::default(), None);
    let report = detected(&engine, "", "fast", 1, [420.0, 300.0]).report;
    assert_eq!((report.zones.len(), &report.persons[0].zones), (0, &None));
}

/// A mask over the right half of the frame and beyond its border.
const RIGHT_HALF: &str =
    r#", "masks": [{"frame_px": [[300, -10], [700, -10], [700, 610], [300, 610]]}]"#;

#[test]
fn masks_hide_persons_under_them_only_in_every_profile() {
    let engine = engine(BlobDetector::default(), None);
    for profile in ["paper", "fast", "balanced", "quality", "direct"] {
        let persons = |center| {
            let detected = detected(&engine, RIGHT_HALF, profile, 1, center);
            detected.report.persons.len()
        };
        assert_eq!(persons([420.0, 300.0]), 0, "{profile}");
        assert!(persons([180.0, 300.0]) > 0, "{profile}");
    }
}

#[test]
fn masked_pixels_are_black_in_frames_of_every_size() {
    let engine = engine(BlobDetector::default(), None);
    for scale in [1, 2] {
        let frame = detected(&engine, RIGHT_HALF, "fast", scale, [420.0, 300.0]).frame;
        assert_eq!(frame.pixel(300 * scale, 300 * scale), [0; 3]);
        assert_eq!(frame.pixel(420 * scale, 300 * scale), [0; 3]);
        assert_eq!(frame.pixel(300 * scale - 1, 300 * scale), [110; 3]);
    }
}

#[test]
fn wholly_masked_views_skip_inference_and_are_counted() {
    let engine = engine(BlobDetector::default(), None);
    let views = |areas| {
        let report = detected(&engine, areas, "balanced", 1, [180.0, 300.0]).report;
        (report.views, report.batch_count)
    };
    let (open, _) = views("");
    assert_eq!((open.inferred, open.masked), (19, 0));
    let (half, _) = views(RIGHT_HALF);
    assert!(half.masked > 2 && half.inferred > 8, "{half:?}");
    assert_eq!(half.inferred + half.masked + half.outside, 19);
    let everything = r#", "masks": [{"frame_px": [[0, 0], [600, 0], [600, 600], [0, 600]]}]"#;
    let (none, batches) = views(everything);
    assert_eq!((none.inferred, none.masked, batches), (0, 18, 0));
    // The planned views have the same count.
    let planned = engine.planned_views(&calibration(RIGHT_HALF), Profile::Balanced);
    assert_eq!(planned.unwrap().pictures, half.inferred - 1);
}

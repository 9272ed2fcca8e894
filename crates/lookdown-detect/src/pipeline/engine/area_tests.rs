//! Tests of zones and masks in the report of a frame.

use super::*;
use crate::parameters::Profile;
use crate::pipeline::ViewCounts;
use crate::pipeline::test_support::{BlobDetector, calibration, engine, frame_with_disc, job};

/// Runs detection on a frame with a disc of 20 pixels at `center`. The frame is `scale` times as
/// large as the calibration's image; the disc is in pixels of the calibration's image.
fn detected(
    engine: &Engine,
    areas: &str,
    profile: &str,
    scale: u32,
    center: [f64; 2],
) -> DetectedFrame {
    let factor = f64::from(scale);
    let image = frame_with_disc(600 * scale, center.map(|at| at * factor), 20.0 * factor);
    let mut job = job(image, &[("profile", profile)]);
    job.calibration = Some(calibration(areas));
    engine.detect(&job).unwrap()
}

/// Zones around a person to the right of the image center, where feet point left. The disc's box
/// and the person extend from about 400 to 440, with the foot at 400.
const ZONES: &str = r#", "zones": [
    {"name": "foot", "frame_px": [[380, 280], [410, 280], [410, 320], [380, 320]]},
    {"name": "box-center", "frame_px": [[411, 280], [450, 280], [450, 320], [411, 320]]},
    {"name": "floor-at-foot", "floor_m": [[1.4, -0.5], [1.95, -0.5], [1.95, 0.5], [1.4, 0.5]]},
    {"name": "floor-at-center", "floor_m": [[2.0, -0.5], [2.5, -0.5], [2.5, 0.5], [2.0, 0.5]]}]"#;

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
                ("box-center", 0),
                ("floor-at-foot", 1),
                ("floor-at-center", 0)
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
    assert_eq!((open.inferred, open.masked), (10, 0));
    let (half, _) = views(RIGHT_HALF);
    assert!(half.masked > 2 && half.inferred > 4, "{half:?}");
    // The crops of the disc and of the nadir do not belong to the plan.
    let planned = half.inferred - 2 + half.not_needed;
    assert_eq!(planned + half.masked + half.outside, 16);
    let everything = r#", "masks": [{"frame_px": [[0, 0], [600, 0], [600, 600], [0, 600]]}]"#;
    let (none, batches) = views(everything);
    assert_eq!((none.inferred, none.masked, batches), (0, 16, 0));
    // The planned views have the same count.
    let plan = engine.planned_views(&calibration(RIGHT_HALF), Profile::Balanced);
    assert_eq!(plan.unwrap().images, planned);
}

/// An area on the floor around the disc at 420, 300, whose foot is at about 1.7 m, 0 m.
const AROUND_FOOT: &str =
    r#", "areas": [{"floor_m": [[1, -0.6], [2.4, -0.6], [2.4, 0.6], [1, 0.6]]}]"#;
/// The same place as an area that ends 0.5 m before the foot, and as an ignored place.
const BEFORE_FOOT: &str =
    r#", "areas": [{"floor_m": [[0, -0.6], [1.2, -0.6], [1.2, 0.6], [0, 0.6]]}]"#;
const IGNORED_FOOT: &str = r#", "ignore": [{"name": "chair", "frame_px": [[380, 280], [410, 280], [410, 320], [380, 320]]}]"#;
/// An area on the other side of the camera.
const OTHER_SIDE: &str = r#", "areas": [{"floor_m": [[-4, -1], [-2.5, -1], [-2.5, 1], [-4, 1]]}]"#;

#[test]
fn persons_outside_areas_and_in_ignored_places_do_not_count() {
    let engine = engine(BlobDetector::default(), None);
    for profile in ["paper", "fast", "balanced", "quality", "direct"] {
        let found = |areas: &str| {
            let detected = detected(&engine, areas, profile, 1, [420.0, 300.0]);
            let report = detected.report;
            let zones: usize = report.zones.iter().map(|zone| zone.persons).sum();
            let margin = report.margin.map(|margin| !margin.is_empty());
            (!report.persons.is_empty(), margin, zones > 0)
        };
        for (areas, expected) in [
            ("", (true, None, true)),
            (AROUND_FOOT, (true, Some(false), true)),
            (BEFORE_FOOT, (false, Some(true), false)),
            (IGNORED_FOOT, (false, None, false)),
            (OTHER_SIDE, (false, Some(false), false)),
        ] {
            let areas = format!("{areas}{ZONES}");
            assert_eq!(found(&areas), expected, "{profile}: {areas}");
        }
    }
}

#[test]
fn views_far_from_all_areas_skip_inference() {
    let engine = engine(BlobDetector::default(), None);
    for (profile, least) in [("fast", 1), ("balanced", 4), ("paper", 15)] {
        let views = |areas| {
            detected(&engine, areas, profile, 1, [420.0, 300.0])
                .report
                .views
        };
        let open = views("");
        assert_eq!(open.outside_areas, 0);
        let limited = views(OTHER_SIDE);
        // Views that are not needed are skipped for another reason.
        let possible = |views: ViewCounts| views.inferred + views.not_needed;
        assert!(
            limited.outside_areas >= least && possible(limited) + least <= possible(open),
            "{profile}: {limited:?}, {open:?}"
        );
        // The disc is far from the area: no crop shows it.
        let (crops_open, crops) = match profile {
            "paper" => (0, 0),
            "balanced" => (2, 1),
            _ => (1, 0),
        };
        let of_plan = |views: ViewCounts| possible(views) + views.outside + views.outside_areas;
        assert_eq!(
            of_plan(limited) - crops,
            of_plan(open) - crops_open,
            "{profile}"
        );
    }
    let planned = engine.planned_views(&calibration(OTHER_SIDE), Profile::Balanced);
    let views = detected(&engine, OTHER_SIDE, "balanced", 1, [420.0, 300.0])
        .report
        .views;
    assert_eq!(
        planned.unwrap().images,
        views.inferred + views.not_needed - 1
    );
}

#[test]
fn people_who_do_not_count_are_concealed() {
    let engine = engine(BlobDetector::default(), None);
    let hidden = |areas, at: [f64; 2]| {
        let detected = detected(&engine, areas, "fast", 1, at);
        let boxes = detected.boxes_of_others();
        boxes.iter().any(|&[left, top, right, bottom]| {
            left <= at[0] && at[0] < right && top <= at[1] && at[1] < bottom
        })
    };
    assert!(!hidden("", [420.0, 300.0]));
    assert!(!hidden(AROUND_FOOT, [420.0, 300.0]));
    for areas in [BEFORE_FOOT, IGNORED_FOOT, OTHER_SIDE] {
        assert!(hidden(areas, [420.0, 300.0]), "{areas}");
    }
}

//! The report's JSON, field by field.

use std::time::Duration;

use jiff::Timestamp;
use lookdown::api::to_report;
use lookdown_calibration::warning::{Warning, WarningCode};
use lookdown_common::report::Report;
use lookdown_detect::{
    detection::{BBox, Refinement, RefinementParameters},
    parameters::Profile,
    pipeline::{
        CalibrationUsed, DetectionReport, ModelUsed, Person, Search, StageTimings, ViewCounts,
        ZoneCount,
    },
};
use lookdown_lens::geometry::{
    FloorVotes, OrientedBox, PersonHeight, Pixel, Posture,
    floor::{Bearing, FloorPosition},
};

fn person() -> Person {
    let oriented_box = OrientedBox {
        center: Pixel::new(1222.9, 771.304),
        width: 118.25,
        height: 241.019,
        angle: 79.84_f64.to_radians(),
        up: nalgebra::Vector2::new(0.0, -1.0),
    };
    Person {
        bbox: BBox::new([1102.4149, 700.0751, 1341.7, 842.600_000_1]).unwrap(),
        score: 0.873_149,
        upright_box: oriented_box,
        oriented_box,
        foot: Pixel::new(1200.0, 771.0),
        bearing: Some(Bearing {
            azimuth: 349.871_f64.to_radians(),
            off_axis: 41.709_f64.to_radians(),
        }),
        floor: Some(FloorPosition {
            x_m: 1.873_49,
            y_m: -0.000_1,
        }),
        height: Some(PersonHeight {
            height_m: 1.740_9,
            sd_m: 0.21,
            foot_angle: 1.0,
        }),
        posture: (Posture::Upright, 0.912_34),
        floor_votes: Some(FloorVotes {
            lying: 0.051_27,
            low: 0.0,
        }),
        views: 3,
        zones: Some(vec!["entrance".to_owned()]),
    }
}

fn report() -> DetectionReport {
    let unknown_place = Person {
        bearing: None,
        floor: None,
        height: None,
        zones: Some(Vec::new()),
        ..person()
    };
    let micros = Duration::from_micros;
    DetectionReport {
        request_id: "0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c70".to_owned(),
        camera: "lobby-north".to_owned(),
        received_at: Timestamp::from_microsecond(1_795_253_400_412_345).unwrap(),
        captured_at: Some("2026-11-21T10:30:00+01:00".parse().unwrap()),
        calibration: CalibrationUsed {
            id: "lobby".to_owned(),
            revision: "9f86d081884c".to_owned(),
            assumed_circle: None,
        },
        image_width: 1680,
        image_height: 1680,
        model: ModelUsed {
            name: "ssdlite_mobilenet_v2".to_owned(),
            revision: "60303ae22b99".to_owned(),
        },
        crop_model: Some(ModelUsed {
            name: "nanodet_g_fisheye_416".to_owned(),
            revision: "5b1f0c77e2aa".to_owned(),
        }),
        profile: Profile::Balanced,
        refinement: RefinementParameters {
            refinement: Refinement::Fusion,
            iou_threshold: 0.4,
            sigma: 0.3,
            score_threshold: 0.3,
            max_detections: 1000,
        },
        defaults: Vec::new(),
        persons: vec![person(), unknown_place],
        scores: vec![0.8731],
        margin: None,
        zones: vec![ZoneCount {
            name: "entrance".to_owned(),
            persons: 1,
        }],
        search: Search::Full,
        views: ViewCounts {
            inferred: 20,
            unchanged: 4,
            outside: 1,
            masked: 2,
            outside_areas: 3,
            not_needed: 5,
        },
        batch_count: 3,
        non_finite: 0,
        timings: StageTimings {
            decode: micros(11_204),
            calibrate: micros(15),
            queue: micros(61),
            remap: micros(21_377),
            inference: micros(580_902),
            refine: micros(412),
            total: micros(614_122),
        },
        warnings: vec![Warning::new(
            WarningCode::FrameRotated,
            "the frame was rotated",
        )],
    }
}

#[test]
fn a_report_has_these_fields_units_and_decimals() {
    insta::assert_json_snapshot!("report", to_report(&report()));
}

#[test]
fn a_report_is_read_as_it_was_written() {
    let mut of_engine = report();
    of_engine.margin = Some(of_engine.persons.clone());
    for of_engine in [report(), of_engine] {
        let written = to_report(&of_engine);
        let json = serde_json::to_string(&written).unwrap();
        assert_eq!(serde_json::from_str::<Report>(&json).unwrap(), written);
    }
}

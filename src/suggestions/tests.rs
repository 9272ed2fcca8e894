//! Findings about cameras, without frames.

use std::{sync::Arc, time::Instant};

use lookdown_calibration::{
    CalibrationId,
    native::{SourcedValue, ValueSource},
};
use lookdown_lens::{
    geometry::{Lens, OrientedBox, Pixel, Ray, pixels::to_corner_origin},
    self_calibration::{FitUncertainty, KnownCamera, RoomFit},
};
use tempfile::TempDir;

use super::{
    MAX_CAMERAS, SILENCE, make_room,
    worker::{FRAMES, Observed, Shared, Subject, Worker},
};
use crate::calibration_store::{Calibrations, FolderStore};
use lookdown_common::OwnCameras;

const SIZE: (u32, u32) = (1600, 1600);
/// A calibration without a height.
const HALL: &str = r#"{ "id": "hall", "image": {"width": 1600, "height": 1600},
  "lens": {"model": "equidistant", "focal": 509.3, "cx": 799.5, "cy": 799.5, "max_theta": 1.57},
  "mount": {"world_up": [0, 0, -1]} }"#;

fn shared(folder: &TempDir, applies: bool) -> Arc<Shared> {
    let store = Box::new(FolderStore::new(folder.path()));
    let calibrations = Calibrations::open(store, true, Arc::default()).unwrap();
    Arc::new(Shared {
        cameras: parking_lot::Mutex::default(),
        calibrations: Arc::new(calibrations),
        limits: lookdown_imaging::decode::DecodeLimits::default(),
        known: KnownCamera::default(),
        applies,
    })
}

fn hall() -> CalibrationId {
    "hall".parse().unwrap()
}

/// The box of a person of 1.75 m, `out_m` away from the point below a camera at 3 m.
fn standing(out_m: f64, azimuth: f64) -> OrientedBox {
    let lens = Lens::equidistant_circle(799.5, 799.5, 800.0, 1.57).unwrap();
    let (sin, cos) = azimuth.sin_cos();
    let ends = [0.0, 1.75].map(|up_m| -> Pixel {
        let ray = Ray::new(out_m * cos, out_m * sin, 3.0 - up_m);
        to_corner_origin(lens.project(&ray).unwrap())
    });
    OrientedBox::averaging((ends[1] - ends[0]).normalize(), [(1.0, &ends[..])]).unwrap()
}

fn fit() -> RoomFit {
    RoomFit {
        focal: 509.3,
        k: [0.0; 4],
        center: [799.5, 799.5],
        max_theta: 1.57,
        directions: [Ray::z(), Ray::x(), Ray::y()],
        explained: 0.8,
        edges: 400,
        edge_scale: 1.0,
        is_circle_detected: true,
        uncertainty: FitUncertainty {
            radius: 0.004,
            center: 1.0,
            level_deg: 0.2,
        },
    }
}

/// A camera with people all around it.
fn observed(subject: Subject) -> Observed {
    let mut observed = Observed::default();
    let now = Instant::now();
    observed.see(subject, SIZE, now);
    let people = (0..12).map(|index| standing(2.0 + 0.2 * f64::from(index), f64::from(index)));
    assert!(observed.add_people(people, now));
    observed
}

#[test]
fn the_height_is_offered_in_a_calibration_without_one() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("hall.json"), HALL).unwrap();
    let shared = shared(&folder, true);
    let camera = observed(Subject::Height(hall()));
    shared.cameras.lock().insert(hall(), camera);
    let worker = Worker(Arc::clone(&shared));
    worker.measure_height(&hall());
    worker.apply(&hall());
    let found = shared.suggestion(&hall()).unwrap();
    let native = found.calibration.unwrap();
    assert!(
        (native.mount.height_m.unwrap() - 3.0).abs() < 0.2,
        "{native:?}"
    );
    assert_eq!(
        native.sources[&SourcedValue::HeightM].source,
        ValueSource::FromPeople
    );
    let entry = shared.calibrations.entry(&hall()).unwrap();
    assert_eq!(
        found.replaces.as_deref(),
        Some(entry.calibration.revision())
    );
    // Only calibrations of cameras without one are stored without a request.
    assert_eq!(entry.native.mount.height_m, None);
}

#[test]
fn a_height_that_was_given_meanwhile_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let given = HALL.replace("[0, 0, -1]", "[0, 0, -1], \"height_m\": 2.8");
    std::fs::write(folder.path().join("hall.json"), given).unwrap();
    let shared = shared(&folder, false);
    let camera = observed(Subject::Height(hall()));
    shared.cameras.lock().insert(hall(), camera);
    Worker(Arc::clone(&shared)).measure_height(&hall());
    let found = shared.suggestion(&hall()).unwrap();
    assert!(matches!(found.height, Some(Ok(_))));
    assert_eq!((found.calibration, found.replaces), (None, None));
}

#[test]
fn a_lens_of_all_frames_is_stored_if_the_settings_permit_it() {
    for (applies, frames, is_stored) in [
        (true, FRAMES, true),
        (false, FRAMES, false),
        (true, FRAMES - 1, false),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let shared = shared(&folder, applies);
        let mut camera = observed(Subject::Lens);
        for _ in 0..frames {
            camera.frame_taken(Instant::now());
        }
        camera.fit = Some(Ok(fit()));
        shared.cameras.lock().insert(hall(), camera);
        let worker = Worker(Arc::clone(&shared));
        worker.measure_height(&hall());
        worker.apply(&hall());
        let stored = shared.calibrations.entry(&hall());
        assert_eq!(stored.is_some(), is_stored, "{applies} {frames}");
        if let Some(stored) = stored {
            assert!(stored.native.mount.height_m.is_some());
        }
    }
}

#[test]
fn an_existing_calibration_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let shared = shared(&folder, true);
    let mut camera = observed(Subject::Lens);
    for _ in 0..FRAMES {
        camera.frame_taken(Instant::now());
    }
    camera.fit = Some(Ok(fit()));
    shared.cameras.lock().insert(hall(), camera);
    // Another server has stored one, which this one has not read yet.
    std::fs::write(folder.path().join("hall.json"), HALL).unwrap();
    Worker(Arc::clone(&shared)).apply(&hall());
    let content = std::fs::read_to_string(folder.path().join("hall.json")).unwrap();
    assert_eq!(content, HALL);
}

#[test]
fn own_camera_is_observed_among_many_names() {
    let now = Instant::now();
    let own = OwnCameras::default();
    own.set([("hall".to_owned(), false)].into());
    let mut observed = std::collections::BTreeMap::new();
    for number in 0..MAX_CAMERAS {
        let mut camera = Observed::default();
        camera.see(Subject::Lens, SIZE, now);
        observed.insert(format!("x{number}").parse().unwrap(), camera);
    }
    let other = "new".parse().unwrap();
    assert!(!make_room(&mut observed, &other, &own, now));
    assert!(make_room(&mut observed, &hall(), &own, now));
    assert!(make_room(&mut observed, &other, &own, now + SILENCE));
    assert_eq!(observed.len(), MAX_CAMERAS - 2);
}

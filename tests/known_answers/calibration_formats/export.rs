//! Written files read back as the same lens. Content that a format cannot hold is refused or
//! reported.

use std::f64::consts::TAU;

use lookdown_calibration::{CalibrationFile, export::Target, native::NativeCalibration};
use lookdown_lens::geometry::{Lens, Ray};
use strum::VariantArray;

use crate::calibration_formats::{camera, fixture, lens};

/// Every lens model with the formats that can hold it, in addition to the native one.
const LENSES: [(&str, &[&str]); 14] = [
    (
        r#"{"model":"equidistant","focal":190.5,"cx":255,"cy":257}"#,
        &["opencv", "kalibr", "ros", "colmap"],
    ),
    (
        r#"{"model":"equisolid","focal":190.5,"cx":255,"cy":257}"#,
        &[],
    ),
    (
        r#"{"model":"stereographic","fx":190.5,"fy":191,"cx":255,"cy":257}"#,
        &["opencv", "kalibr", "colmap"],
    ),
    (
        r#"{"model":"orthographic","focal":190.5,"cx":255,"cy":257}"#,
        &[],
    ),
    (
        r#"{"model":"rectilinear","focal":190.5,"cx":255,"cy":257}"#,
        &["opencv", "kalibr", "ros", "colmap"],
    ),
    (
        r#"{"model":"radial_polynomial","coefficients":[0,200,-3,1e-7],"cx":255,"cy":257}"#,
        &[],
    ),
    (
        r#"{"model":"kannala_brandt","fx":190.9,"fy":190.8,"cx":255,"cy":257,
            "k":[0.0035,1e-7,-0.002,0.0002]}"#,
        &["opencv", "kalibr", "ros", "colmap"],
    ),
    (
        r#"{"model":"ucm","fx":190.9,"fy":190.8,"cx":255,"cy":257,"alpha":0.6}"#,
        &["opencv", "kalibr", "colmap"],
    ),
    (
        r#"{"model":"eucm","fx":190.9,"fy":190.8,"cx":255,"cy":257,"alpha":0.6,"beta":1.1}"#,
        &["kalibr", "colmap"],
    ),
    (
        r#"{"model":"mei","fx":833,"fy":830,"cx":255,"cy":257,"xi":0.8,"k1":-0.03,"k2":0.01,
            "p1":0.0005,"p2":-0.0004}"#,
        &["opencv", "kalibr"],
    ),
    (
        r#"{"model":"double_sphere","fx":158,"fy":158.1,"cx":255,"cy":257,"xi":-0.17,"alpha":0.59}"#,
        &["kalibr"],
    ),
    (
        r#"{"model":"ocam","polynomial":[-200,0,0.001,-1e-7],"cx":255,"cy":257}"#,
        &[],
    ),
    (
        r#"{"model":"fov","fx":447,"fy":447.1,"cx":255,"cy":257,"omega":0.93}"#,
        &["kalibr", "colmap"],
    ),
    (
        r#"{"model":"f_theta","angle_to_pixel":[0,190,1,-2,0,0],"cx":255,"cy":257}"#,
        &[],
    ),
];

fn calibration(lens: &str) -> NativeCalibration {
    let content = format!(r#"{{"id":"hall","image":{{"width":512,"height":520}},"lens":{lens}}}"#);
    serde_json::from_str(&content).unwrap()
}

#[test]
fn every_target_holds_its_lenses_and_refuses_the_others() {
    for (text, holding) in LENSES {
        let calibration = calibration(text);
        let original = Lens::new(&calibration.lens).unwrap();
        for &target in Target::VARIANTS {
            let written = target.write(&calibration);
            if target == Target::Native || holding.contains(&target.name()) {
                let content = written.unwrap().content;
                let read = camera(content.as_bytes(), 0);
                let image = read.image.unwrap();
                assert_eq!((image.width, image.height), (512, 520), "{content}");
                let read = lens(&read);
                for step in 0..60 {
                    let theta = original.max_theta().min(1.4) * f64::from(step) / 60.0;
                    let azimuth = TAU * f64::from(step) / 7.0;
                    let ray = Ray::new(
                        theta.sin() * azimuth.cos(),
                        theta.sin() * azimuth.sin(),
                        theta.cos(),
                    );
                    let (one, other) = (original.project(&ray), read.project(&ray));
                    let off = (one.unwrap() - other.unwrap()).norm();
                    assert!(off < 1e-9, "{text} as {}: off by {off}", target.name());
                }
            } else {
                let refused = written.unwrap_err().to_string();
                let expected = format!("{} has no {} lens", target.name(), original.model());
                assert!(refused.starts_with(&expected), "{refused}");
            }
        }
    }
}

#[test]
fn content_that_a_format_cannot_hold_is_reported() {
    let mut calibration = calibration(
        LENSES[0]
            .0
            .replace("257}", "257,\"max_theta\":1.5}")
            .as_str(),
    );
    calibration.mount.height_m = Some(2.8);
    let lost = Target::Kalibr.write(&calibration).unwrap().lost;
    assert_eq!(
        lost,
        [
            "kalibr cannot tell where the lens image ends: max_theta 1.5 is left out",
            "kalibr cannot tell how the camera hangs: mount is left out"
        ]
    );
    assert!(Target::Native.write(&calibration).unwrap().lost.is_empty());
}

#[test]
fn a_skewed_lens_is_refused_by_formats_without_skew() {
    let skewed = LENSES[6].0.replace("\"k\":", "\"skew\":0.5,\"k\":");
    let calibration = calibration(&skewed);
    assert!(Target::OpenCv.write(&calibration).is_ok());
    assert!(Target::Kalibr.write(&calibration).is_err());
    assert!(Target::Colmap.write(&calibration).is_err());
}

#[test]
fn a_native_file_keeps_everything() {
    let content = fixture("calibrations/nvidia_ftheta.json");
    let read_back = camera(&content, 0);
    let native = read_back.to_native("hall".to_owned(), read_back.image.unwrap());
    let written = Target::Native.write(&native).unwrap().content;
    let file = CalibrationFile::parse(written.as_bytes()).unwrap();
    assert_eq!(file.cameras[0].name.as_deref(), Some("hall"));
    assert_eq!(file.cameras[0].camera.clone().unwrap().lens, native.lens);
}

//! Calibration files of other programs: each format is detected from the content and read as the
//! lens that the program defines.

mod answers;
mod complexity;
mod damage;
mod export;
mod published;
mod traps;

use std::path::PathBuf;

use lookdown_calibration::{CalibrationFile, formats::Camera};
use lookdown_lens::geometry::{Lens, Ray};
use serde_json::Value;

/// A file of `tests/fixtures`.
fn fixture(path: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/fixtures")
        .join(path);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn json(path: &str) -> Value {
    serde_json::from_slice(&fixture(path)).unwrap()
}

/// The camera with index `index` in a file.
fn camera(content: &[u8], index: usize) -> Camera {
    CalibrationFile::parse(content).unwrap().cameras[index]
        .camera
        .clone()
        .unwrap()
}

/// The error message for a refused file, or for its first camera.
fn refusal(content: &[u8]) -> String {
    match CalibrationFile::parse(content) {
        Err(error) => error.to_string(),
        Ok(mut file) => file.cameras.remove(0).camera.unwrap_err().to_string(),
    }
}

fn lens(camera: &Camera) -> Lens {
    Lens::new(&camera.lens).unwrap()
}

fn ray(value: &Value) -> Ray {
    Ray::new(
        value[0].as_f64().unwrap(),
        value[1].as_f64().unwrap(),
        value[2].as_f64().unwrap(),
    )
}

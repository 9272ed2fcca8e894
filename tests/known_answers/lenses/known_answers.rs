//! Common structure of all sets of known answers.

use lookdown_lens::geometry::{Lens, Pixel, Ray, lens::LensModel};
use serde_json::Value;

/// Projections and unprojections of one camera. `None` where the lens must refuse.
pub struct KnownAnswers {
    pub name: String,
    /// The lens as in a native calibration file.
    pub lens_fields: Value,
    /// Width and height of the frame, pixels.
    pub image: [u32; 2],
    pub projections: Vec<(Ray, Option<Pixel>)>,
    pub unprojections: Vec<(Pixel, Option<Ray>)>,
    pub tolerance_px: f64,
    pub tolerance_ray: f64,
    /// The largest angle of the lens according to the reference, radians.
    pub max_theta: Option<f64>,
}

impl KnownAnswers {
    pub fn lens(&self) -> Lens {
        let model: LensModel = serde_json::from_value(self.lens_fields.clone()).unwrap();
        Lens::new(&model).unwrap()
    }
}

/// A file of `tests/fixtures/vectors`.
pub fn fixture(name: &str) -> Value {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/vectors");
    serde_json::from_str(&std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap())
        .unwrap()
}

pub fn numbers(value: &Value) -> Vec<f64> {
    serde_json::from_value(value.clone()).unwrap()
}

/// The items of a list. Empty when it is missing.
pub fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

pub fn ray(value: &Value) -> Ray {
    let [x, y, z] = numbers(value).try_into().unwrap();
    Ray::new(x, y, z)
}

pub fn pixel(value: &Value) -> Pixel {
    let [x, y] = numbers(value).try_into().unwrap();
    Pixel::new(x, y)
}

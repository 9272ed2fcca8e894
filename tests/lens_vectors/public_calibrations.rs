//! Calibrations that others have published, projected by the reference implementation of their
//! format (`public_calibrations.json`, made by `make_public_calibrations.py` beside it).

use lookdown::geometry::{Pixel, Ray};
use serde_json::{Value, json};

use crate::known_answers::{KnownAnswers, fixture, items, numbers, pixel, ray};

/// What the references print or compute in double precision.
const TOLERANCE_PX: f64 = 1e-6;
/// The reference of ocam projects with an approximate inverse polynomial, fitted within the frame.
const OCAM_TOLERANCE_PX: f64 = 0.005;
const TOLERANCE_RAY: f64 = 1e-9;

pub fn all() -> Vec<KnownAnswers> {
    let fixture = fixture("public_calibrations");
    let sets = items(&fixture["sets"]).iter();
    // The documentation's examples are about the camera of another set.
    sets.filter(|set| set["name"] != "ocam_matsuren_docstring")
        .map(read)
        .chain([documented_example(&fixture)])
        .collect()
}

fn read(set: &Value) -> KnownAnswers {
    let name = set["name"].as_str().unwrap();
    let is_colmap = set["model"].as_str().unwrap().starts_with("colmap");
    let is_ocam = name.starts_with("ocam");
    // COLMAP counts from the corner of the first pixel.
    let origin = if is_colmap { 0.5 } else { 0.0 };
    let rays = items(&set["rays"]).iter().map(ray);
    let pixels = items(&set["pixels"]).iter();
    let pixels = pixels.map(|uv| Some(pixel(uv) - nalgebra::Vector2::repeat(origin)));
    let mut projections: Vec<_> = rays.zip(pixels).collect();
    projections.extend(along_the_axis(set));
    if is_ocam {
        let [width, height] = numbers(&set["size"]).try_into().unwrap();
        projections.retain(|(_, expected)| {
            expected.is_some_and(|uv| (0.0..width).contains(&uv.x) && (0.0..height).contains(&uv.y))
        });
    }
    let inverse_pixels = items(&set["inverse_pixels"]).iter().map(pixel);
    let inverse_rays = items(&set["inverse_rays"])
        .iter()
        .map(|value| Some(ray(value)));
    KnownAnswers {
        name: name.to_owned(),
        lens_fields: lens_fields(set),
        image: image(set),
        projections,
        unprojections: inverse_pixels.zip(inverse_rays).collect(),
        tolerance_px: if is_ocam {
            OCAM_TOLERANCE_PX
        } else {
            TOLERANCE_PX
        },
        tolerance_ray: TOLERANCE_RAY,
        max_theta: None,
    }
}

/// The frame's width and height, which some sets have only in their name.
fn image(set: &Value) -> [u32; 2] {
    match set["name"].as_str().unwrap() {
        "moil_axis_2880" => [2880, 2880],
        "tumvi_512_ds" => [512, 512],
        _ => serde_json::from_value(set["size"].clone()).unwrap(),
    }
}

/// The radii that the moil set lists by angle.
fn along_the_axis(set: &Value) -> Vec<(Ray, Option<Pixel>)> {
    let Some(radii) = set["alpha_deg_to_r_px"].as_object() else {
        return Vec::new();
    };
    let centre = pixel(&set["center"]);
    let cases = radii.iter().map(|(degrees, radius)| {
        let (sin, cos) = degrees.parse::<f64>().unwrap().to_radians().sin_cos();
        let expected = Pixel::new(centre.x, centre.y + radius.as_f64().unwrap());
        (Ray::new(0.0, sin, cos), Some(expected))
    });
    cases.collect()
}

/// The examples in the documentation of the ocam reference.
fn documented_example(fixture: &Value) -> KnownAnswers {
    let sets = items(&fixture["sets"]);
    let named = |name: &str| sets.iter().find(|set| set["name"] == name).unwrap();
    let example = named("ocam_matsuren_docstring");
    KnownAnswers {
        name: "ocam_matsuren_docstring".to_owned(),
        lens_fields: lens_fields(named("ocam_matsuren_1600x1600")),
        image: image(named("ocam_matsuren_1600x1600")),
        projections: vec![
            (
                Ray::new(1.0, 1.0, 2.0),
                Some(pixel(&example["world2cam([1,1,2])"])),
            ),
            (
                Ray::new(0.0, 0.0, 2.0),
                Some(pixel(&example["world2cam([0,0,2])"])),
            ),
        ],
        unprojections: vec![(
            Pixel::new(502.0, 900.0),
            Some(ray(&example["cam2world([502,900])"])),
        )],
        tolerance_px: OCAM_TOLERANCE_PX,
        tolerance_ray: TOLERANCE_RAY,
        max_theta: None,
    }
}

/// The camera's parameters under the names of the native calibration file.
fn lens_fields(set: &Value) -> Value {
    let with_model = |name: &str| {
        let mut fields = set["params"].clone();
        fields["model"] = name.into();
        fields
    };
    let matrix = |row: usize, column: usize| set["K"][row][column].as_f64().unwrap();
    let model = set["model"].as_str().unwrap();
    if let Some(model) = model.strip_prefix("colmap ") {
        return from_colmap(model, &numbers(&set["params"]));
    }
    match model.split([' ', '/', ':']).next().unwrap() {
        "opencv_fisheye" => json!({
            "model": "kannala_brandt", "k": set["D"],
            "fx": matrix(0, 0), "fy": matrix(1, 1), "cx": matrix(0, 2), "cy": matrix(1, 2),
        }),
        "mei" => json!({
            "model": "mei", "xi": set["xi"],
            "k1": set["D"][0], "k2": set["D"][1], "p1": set["D"][2], "p2": set["D"][3],
            "fx": matrix(0, 0), "fy": matrix(1, 1), "cx": matrix(0, 2), "cy": matrix(1, 2),
        }),
        "ocam" => with_model("ocam"),
        "double" => with_model("double_sphere"),
        "moil" => {
            let mut fields = with_model("radial_polynomial");
            fields["cx"] = set["center"][0].clone();
            fields["cy"] = set["center"][1].clone();
            fields
        }
        other => panic!("no lens model for {other}"),
    }
}

fn from_colmap(model: &str, params: &[f64]) -> Value {
    match (model, params) {
        ("OPENCV_FISHEYE", [fx, fy, cx, cy, k @ ..]) => json!({
            "model": "kannala_brandt", "k": k,
            "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5,
        }),
        ("SIMPLE_RADIAL_FISHEYE", [f, cx, cy, k]) => json!({
            "model": "kannala_brandt", "k": [k, 0.0, 0.0, 0.0],
            "fx": f, "fy": f, "cx": cx - 0.5, "cy": cy - 0.5,
        }),
        ("EUCM", [fx, fy, cx, cy, alpha, beta]) => json!({
            "model": "eucm", "alpha": alpha, "beta": beta,
            "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5,
        }),
        ("FOV", [fx, fy, cx, cy, omega]) => json!({
            "model": "fov", "omega": omega,
            "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5,
        }),
        (other, _) => panic!("no lens model for {other}"),
    }
}

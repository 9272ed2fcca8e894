//! The 22 cameras with rays in all directions, and pixels inside and outside the lens image.

use serde_json::{Value, json};

use crate::lenses::known_answers::{KnownAnswers, fixture, items, numbers, pixel, ray};

pub fn all() -> Vec<KnownAnswers> {
    let fixtures = fixture("lenses");
    fixtures.as_object().unwrap().values().map(read).collect()
}

fn read(fixture: &Value) -> KnownAnswers {
    let projections = items(&fixture["project"]).iter();
    let unprojections = items(&fixture["unproject"]).iter();
    let is_valid = |case: &Value| case["valid"].as_bool().unwrap();
    KnownAnswers {
        name: fixture["name"].as_str().unwrap().to_owned(),
        lens_fields: lens_fields(fixture),
        image: serde_json::from_value(fixture["image_size"].clone()).unwrap(),
        projections: projections
            .map(|case| {
                let uv = is_valid(case).then(|| pixel(&case["uv"]));
                (ray(&case["xyz"]), uv)
            })
            .collect(),
        unprojections: unprojections
            .map(|case| {
                let xyz = is_valid(case).then(|| ray(&case["ray"]));
                (pixel(&case["uv"]), xyz)
            })
            .collect(),
        tolerance_px: fixture["tolerance_px"].as_f64().unwrap(),
        tolerance_ray: fixture["tolerance_ray"].as_f64().unwrap(),
        max_theta: fixture["theta_max_rad"].as_f64(),
    }
}

/// The camera's parameters with the names of the native calibration file.
fn lens_fields(fixture: &Value) -> Value {
    let params = &fixture["params"];
    let number = |name: &str| params[name].as_f64().unwrap();
    let model = fixture["model"].as_str().unwrap();
    match model {
        "woodscape_poly4" => json!({
            "model": "radial_polynomial",
            "coefficients": [0.0, params["k1"], params["k2"], params["k3"], params["k4"]],
            "aspect": params["aspect_ratio"],
            "cx": number("cx_offset") + number("width") / 2.0 - 0.5,
            "cy": number("cy_offset") + number("height") / 2.0 - 0.5,
        }),
        "ocamcalib" => json!({
            "model": "ocam",
            "polynomial": params["pol"],
            "c": params["c"], "d": params["d"], "e": params["e"],
            "cx": params["yc"], "cy": params["xc"],
        }),
        "ftheta" => {
            let center = numbers(&params["principal_point"]);
            let affine = numbers(&params["linear_cde"]);
            json!({
                "model": "f_theta",
                "angle_to_pixel": params["angle_to_pixeldist_poly"],
                "pixel_to_angle": params["pixeldist_to_angle_poly"],
                "c": affine[0], "d": affine[1], "e": affine[2],
                "cx": center[0], "cy": center[1],
                "max_theta": params["max_angle"],
            })
        }
        _ => {
            let mut fields = params.clone();
            let name = if model == "mei_omni" { "mei" } else { model };
            fields["model"] = name.into();
            if let Some(focal) = fields.as_object_mut().unwrap().remove("f") {
                fields["focal"] = focal;
            }
            fields
        }
    }
}

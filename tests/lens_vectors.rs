//! Lens models against known answers from independent implementations
//! (`tests/fixtures/vectors`; each file names its source).
#![expect(clippy::unwrap_used, reason = "a broken fixture should stop the test")]

use lookdown::geometry::{
    Lens, Pixel, Ray,
    lens::{ImagePlane, RadialCurve},
};
use serde_json::Value;

const FIXTURES: [&str; 9] = [
    "ideal_equidistant",
    "ideal_equisolid",
    "ideal_stereographic",
    "ideal_orthographic",
    "ideal_rectilinear",
    "kb_basalt",
    "kb_nonmonotonic",
    "kb_tumvi512",
    "woodscape_fv",
];

fn load(name: &str) -> Value {
    let path = format!(
        "{}/tests/fixtures/vectors/{name}.json",
        env!("CARGO_MANIFEST_DIR")
    );
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn lens(fixture: &Value) -> Lens {
    let params = &fixture["params"];
    let get = |name: &str| params[name].as_f64().unwrap();
    let (curve, plane) = match fixture["model"].as_str().unwrap() {
        "kannala_brandt" => (
            RadialCurve::KannalaBrandt {
                k: numbers(&params["k"]).try_into().unwrap(),
            },
            ImagePlane::new(get("fx"), get("fy"), get("cx"), get("cy")),
        ),
        "woodscape_poly4" => (
            RadialCurve::Polynomial {
                coefficients: vec![0.0, get("k1"), get("k2"), get("k3"), get("k4")],
            },
            ImagePlane::new(
                1.0,
                get("aspect_ratio"),
                get("cx_offset") + get("width") / 2.0 - 0.5,
                get("cy_offset") + get("height") / 2.0 - 0.5,
            ),
        ),
        ideal => {
            let curve = match ideal {
                "equidistant" => RadialCurve::Equidistant,
                "equisolid" => RadialCurve::Equisolid,
                "stereographic" => RadialCurve::Stereographic,
                "orthographic" => RadialCurve::Orthographic,
                "rectilinear" => RadialCurve::Rectilinear,
                other => panic!("no lens model for {other}"),
            };
            (
                curve,
                ImagePlane::new(get("f"), get("f"), get("cx"), get("cy")),
            )
        }
    };
    Lens::new(curve, plane, None).unwrap()
}

#[test]
fn every_model_projects_as_its_known_answers_say() {
    for name in FIXTURES {
        let fixture = load(name);
        let lens = lens(&fixture);
        let tolerance = fixture["tolerance_px"].as_f64().unwrap();
        for case in fixture["project"].as_array().unwrap() {
            let xyz = numbers(&case["xyz"]);
            let found = lens.project(&Ray::new(xyz[0], xyz[1], xyz[2]));
            if case["valid"].as_bool().unwrap() {
                let uv = numbers(&case["uv"]);
                let found = found.unwrap_or_else(|| panic!("{name}: {xyz:?} was refused"));
                let bound = tolerance.max(1e-11 * uv[0].hypot(uv[1]));
                let error = (found - Pixel::new(uv[0], uv[1])).norm();
                assert!(error <= bound, "{name}: {xyz:?} is off by {error} px");
            } else {
                assert_eq!(found, None, "{name}: {xyz:?} must be refused");
            }
        }
    }
}

#[test]
fn every_model_unprojects_as_its_known_answers_say() {
    for name in FIXTURES {
        let fixture = load(name);
        let lens = lens(&fixture);
        let tolerance = fixture["tolerance_ray"].as_f64().unwrap();
        for case in fixture["unproject"].as_array().unwrap() {
            let uv = numbers(&case["uv"]);
            let found = lens.unproject(&Pixel::new(uv[0], uv[1]));
            if case["valid"].as_bool().unwrap() {
                let ray = numbers(&case["ray"]);
                let found = found.unwrap_or_else(|| panic!("{name}: {uv:?} was refused"));
                let error = (found - Ray::new(ray[0], ray[1], ray[2])).norm();
                assert!(error <= tolerance, "{name}: {uv:?} is off by {error} rad");
            } else {
                assert_eq!(found, None, "{name}: {uv:?} must be refused");
            }
        }
    }
}

#[test]
fn every_model_knows_where_it_stops_being_one_to_one() {
    for name in FIXTURES {
        let fixture = load(name);
        let expected = fixture["theta_max_rad"].as_f64().unwrap();
        let found = lens(&fixture).max_theta();
        assert!(
            (found - expected).abs() < 1e-9,
            "{name}: {found} instead of {expected}"
        );
    }
}

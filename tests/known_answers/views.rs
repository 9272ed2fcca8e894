//! The paper's virtual views against known answers (`tests/fixtures/vectors/pipeline_views.json`,
//! which agree with OpenCV's undistortion maps).

use lookdown_lens::geometry::{FieldOfViewReading, Lens, Mount, Pixel, ViewPlan};
use serde_json::Value;

#[test]
fn the_paper_plan_maps_every_view_pixel_to_the_known_position() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/fixtures/vectors/pipeline_views.json"
    );
    let fixture: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, std::f64::consts::FRAC_PI_2).unwrap();
    let mut points = 0;
    for case in fixture["views"].as_array().unwrap() {
        let reading = match case["fov_variant"].as_str().unwrap() {
            "paper_formula_53.13h" => FieldOfViewReading::Horizontal,
            "true_diag_53.13" => FieldOfViewReading::Diagonal,
            "literal_f_eq_c_90" => FieldOfViewReading::Literal,
            other => panic!("unknown reading {other}"),
        };
        let plan = ViewPlan::paper(reading);
        let number = |name: &str| case[name].as_f64().unwrap();
        let index = plan
            .directions
            .iter()
            .position(|view| {
                (view.elevation - number("elevation")).abs() < 1e-9
                    && (view.azimuth - number("azimuth")).abs() < 1e-9
            })
            .unwrap_or_else(|| panic!("no view at {case}"));
        let view = &plan.views(&Mount::default(), 416, 416)[index];
        assert!((view.focal - number("f_px")).abs() < 1e-9);
        for (row, expected) in case["R_view_to_fisheye"]
            .as_array()
            .unwrap()
            .iter()
            .enumerate()
        {
            for (column, value) in expected.as_array().unwrap().iter().enumerate() {
                let found = view.camera_from_view.matrix()[(row, column)];
                assert!((found - value.as_f64().unwrap()).abs() < 1e-12);
            }
        }
        for point in case["points"].as_array().unwrap() {
            let pair = |name: &str| {
                let values = point[name].as_array().unwrap();
                Pixel::new(values[0].as_f64().unwrap(), values[1].as_f64().unwrap())
            };
            let ray = view.ray_in_camera(&pair("view_uv"));
            if point["inside_180"].as_bool().unwrap() {
                let found = lens.project(&ray).unwrap();
                assert!((found - pair("fisheye_uv")).norm() < 1e-6, "{point}");
            } else {
                assert_eq!(lens.project(&ray), None, "{point}");
            }
            points += 1;
        }
    }
    assert_eq!(points, 84 * 7);
}

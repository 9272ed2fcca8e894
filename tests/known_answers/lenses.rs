//! Every lens model against known answers from independent implementations
//! (`tests/fixtures/vectors`, where each set names its source).

mod known_answers;
mod model_vectors;
mod public_calibrations;

use std::f64::consts::PI;

use known_answers::KnownAnswers;
use lookdown_calibration::Calibration;
use lookdown_lens::geometry::Ray;
use serde_json::json;

/// All sets: 22 synthetic and published cameras with rays in all directions, and 16 published
/// calibrations.
fn every_set() -> Vec<KnownAnswers> {
    let mut sets = model_vectors::all();
    sets.extend(public_calibrations::all());
    assert_eq!(sets.len(), 22 + 16);
    sets
}

fn angle_of(ray: &Ray) -> f64 {
    ray.x.hypot(ray.y).atan2(ray.z)
}

#[test]
fn every_model_projects_to_the_known_pixels() {
    for set in every_set() {
        let lens = set.lens();
        for (ray, expected) in &set.projections {
            let found = lens.project(ray);
            let name = set.name.as_str();
            // Projections of the reference beyond the angle at which its curve turns back are
            // invalid.
            let Some(expected) = expected.filter(|_| angle_of(ray) <= lens.max_theta()) else {
                assert_eq!(found, None, "{name}: {ray} must be refused");
                continue;
            };
            let found = found.unwrap_or_else(|| panic!("{name}: {ray} was refused"));
            let bound = set.tolerance_px.max(1e-11 * expected.coords.norm());
            let error = (found - expected).norm();
            assert!(error <= bound, "{name}: {ray} is off by {error} px");
        }
    }
}

#[test]
fn every_model_unprojects_to_the_known_rays() {
    for set in every_set() {
        let lens = set.lens();
        for (pixel, expected) in &set.unprojections {
            let found = lens.unproject(pixel);
            let name = set.name.as_str();
            let Some(expected) = expected else {
                assert_eq!(found, None, "{name}: {pixel} must be refused");
                continue;
            };
            let found = found.unwrap_or_else(|| panic!("{name}: {pixel} was refused"));
            let error = (found - expected).norm();
            assert!(
                error <= set.tolerance_ray,
                "{name}: {pixel} is off by {error} rad"
            );
        }
    }
}

#[test]
fn unprojection_inverts_projection_for_every_model() {
    for set in every_set() {
        let lens = set.lens();
        for (ray, pixel) in &set.projections {
            let (Some(_), Some(pixel)) = (pixel, lens.project(ray)) else {
                continue;
            };
            let back = lens.unproject(&pixel).unwrap();
            let error = (back - ray.normalize()).norm();
            assert!(error <= 1e-7, "{}: {ray} is off by {error} rad", set.name);
        }
    }
}

#[test]
fn every_model_has_the_known_max_theta() {
    for set in every_set() {
        let Some(expected) = set.max_theta else {
            continue;
        };
        let found = set.lens().max_theta();
        // A curve with a pole ends shortly before the pole. The curve of ocam ends beyond the range
        // of the reference.
        let tolerance = match set.name.as_str() {
            "mei_kalibr" | "mei_nodist" | "ucm_alpha_lt_half" => 1.1e-6,
            "ocamcalib_1600" => PI - expected,
            _ => 1e-9,
        };
        let error = (found - expected).abs();
        assert!(
            error <= tolerance,
            "{}: {found} instead of {expected}",
            set.name
        );
    }
}

#[test]
fn every_model_of_the_contract_has_known_answers() {
    let mut models: Vec<_> = every_set().iter().map(|set| set.lens().model()).collect();
    models.sort_unstable();
    models.dedup();
    assert_eq!(models.len(), 14, "{models:?}");
}

#[test]
fn every_calibration_passes_the_checks_of_a_calibration_file() {
    let folder = tempfile::tempdir().unwrap();
    for set in every_set() {
        let path = folder.path().join(format!("{}.json", set.name));
        let [width, height] = set.image;
        let file = json!({
            "id": set.name,
            "image": {"width": width, "height": height},
            "lens": set.lens_fields,
        });
        std::fs::write(&path, file.to_string()).unwrap();
        let calibration = Calibration::read(&path).unwrap();
        assert_eq!(calibration.lens().model(), set.lens().model());
    }
}

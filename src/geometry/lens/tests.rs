use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;

fn plane() -> ImagePlane {
    ImagePlane {
        skew: 0.3,
        ..ImagePlane::new(210.0, 205.0, 299.5, 301.25)
    }
}

/// Every lens model with plausible parameters, each reaching as far as it can.
fn every_model() -> impl Strategy<Value = Lens> {
    let kannala_brandt =
        prop::array::uniform4(-0.02..0.02).prop_map(|k| LensModel::KannalaBrandt { k });
    let polynomial = (200.0..400.0, -30.0..30.0, -30.0..30.0).prop_map(|(c1, c2, c3)| {
        LensModel::RadialPolynomial {
            coefficients: vec![0.0, c1, c2, c3],
        }
    });
    let curve = prop_oneof![
        Just(LensModel::Equidistant),
        Just(LensModel::Equisolid),
        Just(LensModel::Stereographic),
        Just(LensModel::Orthographic),
        Just(LensModel::Rectilinear),
        kannala_brandt,
        polynomial,
    ];
    curve.prop_map(|curve| Lens::new(curve, plane(), None).expect("the parameters are plausible"))
}

fn ray_at(theta: f64, azimuth: f64) -> Ray {
    Ray::new(
        theta.sin() * azimuth.cos(),
        theta.sin() * azimuth.sin(),
        theta.cos(),
    )
}

proptest! {
    #[test]
    fn every_model_returns_the_ray_it_projected(
        lens in every_model(),
        share in 0.0..0.999,
        azimuth in -PI..PI,
        length in 0.01..100.0,
    ) {
        let theta = lens.max_theta() * share;
        let ray = ray_at(theta, azimuth);
        let pixel = lens.project(&(ray * length)).expect("inside the valid range");
        let back = lens.unproject(&pixel).expect("a projected pixel lies in the lens image");
        // Near a stationary point the radius hardly depends on the angle, so compare in pixels too.
        let again = lens.project(&back).expect("the ray came from the lens");
        prop_assert!((again - pixel).norm() <= 1e-9 * (1.0 + pixel.coords.norm()));
        prop_assert!((back.norm() - 1.0).abs() < 1e-12);
        prop_assert!((back - ray).norm() < 1e-6, "{ray} came back as {back}");
    }

    #[test]
    fn every_model_refuses_rays_beyond_its_rim(
        lens in every_model(),
        excess in 1e-6..1.0,
        azimuth in -PI..PI,
    ) {
        let theta = lens.max_theta() + excess;
        prop_assume!(theta < PI);
        let ray = ray_at(theta, azimuth);
        prop_assert_eq!(lens.project(&ray), None);
        let rim = lens.project_to_rim(&ray).expect("a ray with an azimuth reaches the rim");
        prop_assert!(lens.unproject(&rim).is_some());
    }

    #[test]
    fn a_scaled_lens_sees_the_same_ray_at_the_scaled_place(
        lens in every_model(),
        scale in 0.1..8.0,
        share in 0.0..0.99,
        azimuth in -PI..PI,
    ) {
        let theta = lens.max_theta() * share;
        let ray = ray_at(theta, azimuth);
        let pixel = lens.project(&ray).expect("inside");
        let scaled = lens.scaled(scale, scale).project(&ray).expect("inside");
        let expected = Pixel::new((pixel.x + 0.5) * scale - 0.5, (pixel.y + 0.5) * scale - 0.5);
        prop_assert!((scaled - expected).norm() <= 1e-9 * (1.0 + expected.coords.norm()));
    }
}

#[test]
fn the_optical_axis_meets_the_principal_point() {
    let lens = Lens::new(LensModel::Equidistant, plane(), None).expect("plausible");
    assert_eq!(lens.project(&Ray::z()), Some(Pixel::new(299.5, 301.25)));
    assert_eq!(lens.project(&-Ray::z()), None);
    assert_eq!(lens.project(&Ray::zeros()), None);
    assert_eq!(lens.project(&Ray::new(f64::NAN, 0.0, 1.0)), None);
}

#[test]
fn a_max_theta_beyond_the_turning_point_is_refused_with_the_limit() {
    let curve = LensModel::KannalaBrandt {
        k: [-0.3, 0.0, 0.0, 0.0],
    };
    let error = Lens::new(curve, plane(), Some(1.5)).expect_err("turns over at 1.054 rad");
    assert_eq!(
        error.to_string(),
        "max_theta is 1.5 rad, but the curve of this kannala_brandt lens turns back at 1.054 rad: \
         check its coefficients, or give at most that"
    );
}

#[test]
fn parameters_that_make_no_lens_are_refused_by_name() {
    let build = |curve, plane| {
        Lens::new(curve, plane, None)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let flat = ImagePlane { fx: 0.0, ..plane() };
    assert_eq!(
        build(LensModel::Equidistant, flat),
        "fx is 0: it must be greater than 0"
    );
    let lost = ImagePlane {
        cy: f64::NAN,
        ..plane()
    };
    assert_eq!(
        build(LensModel::Equidistant, lost),
        "cy is NaN: a finite number is needed"
    );
    let falling = LensModel::RadialPolynomial {
        coefficients: vec![0.0, -3.0],
    };
    assert!(build(falling, plane()).contains("does not rise"));
    let torn = LensModel::RadialPolynomial {
        coefficients: vec![4.0, 3.0],
    };
    assert!(build(torn, plane()).contains("coefficients[0] is 4"));
    let constant = LensModel::RadialPolynomial {
        coefficients: vec![0.0],
    };
    assert!(build(constant, plane()).contains("1 entries"));
}

use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;

fn plane() -> ImagePlane {
    ImagePlane {
        skew: 0.3,
        row_skew: -0.2,
        ..ImagePlane::new(210.0, 205.0, 299.5, 301.25)
    }
}

/// Replaced by [`plane`].
const ANY_PINHOLE: Pinhole = [1.0, 1.0, 0.0, 0.0];
const CENTER: [f64; 2] = [0.0, 0.0];

fn lens_of(
    model: impl Into<LensModel>,
    plane: ImagePlane,
    max_theta: Option<f64>,
) -> Result<Lens, LensError> {
    Lens::on_plane(&model.into(), plane, max_theta)
}

fn kannala_brandt(k: [f64; 4]) -> LensModel {
    KannalaBrandt::new(ANY_PINHOLE, k).into()
}

fn radial_polynomial(coefficients: Vec<f64>) -> LensModel {
    RadialPolynomial::new(coefficients, CENTER).into()
}

fn ocam(polynomial: Vec<f64>) -> LensModel {
    Ocam::new(polynomial, CENTER).into()
}

fn mei(xi: f64, [k1, k2, p1, p2]: [f64; 4]) -> LensModel {
    Mei::new(ANY_PINHOLE, xi, k1, k2, p1, p2).into()
}

fn f_theta(angle_to_pixel: Option<[f64; 6]>, pixel_to_angle: Option<[f64; 6]>) -> LensModel {
    let [cx, cy] = CENTER;
    LensModel::FTheta(FTheta {
        angle_to_pixel,
        pixel_to_angle,
        c: 1.0,
        d: 0.0,
        e: 0.0,
        cx,
        cy,
        max_theta: None,
    })
}

/// Every lens model with plausible and not so plausible parameters.
fn every_model() -> impl Strategy<Value = LensModel> {
    let ideal = prop::sample::select(vec![
        Equidistant::new(ANY_PINHOLE).into(),
        Equisolid::new(ANY_PINHOLE).into(),
        Stereographic::new(ANY_PINHOLE).into(),
        Orthographic::new(ANY_PINHOLE).into(),
        Rectilinear::new(ANY_PINHOLE).into(),
    ]);
    let kannala_brandt = prop::array::uniform4(-0.02..0.02).prop_map(kannala_brandt);
    let polynomial = (200.0..400.0, -30.0..30.0, -30.0..30.0);
    let radial_polynomial = polynomial
        .clone()
        .prop_map(|(c1, c2, c3)| radial_polynomial(vec![0.0, c1, c2, c3]));
    let angle_to_pixel =
        polynomial.prop_map(|(c1, c2, c3)| f_theta(Some([0.0, c1, c2, c3, 2.0, -0.4]), None));
    let pixel_to_angle = (0.002..0.02, -1e-6..1e-6, -1e-9..1e-9)
        .prop_map(|(c1, c2, c3)| f_theta(None, Some([0.0, c1, c2, c3, 0.0, 0.0])));
    let unit = 0.0..=1.0;
    let ucm = unit
        .clone()
        .prop_map(|alpha| Ucm::new(ANY_PINHOLE, alpha).into());
    let eucm = (unit.clone(), 0.2..4.0)
        .prop_map(|(alpha, beta)| Eucm::new(ANY_PINHOLE, alpha, beta).into());
    let double_sphere =
        (-0.9..1.5, unit).prop_map(|(xi, alpha)| DoubleSphere::new(ANY_PINHOLE, xi, alpha).into());
    let tangential = -0.01..0.01;
    let mei = (
        -0.5..4.0,
        -0.4..0.3,
        -0.1..0.2,
        tangential.clone(),
        tangential,
    )
        .prop_map(|(xi, k1, k2, p1, p2)| mei(xi, [k1, k2, p1, p2]));
    let ocam = (-800.0..-100.0, -1e-3..1e-3, -1e-6..1e-6, -1e-9..1e-8)
        .prop_map(|(a0, a2, a3, a4)| ocam(vec![a0, 0.0, a2, a3, a4]));
    let fov = (0.01..3.1).prop_map(|omega| Fov::new(ANY_PINHOLE, omega).into());
    prop_oneof![
        ideal,
        kannala_brandt,
        radial_polynomial,
        angle_to_pixel,
        pixel_to_angle,
        ucm,
        eucm,
        double_sphere,
        mei,
        ocam,
        fov,
    ]
}

/// Every lens model, each reaching as far as it can.
fn every_lens() -> impl Strategy<Value = Lens> {
    every_model()
        .prop_map(|model| lens_of(model, plane(), None).expect("the parameters make a lens"))
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
        lens in every_lens(),
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
        lens in every_lens(),
        share in 1e-6..0.999,
        azimuth in -PI..PI,
    ) {
        let lens = lens.limited_to(lens.max_theta().min(3.0));
        let theta = lens.max_theta() + share * (PI - lens.max_theta());
        let ray = ray_at(theta, azimuth);
        prop_assert_eq!(lens.project(&ray), None);
        let rim = lens.project_to_rim(&ray).expect("a ray with an azimuth reaches the rim");
        prop_assert!(lens.unproject(&rim).is_some());
    }

    #[test]
    fn every_model_sees_more_of_the_world_farther_from_its_center(
        lens in every_lens(),
        share in 0.0..0.999,
        azimuth in -PI..PI,
    ) {
        let center = lens.principal_point();
        let distance = |share: f64| {
            let ray = ray_at(lens.max_theta() * share, azimuth);
            (lens.project(&ray).expect("inside the valid range") - center).norm()
        };
        prop_assert!(distance(share) < distance(share + 1e-3));
    }

    #[test]
    fn every_model_makes_a_finite_answer_or_none_of_anything(
        lens in every_lens(),
        x in prop::num::f64::ANY,
        y in prop::num::f64::ANY,
        z in prop::num::f64::ANY,
    ) {
        for pixel in [lens.project(&Ray::new(x, y, z)), lens.project_to_rim(&Ray::new(x, y, z))] {
            prop_assert!(pixel.is_none_or(|pixel| pixel.coords.iter().all(|v| v.is_finite())));
        }
        if let Some(ray) = lens.unproject(&Pixel::new(x, y)) {
            prop_assert!((ray.norm() - 1.0).abs() < 1e-9, "{ray}");
        }
    }

    #[test]
    fn what_a_limited_lens_no_longer_sees_is_only_what_lies_beyond(
        lens in every_lens(),
        limit in 0.1..0.9,
        share in 0.0..1.0,
        azimuth in -PI..PI,
    ) {
        let limited = lens.limited_to(lens.max_theta() * limit);
        let ray = ray_at(lens.max_theta() * share, azimuth);
        let pixel = lens.project(&ray).expect("inside the valid range");
        if share < limit {
            prop_assert_eq!(limited.project(&ray), Some(pixel));
            prop_assert!(limited.unproject(&pixel).is_some());
        } else if share > limit + 1e-6 {
            prop_assert_eq!(limited.project(&ray), None);
            prop_assert_eq!(limited.unproject(&pixel), None);
        }
    }

    #[test]
    fn a_scaled_lens_sees_the_same_ray_at_the_scaled_place(
        lens in every_lens(),
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
    let lens = lens_of(Equidistant::new(ANY_PINHOLE), plane(), None).expect("plausible");
    assert_eq!(lens.project(&Ray::z()), Some(Pixel::new(299.5, 301.25)));
    assert_eq!(lens.project(&-Ray::z()), None);
    assert_eq!(lens.project(&Ray::zeros()), None);
    assert_eq!(lens.project(&Ray::new(f64::NAN, 0.0, 1.0)), None);
}

#[test]
fn max_theta_beyond_the_turning_point_is_refused() {
    let curve = kannala_brandt([-0.3, 0.0, 0.0, 0.0]);
    let error = lens_of(curve, plane(), Some(1.5)).expect_err("turns over at 1.054 rad");
    assert_eq!(
        error.to_string(),
        "max_theta is 1.5 rad, but the curve of this kannala_brandt lens turns back at 1.054 rad: \
         check its coefficients, or give at most that"
    );
}

#[test]
fn parameters_that_make_no_lens_are_refused_by_name() {
    let build = |curve: LensModel, plane| {
        lens_of(curve, plane, None)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let flat = ImagePlane { fx: 0.0, ..plane() };
    assert_eq!(
        build(Equidistant::new(ANY_PINHOLE).into(), flat),
        "fx is 0: it must be greater than 0"
    );
    let lost = ImagePlane {
        cy: f64::NAN,
        ..plane()
    };
    assert_eq!(
        build(Equidistant::new(ANY_PINHOLE).into(), lost),
        "cy is NaN: a finite number is needed"
    );
    let falling = radial_polynomial(vec![0.0, -3.0]);
    assert!(build(falling, plane()).contains("does not rise"));
    let torn = radial_polynomial(vec![4.0, 3.0]);
    assert!(build(torn, plane()).contains("coefficients[0] is 4"));
    let constant = radial_polynomial(vec![0.0]);
    assert!(build(constant, plane()).contains("1 entries"));
}

#[test]
fn a_parameter_outside_its_range_is_refused_with_the_range() {
    let build = |model: LensModel| {
        lens_of(model, plane(), None)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    for (model, expected) in [
        (
            Ucm::new(ANY_PINHOLE, 1.2).into(),
            "alpha is 1.2: this ucm parameter must be from 0 to 1",
        ),
        (
            Eucm::new(ANY_PINHOLE, 0.5, 0.0).into(),
            "beta is 0: this eucm parameter must be above 0",
        ),
        (
            DoubleSphere::new(ANY_PINHOLE, -1.0, 0.5).into(),
            "xi is -1: this double_sphere parameter must be above -1",
        ),
        (
            Fov::new(ANY_PINHOLE, 3.5).into(),
            "omega is 3.5: this fov parameter must be radians above 0 and below 3.1416",
        ),
        (
            mei(0.8, [0.1, f64::INFINITY, 0.0, 0.0]),
            "k2 is inf: a finite number is needed",
        ),
        (
            ocam(vec![471.0, 0.0, -7e-4]),
            "polynomial[0] is 471: this ocam parameter must be below 0; OCamCalib's z axis points \
             into the camera",
        ),
        (
            ocam(vec![]),
            "polynomial has 0 entries: between 1 and 64 are accepted",
        ),
        (
            f_theta(None, Some([1e-3, 2e-3, 0.0, 0.0, 0.0, 0.0])),
            "pixel_to_angle[0] is 0.001: the radius at the optical axis must be 0",
        ),
    ] {
        assert_eq!(build(model), expected);
    }
}

#[test]
fn an_affine_part_that_mirrors_the_image_is_refused() {
    let mirroring = ImagePlane {
        skew: 300.0,
        row_skew: 200.0,
        ..plane()
    };
    let error = lens_of(Equidistant::new(ANY_PINHOLE), mirroring, None).expect_err("mirrors");
    assert!(error.to_string().contains("flattens or mirrors"), "{error}");
}

#[test]
fn the_lens_ends_where_the_distortion_folds() {
    let lens = lens_of(mei(1.0, [-0.3, 0.0, 0.0, 0.0]), plane(), None);
    // r (1 − 0.3 r²) turns back at r = 1/√0.9, and with xi 1 r is tan(theta / 2).
    let expected = 2.0 * (1.0 / 0.9_f64.sqrt()).atan();
    let found = lens.expect("plausible").max_theta();
    assert!((found - expected).abs() < 1e-9, "{found}");
}

#[test]
fn the_rim_of_a_folding_distortion_still_belongs_to_the_lens() {
    let tangential = [0.009_583_660_270_634_51, -0.008_671_048_736_876_826];
    let model = mei(0.0, [0.0, 0.0, tangential[0], tangential[1]]);
    let lens = lens_of(model, plane(), None).expect("plausible");
    for step in 0..1000 {
        let ray = ray_at(3.0, f64::from(step) * 1e-3 * 2.0 * PI);
        let rim = lens.project_to_rim(&ray).expect("has an azimuth");
        let back = lens.unproject(&rim).expect("on the rim");
        let theta = back.x.hypot(back.y).atan2(back.z);
        assert!((theta - lens.max_theta()).abs() < 1e-6, "{theta}");
    }
}

fn stereographic(plane: ImagePlane) -> Lens {
    let model = Stereographic::with_focal(1.0, 0.0, 0.0, 1.4);
    Lens::on_plane(&model.into(), plane, Some(1.4)).unwrap()
}

#[test]
fn the_continuation_within_the_rim_is_the_lens_itself() {
    let plane = ImagePlane::new(210.0, 205.0, 299.5, 301.25);
    let lens = stereographic(plane);
    for theta in [0.0, 0.3, 1.399] {
        let normalized = lens.continued_beyond_rim(&ray_at(theta, 0.9)).unwrap();
        let pixel = plane.pixel_from_normalized(normalized.x, normalized.y);
        assert!((pixel - lens.project(&ray_at(theta, 0.9)).unwrap()).norm() < 1e-9);
    }
}

#[test]
fn continuation_keeps_the_slope_at_the_rim() {
    let plane = ImagePlane::new(1.0, 1.0, 0.0, 0.0);
    let lens = stereographic(plane);
    let radius = |theta: f64| {
        lens.continued_beyond_rim(&ray_at(theta, 0.9))
            .unwrap()
            .coords
            .norm()
    };
    let rim = radius(1.4);
    assert!((radius(1.5) - rim - (rim - radius(1.3))).abs() < 1e-12);
    assert!(
        (radius(3.0) - 2.0 * rim).abs() < 1e-12,
        "it ends where the curve began"
    );
}

#[test]
fn no_continuation_for_what_is_exactly_behind_or_not_finite() {
    let lens = Lens::equidistant_circle(0.0, 0.0, 1.0, 1.5).unwrap();
    assert_eq!(lens.continued_beyond_rim(&-Ray::z()), None);
    assert_eq!(
        lens.continued_beyond_rim(&Ray::new(f64::NAN, 0.0, 1.0)),
        None
    );
    assert_eq!(lens.continued_beyond_rim(&Ray::z()), Some(Pixel::origin()));
}

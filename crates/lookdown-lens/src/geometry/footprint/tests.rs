use proptest::prelude::*;

use super::*;
use crate::geometry::{QuarterTurn, Ray, view_plan::ViewPlan};

fn lens() -> Lens {
    Lens::equidistant_circle(299.5, 299.5, 300.0, std::f64::consts::FRAC_PI_2).expect("plausible")
}

/// A standing person as a vertical ellipsoid of 1.7 m × 0.5 m, seen from 2.75 m: its outline as
/// rays in the camera frame of a camera that looks straight down.
fn standing_person(distance_m: f64, azimuth: f64) -> Vec<Ray> {
    let (height_m, camera_m, radius_m) = (1.7, 2.75, 0.25);
    let center = Ray::new(
        distance_m * azimuth.cos(),
        distance_m * azimuth.sin(),
        camera_m - height_m / 2.0,
    );
    let half = [radius_m, radius_m, height_m / 2.0];
    let mut rays = Vec::new();
    for step in 0..64 {
        for ring in 1..32 {
            let longitude = std::f64::consts::TAU * f64::from(step) / 64.0;
            let latitude = std::f64::consts::PI * (f64::from(ring) / 32.0 - 0.5);
            rays.push(
                center
                    + Ray::new(
                        half[0] * latitude.cos() * longitude.cos(),
                        half[1] * latitude.cos() * longitude.sin(),
                        half[2] * latitude.sin(),
                    ),
            );
        }
    }
    rays
}

fn hull(points: impl Iterator<Item = Pixel>) -> [f64; 4] {
    points.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |hull, point| {
        [
            hull[0].min(point.x),
            hull[1].min(point.y),
            hull[2].max(point.x),
            hull[3].max(point.y),
        ]
    })
}

fn overlap(a: [f64; 4], b: [f64; 4]) -> f64 {
    let area = |r: [f64; 4]| (r[2] - r[0]).max(0.0) * (r[3] - r[1]).max(0.0);
    let common = area([
        a[0].max(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].min(b[3]),
    ]);
    common / (area(a) + area(b) - common)
}

/// Overlap of the mapped view box of a person with its true frame box, over the views that hold
/// the whole person.
fn mean_overlap(back_projection: BackProjection, distance_m: f64, azimuth: f64) -> f64 {
    let (lens, mount) = (lens(), Mount::default());
    let person = standing_person(distance_m, azimuth);
    let truth = hull(person.iter().filter_map(|ray| lens.project(ray)));
    let truth = [
        truth[0] + 0.5,
        truth[1] + 0.5,
        truth[2] + 0.5,
        truth[3] + 0.5,
    ];
    let overlaps: Vec<f64> = ViewPlan::paper(crate::geometry::FieldOfViewReading::Horizontal)
        .views(&mount, 416, 416)
        .iter()
        .filter_map(|view| {
            let pixels: Option<Vec<Pixel>> = person.iter().map(|ray| view.project(ray)).collect();
            let seen = hull(pixels?.into_iter());
            let whole = seen[0] > 8.0 && seen[1] > 8.0 && seen[2] < 407.0 && seen[3] < 407.0;
            let box_in_view = [seen[0] + 0.5, seen[1] + 0.5, seen[2] + 0.5, seen[3] + 0.5];
            whole.then(|| {
                let footprint =
                    Footprint::from_view_box(box_in_view, back_projection, view, &lens, &mount);
                overlap(footprint.expect("inside the lens image").bounds(), truth)
            })
        })
        .collect();
    assert!(
        !overlaps.is_empty(),
        "no view holds a person at {distance_m} m"
    );
    let count = overlaps.len() as f64;
    overlaps.iter().sum::<f64>() / count
}

#[test]
fn tilted_ellipses_are_tight_where_corner_hulls_are_not() {
    // The ellipsoid row of the attainable-tightness study: corners 0.64 at 45°, ellipses 0.9 up.
    for distance_m in [1.0, 2.0, 3.0] {
        let azimuth = std::f64::consts::FRAC_PI_4;
        let corners = mean_overlap(BackProjection::CornerHull, distance_m, azimuth);
        let ellipse = mean_overlap(BackProjection::TiltedEllipse, distance_m, azimuth);
        assert!(
            (0.55..0.72).contains(&corners),
            "corners {corners} at {distance_m} m"
        );
        assert!(ellipse > 0.93, "ellipse {ellipse} at {distance_m} m");
    }
}

#[test]
fn a_box_beyond_the_lens_image_has_no_footprint() {
    let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, 0.6).expect("plausible");
    let mount = Mount::default();
    let view = &ViewPlan::balanced().views(&mount, 300, 300)[2];
    let top = [100.0, 0.0, 200.0, 60.0];
    for back_projection in [BackProjection::CornerHull, BackProjection::TiltedEllipse] {
        assert_eq!(
            Footprint::from_view_box(top, back_projection, view, &lens, &mount),
            None
        );
    }
}

proptest! {
    #[test]
    fn an_ellipse_with_the_found_axes_has_the_box_as_its_extent(
        angle in 0.0..std::f64::consts::TAU,
        half_width in 5.0..80.0,
        half_height in 5.0..200.0,
    ) {
        let vertical = Vector2::new(angle.sin(), angle.cos());
        if let Some((axis, along, across)) = ellipse_axes(vertical, half_width, half_height) {
            let width = (along * axis.x).hypot(across * axis.y);
            let height = (along * axis.y).hypot(across * axis.x);
            prop_assert!((width - half_width).abs() < 1e-6 * half_width);
            prop_assert!((height - half_height).abs() < 1e-6 * half_height);
        }
    }

    #[test]
    fn a_footprint_stays_within_the_lens_image(
        x in 0.0..260.0, y in 0.0..260.0, width in 2.0..40.0, height in 2.0..40.0, view in 0_usize..13,
    ) {
        let (lens, mount) = (lens(), Mount::default());
        let view = &ViewPlan::balanced().views(&mount, 300, 300)[view];
        let view_box = [x, y, x + width, y + height];
        let footprint = Footprint::from_view_box(view_box, BackProjection::TiltedEllipse, view, &lens, &mount);
        if let Some(footprint) = footprint {
            let [x_min, y_min, x_max, y_max] = footprint.bounds();
            prop_assert!(x_min >= -1e-6 && y_min >= -1e-6 && x_max <= 600.0 + 1e-6 && y_max <= 600.0 + 1e-6);
        }
    }
}

proptest! {
    #[test]
    fn the_footprint_of_a_crops_box_is_exact(
        turn in prop::sample::select(QuarterTurn::ALL.to_vec()),
        [x, y, width, height] in prop::array::uniform4(1.0..200.0_f64),
        scale in 0.2..4.0_f64,
    ) {
        let crop = FrameCrop {
            is_mirrored: false,
            turn,
            center: Pixel::new(300.0, 280.0),
            scale,
            width: 416,
            height: 416,
        };
        let found = [x, y, x + width, y + height];
        let expected = crop.frame_box(found);
        let center = Pixel::new(
            f64::midpoint(expected[0], expected[2]) - 0.5,
            f64::midpoint(expected[1], expected[3]) - 0.5,
        );
        let footprint = Footprint::from_crop_box(found, &crop, &lens());
        prop_assert_eq!(footprint.is_some(), lens().unproject(&center).is_some());
        if let Some(footprint) = footprint {
            for (side, expected) in footprint.bounds().into_iter().zip(expected) {
                prop_assert!((side - expected).abs() < 1e-9, "{side} instead of {expected}");
            }
        }
    }
}

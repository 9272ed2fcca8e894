use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::geometry::{Mount, Pixel, ViewPlan};

#[test]
fn the_paper_plan_has_four_rings_of_thirty_two_views() {
    let plan = ViewPlan::paper(FieldOfViewReading::default());
    assert_eq!(plan.directions.len(), 128);
    for (ring, elevation) in plan.directions.chunks(32).zip([0.0, 0.3, 0.6, 0.9]) {
        assert!(ring.iter().all(|view| view.elevation == elevation));
        assert!((ring[0].azimuth - (3.06 - 31.0 * 0.2)).abs() < 1e-12);
        assert!((ring[31].azimuth - 3.06).abs() < 1e-12);
    }
}

#[test]
fn readings_of_the_field_of_view_are_53_39_and_90_degrees() {
    let degrees = |reading: FieldOfViewReading| reading.radians().to_degrees();
    assert!((degrees(FieldOfViewReading::Horizontal) - 53.1301).abs() < 1e-4);
    assert!((degrees(FieldOfViewReading::Diagonal) - 38.9424).abs() < 1e-4);
    assert!((degrees(FieldOfViewReading::Literal) - 90.0).abs() < 1e-9);
}

#[test]
fn the_rings_of_a_plan_reach_the_rim_of_a_180_degree_lens() {
    for (plan, count) in [(ViewPlan::fast(), 5), (ViewPlan::balanced(), 16)] {
        let views = plan.views(&Mount::default(), 301, 301);
        assert_eq!(views.len(), count);
        let reach = views
            .iter()
            .map(|view| view.ray_in_camera(&Pixel::new(150.0, 0.0)))
            .map(|ray| ray.x.hypot(ray.y).atan2(ray.z))
            .fold(0.0, f64::max);
        assert!(
            reach > 85_f64.to_radians(),
            "a plan of {count} reaches {reach}"
        );
    }
}

#[test]
fn a_turned_plan_looks_where_a_turned_camera_would() {
    let angle = 0.3_f64;
    let views = |plan: ViewPlan| plan.views(&Mount::default(), 301, 301);
    let pixel = Pixel::new(40.0, 250.0);
    let spin = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    for (view, turned) in views(ViewPlan::balanced())
        .iter()
        .zip(views(ViewPlan::balanced().turned(angle)))
    {
        let expected = spin * view.ray_in_camera(&pixel);
        assert!((turned.ray_in_camera(&pixel) - expected).norm() < 1e-12);
    }
}

#[test]
fn wider_lenses_leave_more_beyond_the_plan() {
    let views = ViewPlan::balanced().views(&Mount::default(), 416, 416);
    let coverage = |max_theta: f64| {
        let lens = Lens::equidistant_circle(499.5, 499.5, 500.0, max_theta);
        Coverage::new(&lens.expect("a plausible lens"), &views, 1000, 1000)
    };
    let (narrow, wide) = (coverage(1.2), coverage(3.0));
    assert!(narrow.seen_share > 0.999, "{narrow:?}");
    assert!(wide.seen_share < 0.6, "{wide:?}");
    assert!(narrow.mean_views > wide.mean_views);
    let none = Coverage::new(
        &Lens::equidistant_circle(499.5, 499.5, 500.0, 1.2).expect("a plausible lens"),
        &[],
        1000,
        1000,
    );
    assert_eq!((none.seen_share, none.mean_views), (0.0, 0.0));
}

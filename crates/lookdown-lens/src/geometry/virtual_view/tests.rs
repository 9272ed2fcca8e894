use nalgebra::Unit;
use proptest::prelude::*;

use super::*;

fn mount(up: [f64; 3]) -> Mount {
    Mount::new(Unit::new_normalize(Vector3::from(up)), None)
}

fn direction(elevation: f64, azimuth: f64) -> ViewDirection {
    ViewDirection {
        elevation,
        azimuth,
        field_of_view: 1.2,
    }
}

proptest! {
    #[test]
    fn a_pole_at_the_view_center_stands_upright_under_any_mount(
        up in prop::array::uniform3(-1.0..1.0_f64),
        elevation in 0.05..1.3,
        azimuth in -3.2..3.2,
    ) {
        prop_assume!(Vector3::from(up).norm() > 0.1);
        let mount = mount(up);
        let view = VirtualView::new(&direction(elevation, azimuth), &mount, 301, 301);
        let axis = view.ray_in_camera(&Pixel::new(150.0, 150.0));
        prop_assume!(axis.cross(&mount.world_up()).norm() > 0.01);
        let vertical = view.vertical_at(&Pixel::new(150.0, 150.0), &mount).expect("not along the vertical");
        prop_assert!((vertical - Vector2::new(0.0, -1.0)).norm() < 1e-6, "{vertical}");
    }

    #[test]
    fn a_view_finds_its_own_rays_again(
        elevation in 0.0..1.3,
        azimuth in -3.2..3.2,
        x in 0.0..300.0,
        y in 0.0..200.0,
    ) {
        let view = VirtualView::new(&direction(elevation, azimuth), &Mount::default(), 301, 201);
        let pixel = Pixel::new(x, y);
        let back = view.project(&view.ray_in_camera(&pixel)).expect("in front of the view");
        prop_assert!((back - pixel).norm() < 1e-9);
        prop_assert_eq!(view.project(&-view.ray_in_camera(&pixel)), None);
    }
}

#[test]
fn a_tilted_ceiling_camera_is_centered_on_the_nadir() {
    let mount = mount([0.3, 0.1, -1.0]);
    assert!(mount.is_near_nadir());
    let view = VirtualView::new(&direction(0.0, 0.0), &mount, 301, 301);
    let axis = view.ray_in_camera(&Pixel::new(150.0, 150.0));
    assert!((axis.normalize() - mount.nadir()).norm() < 1e-12);
}

#[test]
fn a_wall_camera_keeps_the_plan_on_its_optical_axis() {
    let mount = mount([0.0, -1.0, 0.0]);
    assert!(!mount.is_near_nadir());
    let view = VirtualView::new(&direction(0.0, 2.0), &mount, 301, 301);
    let axis = view.ray_in_camera(&Pixel::new(150.0, 150.0));
    assert!((axis - Ray::z()).norm() < 1e-12);
    // Image up of the frame is up in the world, so it is up in the view, whatever the azimuth.
    let up = view.camera_from_view * Vector3::new(0.0, -1.0, 0.0);
    assert!((up - mount.world_up()).norm() < 1e-12);
}

#[test]
fn ring_views_are_turns_of_each_other_about_the_axis() {
    let down = Mount::default();
    let first = VirtualView::new(&direction(0.8, 0.3), &down, 301, 201);
    let turned = VirtualView::new(&direction(0.8, 1.5), &down, 301, 201);
    let turn = turned.turned_from(&first).expect("about the axis");
    assert!((turn - 1.2).abs() < 1e-12, "{turn}");
    for other in [
        VirtualView::new(&direction(0.81, 1.5), &down, 301, 201),
        VirtualView::new(&direction(0.8, 1.5), &mount([0.1, 0.0, -1.0]), 301, 201),
        VirtualView::new(&direction(0.8, 1.5), &down, 301, 200),
    ] {
        assert_eq!(other.turned_from(&first), None);
    }
}

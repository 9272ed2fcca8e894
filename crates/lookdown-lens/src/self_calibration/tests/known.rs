//! Values that the user knows, frames of several cameras, and lenses without a circle.

use nalgebra::Rotation3;

use super::{circle, edges, equisolid, rivals};
use crate::self_calibration::{FieldOfView, FitRefusal, IdealLens, KnownCamera, RoomFit};

fn tilted() -> Rotation3<f64> {
    Rotation3::from_euler_angles(0.14, -0.09, 0.4)
}

fn with_field_of_view(degrees: f64, known: KnownCamera) -> KnownCamera {
    KnownCamera {
        field_of_view: Some(FieldOfView::from_degrees(degrees).unwrap()),
        ..known
    }
}

#[test]
fn lens_that_the_edges_contradict_is_refused() {
    let room = Rotation3::from_euler_angles(0.05, -0.09, 0.4);
    let known = KnownCamera {
        lens: Some(IdealLens::Equidistant),
        ..KnownCamera::default()
    };
    match RoomFit::new(&[edges(&room)], &[circle()], known) {
        Err(FitRefusal::Contradicted {
            field_of_view_deg, ..
        }) => assert!(
            (field_of_view_deg - 177.6).abs() < 0.5,
            "{field_of_view_deg}"
        ),
        other => panic!("{other:?}"),
    }
}

#[test]
fn contradiction_is_named_before_a_rival() {
    let (all, circles) = rivals();
    // With a wrong circle, the true lens is contradicted, too.
    let fit = RoomFit::new(&[all], &circles, equisolid());
    assert!(
        matches!(fit, Err(FitRefusal::Contradicted { .. })),
        "{fit:?}"
    );
}

#[test]
fn field_of_view_that_no_lens_has_is_named() {
    let orthographic = KnownCamera {
        lens: Some(IdealLens::Orthographic),
        ..KnownCamera::default()
    };
    for known in [
        with_field_of_view(180.0, orthographic),
        with_field_of_view(270.0, KnownCamera::default()),
    ] {
        let fit = RoomFit::new(&[edges(&tilted())], &[circle()], known);
        assert_eq!(fit, Err(FitRefusal::NoSuchLens));
    }
}

#[test]
fn frame_of_another_camera_is_named() {
    let other = edges(&Rotation3::from_euler_angles(-0.3, 0.2, 1.1));
    let [first, second] = [edges(&tilted()), edges(&tilted())];
    let fit = RoomFit::new(&[first, second, other], &[circle()], equisolid());
    assert!(
        matches!(fit, Err(FitRefusal::FrameDisagrees { frame: 3, .. })),
        "{fit:?}"
    );
}

#[test]
fn lens_without_a_circle_sees_up_to_the_corner() {
    let fit = RoomFit::new(&[edges(&tilted())], &[circle()], equisolid()).unwrap();
    let at_circle = fit.max_theta;
    let [near, far] = [1.05, 3.0].map(|share| fit.clone().without_circle(share * circle().radius));
    assert!(near.max_theta > 1.04 * at_circle && near.max_theta < 1.1 * at_circle);
    assert!(far.max_theta > near.max_theta && far.max_theta <= 1.745);
    assert!(!far.is_circle_detected && fit.is_circle_detected);
}

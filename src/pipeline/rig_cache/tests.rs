use super::*;
use crate::{
    calibration::CameraGeometry,
    geometry::{Lens, Mount, ViewPlan},
    imaging::NetworkInput,
};

fn key(radius: i64) -> RigKey {
    RigKey {
        camera: RigCamera::Assumed {
            cx: 0,
            cy: 0,
            radius,
        },
        frame_size: (64, 64),
        profile: Profile::Fast,
        input_size: (32, 32),
    }
}

fn rig() -> CameraRig {
    let geometry = CameraGeometry {
        lens: Lens::equidistant_circle(31.5, 31.5, 32.0, 1.5).unwrap(),
        mount: Mount::default(),
    };
    let plan = ViewPlan::balanced();
    CameraRig::new(geometry, 64, 64, Some(&plan), &NetworkInput::plain(32, 32))
}

#[test]
fn a_rig_is_built_once_and_shared() {
    let cache = RigCache::new(usize::MAX);
    let first = cache.get_or_build(&key(1), rig);
    let second = cache.get_or_build(&key(1), || unreachable!("it is there already"));
    assert!(Arc::ptr_eq(&first, &second));
}

#[test]
fn the_least_recently_used_rig_leaves_when_the_budget_is_spent() {
    let cache = RigCache::new(2 * rig().bytes());
    cache.get_or_build(&key(1), rig);
    cache.get_or_build(&key(2), rig);
    cache.get_or_build(&key(1), || unreachable!("it is there already"));
    cache.get_or_build(&key(3), rig);
    cache.get_or_build(&key(1), || unreachable!("it was used after the second"));
    let mut rebuilt = false;
    cache.get_or_build(&key(2), || {
        rebuilt = true;
        rig()
    });
    assert!(rebuilt, "the second should have been evicted");
}

#[test]
fn a_rig_larger_than_the_budget_still_serves_its_frame() {
    let cache = RigCache::new(1);
    assert!(cache.get_or_build(&key(1), rig).bytes() > 1);
    let kept = cache.get_or_build(&key(1), || unreachable!("the newest stays"));
    assert_eq!(kept.view_count(), 24);
}

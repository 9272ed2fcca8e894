use lookdown_calibration::{Areas, CameraGeometry};
use lookdown_lens::geometry::{Lens, Mount, ViewPlan};
use strum::VariantArray;

use super::*;
use crate::metrics::IntGauge;
use lookdown_imaging::NetworkInput;

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

fn geometry() -> CameraGeometry {
    CameraGeometry {
        lens: Lens::equidistant_circle(31.5, 31.5, 32.0, 1.5).unwrap(),
        mount: Mount::default(),
        areas: Areas::default(),
    }
}

fn rig() -> CameraRig {
    let plan = ViewPlan::balanced();
    CameraRig::new(
        geometry(),
        64,
        64,
        Some(&plan),
        &NetworkInput::plain(32, 32),
    )
}

fn cache(budget_bytes: usize) -> RigCache {
    RigCache::new(budget_bytes, Arc::default())
}

/// Rigs, bytes, builds and evictions.
fn usage(cache: &RigCache) -> [i64; 4] {
    let metrics = &cache.metrics;
    let [builds, evictions] = [&metrics.rig_cache_builds, &metrics.rig_cache_evictions]
        .map(|counter| i64::try_from(counter.get()).unwrap());
    let [rigs, bytes] = [&metrics.rig_cache_rigs, &metrics.rig_cache_bytes].map(IntGauge::get);
    [rigs, bytes, builds, evictions]
}

#[test]
fn a_rig_is_built_once_and_shared() {
    let cache = cache(usize::MAX);
    let first = cache.get_or_build(&key(1), rig);
    let second = cache.get_or_build(&key(1), || unreachable!("the rig is cached"));
    assert!(Arc::ptr_eq(&first, &second));
}

#[test]
fn the_least_recently_used_rig_is_evicted_beyond_the_budget() {
    let cache = cache(2 * rig().bytes());
    cache.get_or_build(&key(1), rig);
    cache.get_or_build(&key(2), rig);
    cache.get_or_build(&key(1), || unreachable!("the rig is cached"));
    cache.get_or_build(&key(3), rig);
    cache.get_or_build(&key(1), || unreachable!("recently used rigs stay"));
    let mut rebuilt = false;
    cache.get_or_build(&key(2), || {
        rebuilt = true;
        rig()
    });
    assert!(rebuilt, "the second should have been evicted");
}

#[test]
fn the_memory_of_evicted_rigs_is_freed_soon() {
    const BUILDS: i64 = 300;
    let cache = cache(2 * rig().bytes());
    let built = (0..BUILDS).map(|radius| Arc::downgrade(&cache.get_or_build(&key(radius), rig)));
    let built: Vec<_> = built.collect();
    let alive = built.iter().filter(|rig| rig.strong_count() > 0).count();
    // The cache frees an entry a few operations after its eviction.
    assert!((2..30).contains(&alive), "{alive}");
}

#[test]
fn callers_wait_for_one_build() {
    let cache = cache(usize::MAX);
    let slow = || {
        std::thread::sleep(std::time::Duration::from_millis(20));
        rig()
    };
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| cache.get_or_build(&key(1), slow));
        }
    });
    assert_eq!(usage(&cache)[2], 1);
}

#[test]
fn a_rig_larger_than_the_budget_still_serves_its_frame() {
    let cache = cache(1);
    assert!(cache.get_or_build(&key(1), rig).bytes() > 1);
    let kept = cache.get_or_build(&key(1), || unreachable!("the newest rig is not evicted"));
    assert_eq!((kept.view_count(), kept.detail_count()), (8, 8));
}

#[test]
fn usage_reports_contents_builds_and_evictions() {
    let bytes = rig().bytes();
    let cache = cache(2 * bytes);
    assert_eq!(usage(&cache), [0; 4]);
    for radius in [1, 2, 1] {
        cache.get_or_build(&key(radius), rig);
    }
    let full = gauge_value(2 * bytes);
    assert_eq!(usage(&cache), [2, full, 2, 0]);
    cache.get_or_build(&key(3), rig);
    assert_eq!(usage(&cache), [2, full, 3, 1]);
}

#[test]
fn a_thousand_cameras_used_once_each_fit_the_default_budget() {
    let cache = cache(1 << 30);
    for radius in 0..1000 {
        cache.get_or_build(&key(radius), rig);
    }
    let [rigs, _, builds, evictions] = usage(&cache);
    assert_eq!([rigs, builds, evictions], [1000, 1000, 0]);
    // The same holds for views as large as those of the default model.
    let plan = ViewPlan::balanced();
    let input = NetworkInput::plain(416, 416);
    let full_size = CameraRig::new(geometry(), 64, 64, Some(&plan), &input);
    assert!(1000 * full_size.bytes() < 1 << 30, "{}", full_size.bytes());
}

#[test]
fn no_profile_takes_more_than_two_mebibytes_per_camera() {
    for &profile in Profile::VARIANTS {
        let plan = profile.view_plan();
        for (side, up) in [(416, [0.0, 0.0, -1.0]), (300, [0.0, 0.3, -1.0])] {
            let geometry = CameraGeometry {
                mount: Mount::new(nalgebra::Unit::new_normalize(up.into()), None),
                ..geometry()
            };
            let input = NetworkInput::plain(side, side);
            let rig = CameraRig::new(geometry, 1680, 1680, plan.as_ref(), &input);
            assert!(
                rig.bytes() <= 2 << 20,
                "{}: {}",
                profile.name(),
                rig.bytes()
            );
        }
    }
}

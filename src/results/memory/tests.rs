use std::{num::NonZeroUsize, time::Duration};

use bytes::Bytes;
use proptest::prelude::*;

use super::*;
use crate::annotated_image::StoredFrame;

const ROOMY: [usize; 4] = [1000, 1000, 1000, 1 << 20];

fn kept([max_cameras, history_per_camera, max_reports, max_bytes]: [usize; 4]) -> BoundedReports {
    let count = |number| NonZeroUsize::new(number).unwrap();
    BoundedReports::new(ResultLimits {
        max_cameras: count(max_cameras),
        history_per_camera: count(history_per_camera),
        max_reports: count(max_reports),
        max_bytes,
        max_images: count(2),
        max_listeners: NonZeroUsize::MIN,
        max_age: Duration::from_hours(24),
    })
}

fn add_with_image(kept: &mut BoundedReports, camera: &str) -> ReportId {
    let report = NewReport {
        camera: camera.to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        persons: 0,
        scores: None,
        json: Bytes::new(),
    };
    let image = StoredFrame {
        jpeg: Bytes::from_static(b"frame"),
        sketch: Bytes::from_static(b"sketch"),
    };
    kept.add(report, Some(image), Timestamp::UNIX_EPOCH).id
}

fn add(kept: &mut BoundedReports, camera: &str, length: usize) -> ReportId {
    let report = NewReport {
        camera: camera.to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        persons: 0,
        scores: None,
        json: Bytes::from(vec![b' '; length]),
    };
    kept.add(report, None, Timestamp::UNIX_EPOCH).id
}

fn ids(kept: &BoundedReports, cameras: &Cameras, after: ReportId) -> Vec<ReportId> {
    let found = kept.since(cameras, after, usize::MAX);
    found.iter().map(|report| report.id).collect()
}

fn one(camera: &str) -> Cameras {
    Cameras::One(camera.to_owned())
}

#[test]
fn a_camera_keeps_only_its_last_reports() {
    let mut kept = kept([10, 3, 100, 1 << 20]);
    let given: Vec<_> = (0..5).map(|_| add(&mut kept, "lobby", 1)).collect();
    let start = ReportId::default();
    assert_eq!(ids(&kept, &one("lobby"), start), given[2..]);
    assert_eq!(ids(&kept, &one("lobby"), given[3]), given[4..]);
    assert_eq!(kept.latest("lobby").unwrap().id, given[4]);
    assert!(ids(&kept, &one("hall"), start).is_empty());
    assert!(kept.latest("hall").is_none());
}

#[test]
fn reports_of_all_cameras_are_paged_in_arrival_order() {
    let mut kept = kept(ROOMY);
    let cameras = ["a", "b", "a", "c", "b", "a"];
    let given = cameras.map(|camera| add(&mut kept, camera, 1));
    assert_eq!(ids(&kept, &Cameras::All, ReportId::default()), given);
    assert_eq!(ids(&kept, &Cameras::All, given[2]), given[3..]);
    let page = kept.since(&Cameras::All, given[0], 2);
    let page: Vec<_> = page.iter().map(|report| report.id).collect();
    assert_eq!(page, given[1..3]);
    let latest: Vec<_> = kept.latest.values().map(|report| report.id).collect();
    assert_eq!(latest, given[3..]);
}

#[test]
fn the_longest_silent_camera_is_evicted_first() {
    let mut kept = kept([2, 10, 100, 1 << 20]);
    for camera in ["a", "a", "b", "a", "c"] {
        add(&mut kept, camera, 1);
    }
    assert!(kept.latest("b").is_none());
    assert_eq!(kept.usage().cameras, 2);
    assert_eq!(kept.usage().reports, 4);
}

#[test]
fn a_busy_camera_does_not_evict_the_latest_report_of_another() {
    for limits in [[10, 100, 4, 1 << 20], [10, 100, 100, 3000]] {
        let mut kept = kept(limits);
        let silent = add(&mut kept, "silent", 100);
        for _ in 0..50 {
            add(&mut kept, "busy", 100);
        }
        assert_eq!(kept.latest("silent").unwrap().id, silent);
        assert!(kept.usage().reports > 1);
    }
}

#[test]
fn a_report_above_the_byte_limit_evicts_everything() {
    let mut kept = kept([10, 10, 10, 1000]);
    add(&mut kept, "a", 100);
    add(&mut kept, "b", 5000);
    assert_eq!(kept.usage(), ResultUse::default());
}

#[test]
fn a_camera_has_the_image_of_its_latest_report_or_none() {
    let mut kept = kept([2, 1, 100, 1 << 20]);
    add_with_image(&mut kept, "a");
    let id = add_with_image(&mut kept, "a");
    assert_eq!(kept.images.get("a").unwrap().id, id);
    add(&mut kept, "a", 1);
    assert!(!kept.images.contains_key("a"));
    // The image is evicted with its camera.
    add_with_image(&mut kept, "a");
    add(&mut kept, "b", 1);
    add(&mut kept, "c", 1);
    assert!(!kept.images.contains_key("a"));
    assert_eq!(kept.usage().images, 0);
}

#[test]
fn the_oldest_image_is_evicted_first() {
    let mut kept = kept(ROOMY);
    for camera in ["a", "b", "a", "c"] {
        add_with_image(&mut kept, camera);
    }
    let there = ["a", "b", "c"].map(|camera| kept.images.contains_key(camera));
    assert_eq!(there, [true, false, true]);
}

proptest! {
    #[test]
    fn limits_and_counts_hold_for_any_sequence_of_reports(
        limits in [1_usize..6, 1_usize..6, 1_usize..20, 200_usize..4000],
        reports in prop::collection::vec((0_u8..8, 0_usize..600), 1..80),
    ) {
        let mut kept = kept(limits);
        for (camera, length) in reports {
            let id = add(&mut kept, &camera.to_string(), length);
            let [max_cameras, per_camera, max_reports, max_bytes] = limits;
            let usage = kept.usage();
            prop_assert!(usage.cameras <= max_cameras);
            prop_assert!(usage.reports <= max_reports);
            prop_assert!(usage.bytes <= max_bytes);
            prop_assert!(kept.cameras.values().all(|reports| (1..=per_camera).contains(&reports.len())));
            let all = kept.since(&Cameras::All, ReportId::default(), usize::MAX);
            prop_assert_eq!(all.len(), usage.reports);
            prop_assert_eq!(all.iter().map(|report| report.report.bytes()).sum::<usize>(), usage.bytes);
            prop_assert_eq!(kept.latest.len(), usage.cameras);
            if let Some(last) = all.last() {
                prop_assert_eq!(last.id, id);
            }
        }
    }
}

#[test]
fn reports_beyond_their_age_are_removed() {
    let mut kept = kept(ROOMY);
    // The times of these IDs are microseconds apart.
    for camera in ["lobby", "lobby", "hall"] {
        add_with_image(&mut kept, camera);
    }
    let hours = |hours| Timestamp::UNIX_EPOCH + SignedDuration::from_hours(hours);
    kept.expire(hours(23));
    assert_eq!((kept.usage().reports, kept.removed_cameras), (3, 0));
    kept.expire(hours(25));
    assert_eq!((kept.usage().reports, kept.removed_cameras), (0, 2));
    assert!(!kept.images.contains_key("lobby"));
}

#[test]
fn a_deleted_camera_leaves_the_others() {
    let mut kept = kept(ROOMY);
    for camera in ["lobby", "hall", "lobby"] {
        add_with_image(&mut kept, camera);
    }
    assert!(kept.delete("lobby"));
    assert!(!kept.delete("lobby"));
    assert!(kept.cameras.keys().eq(["hall"]));
    assert_eq!((kept.usage().reports, kept.usage().images), (1, 1));
}

#[test]
fn own_camera_stays_among_many_names() {
    let mut kept = kept([2, 3, 1000, 1 << 20]);
    kept.own.set([("hall".to_owned(), false)].into());
    let own = add_with_image(&mut kept, "hall");
    for number in 0..5 {
        add_with_image(&mut kept, &format!("x{number}"));
    }
    assert_eq!(kept.latest("hall").unwrap().id, own);
    assert!(kept.images.contains_key("hall"));
    assert_eq!(kept.usage().cameras, 2);
}

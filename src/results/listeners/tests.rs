use bytes::Bytes;
use jiff::Timestamp;

use super::*;
use crate::results::{NewReport, ReportId};

fn report_of(camera: &str) -> Arc<StoredReport> {
    let report = NewReport {
        camera: camera.to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        persons: 0,
        json: Bytes::from_static(b"{}"),
    };
    Arc::new(StoredReport {
        id: ReportId::default(),
        report,
    })
}

fn room_for(most: usize) -> Arc<Listeners> {
    Arc::new(Listeners::new(NonZeroUsize::new(most).unwrap()))
}

fn lobby() -> Cameras {
    Cameras::One("lobby".to_owned())
}

#[tokio::test]
async fn a_listener_hears_its_camera_and_one_to_all_hears_everybody() {
    let listeners = room_for(2);
    let mut one = listeners.listen(lobby()).unwrap();
    let mut all = listeners.listen(Cameras::All).unwrap();
    for camera in ["hall", "lobby"] {
        listeners.tell(&report_of(camera));
    }
    assert_eq!(one.next().await.unwrap().report.camera, "lobby");
    assert_eq!(all.next().await.unwrap().report.camera, "hall");
    assert_eq!(all.next().await.unwrap().report.camera, "lobby");
}

#[test]
fn there_is_no_more_room_than_there_is_and_who_leaves_makes_some() {
    let listeners = room_for(2);
    let first = listeners.listen(lobby()).unwrap();
    let _second = listeners.listen(Cameras::All).unwrap();
    let refused = listeners.listen(lobby()).unwrap_err();
    assert_eq!(refused, ListenError::Full { most: 2 });
    drop(first);
    assert_eq!(listeners.count(), 1);
    let _third = listeners.listen(lobby()).unwrap();
    assert_eq!(listeners.dropped(), 0);
}

#[tokio::test]
async fn who_does_not_keep_up_hears_what_waits_for_him_and_nothing_more() {
    let listeners = room_for(2);
    let mut slow = listeners.listen(lobby()).unwrap();
    for _ in 0..=QUEUE {
        listeners.tell(&report_of("lobby"));
    }
    assert_eq!((listeners.dropped(), listeners.count()), (1, 1));
    for _ in 0..QUEUE {
        assert!(slow.next().await.is_some());
    }
    assert!(slow.next().await.is_none());
    drop(slow);
    assert_eq!(listeners.count(), 0);
}

#[tokio::test]
async fn at_the_end_everybody_is_told_and_nobody_comes_any_more() {
    let listeners = room_for(2);
    let mut listening = listeners.listen(lobby()).unwrap();
    listeners.end();
    assert!(listening.next().await.is_none());
    assert_eq!(listeners.listen(lobby()).unwrap_err(), ListenError::Ended);
}

#[test]
fn nothing_is_left_of_listeners_that_have_gone() {
    let listeners = room_for(100);
    for number in 0..1000 {
        drop(listeners.listen(Cameras::One(number.to_string())).unwrap());
    }
    assert_eq!(listeners.count(), 0);
    assert!(listeners.group().queues.is_empty());
}

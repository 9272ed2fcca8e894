use bytes::Bytes;
use jiff::Timestamp;

use super::*;
use crate::results::{NewReport, ReportId};

fn report_of(camera: &str) -> Arc<StoredReport> {
    let report = NewReport {
        camera: camera.to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        persons: 0,
        scores: None,
        json: Bytes::from_static(b"{}"),
    };
    Arc::new(StoredReport {
        id: ReportId::default(),
        report,
    })
}

fn room_for(most: usize) -> Arc<Listeners> {
    Arc::new(Listeners::new(
        NonZeroUsize::new(most).unwrap(),
        Arc::default(),
    ))
}

fn count(listeners: &Listeners) -> i64 {
    listeners.metrics.results_listeners.get()
}

fn dropped(listeners: &Listeners) -> u64 {
    listeners.metrics.results_listeners_dropped.get()
}

fn lobby() -> Cameras {
    Cameras::One("lobby".to_owned())
}

#[tokio::test]
async fn listeners_receive_reports_of_their_camera_or_of_all() {
    let listeners = room_for(2);
    let mut one = listeners.listen(&Client::Only, lobby()).unwrap();
    let mut all = listeners.listen(&Client::Only, Cameras::All).unwrap();
    for camera in ["hall", "lobby"] {
        listeners.notify(&report_of(camera));
    }
    assert_eq!(one.next().await.unwrap().report.camera, "lobby");
    assert_eq!(all.next().await.unwrap().report.camera, "hall");
    assert_eq!(all.next().await.unwrap().report.camera, "lobby");
}

#[test]
fn listener_limit_holds_and_a_dropped_listener_frees_a_permit() {
    let listeners = room_for(2);
    let first = listeners.listen(&Client::Only, lobby()).unwrap();
    let _second = listeners.listen(&Client::Only, Cameras::All).unwrap();
    let refused = listeners.listen(&Client::Only, lobby()).unwrap_err();
    assert_eq!(refused, ListenError::Full { most: 2 });
    drop(first);
    assert_eq!(count(&listeners), 1);
    let _third = listeners.listen(&Client::Only, lobby()).unwrap();
    assert_eq!(dropped(&listeners), 0);
}

#[tokio::test]
async fn slow_listener_gets_its_queue_and_nothing_more() {
    let listeners = room_for(2);
    let mut slow = listeners.listen(&Client::Only, lobby()).unwrap();
    for _ in 0..=QUEUE {
        listeners.notify(&report_of("lobby"));
    }
    assert_eq!((dropped(&listeners), count(&listeners)), (1, 1));
    for _ in 0..QUEUE {
        assert!(slow.next().await.is_some());
    }
    assert!(slow.next().await.is_none());
    drop(slow);
    assert_eq!(count(&listeners), 0);
}

#[tokio::test]
async fn end_closes_all_streams_and_refuses_new_listeners() {
    let listeners = room_for(2);
    let mut listening = listeners.listen(&Client::Only, lobby()).unwrap();
    listeners.end();
    assert!(listening.next().await.is_none());
    assert_eq!(
        listeners.listen(&Client::Only, lobby()).unwrap_err(),
        ListenError::Ended
    );
}

#[test]
fn dropped_listeners_leave_nothing_behind() {
    let listeners = room_for(100);
    for number in 0..1000 {
        drop(
            listeners
                .listen(&Client::Only, Cameras::One(number.to_string()))
                .unwrap(),
        );
    }
    assert_eq!(count(&listeners), 0);
    assert!(listeners.group.lock().queues.is_empty());
}

#[test]
fn one_client_leaves_half_of_the_listeners_to_others() {
    let listeners = room_for(4);
    let (greedy, modest) = (Client::with_key("greedy"), Client::with_key("modest"));
    let held = [(); 2].map(|()| listeners.listen(&greedy, Cameras::All).unwrap());
    let refused = listeners.listen(&greedy, lobby()).unwrap_err();
    assert_eq!(
        refused,
        ListenError::ShareUsed {
            client: greedy.clone(),
            share: 2,
            most: 4
        }
    );
    let _other = listeners.listen(&modest, lobby()).unwrap();
    drop(held);
    assert!(listeners.listen(&greedy, lobby()).is_ok());
}

use super::*;
use crate::fairness::{Client, SharedBudget};

const LIMIT: Duration = Duration::from_mins(1);

struct InFlightFixture {
    in_flight: Arc<InFlight>,
    budget: SharedBudget,
    start: Instant,
}

impl InFlightFixture {
    fn new() -> Self {
        Self {
            in_flight: Arc::default(),
            budget: SharedBudget::new(8),
            start: Instant::now(),
        }
    }

    fn at(&self, seconds: u64) -> Instant {
        self.start + Duration::from_secs(seconds)
    }

    fn add(&self, request_id: &str, seconds: u64) -> (InFlightGuard, Ticket) {
        let ticket = Ticket {
            request_id: request_id.to_owned(),
            ..Ticket::default()
        };
        let permits = self.budget.take(&Client::Only, 1).unwrap();
        let guard = self.in_flight.add(&ticket, permits, self.at(seconds));
        (guard, ticket)
    }

    fn is_stalled(&self, seconds: u64) -> bool {
        self.in_flight.stall(self.at(seconds), LIMIT).is_some()
    }
}

#[test]
fn work_without_progress_is_a_stall_until_an_item_ends() {
    let fixture = InFlightFixture::new();
    let (stuck, _) = fixture.add("stuck", 0);
    stuck.begin(fixture.at(1));
    let (waits, _) = fixture.add("waits", 30);
    assert!(!fixture.is_stalled(60));
    assert!(fixture.is_stalled(61));
    // Arrivals are not progress.
    let _late = fixture.add("late", 100);
    assert!(fixture.is_stalled(101));
    waits.end(fixture.at(102));
    assert!(!fixture.is_stalled(102));
    assert!(fixture.is_stalled(162));
}

#[test]
fn a_pool_without_work_is_never_stalled() {
    let fixture = InFlightFixture::new();
    assert!(!fixture.is_stalled(1000));
    let (guard, _) = fixture.add("first", 2000);
    assert!(!fixture.is_stalled(2001));
    guard.end(fixture.at(2002));
    assert!(!fixture.is_stalled(9000));
}

#[test]
fn a_long_frame_that_progresses_is_no_stall() {
    let fixture = InFlightFixture::new();
    let (guard, ticket) = fixture.add("long", 0);
    guard.begin(fixture.at(0));
    let _waits = fixture.add("waits", 1);
    ticket.timeline.enter(Stage::Queue, fixture.at(1));
    for seconds in (0..1000).step_by(59) {
        // A batch of views is done.
        ticket.timeline.progress(fixture.at(seconds));
        assert!(!fixture.is_stalled(seconds + 59));
    }
}

#[test]
fn each_stall_is_reported_once_with_stage_and_requests() {
    let fixture = InFlightFixture::new();
    let (guard, ticket) = fixture.add("a1", 0);
    let _waits = fixture.add("b2", 10);
    guard.begin(fixture.at(0));
    ticket.timeline.enter(Stage::Decode, fixture.at(2));
    let report = |seconds| fixture.in_flight.new_stall(fixture.at(seconds), LIMIT);
    assert_eq!(report(61), None);
    let stall = report(65).unwrap();
    assert_eq!(stall.since, Duration::from_secs(63));
    assert_eq!(stall.to_string(), "a1 (decode, 65 s), b2 (waiting, 55 s)");
    assert_eq!(report(70), None);
    ticket.timeline.enter(Stage::Queue, fixture.at(71));
    assert_eq!(report(72), None);
    let again = report(140).unwrap();
    assert_eq!(again.work[0].stage, "network");
}

use super::*;
use crate::fairness::{Client, SharedBudget};

const LIMIT: Duration = Duration::from_mins(1);

struct Bench {
    in_flight: Arc<InFlight>,
    budget: SharedBudget,
    start: Instant,
}

impl Bench {
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

    fn add(&self, request_id: &str, seconds: u64) -> (Place, Ticket) {
        let ticket = Ticket {
            request_id: request_id.to_owned(),
            ..Ticket::default()
        };
        let permits = self.budget.take(&Client::Only, 1).unwrap();
        let place = self.in_flight.add(&ticket, permits, self.at(seconds));
        (place, ticket)
    }

    fn is_stalled(&self, seconds: u64) -> bool {
        self.in_flight.stall(self.at(seconds), LIMIT).is_some()
    }
}

#[test]
fn work_without_progress_is_a_stall_until_an_item_ends() {
    let bench = Bench::new();
    let (stuck, _) = bench.add("stuck", 0);
    stuck.begin(bench.at(1));
    let (waits, _) = bench.add("waits", 30);
    assert!(!bench.is_stalled(60));
    assert!(bench.is_stalled(61));
    // Arrivals are no progress.
    let _late = bench.add("late", 100);
    assert!(bench.is_stalled(101));
    waits.end(bench.at(102));
    assert!(!bench.is_stalled(102));
    assert!(bench.is_stalled(162));
}

#[test]
fn a_pool_without_work_is_never_stalled() {
    let bench = Bench::new();
    assert!(!bench.is_stalled(1000));
    let (place, _) = bench.add("first", 2000);
    assert!(!bench.is_stalled(2001));
    place.end(bench.at(2002));
    assert!(!bench.is_stalled(9000));
}

#[test]
fn a_long_frame_that_progresses_is_no_stall() {
    let bench = Bench::new();
    let (place, ticket) = bench.add("long", 0);
    place.begin(bench.at(0));
    let _waits = bench.add("waits", 1);
    ticket.timeline.enter(Stage::Queue, bench.at(1));
    for seconds in (0..1000).step_by(59) {
        // A batch of views is done.
        ticket.timeline.progress(bench.at(seconds));
        assert!(!bench.is_stalled(seconds + 59));
    }
}

#[test]
fn each_stall_is_reported_once_with_stage_and_requests() {
    let bench = Bench::new();
    let (place, ticket) = bench.add("a1", 0);
    let _waits = bench.add("b2", 10);
    place.begin(bench.at(0));
    ticket.timeline.enter(Stage::Decode, bench.at(2));
    let report = |seconds| bench.in_flight.new_stall(bench.at(seconds), LIMIT);
    assert_eq!(report(61), None);
    let stall = report(65).unwrap();
    assert_eq!(stall.since, Duration::from_secs(63));
    assert_eq!(stall.to_string(), "a1 (decode, 65 s), b2 (waiting, 55 s)");
    assert_eq!(report(70), None);
    ticket.timeline.enter(Stage::Queue, bench.at(71));
    assert_eq!(report(72), None);
    let again = report(140).unwrap();
    assert_eq!(again.work[0].stage, "network");
    assert_eq!(bench.in_flight.stalls(), 2);
}

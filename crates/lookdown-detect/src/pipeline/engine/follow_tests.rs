use std::time::Duration;

use jiff::Timestamp;

use super::*;
use crate::pipeline::{
    Search,
    test_support::{BlobDetector, calibration, engine, frame_with_disc, job},
};

/// An engine and the reports of frames of one camera.
struct FollowedCamera(Engine);

impl FollowedCamera {
    fn new() -> Self {
        Self(engine(BlobDetector::default(), Some(calibration(""))))
    }

    /// Returns the report of a frame captured at `millis` with a disc of this center and radius.
    fn report(&self, millis: u64, disc: [f64; 2], radius: f64) -> DetectionReport {
        self.report_with(millis, disc, radius, "false")
    }

    fn report_with(
        &self,
        millis: u64,
        disc: [f64; 2],
        radius: f64,
        motion: &str,
    ) -> DetectionReport {
        let at = Timestamp::UNIX_EPOCH + Duration::from_millis(millis);
        let at = at.to_string();
        let parameters = [
            ("calibration", "lobby"),
            ("profile", "fast"),
            ("follow", "true"),
            ("motion", motion),
            ("captured_at", &*at),
        ];
        let image = frame_with_disc(600, disc, radius);
        self.0.detect(&job(image, &parameters)).unwrap().report
    }
}

#[test]
fn a_walker_is_followed_with_one_crop_a_frame() {
    let camera = FollowedCamera::new();
    assert_eq!(camera.report(0, [420.0, 300.0], 20.0).search, Search::Full);
    for (millis, x) in [(200, 412.0), (400, 404.0), (600, 396.0), (800, 388.0)] {
        let report = camera.report(millis, [x, 300.0], 20.0);
        assert_eq!(
            (report.search, report.views.inferred),
            (Search::Followed, 1)
        );
        let [person] = report.persons.as_slice() else {
            panic!("{:?}", report.persons)
        };
        let [found, y] = person.bbox.center();
        assert!(
            (found - x).abs() < 4.0 && (y - 300.0).abs() < 4.0,
            "{found}, {y}"
        );
        assert!(person.floor.is_some() && person.score > 0.5);
    }
}

#[test]
fn the_whole_frame_is_searched_every_second() {
    let camera = FollowedCamera::new();
    let searches = [0, 200, 400, 600, 800, 1000, 1200]
        .map(|millis| camera.report(millis, [420.0, 300.0], 20.0).search);
    assert_eq!(searches[0], Search::Full);
    assert!(
        searches[1..5]
            .iter()
            .all(|search| *search == Search::Unchanged)
    );
    assert_eq!(
        (searches[5], searches[6]),
        (Search::Full, Search::Unchanged)
    );
    let metric = &camera.0.metrics.frame_searches;
    assert_eq!(metric.with_label_values(&["full"]).get(), 2);
    assert_eq!(metric.with_label_values(&["unchanged"]).get(), 5);
}

#[test]
fn a_slow_search_is_not_repeated_after_a_second() {
    let slow = BlobDetector {
        before: Box::new(|| {
            std::thread::sleep(Duration::from_millis(400));
            Ok(())
        }),
        ..BlobDetector::default()
    };
    let camera = FollowedCamera(engine(slow, Some(calibration(""))));
    let searches = [0, 1100, 10_000].map(|at| camera.report(at, [420.0, 300.0], 20.0).search);
    assert_eq!(searches, [Search::Full, Search::Unchanged, Search::Full]);
}

#[test]
fn with_motion_a_still_frame_is_not_searched_for_10_s() {
    let camera = FollowedCamera::new();
    // A search finds its views in the motion cache, whose clock is that of the server.
    let views = [0, 200, 1200, 9800, 10_000, 10_200].map(|millis| {
        let report = camera.report_with(millis, [420.0, 300.0], 20.0, "true");
        (report.views.inferred > 0, report.views.unchanged > 0)
    });
    let (searched, skipped) = ((false, true), (false, false));
    assert_eq!(views[0], (true, false));
    assert_eq!(views[1..], [skipped, skipped, skipped, searched, skipped]);
    let moved = camera.report_with(11_200, [412.0, 300.0], 20.0, "true");
    assert_eq!(moved.search, Search::Full);
}

#[test]
fn with_motion_someone_new_is_searched_until_settled() {
    let camera = FollowedCamera::new();
    camera.report_with(0, [420.0, 300.0], 0.0, "true");
    let repeated = [200, 1200, 2200, 3200, 4200, 5200].map(|millis| {
        let report = camera.report_with(millis, [420.0, 300.0], 20.0, "true");
        (report.search, report.views.inferred > 0)
    });
    let (searched, skipped) = ((Search::Full, true), (Search::Unchanged, false));
    assert_eq!(
        repeated,
        [searched, searched, searched, searched, searched, skipped]
    );
    let score = |report: DetectionReport| report.persons[0].score;
    let settled = score(camera.report_with(6200, [420.0, 300.0], 20.0, "true"));
    assert!(settled > 0.5, "{settled}");
    // Someone whom a search does not find may be there all the same.
    camera.report_with(6400, [420.0, 300.0], 0.0, "true");
    let gone = camera.report_with(7400, [420.0, 300.0], 0.0, "true");
    assert_eq!((gone.search, gone.persons.len()), (Search::Full, 0));
    let gone = camera.report_with(8400, [420.0, 300.0], 0.0, "true");
    assert_eq!((gone.search, gone.persons.len()), (Search::Unchanged, 0));
}

#[test]
fn a_person_without_motion_stays_without_inference() {
    let camera = FollowedCamera::new();
    let first = camera.report(0, [420.0, 300.0], 20.0);
    let second = camera.report(200, [420.0, 300.0], 20.0);
    assert_eq!((second.views.inferred, second.batch_count), (0, 0));
    assert_eq!(second.persons[0].bbox, first.persons[0].bbox);
    assert_eq!(second.persons[0].score, first.persons[0].score);
}

#[test]
fn motion_where_no_person_was_starts_a_search() {
    let camera = FollowedCamera::new();
    assert!(camera.report(0, [420.0, 300.0], 0.0).persons.is_empty());
    let entered = camera.report(200, [420.0, 300.0], 20.0);
    assert_eq!((entered.search, entered.persons.len()), (Search::Full, 1));
    // The crop would not show a person who leaps.
    let leapt = camera.report(400, [150.0, 300.0], 20.0);
    assert_eq!((leapt.search, leapt.persons.len()), (Search::Full, 1));
}

#[test]
fn a_person_whom_no_crop_confirms_starts_a_search() {
    let camera = FollowedCamera::new();
    camera.report(0, [420.0, 300.0], 20.0);
    let gone = camera.report(200, [420.0, 300.0], 0.0);
    assert_eq!((gone.search, gone.persons.len()), (Search::Full, 0));
    let back = camera.report(400, [420.0, 300.0], 20.0);
    assert_eq!((back.search, back.persons.len()), (Search::Full, 1));
}

#[test]
fn wider_crops_follow_a_walker_half_a_second_later() {
    let camera = FollowedCamera::new();
    camera.report(0, [420.0, 300.0], 20.0);
    let next = camera.report(500, [390.0, 300.0], 20.0);
    assert_eq!((next.search, next.persons.len()), (Search::Followed, 1));
    // After another .5 s a search is due.
    let known = camera.report(1000, [360.0, 300.0], 20.0);
    assert_eq!((known.search, known.persons.len()), (Search::Full, 1));
}

#[test]
fn a_walker_whom_a_search_misses_is_still_expected() {
    let camera = FollowedCamera::new();
    for (millis, x) in [
        (0, 420.0),
        (200, 412.0),
        (400, 404.0),
        (600, 396.0),
        (800, 388.0),
    ] {
        camera.report(millis, [x, 300.0], 20.0);
    }
    let missed = camera.report(1000, [380.0, 300.0], 0.0);
    assert_eq!((missed.search, missed.persons.len()), (Search::Full, 0));
    let again = camera.report(1200, [372.0, 300.0], 20.0);
    assert_eq!((again.search, again.persons.len()), (Search::Followed, 1));
}

#[test]
fn a_score_of_one_search_counts_half_until_the_next() {
    let camera = FollowedCamera::new();
    camera.report(0, [420.0, 300.0], 0.0);
    let score = |millis| camera.report(millis, [420.0, 300.0], 20.0).persons[0].score;
    let (searched, once) = (score(200), score(400));
    let (again, twice) = (score(1200), score(1400));
    assert!((searched - again).abs() < 1e-9);
    assert!(
        once < twice && twice < searched,
        "{once} {twice} {searched}"
    );
}

#[test]
fn an_earlier_or_changed_frame_is_searched() {
    let camera = FollowedCamera::new();
    camera.report(500, [420.0, 300.0], 20.0);
    assert_eq!(
        camera.report(100, [420.0, 300.0], 20.0).search,
        Search::Full
    );
    // The light changes everywhere.
    let white = frame_with_disc(600, [300.0, 300.0], 299.0);
    let parameters = [
        ("calibration", "lobby"),
        ("profile", "fast"),
        ("follow", "true"),
        ("captured_at", "1970-01-01T00:00:00.2Z"),
    ];
    let report = camera.0.detect(&job(white, &parameters)).unwrap().report;
    assert_eq!(report.search, Search::Full);
}

#[test]
fn scores_below_the_threshold_stay_between_searches() {
    let engine = engine(BlobDetector::default(), Some(calibration("")));
    let scores = |millis: u64, threshold: &str| {
        let at = (Timestamp::UNIX_EPOCH + Duration::from_millis(millis)).to_string();
        let parameters = [
            ("calibration", "lobby"),
            ("profile", "fast"),
            ("follow", "true"),
            ("score_threshold", threshold),
            ("captured_at", &*at),
        ];
        let image = frame_with_disc(600, [420.0, 300.0], 20.0);
        let report = engine.detect(&job(image, &parameters)).unwrap().report;
        (report.search, report.persons.len(), report.scores.len())
    };
    assert_eq!(scores(0, "0.3"), (Search::Full, 1, 1));
    assert_eq!(scores(200, "0.3"), (Search::Unchanged, 1, 1));
    // No person has this score.
    assert_eq!(scores(2000, "1"), (Search::Full, 0, 1));
    assert_eq!(scores(2200, "1"), (Search::Unchanged, 0, 1));
}

use lookdown_detect::metrics::replace_info;

use super::*;

#[test]
fn every_name_carries_the_prefix_and_every_metric_its_help() {
    let metrics = Metrics::default();
    metrics.views.inc_by(24);
    metrics
        .queue_duration
        .with_label_values(&["m", "fast"])
        .observe(0.2);
    let text = metrics.render().unwrap();
    assert!(
        text.contains(
            "# HELP lookdown_views_total Views that ran through the network, of frames that got a report.\n"
        ),
        "{text}"
    );
    assert!(text.contains("\nlookdown_views_total 24\n"), "{text}");
    let bucket =
        "lookdown_queue_duration_seconds_bucket{model=\"m\",profile=\"fast\",le=\"0.25\"} 1";
    assert!(text.contains(bucket), "{text}");
}

#[test]
fn at_most_a_thousand_zones_are_shown_until_they_are_removed() {
    let metrics = Metrics::default();
    let shown = || {
        let text = metrics.render().unwrap();
        let rows = text.lines().map(str::to_owned);
        let rows = rows.filter(|line| line.starts_with("lookdown_zone_persons"));
        rows.collect::<Vec<_>>()
    };
    assert!(shown().is_empty());
    metrics.set_zones("lobby", [("door", 2), ("till", 0)]);
    metrics.set_zones("lobby", [("door", 1), ("till", 3)]);
    let (door, till) = (
        "lookdown_zone_persons{camera=\"lobby\",zone=\"door\"} 1",
        "lookdown_zone_persons{camera=\"lobby\",zone=\"till\"} 3",
    );
    assert_eq!(shown(), [door, till]);
    metrics.set_zones("lobby", [("till", 3)]);
    assert_eq!(shown(), [till]);
    metrics.retain_cameras(&["hall".to_owned()]);
    assert!(shown().is_empty());
    for camera in 0..100 {
        let names: Vec<_> = (0..20).map(|zone| zone.to_string()).collect();
        metrics.set_zones(
            &camera.to_string(),
            names.iter().map(|name| (name.as_str(), 1)),
        );
    }
    assert_eq!(shown().len(), MAX_ROWS);
}

#[test]
fn a_camera_shows_its_persons_and_the_time_of_its_report() {
    let metrics = Metrics::default();
    metrics.set_camera("lobby", NumberWithBar::untaught(2), 1_763_717_400.5);
    metrics.set_camera("lobby", NumberWithBar::untaught(3), 1_763_717_401.5);
    let text = metrics.render().unwrap();
    for row in [
        "lookdown_camera_persons{camera=\"lobby\"} 3",
        "lookdown_camera_last_report_timestamp_seconds{camera=\"lobby\"} 1763717401.5",
    ] {
        assert!(text.contains(row), "{text}");
    }
    metrics.retain_cameras(&[]);
    assert!(!metrics.render().unwrap().contains("{camera="));
}

#[test]
fn a_row_of_an_info_metric_replaces_the_one_before() {
    let metrics = Metrics::default();
    let mut before = None;
    for revision in ["a", "a", "b"] {
        let row = [revision];
        let before = before.replace(row);
        let before = before.as_ref().map(<[_; 1]>::as_slice);
        replace_info(&metrics.calibrations_info, before, &row);
    }
    let text = metrics.render().unwrap();
    let shown = text
        .lines()
        .filter(|line| line.starts_with("lookdown_calibrations_info"));
    assert_eq!(
        shown.collect::<Vec<_>>(),
        ["lookdown_calibrations_info{revision=\"b\"} 1"]
    );
}

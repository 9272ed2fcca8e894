use super::*;

#[test]
fn every_name_carries_the_prefix_and_every_metric_its_help() {
    let metrics = Metrics::new().unwrap();
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
fn concurrent_scrapes_count_a_dropped_frame_once() {
    const FRAMES: u64 = 20_000;
    let metrics = Metrics::new().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| (1..=FRAMES).for_each(|frames| metrics.show_frames(2, frames)));
        }
    });
    assert_eq!(metrics.withdrawn_frames.get(), FRAMES);
    assert_eq!(metrics.pending_frames.get(), 2);
}

#[test]
fn rig_cache_counters_rise_and_gauges_follow_its_size() {
    let metrics = Metrics::new().unwrap();
    metrics.show_rig_cache(2, 2000, 3, 1);
    metrics.show_rig_cache(1, 1000, 4, 3);
    let text = metrics.render().unwrap();
    for line in [
        "lookdown_rig_cache_rigs 1",
        "lookdown_rig_cache_bytes 1000",
        "lookdown_rig_cache_builds_total 4",
        "lookdown_rig_cache_evictions_total 3",
    ] {
        assert!(text.contains(&format!("\n{line}\n")), "{text}");
    }
}

#[test]
fn a_replaced_model_is_no_longer_shown() {
    let metrics = Metrics::new().unwrap();
    metrics.show_models(&[("a", "1"), ("b", "1")], &[("success", 2)]);
    metrics.show_models(&[("a", "2"), ("b", "1")], &[("success", 3)]);
    let loads = metrics.model_loads.with_label_values(&["success"]);
    assert_eq!(loads.get(), 3);
    let text = metrics.render().unwrap();
    let shown = text
        .lines()
        .filter(|line| line.starts_with("lookdown_model_info"));
    assert_eq!(
        shown.collect::<Vec<_>>(),
        [
            "lookdown_model_info{model=\"a\",revision=\"2\"} 1",
            "lookdown_model_info{model=\"b\",revision=\"1\"} 1",
        ]
    );
}

#[test]
fn at_most_a_thousand_zones_are_shown_until_they_are_removed() {
    let metrics = Metrics::new().unwrap();
    let shown = || {
        let text = metrics.render().unwrap();
        let rows = text.lines().map(str::to_owned);
        let rows = rows.filter(|line| line.starts_with("lookdown_zone_persons"));
        rows.collect::<Vec<_>>()
    };
    assert!(shown().is_empty());
    metrics.show_zones("lobby", [("door", 2), ("till", 0)]);
    metrics.show_zones("lobby", [("door", 1), ("till", 3)]);
    let (door, till) = (
        "lookdown_zone_persons{calibration=\"lobby\",zone=\"door\"} 1",
        "lookdown_zone_persons{calibration=\"lobby\",zone=\"till\"} 3",
    );
    assert_eq!(shown(), [door, till]);
    metrics.retain_zones(|_, zone| zone != "door");
    assert_eq!(shown(), [till]);
    for calibration in 0..100 {
        let names: Vec<_> = (0..20).map(|zone| zone.to_string()).collect();
        metrics.show_zones(
            &calibration.to_string(),
            names.iter().map(|name| (name.as_str(), 1)),
        );
    }
    assert_eq!(shown().len(), zone_persons::MAX_ROWS);
}

#[test]
fn only_the_current_revision_of_the_calibrations_is_shown() {
    let metrics = Metrics::new().unwrap();
    for revision in ["a", "a", "b"] {
        metrics.show_calibrations(2, revision, 0, true, &[("success", 2)]);
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

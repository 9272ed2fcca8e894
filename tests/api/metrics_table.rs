//! The table of metrics in docs/observability.md lists exactly the metrics that the server exports.

use std::collections::BTreeSet;

use crate::service::{Service, frame};

/// Returns a table row for each metric in this text, in the order of the text.
fn rows(metrics: &str) -> Vec<String> {
    let helps = metrics
        .lines()
        .filter_map(|line| line.strip_prefix("# HELP "));
    let rows = helps.map(|line| {
        let (name, help) = line.split_once(' ').unwrap();
        let kind = metrics
            .lines()
            .find_map(|line| line.strip_prefix(&format!("# TYPE {name} ")))
            .unwrap();
        let labels: Vec<_> = labels(metrics, name)
            .iter()
            .map(|label| format!("`{label}`"))
            .collect();
        format!("| `{name}` | {kind} | {} | {help} |", labels.join(", ")).replace("|  |", "| |")
    });
    rows.collect()
}

/// Returns the names of the labels of a metric's samples.
fn labels<'a>(metrics: &'a str, name: &str) -> BTreeSet<&'a str> {
    let samples = metrics.lines().filter_map(|line| line.strip_prefix(name));
    let samples = samples.map(|rest| rest.strip_prefix("_bucket").unwrap_or(rest));
    let labels = samples.filter_map(|rest| rest.strip_prefix('{')?.split_once('}'));
    labels
        .flat_map(|(labels, _)| labels.split(','))
        .filter_map(|label| Some(label.split_once('=')?.0))
        .filter(|label| *label != "le")
        .collect()
}

#[tokio::test]
async fn the_documentation_lists_exactly_the_exported_metrics() {
    let service = Service::start();
    service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await;
    let metrics = service.get("/metrics").await.text();
    let shown = rows(&metrics);
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/observability.md");
    let document = std::fs::read_to_string(document).unwrap();
    let (_, section) = document.split_once("\n## Metrics\n").unwrap();
    let section = section.split("\n## ").next().unwrap();
    let documented = section
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect::<Vec<_>>();
    assert_eq!(
        documented,
        shown,
        "the table should be:\n{}",
        shown.join("\n")
    );
    assert!(shown.len() > 30, "{shown:?}");
}

//! Zones and masks of a calibration over HTTP.

use std::time::{Duration, Instant};

use lookdown::results::ResultStore;
use serde_json::{Value, json};

use crate::service::{Bounds, Service, frame};

/// A calibration `lobby` with these areas for the frames of the service.
fn lobby(zones: &Value, masks: &Value) -> Value {
    json!({
        "id": "lobby", "image": { "width": 200, "height": 200 },
        "lens": { "model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5,
            "max_theta": 1.5 },
        "mount": { "world_up": [0.0, 0.0, -1.0], "height_m": 3.0 },
        "zones": zones, "masks": masks
    })
}

fn zones() -> Value {
    json!([
        { "name": "left", "frame_px": [[0.0, 0.0], [100.0, 0.0], [100.0, 200.0], [0.0, 200.0]] },
        { "name": "right", "frame_px": [[100.0, 0.0], [200.0, 0.0], [200.0, 200.0], [100.0, 200.0]] },
        { "name": "far", "floor_m": [[50.0, 0.0], [60.0, 0.0], [60.0, 9.5]] }
    ])
}

#[tokio::test]
async fn get_returns_what_put_stored() {
    let service = Service::start();
    let masks = json!([{ "frame_px": [[0.0, 0.0], [50.0, 0.0], [0.0, 50.5]] }]);
    let sent = lobby(&zones(), &masks);
    let answer = service.put("/calibrations/lobby", &sent.to_string()).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(service.get("/calibrations/lobby").await.json(), sent);
}

#[tokio::test]
async fn a_self_intersecting_zone_is_refused() {
    let service = Service::start();
    let zones = json!([{ "name": "a", "frame_px": [[0, 0], [9, 9], [9, 0], [0, 9]] }]);
    let sent = lobby(&zones, &json!([]));
    let answer = service.put("/calibrations/lobby", &sent.to_string()).await;
    assert_eq!(answer.status, 422);
    let detail = answer.problem()["detail"].as_str().unwrap().to_owned();
    assert!(
        detail.contains("zones[0].frame_px: the edge from corner 1 to 2 meets"),
        "{detail}"
    );
}

#[tokio::test]
async fn reports_list_zones_only_if_the_calibration_has_them() {
    let service = Service::start();
    let report = async || {
        let answer = service.post_raw("calibration=lobby&profile=fast", frame());
        answer.await.json()
    };
    let without = report().await;
    assert!(without.get("zones").is_none());
    assert!(without["persons"][0].get("zones").is_none());
    let sent = lobby(&zones(), &json!([]));
    service.put("/calibrations/lobby", &sent.to_string()).await;
    let with = report().await;
    let persons = with["persons"].as_array().unwrap();
    assert!(!persons.is_empty());
    let counted: Vec<_> = ["left", "right", "far"]
        .iter()
        .map(|name| {
            let is_in = |person: &&Value| {
                let zones = person["zones"].as_array().unwrap();
                zones.contains(&json!(name))
            };
            json!({ "name": name, "persons": persons.iter().filter(is_in).count() })
        })
        .collect();
    assert_eq!(with["zones"], json!(counted));
    let [left, right] = [0, 1].map(|zone| with["zones"][zone]["persons"].as_u64().unwrap());
    assert_eq!(left + right, persons.len() as u64);
}

#[tokio::test]
async fn zone_metrics_are_optional_and_follow_the_zones() {
    for zone_metrics in [false, true] {
        let service = Service::within(&Bounds {
            zone_metrics,
            ..Bounds::default()
        });
        let shown = async || {
            let metrics = service.get("/metrics").await.text();
            let rows = metrics.lines().map(str::to_owned);
            let rows = rows.filter(|line| line.starts_with("lookdown_zone_persons{"));
            rows.collect::<Vec<_>>()
        };
        let sent = lobby(&zones(), &json!([]));
        service.put("/calibrations/lobby", &sent.to_string()).await;
        let query = "calibration=lobby&profile=fast";
        let report = service.post_raw(query, frame()).await.json();
        let row = |zone: &Value| {
            let name = zone["name"].as_str().unwrap();
            format!(
                "lookdown_zone_persons{{camera=\"lobby\",zone=\"{name}\"}} {}",
                zone["persons"]
            )
        };
        let mut expected: Vec<_> = report["zones"]
            .as_array()
            .unwrap()
            .iter()
            .map(row)
            .collect();
        expected.sort_unstable();
        if !zone_metrics {
            expected.clear();
        }
        assert_eq!(shown().await, expected);
        let sent = lobby(&json!([zones()[0]]), &json!([]));
        service.put("/calibrations/lobby", &sent.to_string()).await;
        service.post_raw(query, frame()).await;
        assert_eq!(shown().await.len(), usize::from(zone_metrics));
        service.results.delete("lobby").await.unwrap();
        assert!(shown().await.is_empty());
    }
}

#[tokio::test]
async fn masked_views_are_counted_and_not_in_the_plan() {
    let service = Service::start();
    let masks = json!([{ "frame_px": [[100, 0], [200, 0], [200, 200], [100, 200]] }]);
    let sent = lobby(&json!([]), &masks);
    service.put("/calibrations/lobby", &sent.to_string()).await;
    let report = service.post_raw("calibration=lobby", frame()).await.json();
    let views = &report["views"];
    let masked = views["masked"].as_u64().unwrap();
    assert!(masked > 0, "{views}");
    let plan = service.get("/calibrations/lobby/views").await.json();
    let [planned, crops] =
        ["images", "crops_at_most"].map(|count| plan["cost"][count].as_u64().unwrap());
    let [inferred, not_needed] =
        ["inferred", "not_needed"].map(|count| views[count].as_u64().unwrap());
    assert!(
        (planned..=planned + crops).contains(&(inferred + not_needed)),
        "{views}, {plan}"
    );
}

#[tokio::test]
async fn a_plan_for_huge_frames_with_many_masks_is_fast() {
    const SIDE: u32 = 65536;
    // Teeth of a comb, all as high as the frame.
    let comb = |left: u32| {
        let teeth = (0..62).map(|tooth| [left + 1000 * tooth, tooth % 2 * 60000]);
        let back = [[left + 61000, SIDE - 1], [left, SIDE - 1]];
        json!({ "frame_px": teeth.chain(back).collect::<Vec<_>>() })
    };
    let masks: Vec<_> = (0..32).map(|mask| comb(20 * mask)).collect();
    let sent = json!({
        "id": "huge", "image": { "width": SIDE, "height": SIDE },
        "lens": { "model": "equidistant", "focal": 20000, "cx": 32768, "cy": 32768,
            "max_theta": 1.5 },
        "masks": masks
    });
    let service = Service::start();
    let began = Instant::now();
    let answer = service
        .post("/calibrations/huge/views", &sent.to_string())
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    // Without optimization; in all rows of the frame it takes a hundred times as long.
    assert!(began.elapsed() < Duration::from_secs(12));
}

/// The calibration `lobby` with these areas and ignored places.
fn lobby_with(areas: &Value, ignore: &Value) -> Value {
    let mut lobby = lobby(&zones(), &json!([]));
    lobby["areas"] = areas.clone();
    lobby["ignore"] = ignore.clone();
    lobby
}

#[tokio::test]
async fn people_outside_areas_are_in_no_result() {
    let service = Service::start();
    let report = async |query: &str| {
        let query = format!("calibration=lobby&{query}");
        service.post_raw(&query, frame()).await
    };
    let whole = json!([{ "frame_px": [[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0]] }]);
    let far = json!([{ "floor_m": [[80.0, 80.0], [90.0, 80.0], [90.0, 90.0]] }]);
    for (areas, ignore, is_left_out) in [
        (json!([]), json!([]), false),
        (whole.clone(), json!([]), false),
        (far, json!([]), true),
        (json!([]), whole, true),
    ] {
        let sent = lobby_with(&areas, &ignore);
        let answer = service.put("/calibrations/lobby", &sent.to_string()).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        let got = service.get("/calibrations/lobby").await.json();
        assert_eq!(got.get("areas").unwrap_or(&json!([])), &areas);
        assert_eq!(got.get("ignore").unwrap_or(&json!([])), &ignore);
        let answer = report("profile=fast").await.json();
        let persons = answer["persons"].as_array().unwrap().len();
        assert_eq!(persons == 0, is_left_out, "{answer}");
        assert_eq!(answer.get("margin").is_some(), areas != json!([]));
        let zones = answer["zones"].as_array().unwrap().iter();
        let in_zones: u64 = zones.map(|zone| zone["persons"].as_u64().unwrap()).sum();
        assert_eq!(in_zones == 0, is_left_out);
        let coco = report("profile=fast&format=coco").await.json();
        let exported = coco["annotations"].as_array().unwrap().len();
        assert_eq!(exported, persons);
        let rows = service.get("/results").await.json();
        assert_eq!(rows[0]["frame_persons"], json!(persons));
    }
}

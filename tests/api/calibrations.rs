//! Reading calibrations over HTTP, and changed files.

use std::fs;

use axum::{body::Body, http::Request};
use lookdown_lens::geometry::{FieldOfViewReading, ViewPlan};
use serde_json::{Value, json};

use crate::service::{Service, form_to, frame};

const PATH: &str = "/calibrations/lobby";

#[tokio::test]
async fn list_resource_and_reports_have_the_same_revision() {
    let service = Service::start();
    let report = service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await
        .json();
    let revision = &report["calibration"]["revision"];
    let list = service.get("/calibrations").await.json();
    let image = json!({ "width": 200, "height": 200 });
    let lobby = json!({
        "id": "lobby", "revision": revision, "file": "lobby.json", "image": image,
        "lens": "equidistant"
    });
    assert_eq!(list, json!([lobby]));
    let answer = service.get(PATH).await;
    assert_eq!(answer.header("etag"), revision.to_string());
    assert_eq!(answer.header("content-type"), "application/json");
    let native = answer.json();
    assert_eq!((&native["id"], &native["image"]), (&json!("lobby"), &image));
    assert_eq!(native["mount"]["height_m"], 3.0);
}

#[tokio::test]
async fn a_known_revision_returns_304_without_a_body() {
    let service = Service::start();
    let tag = service.get(PATH).await.header("etag").to_owned();
    for (asked, status) in [
        (tag.as_str(), 304),
        ("*", 304),
        ("\"other\"", 200),
        ("x", 400),
    ] {
        let request = Request::get(PATH).header("if-none-match", asked);
        let answer = service.send(request.body(Body::empty()).unwrap()).await;
        assert_eq!(answer.status, status, "{asked}");
        if status == 304 {
            assert_eq!((answer.header("etag"), answer.body.len()), (&*tag, 0));
        }
    }
}

#[tokio::test]
async fn an_unknown_calibration_is_404_with_a_remedy() {
    let service = Service::start();
    for path in [
        "/calibrations/hall",
        "/calibrations/hall/views",
        "/calibrations/NO",
    ] {
        let answer = service.get(path).await;
        assert_eq!(answer.status, 404, "{path}");
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/unknown-calibration");
    }
}

#[tokio::test]
async fn frames_for_unusable_files_are_refused_with_a_remedy() {
    let service = Service::start();
    let rig = include_str!("../fixtures/calibrations/kalibr_camchain.yaml");
    fs::write(service.folder.path().join("rig.yaml"), rig).unwrap();
    fs::write(service.folder.path().join("hall.json"), "{}").unwrap();
    service.calibrations.refresh();
    for (calibration, expected) in [
        ("rig", "name one of rig-cam0, rig-cam1"),
        ("hall", "cannot be used"),
    ] {
        let answer = service
            .post_raw(&format!("calibration={calibration}"), frame())
            .await;
        assert_eq!(answer.status, 404);
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/unknown-calibration");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains(expected), "{detail}");
    }
}

#[tokio::test]
async fn an_invalid_new_version_is_reported_and_the_old_one_used() {
    let service = Service::start();
    let before = service.get(PATH).await;
    fs::write(service.folder.path().join("lobby.json"), "{ broken").unwrap();
    fs::write(service.folder.path().join("hall.json"), "{}").unwrap();
    service.calibrations.refresh();
    service.still_works().await;
    assert_eq!(service.get(PATH).await.body, before.body);

    let ready = service.get("/readyz").await;
    assert_eq!(
        (ready.status.as_u16(), &ready.json()["status"]),
        (200, &json!("ready"))
    );
    let reported = &ready.json()["calibrations"];
    assert_eq!(reported["serving"], 1);
    let files: Vec<_> = reported["problems"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| &p["file"])
        .collect();
    assert_eq!(files, ["hall.json", "lobby.json"]);
    let list = service.get("/calibrations").await.json();
    assert_eq!(
        (&list[0]["id"], &list[0]["revision"]),
        (&json!("hall"), &Value::Null)
    );
    assert!(
        list[1]["revision"].is_string() && list[1]["problem"].is_string(),
        "{list}"
    );
    let hall = service.get("/calibrations/hall").await;
    let detail = hall.problem()["detail"].as_str().unwrap().to_owned();
    assert!(
        hall.status == 404 && detail.starts_with("hall.json cannot be used"),
        "{detail}"
    );

    let metrics = service.get("/metrics").await.text();
    for line in [
        "lookdown_calibrations 1",
        "lookdown_calibration_files_broken 2",
        "lookdown_calibration_store_up 1",
        "lookdown_calibration_loads_total{result=\"success\"} 1",
        "lookdown_calibration_loads_total{result=\"failure\"} 2",
    ] {
        assert!(
            metrics.lines().any(|reported| reported == line),
            "{line} is not in\n{metrics}"
        );
    }
}

#[tokio::test]
async fn the_view_plan_has_every_view_of_the_model() {
    let service = Service::start();
    for (query, plan) in [
        ("?profile=fast", ViewPlan::fast()),
        ("", ViewPlan::balanced()),
        (
            "?profile=paper",
            ViewPlan::paper(FieldOfViewReading::Horizontal),
        ),
    ] {
        let views = plan.directions.len();
        let path = format!("{PATH}/views{query}");
        let plan = service.get(&path).await.json();
        let planned = plan["views"].as_array().unwrap();
        assert_eq!(
            (planned.len(), &plan["cost"]["images"]),
            (views, &json!(views)),
            "{query}"
        );
        assert_eq!(plan["cost"]["pixels"], views * 64 * 64);
        assert_eq!(plan["cost"]["batches"], 1);
        let share = plan["coverage"].as_f64().unwrap();
        assert!((0.6..=1.0).contains(&share), "{query}: {share}");
        assert!(plan["overlap"].as_f64().unwrap() > 1.0);
        for view in planned {
            let outline = view["outline"].as_array().unwrap();
            let inside = |value: &Value| (-1.0..=201.0).contains(&value.as_f64().unwrap());
            assert!(!outline.is_empty(), "{view}");
            assert!(
                outline.iter().all(|at| inside(&at[0]) && inside(&at[1])),
                "{view}"
            );
            assert_eq!(view["principal_point"], json!([31.5, 31.5]));
        }
    }
    let report = service
        .post_raw("calibration=lobby&profile=paper", frame())
        .await;
    assert_eq!(report.status, 200);
    let metrics = service.get("/metrics").await.text();
    assert!(
        metrics.contains("\nlookdown_views_total 128\n"),
        "{metrics}"
    );
}

#[tokio::test]
async fn the_direction_of_a_view_matches_its_pose() {
    let service = Service::start();
    let plan = service
        .get("/calibrations/lobby/views?profile=paper")
        .await
        .json();
    // The rings of the paper: 32 views each, 0, 0.3, 0.6 and 0.9 rad off the axis, 53.13° wide.
    for (index, view) in plan["views"].as_array().unwrap().iter().enumerate() {
        let number = |name: &str| view[name].as_f64().unwrap();
        let ring = [0.0_f64, 0.3, 0.6, 0.9][index / 32];
        assert!(
            (number("off_axis_deg") - ring.to_degrees()).abs() < 1e-6,
            "{view}"
        );
        assert!(
            (number("field_of_view_deg") - 53.130_102).abs() < 1e-5,
            "{view}"
        );
        // Its axis is the last column of its pose; the lens maps it near the middle of the outline.
        let axis = [0, 1, 2].map(|row| view["camera_from_view"][row][2].as_f64().unwrap());
        let off_axis = axis[0].hypot(axis[1]).atan2(axis[2]);
        assert!((off_axis - ring).abs() < 1e-9, "{view}");
        let outline = view["outline"].as_array().unwrap();
        let middle = [0, 1].map(|side| {
            let values = outline.iter().map(|at| at[side].as_f64().unwrap());
            let (least, most) = values.fold((f64::MAX, f64::MIN), |(least, most), value| {
                (least.min(value), most.max(value))
            });
            f64::midpoint(least, most)
        });
        let azimuth = axis[1].atan2(axis[0]);
        let expected = [azimuth.cos(), azimuth.sin()].map(|part| 100.0 + 63.66 * ring * part);
        let distance = (middle[0] - expected[0]).hypot(middle[1] - expected[1]);
        assert!(distance < 6.0, "{middle:?} is not near {expected:?}");
    }
}

#[tokio::test]
async fn direct_plans_have_no_views_and_invalid_queries_are_refused() {
    let service = Service::start();
    let plan = service
        .get("/calibrations/lobby/views?profile=direct")
        .await
        .json();
    assert_eq!(
        (&plan["views"], &plan["cost"]["images"]),
        (&json!([]), &json!(1))
    );
    for (query, status, kind) in [
        ("profile=best", 422, "invalid-parameter"),
        ("profil=fast", 400, "unknown-parameter"),
        ("profile=fast&profile=fast", 400, "repeated-parameter"),
    ] {
        let answer = service.get(&format!("{PATH}/views?{query}")).await;
        assert_eq!(answer.status, status, "{query}");
        let urn = format!("/problems/{kind}");
        assert_eq!(answer.problem()["type"], urn, "{query}");
    }
}

#[tokio::test]
async fn a_view_plan_is_previewed_without_storing() {
    let service = Service::start();
    let saved = service.get(PATH).await.text();
    let trial = saved.replace("\"lobby\"", "\"trial\"");
    let tried = service
        .post("/calibrations/trial/views?profile=fast", &trial)
        .await;
    assert_eq!(tried.status, 200, "{}", tried.text());
    let (tried, known) = (
        tried.json(),
        service
            .get("/calibrations/lobby/views?profile=fast")
            .await
            .json(),
    );
    assert_eq!(tried["calibration"], "trial");
    assert_eq!(tried["views"], known["views"]);
    assert!(tried["views"][0].get("grid").is_none());
    assert_eq!(service.get("/calibrations/trial").await.status, 404);
    for (path, body, kind) in [
        ("/calibrations/trial/views", "{}", "invalid-calibration"),
        ("/calibrations/other/views", &*trial, "invalid-calibration"),
        ("/calibrations/NO/views", &*trial, "invalid-calibration"),
        (
            "/calibrations/trial/views?profile=best",
            &*trial,
            "invalid-parameter",
        ),
        (
            "/calibrations/trial/views?sigma=1",
            &*trial,
            "unknown-parameter",
        ),
    ] {
        let urn = format!("/problems/{kind}");
        assert_eq!(
            service.post(path, body).await.problem()["type"],
            urn,
            "{path}"
        );
    }
}

#[tokio::test]
async fn a_grid_maps_a_view_to_the_frame() {
    let service = Service::start();
    let path = format!("{PATH}/views?profile=fast&grid=16");
    let plan = service.get(&path).await.json();
    let image = [0, 1].map(|side| plan["image"][side].as_f64().unwrap());
    for view in plan["views"].as_array().unwrap() {
        let grid = view["grid"].as_array().unwrap();
        assert_eq!(grid.len(), 17 * 17);
        // Nodes that the lens does not see have no position.
        let (seen, unseen): (Vec<_>, Vec<_>) = grid.iter().partition(|node| node.is_array());
        assert!(seen.len() > 100 && !unseen.is_empty(), "{}", seen.len());
        for node in seen {
            let at = [0, 1].map(|side| node[side].as_f64().unwrap());
            assert!((0..2).all(|side| (-1.0..=image[side] + 1.0).contains(&at[side])));
        }
        // The middle node is on the axis: 63.66 pixels per radian around (100, 100).
        let middle = &grid[8 * 17 + 8];
        let [azimuth, off_axis] =
            ["azimuth_deg", "off_axis_deg"].map(|name| view[name].as_f64().unwrap().to_radians());
        let expected = [azimuth.cos(), azimuth.sin()].map(|part| 100.0 + 63.66 * off_axis * part);
        for side in 0..2 {
            let difference = middle[side].as_f64().unwrap() - expected[side];
            assert!(difference.abs() < 0.1, "{middle} {expected:?}");
        }
    }
    for grid in ["0", "33", "many", "-1"] {
        let answer = service.get(&format!("{PATH}/views?grid={grid}")).await;
        assert_eq!(answer.status, 422, "{grid}");
    }
}

#[tokio::test]
async fn a_frame_without_edges_is_no_fit_and_says_why() {
    let service = Service::start();
    let request = Request::post("/calibrations/hall/fit").body(Body::from(frame()));
    let answer = service.send(request.unwrap()).await;
    assert_eq!(answer.status, 422);
    let detail = answer.json()["detail"].to_string();
    assert!(detail.contains("edges, too few for a fit"), "{detail}");
    let request = Request::post("/calibrations/hall/fit").body(Body::from("no image"));
    assert_eq!(service.send(request.unwrap()).await.status, 422);
}

#[tokio::test]
async fn camera_that_looks_straight_down_is_fitted_with_its_lens() {
    let service = Service::start();
    let office = include_bytes!("../../samples/office.jpg");
    let fit = async |query: &str| {
        let request = Request::post(format!("/calibrations/hall/fit{query}"));
        service
            .send(request.body(Body::from(&office[..])).unwrap())
            .await
    };
    let answer = fit("").await;
    assert_eq!(answer.status, 422);
    let problem = answer.json();
    let detail = problem["detail"].to_string();
    assert!(detail.contains("give the model of the lens"), "{detail}");
    assert_eq!(problem["refusal"], "uncertain");
    for (query, is_given) in [
        ("?lens=equidistant", false),
        ("?lens=equidistant&field_of_view_deg=180&ceiling=true", true),
    ] {
        let found = fit(query).await.json();
        let lens = &found["calibration"]["lens"];
        assert_eq!(lens["model"], "equidistant", "{found}");
        let focal = lens["fx"].as_f64().or(lens["focal"].as_f64()).unwrap();
        assert!((focal / 305.577 - 1.0).abs() < 0.01, "{found}");
        let source = &found["calibration"]["sources"]["lens"]["source"];
        assert_eq!(source == "given", is_given, "{found}");
    }
    let form = form_to(
        "/calibrations/hall/fit",
        &[("img", office), ("lens", b"equidistant")],
    );
    assert_eq!(service.send(form).await.status, 200);
}

#[tokio::test]
async fn several_frames_of_a_camera_are_fitted_together() {
    let service = Service::start();
    let office = &include_bytes!("../../samples/office.jpg")[..];
    let lens: (&str, &[u8]) = ("lens", b"equidistant");
    let fit = async |frames: &[&[u8]]| {
        let frames = frames.iter().map(|frame| ("img", *frame));
        let parts: Vec<_> = frames.chain([lens]).collect();
        service
            .send(form_to("/calibrations/hall/fit", &parts))
            .await
    };
    let [one, two] = [fit(&[office]).await, fit(&[office; 2]).await].map(|answer| answer.json());
    assert_eq!(
        two["edges"].as_u64().unwrap(),
        2 * one["edges"].as_u64().unwrap()
    );
    for (frames, fault) in [
        (vec![office, &frame()[..]], "differ in size"),
        (vec![office; 6], "more than 5 frames"),
    ] {
        let answer = fit(&frames).await;
        assert_eq!(answer.status, 422);
        let detail = answer.json()["detail"].to_string();
        assert!(detail.contains(fault), "{detail}");
    }
}

#[tokio::test]
async fn wrong_values_of_a_fit_are_named() {
    let service = Service::start();
    for (query, parameter, status) in [
        ("profile=fast", "profile", 400),
        ("lens=pinhole", "lens", 422),
        ("field_of_view_deg=30", "field_of_view_deg", 422),
        ("ceiling=maybe", "ceiling", 422),
        ("lens=equidistant&lens=equisolid", "lens", 400),
        ("img=frame.jpg", "img", 400),
    ] {
        let request = Request::post(format!("/calibrations/hall/fit?{query}"));
        let answer = service
            .send(request.body(Body::from(frame())).unwrap())
            .await;
        assert_eq!(answer.status, status, "{query}");
        assert_eq!(answer.json()["parameter"], parameter);
    }
}

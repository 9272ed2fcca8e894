use lookdown_lens::geometry::{LineEnds, Pixel, ZoneArea};

use crate::{CalibrationFile, export::Target, native::NativeCalibration};

/// A camera of 800 × 600 pixels with these further fields.
fn file(height: &str, areas: &str) -> String {
    format!(
        r#"{{ "id": "hall", "image": {{"width": 800, "height": 600}},
             "lens": {{"model": "equidistant", "focal": 250, "cx": 399.5, "cy": 299.5, "max_theta": 1.5}},
             "mount": {{"world_up": [0, 0, -1]{height}}}, {areas} }}"#
    )
}

fn read(content: &str) -> Result<crate::Calibration, String> {
    let file = CalibrationFile::parse(content.as_bytes()).map_err(|error| error.to_string())?;
    let (_, checked) = file.calibrations("hall", content.as_bytes()).swap_remove(0);
    checked.map_err(|error| error.to_string())
}

fn refusal(areas: &str) -> String {
    read(&file(r#", "height_m": 3"#, areas)).unwrap_err()
}

const AREAS: &str = r#"
    "zones": [{"name": "till-1", "frame_px": [[100, 100], [300, 100], [300, 200]]},
              {"name": "door", "floor_m": [[-1, -1], [1.5, -1], [1.5, 2]]}],
    "masks": [{"frame_px": [[700, 500], [900, 500], [900, 700], [700, 700]]}]"#;

#[test]
fn zones_and_masks_grow_with_the_frame_and_the_floor_does_not() {
    let calibration = read(&file(r#", "height_m": 3"#, AREAS)).unwrap();
    let areas = calibration.for_frame(1600, 1200).unwrap().areas;
    let names: Vec<_> = areas.zones.iter().map(|zone| zone.name.as_str()).collect();
    assert_eq!(names, ["till-1", "door"]);
    assert!(areas.zones[0].area.holds(Pixel::new(550.0, 220.0), None));
    assert!(!areas.zones[0].area.holds(Pixel::new(275.0, 110.0), None));
    let ZoneArea::Floor(floor) = &areas.zones[1].area else {
        panic!("the second zone is one of the floor");
    };
    assert_eq!(floor.corners()[2], Pixel::new(1.5, 2.0));
    assert_eq!(areas.masks[0].corners()[0], Pixel::new(1400.0, 1000.0));
    let smaller = calibration.for_frame(400, 300).unwrap().areas;
    assert_eq!(smaller.masks[0].corners()[0], Pixel::new(350.0, 250.0));
}

#[test]
fn yaml_and_toml_have_them_too_and_a_written_file_keeps_them() {
    let json = file(r#", "height_m": 3"#, AREAS);
    let native: NativeCalibration = serde_json::from_str(&json).unwrap();
    let areas = read(&json).unwrap().areas().clone();
    let written = Target::Native.write(&native).unwrap();
    assert!(written.lost.is_empty());
    let yaml = "id: hall\nimage: {width: 800, height: 600}\nlens: {model: equidistant, focal: 250, \
        cx: 399.5, cy: 299.5, max_theta: 1.5}\nmount: {world_up: [0, 0, -1], height_m: 3}\nzones:\n\
        - name: till-1\n  frame_px: [[100, 100], [300, 100], [300, 200]]\n\
        - {name: door, floor_m: [[-1, -1], [1.5, -1], [1.5, 2]]}\n\
        masks:\n- frame_px: [[700, 500], [900, 500], [900, 700], [700, 700]]\n";
    let toml = "id = \"hall\"\nimage = {width = 800, height = 600}\n[lens]\nmodel = \
        \"equidistant\"\nfocal = 250\ncx = 399.5\ncy = 299.5\nmax_theta = 1.5\n[mount]\n\
        world_up = [0, 0, -1]\nheight_m = 3\n[[zones]]\nname = \"till-1\"\n\
        frame_px = [[100, 100], [300, 100], [300, 200]]\n[[zones]]\nname = \"door\"\n\
        floor_m = [[-1, -1], [1.5, -1], [1.5, 2]]\n[[masks]]\n\
        frame_px = [[700, 500], [900, 500], [900, 700], [700, 700]]\n";
    for content in [&written.content, yaml, toml] {
        assert_eq!(*read(content).unwrap().areas(), areas, "{content}");
    }
    let lost = Target::OpenCv.write(&native).unwrap().lost;
    assert!(
        lost.contains(&"opencv has no masks: those of the calibration (1) are left out".to_owned())
            && lost
                .iter()
                .any(|warning| warning.starts_with("opencv has no zones")),
        "{lost:?}"
    );
}

#[test]
fn what_is_no_area_is_refused_with_its_field_and_the_remedy() {
    let triangle = "[[1, 1], [9, 1], [9, 9]]";
    let zone = |fields: &str| refusal(&format!(r#""zones": [{{{fields}}}]"#));
    for (refusal, expected) in [
        (
            zone(r#""name": "Door", "frame_px": [[1, 1], [9, 1], [9, 9]]"#),
            "zones[0].name: it is \"Door\": use 1 to 64 of a-z",
        ),
        (
            zone(r#""name": "a", "frame_px": [[1, 1], [9, 1]]"#),
            "zones[0].frame_px: it has 2 corners: give 3 to 64",
        ),
        (
            zone(r#""name": "a", "frame_px": [[1, 1], [9, 9], [9, 1], [1, 9]]"#),
            "zones[0].frame_px: the edge from corner 1 to 2 meets the one from corner 3 to 4",
        ),
        (
            zone(r#""name": "a", "frame_px": [[801, 1], [900, 1], [900, 9]]"#),
            "zones[0].frame_px: it lies wholly outside the frame of 800×600 pixels",
        ),
        (
            zone(r#""name": "a", "floor_m": [[1, 1], [1e9, 1], [9, 9]]"#),
            "zones[0].floor_m: corner 2 is [1000000000, 1]",
        ),
        (zone(r#""name": "a""#), "zones[0]: it has no corners"),
        (
            zone(&format!(
                r#""name": "a", "frame_px": {triangle}, "floor_m": {triangle}"#
            )),
            "zones[0]: it has both frame_px and floor_m",
        ),
        (
            refusal(&format!(
                r#""zones": [{{"name": "a", "frame_px": {triangle}}},
                             {{"name": "a", "floor_m": {triangle}}}]"#
            )),
            "zones[1].name: another zone is called \"a\", too: rename one",
        ),
        (
            refusal(&format!(
                r#""masks": [{}]"#,
                vec![format!(r#"{{"frame_px": {triangle}}}"#); 33].join(",")
            )),
            "masks: there are 33: a calibration may have 32",
        ),
        (
            refusal(r#""masks": [{"frame_px": [[-9, -9], [-1, -9], [-1, -1]]}]"#),
            "masks[0].frame_px: it lies wholly outside",
        ),
    ] {
        assert!(refusal.starts_with(expected), "{refusal}");
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let yaml = |corner: &str| {
        format!(
            "id: hall\nimage: {{width: 800, height: 600}}\nlens: {{model: equidistant, focal: 250, \
             cx: 399.5, cy: 299.5}}\nmasks:\n- frame_px: [[1, 1], {corner}, [9, 9]]\n"
        )
    };
    assert!(read(&yaml("[9, 1]")).is_ok());
    for corner in ["[.nan, 1]", "[9, .inf]", "[9]", "[9, 1, 2]", "[a, b]"] {
        assert!(read(&yaml(corner)).is_err(), "{corner}");
    }
}

#[test]
fn the_floor_is_known_only_with_the_height() {
    let zone = r#""zones": [{"name": "a", "floor_m": [[1, 1], [9, 1], [9, 9]]}]"#;
    let refusal = read(&file("", zone)).unwrap_err();
    assert!(
        refusal
            .starts_with("zones[0].floor_m: where the floor is follows from the camera's height"),
        "{refusal}"
    );
}

#[test]
fn areas_and_ignored_places_are_read_scaled_and_written() {
    let places = r#""areas": [{"floor_m": [[-3, -3], [3, -3], [3, 3], [-3, 3]]}],
        "ignore": [{"name": "chair", "frame_px": [[100, 100], [200, 100], [200, 200]]}]"#;
    let content = file(r#", "height_m": 3"#, places);
    let calibration = read(&content).unwrap();
    let filter = calibration.for_frame(1600, 1200).unwrap().areas.foot_filter;
    assert!(matches!(&filter.areas[..], [ZoneArea::Floor(_)]));
    assert!(filter.ignore[0].holds(Pixel::new(350.0, 250.0), None));
    assert!((filter.margin_px - 80.0).abs() < 1e-9);
    let native: NativeCalibration = serde_json::from_str(&content).unwrap();
    let written = Target::Native.write(&native).unwrap().content;
    assert_eq!(
        serde_json::from_str::<NativeCalibration>(&written).unwrap(),
        native
    );
    let lost = Target::Kalibr.write(&native).map(|exported| exported.lost);
    let lost = lost.unwrap_or_else(|error| vec![error.to_string()]);
    assert!(!lost.is_empty());
}

#[test]
fn invalid_areas_and_ignored_places_are_refused() {
    let triangle = "[[1, 1], [9, 1], [9, 9]]";
    for (refusal, expected) in [
        (refusal(r#""areas": [{}]"#), "areas[0]: it has no corners"),
        (
            refusal(r#""ignore": [{"floor_m": [[1, 1], [2, 1]]}]"#),
            "ignore[0].floor_m: it has 2 corners",
        ),
        (
            refusal(&format!(
                r#""ignore": [{{"name": "A b", "frame_px": {triangle}}}]"#
            )),
            "ignore[0].name: it is \"A b\"",
        ),
        (
            refusal(&format!(
                r#""areas": [{}]"#,
                vec![format!(r#"{{"frame_px": {triangle}}}"#); 33].join(",")
            )),
            "areas: there are 33",
        ),
        (
            read(&file(
                "",
                &format!(r#""areas": [{{"floor_m": {triangle}}}]"#),
            ))
            .unwrap_err(),
            "areas[0].floor_m: where the floor is follows from the camera's height",
        ),
    ] {
        assert!(refusal.starts_with(expected), "{refusal}");
    }
}

#[test]
fn fractions_of_the_frame_are_refused_as_such() {
    let corners = "[[0.05, 0.05], [0.95, 0.05], [0.95, 0.95], [0.05, 0.95]]";
    for (list, name) in [
        ("zones", r#""name": "a", "#),
        ("masks", ""),
        ("areas", ""),
        ("ignore", ""),
    ] {
        let refused = refusal(&format!(r#""{list}": [{{{name}"frame_px": {corners}}}]"#));
        let expected = format!("{list}[0].frame_px: its corners are 0.05 to 0.95, which look like");
        assert!(refused.contains(&expected), "{refused}");
    }
    let refused = refusal(r#""masks": [{"frame_px": [[10, 10], [13, 10], [13, 12]]}]"#);
    assert!(refused.contains("it is 3 × 2 pixels small"), "{refused}");
}

#[test]
fn an_area_on_the_floor_has_an_extent() {
    let content = file(
        r#", "height_m": 3"#,
        r#""areas": [{"floor_m": [[0, 0], [1e-308, 0], [1e-308, 1e-308]]}]"#,
    );
    let refused = read(&content).unwrap_err();
    assert!(refused.contains("areas[0].floor_m: it is"), "{refused}");
}

#[test]
fn a_mask_that_hides_little_has_a_warning() {
    let masks = r#""masks": [{"frame_px": [[0, 0], [5, 0], [5, 5], [0, 5]]},
                             {"frame_px": [[-100, 0], [100, 0], [100, 100], [-100, 100]]}]"#;
    let calibration = read(&file("", masks)).unwrap();
    let (width, height) = calibration.image_size();
    let pixels = f64::from(width) * f64::from(height);
    let percent = [25.0, 10_000.0].map(|covered| 100.0 * covered / pixels);
    let shares = calibration.areas().shares(width, height);
    for (share, percent) in shares.iter().zip(percent) {
        assert!((share.percent - percent).abs() < 1e-9, "{share:?}");
    }
    let warnings = calibration.warnings();
    let small = warnings
        .iter()
        .filter(|warning| warning.code.name() == "mask-small");
    assert_eq!(small.count(), 1, "{warnings:?}");
}

const LINES: &str = r#""lines": [
    {"name": "door", "floor_m": [[-1, 2], [1, 2]], "directions": ["enter", "leave"]},
    {"name": "till", "frame_px": [[100, 100], [300, 100]]}]"#;

#[test]
fn lines_are_read_scaled_and_written() {
    let json = file(r#", "height_m": 3"#, LINES);
    let calibration = read(&json).unwrap();
    let lines = calibration.for_frame(1600, 1200).unwrap().areas.lines;
    assert_eq!(lines[0].directions, ["enter", "leave"]);
    assert_eq!(lines[0].ends, calibration.areas().lines[0].ends);
    assert_eq!(lines[1].directions, ["in", "out"]);
    let LineEnds::Frame([from, to]) = lines[1].ends else {
        panic!("the second line is one of the frame");
    };
    assert_eq!((from.x, from.y, to.x, to.y), (200.0, 200.0, 600.0, 200.0));
    let native: NativeCalibration = serde_json::from_str(&json).unwrap();
    let written = Target::Native.write(&native).unwrap();
    assert_eq!(read(&written.content).unwrap().areas(), calibration.areas());
    let lost = Target::Kalibr.write(&native).unwrap().lost;
    assert!(
        lost.iter().any(|lost| lost.contains("has no lines")),
        "{lost:?}"
    );
}

#[test]
fn invalid_lines_are_refused_with_field_and_remedy() {
    let line = |fields: &str| refusal(&format!(r#""lines": [{{{fields}}}]"#));
    for (refusal, expected) in [
        (
            line(r#""name": "a b", "floor_m": [[0, 0], [1, 0]]"#),
            "lines[0].name: it is \"a b\": use 1 to 64 of a-z",
        ),
        (
            line(r#""name": "a""#),
            "lines[0]: it has no ends: give two points",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [1, 0]], "frame_px": [[0, 0], [9, 9]]"#),
            "lines[0]: it has both frame_px and floor_m",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [1, 0], [2, 0]]"#),
            "lines[0].floor_m: it has 3 points: give the two ends",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [0.05, 0]]"#),
            "lines[0].floor_m: it is 0.05 meters long: give ends at least 0.1 meters apart",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [1e9, 0]]"#),
            "lines[0].floor_m: an end is [1000000000, 0]: give numbers from -1000 to 1000 meters",
        ),
        (
            line(r#""name": "a", "frame_px": [[900, 0], [900, 100]]"#),
            "lines[0].frame_px: both ends are outside the frame of 800×600 pixels",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [1, 0]], "directions": ["in", "in"]"#),
            "lines[0].directions: both are \"in\"",
        ),
        (
            line(r#""name": "a", "floor_m": [[0, 0], [1, 0]], "directions": ["in", "Out"]"#),
            "lines[0].directions[1]: it is \"Out\"",
        ),
        (
            refusal(
                r#""lines": [{"name": "a", "floor_m": [[0, 0], [1, 0]]},
                             {"name": "a", "floor_m": [[0, 0], [1, 0]]}]"#,
            ),
            "lines[1].name: another line has the name \"a\": rename one",
        ),
    ] {
        assert!(refusal.starts_with(expected), "{refusal}");
    }
    let floor = r#""lines": [{"name": "a", "floor_m": [[0, 0], [1, 0]]}]"#;
    let refusal = read(&file("", floor)).unwrap_err();
    assert!(
        refusal.starts_with("lines[0].floor_m: the floor needs the camera's height"),
        "{refusal}"
    );
}

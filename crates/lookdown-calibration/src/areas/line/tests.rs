use super::super::tests::{file, read, refusal};
use crate::export::Target;
use crate::native::NativeCalibration;
use lookdown_lens::geometry::LineEnds;

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

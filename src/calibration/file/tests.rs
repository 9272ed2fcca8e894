use super::*;

const LOBBY: &str = r#"{ "id": "lobby", "image": {"width": 1680, "height": 1680},
  "lens": {"model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5708},
  "mount": {"world_up": [0, 0, -1], "height_m": 2.8} }"#;

fn read_text(name: &str, text: &str) -> Result<Calibration, CalibrationError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    read(&path)
}

fn refusal(text: &str) -> String {
    let error = read_text("lobby.json", text).unwrap_err().to_string();
    error
        .split_once("lobby.json: ")
        .expect("names the file")
        .1
        .to_owned()
}

#[test]
fn json_yaml_and_toml_of_one_shape_make_the_same_camera() {
    let json = read_text("lobby.json", LOBBY).unwrap();
    let yaml = read_text(
        "lobby.yaml",
        "id: lobby\nimage: {width: 1680, height: 1680}\nlens: {model: equidistant, focal: 534.76, \
         cx: 839.5, cy: 839.5, max_theta: 1.5708}\nmount: {world_up: [0, 0, -1], height_m: 2.8}\n",
    )
    .unwrap();
    let toml = read_text(
        "lobby.toml",
        "id = \"lobby\"\nimage = {width = 1680, height = 1680}\n[lens]\nmodel = \"equidistant\"\n\
         focal = 534.76\ncx = 839.5\ncy = 839.5\nmax_theta = 1.5708\n[mount]\n\
         world_up = [0, 0, -1]\nheight_m = 2.8\n",
    )
    .unwrap();
    let camera = |calibration: &Calibration| calibration.for_frame(1680, 1680).unwrap();
    assert_eq!(camera(&json), camera(&yaml));
    assert_eq!(camera(&json), camera(&toml));
    assert_eq!(json.id().as_str(), "lobby");
}

#[test]
fn every_lens_model_of_the_contract_is_read() {
    let lens = |lens: &str| {
        LOBBY.replace(
            r#"{"model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5708}"#,
            lens,
        )
    };
    for (text, model) in [
        (
            r#"{"model":"equisolid","fx":600,"fy":601,"cx":840,"cy":840}"#,
            "equisolid",
        ),
        (
            r#"{"model":"stereographic","focal":400,"cx":840,"cy":840}"#,
            "stereographic",
        ),
        (
            r#"{"model":"orthographic","focal":800,"cx":840,"cy":840}"#,
            "orthographic",
        ),
        (
            r#"{"model":"rectilinear","focal":800,"cx":840,"cy":840}"#,
            "rectilinear",
        ),
        (
            r#"{"model":"kannala_brandt","fx":500,"fy":500,"cx":840,"cy":840,"k":[0.01,0,0,0],"skew":0.1}"#,
            "kannala_brandt",
        ),
        (
            r#"{"model":"radial_polynomial","coefficients":[0,938.16,44.013,-46.56],"cx":840,"cy":840,"aspect":1.01}"#,
            "radial_polynomial",
        ),
    ] {
        let camera = read_text("lobby.json", &lens(text))
            .unwrap()
            .for_frame(1680, 1680)
            .unwrap();
        assert_eq!(camera.lens.model(), model);
    }
}

#[test]
fn a_lens_without_max_theta_ends_at_the_farthest_corner() {
    let text = LOBBY.replace(r#", "max_theta": 1.5708"#, "");
    let camera = read_text("lobby.json", &text)
        .unwrap()
        .for_frame(1680, 1680)
        .unwrap();
    let corner = 840.0 * std::f64::consts::SQRT_2 / 534.76;
    assert!((camera.lens.max_theta() - corner).abs() < 1e-9);
}

#[test]
fn what_makes_no_camera_is_refused_with_field_value_and_remedy() {
    for (from, to, expected) in [
        (
            r#""lobby""#,
            r#""Lob by""#,
            "id: \"Lob by\" is not a calibration ID",
        ),
        (
            "1680, \"height\": 1680",
            "8, \"height\": 8",
            "image: 8×8 pixels; each side must be 16",
        ),
        ("534.76", "-5", "lens: fx is -5: it must be greater than 0"),
        (
            "1.5708",
            "9",
            "lens: max_theta is 9 rad, but this equidistant lens",
        ),
        (
            r#""focal": 534.76"#,
            r#""fx": 534.76"#,
            "lens: give either focal, or both fx and fy",
        ),
        (
            "[0, 0, -1]",
            "[0, 0, -2]",
            "mount: world_up is [0, 0, -2], of length 2.000: give a unit",
        ),
        ("2.8", "0", "mount: height_m is 0: give metres above 0"),
        (
            "equidistant",
            "equidistance",
            "not a calibration file: unknown variant `equidistance`",
        ),
        (
            "height_m",
            "height",
            "not a calibration file: unknown field `height`",
        ),
        (
            "{ \"id\"",
            "{ id",
            "not a calibration file: key must be a string",
        ),
    ] {
        let text = refusal(&LOBBY.replace(from, to));
        assert!(text.starts_with(expected), "{text}");
    }
}

#[test]
fn a_file_too_large_to_be_a_calibration_is_not_read() {
    let error = read_text("lobby.json", &" ".repeat(1024 * 1024 + 1)).unwrap_err();
    assert!(
        error.to_string().contains("at most 1048576 are read"),
        "{error}"
    );
}

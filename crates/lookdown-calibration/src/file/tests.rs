use super::*;
use crate::native::NativeCalibration;

const LOBBY: &str = r#"{ "id": "lobby", "image": {"width": 1680, "height": 1680},
  "lens": {"model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5708},
  "mount": {"world_up": [0, 0, -1], "height_m": 2.8} }"#;

fn read_text(name: &str, text: &str) -> Result<Calibration, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    Calibration::read(&path)
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

fn with_lens(lens: &str) -> String {
    LOBBY.replace(
        r#"{"model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5708}"#,
        lens,
    )
}

/// Lenses of every model of the contract but `equidistant`, and the names of the models.
const LENSES: [(&str, &str); 14] = [
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
    (
        r#"{"model":"ucm","fx":500,"fy":500,"cx":840,"cy":840,"alpha":0.6}"#,
        "ucm",
    ),
    (
        r#"{"model":"eucm","fx":500,"fy":500,"cx":840,"cy":840,"alpha":0.6,"beta":1.1}"#,
        "eucm",
    ),
    (
        r#"{"model":"mei","fx":1200,"fy":1200,"cx":840,"cy":840,"xi":1.2,"k1":-0.1,"k2":0.1,"p1":0.001,"p2":0,"skew":0.2}"#,
        "mei",
    ),
    (
        r#"{"model":"double_sphere","fx":500,"fy":500,"cx":840,"cy":840,"xi":-0.2,"alpha":0.6}"#,
        "double_sphere",
    ),
    (
        r#"{"model":"ocam","polynomial":[-471.4,0,7.4e-4,-3.8e-7,5.8e-10],"cx":840,"cy":840,"c":1.0003,"d":-0.0003,"e":0.0009}"#,
        "ocam",
    ),
    (
        r#"{"model":"fov","fx":800,"fy":800,"cx":840,"cy":840,"omega":0.93}"#,
        "fov",
    ),
    (
        r#"{"model":"f_theta","angle_to_pixel":[0,560,4,-9,2,-0.4],"cx":840,"cy":840,"c":1.001,"max_theta":1.5}"#,
        "f_theta",
    ),
    (
        r#"{"model":"f_theta","pixel_to_angle":[0,0.0018,0,0,0,0],"cx":840,"cy":840}"#,
        "f_theta",
    ),
];

#[test]
fn every_lens_model_of_the_contract_is_read() {
    for (lens, model) in LENSES {
        let calibration = read_text("lobby.json", &with_lens(lens)).unwrap();
        assert_eq!(calibration.lens().model(), model);
    }
}

#[test]
fn what_is_written_is_read_back_as_the_same_camera() {
    for (lens, _) in LENSES {
        let text = with_lens(lens);
        let native: NativeCalibration = serde_json::from_str(&text).unwrap();
        let expected = read_text("lobby.json", &text).unwrap();
        for (name, written) in [
            ("lobby.json", serde_json::to_string(&native).unwrap()),
            ("lobby.yaml", serde_saphyr::to_string(&native).unwrap()),
            ("lobby.toml", toml::to_string(&native).unwrap()),
        ] {
            let read = read_text(name, &written).unwrap();
            let camera = |calibration: &Calibration| calibration.for_frame(1680, 1680).unwrap();
            assert_eq!(camera(&read), camera(&expected), "{written}");
            assert!(!written.contains("null"), "{written}");
        }
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
        (
            "534.76",
            "-5",
            "lens: focal is -5: it must be greater than 0",
        ),
        (
            "\"cx\": 839.5",
            "\"cx\": 8390.5",
            "lens: its center, cx 8390.5 and cy 839.5, lies outside the frame of 1680×1680 pixels",
        ),
        (
            "\"focal\": 534.76",
            "\"fx\": 534.76, \"fy\": 53.476",
            "lens: an angle is 10.000 times as long across the frame as down it",
        ),
        (
            "534.76",
            "53.476",
            "lens: its image ends 84 pixels from the center, a speck in a frame of 1680×1680",
        ),
        (
            "534.76",
            "5347.6",
            "lens: the corners of a frame of 1680×1680 pixels are only 12.7° off its axis",
        ),
        (
            "equidistant",
            "ucm",
            "not a calibration file: lens.focal: unknown field `focal`, expected one of `fx`, `fy`, `cx`",
        ),
        (
            "534.76",
            "\"534.76\"",
            "not a calibration file: lens.focal: invalid type: string \"534.76\", expected f64",
        ),
        (
            r#"{"model": "equidistant", "focal": 534.76,"#,
            r#"{"model": "kannala_brandt", "fx": 534.76, "fy": 534.76, "k": [0.1, 0, 0],"#,
            "not a calibration file: lens.k: invalid length 3, expected an array of length 4",
        ),
        (
            r#"{"model": "equidistant", "focal": 534.76,"#,
            r#"{"model": "f_theta","#,
            "lens: give either angle_to_pixel or pixel_to_angle",
        ),
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
        ("2.8", "0", "mount: height_m is 0: give 0.01 to 1000 meters"),
        (
            "equidistant",
            "equidistance",
            "not a calibration file: lens.model: \"equidistance\" is none of equidistant, equisolid,",
        ),
        (
            "height_m",
            "height",
            "not a calibration file: unknown field `height`",
        ),
        (
            "{ \"id\"",
            "{ id",
            "not a calibration file: it is not valid JSON at line 1: correct that line",
        ),
    ] {
        let text = refusal(&LOBBY.replace(from, to));
        assert!(text.starts_with(expected), "{text}");
        assert!(!text.contains('\n'), "one sentence: {text}");
    }
}

#[test]
fn a_file_too_large_to_be_a_calibration_is_not_read() {
    let error = read_text("lobby.json", &" ".repeat(1024 * 1024 + 1)).unwrap_err();
    assert!(
        error.to_string().contains("more than 1048576 bytes"),
        "{error}"
    );
}

#[test]
fn faults_of_yaml_and_toml_are_one_line_with_the_place() {
    for (name, text, expected) in [
        (
            "lobby.yaml",
            "id: lobby\nimage: {width: 16, height: .nan}\n",
            "it is not valid YAML at line 2: correct that line",
        ),
        (
            "lobby.toml",
            "id = \"lobby\"\nimage = {width = 1680, height = -1}\n",
            "TOML parse error at line 2, column 33: invalid value: integer `-1`, expected u32",
        ),
        (
            "lobby.toml",
            "id = \"lobby\"\nimage = {width = 1680, height = 1680}\n[lens]\nmodel = \"ucm\"\n\
             alpha = nan\n",
            "lens.alpha: invalid type: null, expected f64",
        ),
    ] {
        let error = read_text(name, text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn one_of_several_cameras_is_read_by_its_id() {
    let camera = |focal: u32| {
        format!(
            "  camera_model: pinhole\n  intrinsics: [{focal}, {focal}, 400, 300]\n  \
             distortion_model: equidistant\n  distortion_coeffs: [0.01, 0, 0, 0]\n  \
             resolution: [800, 600]\n"
        )
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.yaml");
    let text = format!("cam0:\n{}cam1:\n{}", camera(300), camera(310));
    std::fs::write(&path, text).unwrap();

    let (calibration, stated) = read_camera(&path, Some("rig-cam1")).unwrap();
    assert_eq!(calibration.id().as_str(), "rig-cam1");
    let focal = serde_json::to_value(&stated.lens).unwrap()["fx"].as_f64();
    assert_eq!(focal, Some(310.0));
    let problem = |id| read_camera(&path, id).unwrap_err().to_string();
    for (id, part) in [
        (
            Some("cam1"),
            "the file holds rig-cam0, rig-cam1, not \"cam1\"",
        ),
        (None, "the file holds 2: name one of rig-cam0, rig-cam1"),
    ] {
        assert!(problem(id).contains(part), "{}", problem(id));
    }
}

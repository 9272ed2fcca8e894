//! Details of calibration formats that are easily misread.

use lookdown_calibration::CalibrationFile;
use lookdown_lens::geometry::{Pixel, Ray, lens::LensModel};

use crate::calibration_formats::{camera, fixture, lens, refusal};

fn text(file: &str) -> String {
    String::from_utf8(fixture(&format!("calibrations/{file}"))).unwrap()
}

#[track_caller]
fn assert_refused(content: &str, expected: &str) {
    let refusal = refusal(content.as_bytes());
    assert!(refusal.contains(expected), "{refusal}");
}

#[test]
fn ocamcalib_lists_row_before_column_and_height_before_width() {
    let content = text("ocamcalib_calib_results.txt").replace("1600 1600", "1200 1600");
    let camera = camera(content.as_bytes(), 0);
    let image = camera.image.unwrap();
    assert_eq!((image.width, image.height), (1600, 1200));
    let LensModel::Ocam(lens) = camera.lens else {
        panic!("not an ocam lens");
    };
    assert_eq!((lens.cx, lens.cy), (798.175_741, 794.308_657));
}

#[test]
fn ocamcalib_counts_its_coefficients() {
    let content = text("ocamcalib_calib_results.txt").replace("\n5 -4.7", "\n6 -4.7");
    assert_refused(
        &content,
        "direct polynomial: its first number must be the count",
    );
}

#[test]
fn colmap_loses_half_a_pixel() {
    let camera = camera(b"1 OPENCV_FISHEYE 512 400 190 191 255.5 200.5 0 0 0 0\n", 0);
    let LensModel::KannalaBrandt(lens) = camera.lens else {
        panic!("not a Kannala-Brandt lens");
    };
    assert_eq!((lens.cx, lens.cy), (255.0, 200.0));
}

#[test]
fn colmap_thin_prism_terms_are_refused_unless_they_are_zero() {
    let content = text("colmap_cameras.txt");
    let file = CalibrationFile::parse(content.as_bytes()).unwrap();
    let names: Vec<_> = file
        .cameras
        .iter()
        .filter_map(|camera| camera.name.as_deref())
        .collect();
    assert_eq!(names, ["1", "2", "3", "4"]);
    let refused = file.cameras[3].camera.clone().unwrap_err().to_string();
    assert!(
        refused.contains("p1, p2, sx1, sy1 are 0.0001, -0.0002"),
        "{refused}"
    );
    assert!(file.cameras[..3].iter().all(|camera| camera.camera.is_ok()));
    let plain = b"1 THIN_PRISM_FISHEYE 512 512 190 191 256 256 0.01 0.02 0 0 0.03 0.04 0 0\n";
    let LensModel::KannalaBrandt(lens) = camera(plain, 0).lens else {
        panic!("not a Kannala-Brandt lens");
    };
    // k1 and k2, then the tangential terms, then k3 and k4.
    assert_eq!(lens.k, [0.01, 0.02, 0.03, 0.04]);
}

#[test]
fn kalibr_lists_sphere_parameters_before_focal_lengths() {
    let camera = |model: &str, intrinsics: &str| {
        let content = format!(
            "cam0:\n  camera_model: {model}\n  distortion_model: none\n  distortion_coeffs: []\n  \
             intrinsics: {intrinsics}\n  resolution: [752, 480]\n"
        );
        camera(content.as_bytes(), 0).lens
    };
    let LensModel::DoubleSphere(sphere) = camera("ds", "[-0.2, 0.6, 348, 347, 366, 249]") else {
        panic!("not a double sphere");
    };
    assert_eq!((sphere.xi, sphere.alpha, sphere.fx), (-0.2, 0.6, 348.0));
    let LensModel::Eucm(eucm) = camera("eucm", "[0.6, 1.1, 460, 459, 366, 249]") else {
        panic!("not an EUCM lens");
    };
    assert_eq!((eucm.alpha, eucm.beta, eucm.fx), (0.6, 1.1, 460.0));
    let LensModel::Mei(mei) = camera("omni", "[0.8, 833, 830, 374, 254]") else {
        panic!("not a Mei lens");
    };
    assert_eq!((mei.xi, mei.fx, mei.k1), (0.8, 833.0, 0.0));
}

#[test]
fn incompatible_kalibr_models_are_refused() {
    for (from, to, expected) in [
        (
            "camera_model: omni\n  distortion_coeffs: [-0.33518750, 0.13211436, 0.00055967, \
             0.00057686]\n  distortion_model: radtan",
            "camera_model: omni\n  distortion_coeffs: [0.1, 0, 0, 0]\n  distortion_model: \
             equidistant",
            "cam1.distortion_model: it is \"equidistant\" on a camera_model of \"omni\"",
        ),
        (
            "[0.80065662, 833.006,",
            "[833.006,",
            "cam1.intrinsics: it has 4 numbers: 5 are needed, xi, fu, fv, pu, pv",
        ),
    ] {
        let content = text("kalibr_camchain.yaml");
        assert!(content.contains(from));
        let file = CalibrationFile::parse(content.replace(from, to).as_bytes()).unwrap();
        let refused = file.cameras[1].camera.clone().unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
        assert!(
            file.cameras[0].camera.is_ok(),
            "one camera spoils the others"
        );
    }
}

#[test]
fn an_ordinary_lens_is_refused_under_every_name() {
    assert_refused(
        &text("ros_plumb_bob_called_fisheye.yaml"),
        "distortion_model: it is plumb_bob, which describes ordinary lenses below 180°",
    );
    let file = CalibrationFile::parse(text("kalibr_with_directive.yaml").as_bytes()).unwrap();
    let refused = file.cameras[1].camera.clone().unwrap_err().to_string();
    assert!(
        refused.starts_with("cam1.distortion_model: it is radtan"),
        "{refused}"
    );
    let ordinary = text("opencv_nameless_model.yml").replace("data: [ 0.003", "data: [ 0.1, 0.003");
    assert_refused(
        &ordinary,
        "D: it is a camera with 5 coefficients, which describes ordinary",
    );
    let said = text("opencv_fisheye.yml").replace("fisheye_model: 1", "fisheye_model: 0");
    assert_refused(
        &said,
        "fisheye_model: it is radial and tangential distortion",
    );
}

#[test]
fn four_coefficients_without_a_model_are_read_as_fisheye() {
    let camera = camera(&fixture("calibrations/opencv_nameless_model.yml"), 0);
    assert_eq!(camera.notes.len(), 1);
    assert!(camera.notes[0].message.contains("taken for cv::fisheye"));
}

#[test]
fn a_camera_matrix_stored_by_columns_is_refused() {
    let content = r#"{"K": [[190, 0, 0], [0, 190, 0], [255, 256, 1]], "D": [0, 0, 0, 0],
        "width": 512, "height": 512}"#;
    assert_refused(
        content,
        "K: its rows must be fx, skew, cx; 0, fy, cy; 0, 0, 1",
    );
}

#[test]
fn corner_points_are_not_a_calibration() {
    assert_refused(
        &text("opencv_corner_points.xml"),
        "the file holds the corner points of a calibration, not its result",
    );
}

#[test]
fn camodocal_counts_coefficients_by_their_power() {
    let camera = camera(&fixture("calibrations/camodocal_kannala_brandt.yaml"), 0);
    let LensModel::KannalaBrandt(lens) = camera.lens else {
        panic!("not a Kannala-Brandt lens");
    };
    assert_eq!(lens.k[0], 0.003_482_389_402_249_343_4);
}

#[test]
fn woodscape_offsets_count_from_the_middle_of_the_frame() {
    let LensModel::RadialPolynomial(lens) = camera(&fixture("calibrations/woodscape.json"), 0).lens
    else {
        panic!("not a radial polynomial");
    };
    assert_eq!((lens.cx, lens.cy), (3.942 + 639.5, -3.093 + 482.5));
}

#[test]
fn nvidia_uses_the_polynomial_that_it_calls_exact() {
    let backward = text("nvidia_ftheta.json");
    let forward = backward.replace("PIXELDIST_TO_ANGLE", "ANGLE_TO_PIXELDIST");
    let polynomials = |content: &str| {
        let LensModel::FTheta(lens) = camera(content.as_bytes(), 0).lens else {
            panic!("not an f-theta lens");
        };
        (lens.angle_to_pixel.is_some(), lens.pixel_to_angle.is_some())
    };
    assert_eq!(polynomials(&backward), (false, true));
    assert_eq!(polynomials(&forward), (true, false));
    let identity = backward
        .replace("1.0012,", "0,")
        .replace("0.0004,", "0,")
        .replace("-0.0003", "0");
    let LensModel::FTheta(lens) = camera(identity.as_bytes(), 0).lens else {
        panic!("not an f-theta lens");
    };
    assert_eq!((lens.c, lens.d, lens.e), (1.0, 0.0, 0.0));
}

#[test]
fn a_field_of_view_beyond_the_curve_is_cut_off_with_a_note() {
    let file = CalibrationFile::parse(&fixture("calibrations/moil.json")).unwrap();
    let by_name = |name: &str| {
        let mut cameras = file.cameras.iter();
        let found = cameras.find(|camera| camera.name.as_deref() == Some(name));
        found.unwrap().camera.clone()
    };
    let bent = by_name("Bent").unwrap();
    assert!(
        bent.notes[0]
            .message
            .contains("claims a field of view of 220.0°"),
        "{:?}",
        bent.notes
    );
    // 200 a - 60 a³ has its maximum at a = sqrt(200 / 180).
    let limit = (200.0_f64 / 180.0).sqrt();
    assert!((bent.lens.max_theta().unwrap() - limit).abs() < 1e-3);
    assert!(by_name("Axis").unwrap().notes.is_empty());
    let oblong = by_name("Oblong").unwrap_err().to_string();
    assert_eq!(
        oblong,
        "Oblong.ratio: it is 1.48: only square pixels (1) are read, measure this lens anew"
    );
}

#[test]
fn formats_without_a_frame_size_have_a_clear_error() {
    let content = fixture("calibrations/py_ocamcalib.json");
    let file = CalibrationFile::parse(&content).unwrap();
    let (id, calibration) = file.calibrations("hall", &content).remove(0);
    assert_eq!(id, "hall");
    assert_eq!(
        calibration.unwrap_err().to_string(),
        "size: the file has no frame size: convert it with `lookdown \
         calibration convert --size WIDTHxHEIGHT`, or PUT it with ?size=WIDTHxHEIGHT"
    );
}

#[test]
fn a_file_without_a_calibration_is_refused_in_a_sentence() {
    for (content, expected) in [
        (
            "{\"a\": 1}",
            "its fields are those of no format that is read",
        ),
        ("hello", "it has no named fields"),
        (
            "<svg/>",
            "its XML is <svg>; of XML, OpenCV's <opencv_storage> is read",
        ),
        ("{", "its JSON ends early"),
        ("", "it has no named fields"),
        ("<opencv_storage>", "its XML ends before </opencv_storage>"),
        (
            "a: b: c",
            "it is not valid YAML at line 1: correct that line",
        ),
        ("a = ", "it is not valid TOML at line 1: correct that line"),
        ("<opencv_storage><a></b>", "it is not valid XML at line 1"),
    ] {
        assert_refused(content, expected);
    }
    let deep = format!("{{\"lens\": {}", "[".repeat(10_000));
    assert_refused(&deep, "it is not valid JSON at line 1");
    let deep = format!("a: {}", "[".repeat(1000));
    assert_refused(&deep, "not a calibration file: ");
    let deep = format!(
        "<opencv_storage>{}",
        "<_>".repeat(1000) + &"</_>".repeat(1000)
    ) + "</opencv_storage>";
    assert_refused(&deep, "nested too deeply");
    let aliases = "- [*a, *a, *a, *a]\n".repeat(40);
    let bomb = format!("a: &a [1, 1, 1, 1]\nb:\n{aliases}");
    assert_refused(&bomb, "not a calibration file: ");
    let doctype = "<!DOCTYPE x [<!ENTITY a \"b\">]><opencv_storage>&a;</opencv_storage>";
    assert_refused(doctype, "not a calibration file: ");
}

#[expect(clippy::too_many_lines, reason = "a table")]
#[test]
fn files_of_other_kinds_are_named_with_the_one_to_take() {
    let text = |text: &str| text.as_bytes().to_vec();
    let tar = [vec![b'x'; 257], text("ustar")].concat();
    for (content, expected) in [
        (
            b"PK\x03\x04..\xffK.npy".to_vec(),
            "it is a NumPy archive (.npz): write K, D and",
        ),
        (b"PK\x03\x04\xff".to_vec(), "it is a ZIP archive: unpack it"),
        (
            b"\x93NUMPY\x01".to_vec(),
            "it is a NumPy array (.npy): write K, D and",
        ),
        (
            b"\x80\x04\x95}".to_vec(),
            "it is a Python pickle: write K, D and",
        ),
        (
            text("(dp0\nS'K'\np1\n"),
            "it is a Python pickle: write K, D and",
        ),
        (b"\x1f\x8b\x08".to_vec(), "it is a gzip archive: unpack it"),
        (
            [tar, b"\xff".to_vec()].concat(),
            "it is a tar archive: unpack it",
        ),
        (
            b"MATLAB 5.0 MAT-file\0".to_vec(),
            "it is a MATLAB file (.mat): write the intrinsics",
        ),
        (
            text("%PDF-1.4\n1 0 obj"),
            "it is a PDF report: take the file with the result",
        ),
        (
            b"\xff\xd8\xff\xe0".to_vec(),
            "it is a JPEG image: take the file with the result",
        ),
        (
            b"\xff\xfeK\0".to_vec(),
            "it is UTF-16 text: save it as UTF-8",
        ),
        (
            b"\x01\0\0\0\0\0\0\0".to_vec(),
            "it is a binary file: take the text file",
        ),
        (
            b"K: \xe4".to_vec(),
            "it is text in another encoding than UTF-8",
        ),
        (
            text("Calibration results \n====\ncam0 (/a):\n    type: x"),
            "take its camchain.yaml",
        ),
        (
            text("# oST version 5.0 parameters\n\n[image]\n\nwidth\n640"),
            "take the ost.yaml",
        ),
        (
            text("[surface0]\nprojection-type=4\ndistortion=1;2"),
            "a configuration of nvdewarper",
        ),
        (
            text("DIM=(1, 2)\nK=np.array([[1.0]])"),
            "printed NumPy arrays or code: write K",
        ),
        (
            text("target_type: aprilgrid\ntagCols: 6"),
            "the target of a Kalibr calibration",
        ),
        (
            text("# Image list with two lines\n1 0.8"),
            "it is COLMAP's images.txt: take cameras",
        ),
        (
            text("[\n {\"shots\": {}}]"),
            "OpenSfM's reconstruction.json: take camera_models",
        ),
        (text("<html><body>login"), "it is a web page"),
        (
            text("<document><calibration type=\"equidistant_fisheye\"/></document>"),
            "it is Metashape's XML",
        ),
        (
            text("<lensdatabase><lens/></lensdatabase>"),
            "it is a database of Lensfun",
        ),
        (
            text("# Rig calib list with one line\n1 1 CAMERA"),
            "it is COLMAP's rigs.txt",
        ),
        (
            text("importantnote: Pix4D internal\n\nF 4.5"),
            "it is the camera of Pix4D",
        ),
        (
            text("[LEFT_CAM_2K]\nfx=1400\nk1=-0.17"),
            "the calibration of a ZED camera",
        ),
        (
            text("[{\"img_name\": \"a\", \"fx\": 400, \"fy\": 400, \"width\": 5, \"height\": 5}]"),
            "cameras.json of Gaussian splatting",
        ),
        (
            text("{\"camera_angle_x\": 0.69, \"frames\": []}"),
            "take transforms.json with fl_x",
        ),
        (
            text("{\"sfm_data_version\": \"0.3\", \"intrinsics\": [{\"key\": 0}]}"),
            "it is OpenMVG's sfm_data.json",
        ),
        (
            text("{\"K\": [[4, 0, 2], [0, 4, 2], [0, 0, 1]], \"RadialDistortion\": [0, 0]}"),
            "it is MATLAB's model of ordinary lenses",
        ),
    ] {
        let refusal = refusal(&content);
        assert!(refusal.starts_with("not a calibration file: "), "{refusal}");
        assert!(refusal.contains(expected), "{refusal}");
    }
}

#[test]
fn the_first_of_several_equal_documents_is_read() {
    let message = text("ros_message.yaml");
    let expected = camera(message.as_bytes(), 0);
    for content in [
        format!("{message}\n---\n"),
        format!("---\n{message}\n...\n# end\n"),
        format!("{message}\n---\n{message}\n---\n"),
    ] {
        assert_eq!(camera(content.as_bytes(), 0), expected);
    }
    let mixed = format!("{message}\n---\n{}", text("kalibr_camchain.yaml"));
    assert_refused(&mixed, "it has several YAML documents of different kinds");
}

/// The ray 60° off the axis at the azimuth of 30°, computed with the formula of each program.
#[test]
fn units_and_origins_of_reconstructions_are_converted() {
    let ray = |degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (y, x) = 30_f64.to_radians().sin_cos();
        Ray::new(sin * x, sin * y, cos)
    };
    let opensfm = r#"{"a": {"projection_type": "fisheye", "width": 1600, "height": 1200,
        "focal": 0.36, "k1": -0.01, "k2": 0.002}}"#;
    let fisheye62 = r#"{"a": {"projection_type": "fisheye62", "width": 1600, "height": 1200,
        "focal_x": 0.36, "focal_y": 0.36, "c_x": 0, "c_y": 0, "k1": -0.01, "k2": 0.002,
        "k3": 0, "k4": 0, "k5": 0, "k6": 0.01, "p1": 0, "p2": 0}}"#;
    let alicevision = r#"{"intrinsics": [{"intrinsicId": "1", "width": "2000", "height": "2000",
        "sensorWidth": "6.17", "sensorHeight": "6.17", "type": "fisheye4", "focalLength": "1.9",
        "pixelRatio": "1", "principalPoint": ["13.5", "-26.25"],
        "distortionParams": ["-0.0063", "0.003", "-0.0018", "0.0001"]}]}"#;
    // Half as wide as the frame that it was calibrated with.
    let anamorphic = r#"{"calib_dimension": {"w": 1920, "h": 1440}, "input_horizontal_stretch": 2.0,
        "fisheye_params": {"camera_matrix": [[877.5, 0.0, 960.25], [0.0, 876.0, 718.5], [0, 0, 1]],
        "distortion_coeffs": [0.2, 0.05, -0.02, 0.01]}}"#;
    for (content, expected) in [
        (opensfm, (1_317.402_137_6, 898.510_938_5)),
        (fisheye62, (1_326.487_142_1, 903.756_168_4)),
        (alicevision, (1_568.455_535_4, 1_293.942_402_9)),
        (anamorphic, (1_968.964_054_5 / 2.0, 1_299.885_807_3)),
    ] {
        let camera = camera(content.as_bytes(), 0);
        let pixel = lens(&camera).project(&ray(60.0)).unwrap();
        let expected = Pixel::new(expected.0, expected.1);
        assert!((pixel - expected).norm() < 1e-6, "{content}: {pixel}");
    }
}

#[test]
fn models_without_a_lens_here_are_refused_by_name() {
    let changed = |file: &str, from: &str, to: &str| text(file).replace(from, to);
    for (content, expected) in [
        (
            changed("opensfm.json", "\"p1\": 0.0", "\"p1\": 0.1"),
            "tangential or thin-prism terms",
        ),
        (
            changed("opensfm.json", "fisheye_opencv", "brown"),
            "a.projection_type: it is brown, which",
        ),
        (
            changed("opensfm.json", "fisheye_opencv", "spherical"),
            "it is \"spherical\": fisheye,",
        ),
        (
            "Camera: {model: equirectangular, cols: 1920, rows: 960}".to_owned(),
            "Camera.model: it is \"equirectangular\": fisheye",
        ),
        (
            "K: [0, 0, 0, 0, 0, 0, 0, 0, 0]\nD: []\ndistortion_model: equidistant".to_owned(),
            "K: its focal lengths are 0: the camera is not calibrated",
        ),
        (text("depthai.json"), "cameraData[0].cameraType: it is"),
        (
            changed("gyroflow.json", "null", "\"gopro\""),
            "distortion_model: it is \"gopro\": only",
        ),
        (
            changed("nerfstudio.json", "OPENCV_FISHEYE", "OPENCV"),
            "camera_model: it is OPENCV, which",
        ),
        (
            changed("alicevision.sfm", "fisheye4", "equidistant"),
            "it is \"equidistant\": fisheye4 is",
        ),
        (
            changed("openvslam.yaml", "fisheye", "perspective"),
            "Camera.model: it is perspective,",
        ),
    ] {
        let file = CalibrationFile::parse(content.as_bytes()).unwrap();
        let mut problems = file
            .cameras
            .iter()
            .filter_map(|camera| camera.camera.as_ref().err());
        let found = problems.any(|problem| problem.to_string().contains(expected));
        assert!(found, "{expected}: {file:?}");
    }
}

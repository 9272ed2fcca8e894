//! Files with the parameters of a camera in `fixtures/vectors` project to its known answers.
//!
//! OpenCV 5.0.0 and pycolmap 4.2.1 wrote the files of their formats. The other files are written by
//! hand in the structure of each program.

use lookdown_calibration::CalibrationFile;
use lookdown_lens::geometry::Pixel;
use serde_json::Value;

use crate::calibration_formats::{camera, fixture, json, lens, ray};

/// File, index of the camera in it, format, known answers.
const FILES: [(&str, usize, &str, &str); 50] = [
    ("opencv_fisheye.yml", 0, "OpenCV FileStorage", "kb_tumvi512"),
    (
        "opencv_fisheye_4x_header.yml",
        0,
        "OpenCV FileStorage",
        "kb_tumvi512",
    ),
    ("opencv_fisheye.xml", 0, "OpenCV FileStorage", "kb_tumvi512"),
    (
        "opencv_fisheye.json",
        0,
        "OpenCV FileStorage",
        "kb_tumvi512",
    ),
    (
        "opencv_other_names.yml",
        0,
        "OpenCV FileStorage",
        "kb_tumvi512",
    ),
    (
        "opencv_nameless_model.yml",
        0,
        "OpenCV FileStorage",
        "kb_tumvi512",
    ),
    (
        "opencv_plain_lists.json",
        0,
        "OpenCV FileStorage",
        "kb_tumvi512",
    ),
    ("opencv_omnidir.yml", 0, "OpenCV FileStorage", "mei_xi_gt1"),
    ("opencv_omnidir.xml", 0, "OpenCV FileStorage", "mei_xi_gt1"),
    ("opencv_omnidir.json", 0, "OpenCV FileStorage", "mei_xi_gt1"),
    (
        "ros_camera_info_equidistant.yaml",
        0,
        "ROS camera_info",
        "kb_tumvi512",
    ),
    ("ros_message.yaml", 0, "ROS camera_info", "kb_tumvi512"),
    ("kalibr_camchain.yaml", 0, "Kalibr camchain", "kb_tumvi512"),
    ("kalibr_camchain.yaml", 1, "Kalibr camchain", "mei_kalibr"),
    ("kalibr_camchain.yaml", 2, "Kalibr camchain", "ds_euroc"),
    ("kalibr_camchain.yaml", 3, "Kalibr camchain", "eucm_a"),
    (
        "kalibr_with_directive.yaml",
        0,
        "Kalibr camchain",
        "kb_tumvi512",
    ),
    ("camodocal_mei.yaml", 0, "camodocal", "mei_kalibr"),
    (
        "camodocal_kannala_brandt.yaml",
        0,
        "camodocal",
        "kb_tumvi512",
    ),
    ("basalt.json", 0, "Basalt", "ds_basalt"),
    ("basalt.json", 1, "Basalt", "eucm_a"),
    ("basalt.json", 2, "Basalt", "ucm_a"),
    ("basalt.json", 3, "Basalt", "kb_tumvi512"),
    (
        "ocamcalib_calib_results.txt",
        0,
        "OCamCalib",
        "ocamcalib_1600",
    ),
    ("py_ocamcalib.json", 0, "py-OCamCalib", "ocamcalib_1600"),
    ("multicol.yaml", 0, "MultiCol-SLAM", "ocamcalib_1600"),
    (
        "adapter_ocam.yml",
        0,
        "fisheye-calib-adapter",
        "ocamcalib_1600",
    ),
    ("adapter_ds.yml", 0, "fisheye-calib-adapter", "ds_basalt"),
    ("adapter_eucm.yml", 0, "fisheye-calib-adapter", "eucm_a"),
    ("adapter_ucm.yml", 0, "fisheye-calib-adapter", "ucm_a"),
    ("adapter_kb4.yml", 0, "fisheye-calib-adapter", "kb_tumvi512"),
    (
        "intrinsic_model_eucm.json",
        0,
        "camera-intrinsic-model",
        "eucm_a",
    ),
    (
        "intrinsic_model_kb4.json",
        0,
        "camera-intrinsic-model",
        "kb_tumvi512",
    ),
    ("woodscape.json", 0, "WoodScape", "woodscape_fv"),
    ("nvidia_ftheta.json", 0, "NVIDIA f-theta", "ftheta_backward"),
    ("opencv_stereo.yml", 1, "OpenCV FileStorage", "kb_tumvi512"),
    ("openvslam.yaml", 0, "SLAM settings", "kb_tumvi512"),
    ("stella_vslam.yaml", 0, "SLAM settings", "kb_tumvi512"),
    ("orb_slam3.yaml", 0, "SLAM settings", "kb_tumvi512"),
    ("orb_slam3.yaml", 1, "SLAM settings", "kb_tumvi512"),
    (
        "nerfstudio.json",
        0,
        "nerfstudio transforms.json",
        "kb_tumvi512",
    ),
    (
        "instant_ngp.json",
        1,
        "nerfstudio transforms.json",
        "kb_tumvi512",
    ),
    ("gyroflow.json", 0, "gyroflow lens profile", "kb_tumvi512"),
    ("depthai.json", 1, "DepthAI", "kb_tumvi512"),
    (
        "opensfm.json",
        0,
        "OpenSfM camera_models.json",
        "kb_tumvi512",
    ),
    (
        "opensfm.json",
        1,
        "OpenSfM camera_models.json",
        "kb_tumvi512",
    ),
    (
        "matlab_fisheye.json",
        0,
        "MATLAB fisheyeIntrinsics",
        "ocamcalib_1600",
    ),
    (
        "matlab_kannala_brandt.json",
        0,
        "MATLAB fisheyeIntrinsics",
        "kb_tumvi512",
    ),
    ("dso.txt", 0, "DSO camera.txt", "kb_tumvi512"),
    ("dso_pixels.txt", 0, "DSO camera.txt", "kb_tumvi512"),
];

#[test]
fn every_file_is_recognized_and_projects_as_its_camera() {
    let vectors = json("vectors/lenses.json");
    for (file, index, format, vector) in FILES {
        let content = fixture(&format!("calibrations/{file}"));
        let found = CalibrationFile::parse(&content).unwrap();
        assert_eq!(found.format.name(), format, "{file}");
        let camera = camera(&content, index);
        let answers = &vectors[vector];
        if let Some(image) = camera.image {
            let size = &answers["image_size"];
            assert_eq!(size[0], image.width, "{file}");
            assert_eq!(size[1], image.height, "{file}");
        }
        let lens = lens(&camera);
        let points = answers["project"].as_array().unwrap();
        let valid: Vec<_> = points.iter().filter(|point| is_valid(point)).collect();
        assert!(valid.len() > 20, "{vector} has few answers");
        for point in valid {
            let expected = Pixel::new(
                point["uv"][0].as_f64().unwrap(),
                point["uv"][1].as_f64().unwrap(),
            );
            let Some(pixel) = lens.project(&ray(&point["xyz"])) else {
                panic!("{file}, camera {index}: refuses {}", point["xyz"]);
            };
            // Near its limit a lens reaches pixels far beyond any frame, where precision is lost.
            let tolerance = f64::max(1e-6, 1e-9 * expected.coords.norm());
            assert!(
                (pixel - expected).norm() <= tolerance,
                "{file}, camera {index}: {pixel} instead of {expected}"
            );
        }
    }
}

/// A matrix and coefficients, which stand for `$K`, `$F`, `$C` and `$D` below.
const K: &str = "[[190.975, 0.0, 254.931], [0.0, 190.973, 256.897], [0.0, 0.0, 1.0]]";
const F: &str = "190.975, 190.973";
const C: &str = "254.931, 256.897";
const D: &str = "[0.00348, 0.000715, -0.00205, 0.000203]";

/// The same camera in the other names and wrappers of these programs.
const VARIANTS: [&str; 14] = [
    r#"{"K": $K, "D": $D, "DIM": [512, 512]}"#,
    "calibrationDate: x\ncameraResolution: [512, 512]\ncameraMatrix: $K\ndist_coeffs: $D",
    "CameraMat: $K\nDistCoeff: $D\nImageSize: [512, 512]\nDistModel: fisheye",
    "[cam_0]\nname = 'a'\nsize = [512, 512]\nmatrix = $K\ndistortions = $D\nfisheye = true",
    "image_size: [512, 512]\nLEFT.K: $K\nLEFT.D: $D\nRIGHT.K: $K\nRIGHT.D: $D",
    "image_size: [512, 512]\nK_01: $K\nD_01: $D\nK_02: $K\nD_02: $D",
    "image_size: [512, 512]\nrightcamera_matrix: 1\nKr: $K\nDr: $D\nKl: $K\nDl: $D",
    "sensor_type: camera\nresolution: [512, 512]\ncamera_model: pinhole\nintrinsics: [$F, $C]\n\
     distortion_model: equidistant\ndistortion_coefficients: $D",
    r#"{"op": "publish", "msg": {"width": 512, "height": 512, "k": $K, "d": $D,
        "distortion_model": "equidistant"}}"#,
    r#"[{"name": "a", "K": $K, "dist": $D, "imgSize": [512, 512]}]"#,
    r#"{"cameras": [{"id": 3, "camera_matrix": $K, "dist_coeffs": $D, "size": [512, 512]}]}"#,
    "cameras:\n- {T_SC: [1], image_dimension: [512, 512], distortion_coefficients: $D,\n   \
     distortion_type: equidistant, focal_length: [$F], principal_point: [$C]}",
    "label: x\ncameras:\n- camera:\n    image_height: 512\n    image_width: 512\n    \
     type: pinhole\n    intrinsics: {rows: 4, cols: 1, data: [$F, $C]}\n    \
     distortion: {type: equidistant, parameters: {data: $D}}",
    r#"{"camera_model": "pinhole", "intrinsics": [$F, $C], "resolution": [512, 512],
        "distortion_model": "equidistant", "distortion_coeffs": $D}"#,
];

#[test]
fn other_names_and_wrappers_of_a_camera_are_read() {
    let expected =
        format!(r#"{{"K": {K}, "D": {D}, "fisheye_model": true, "image_size": [512, 512]}}"#);
    let expected = camera(expected.as_bytes(), 0);
    for variant in VARIANTS {
        let text = variant.replace("$K", K).replace("$D", D);
        let text = text.replace("$F", F).replace("$C", C);
        let found = CalibrationFile::parse(text.as_bytes());
        let found = found.unwrap_or_else(|error| panic!("{variant}: {error}"));
        for camera in found.cameras {
            let camera = camera
                .camera
                .unwrap_or_else(|error| panic!("{variant}: {error}"));
            assert_eq!(
                (camera.image, &camera.lens),
                (expected.image, &expected.lens),
                "{variant}"
            );
        }
    }
}

fn is_valid(point: &Value) -> bool {
    point["valid"] == true
}

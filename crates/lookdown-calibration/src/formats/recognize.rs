//! Recognition of a file's format from its content alone.

use serde_json::Value;
use strum::IntoEnumIterator as _;

use super::{Format, dso, fields::Fields, ocam, opencv, slam};

/// The line-based format of a text, if it is in one.
pub(super) fn recognize_lines(text: &str) -> Option<Format> {
    let mut content = text
        .lines()
        .map(str::trim)
        .filter(|line| !(line.is_empty() || line.starts_with('#')));
    if text.contains("coefficients for the DIRECT mapping") {
        Some(Format::OCamCalib)
    } else if text.lines().any(|line| line.starts_with("Camera.nrpol")) {
        Some(Format::MultiCol)
    } else if text.starts_with("# Camera list") || content.next().is_some_and(is_colmap_camera) {
        Some(Format::Colmap)
    } else if dso::is_camera(text) {
        Some(Format::Dso)
    } else {
        None
    }
}

/// `ID MODEL WIDTH HEIGHT PARAMS…`
fn is_colmap_camera(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let is_count = |word: Option<&str>| word.is_some_and(|word| word.parse::<u64>().is_ok());
    is_count(words.next())
        && words.next().is_some_and(|model| {
            model
                .chars()
                .all(|letter| letter.is_ascii_uppercase() || letter == '_')
        })
        && is_count(words.next())
        && is_count(words.next())
}

/// The format of a tree: the first one whose fields it has.
pub(super) fn recognize_tree(fields: &Fields<'_>) -> Option<Format> {
    let has = |key: &str| fields.has(key);
    let any_entry_has = |keys: &[&str]| {
        let mut entries = fields.map.values();
        entries.any(|entry| keys.iter().all(|key| entry.get(key).is_some()))
    };
    let part_has = |part: Option<&Value>, key: &str| part.is_some_and(|it| it.get(key).is_some());
    let field_has = |field: &str, key: &str| part_has(fields.map.get(field), key);
    let first_has =
        |list: &str, key: &str| part_has(fields.map.get(list).and_then(|list| list.get(0)), key);
    Format::iter().find(|format| match format {
        Format::Native => has("lens") || (has("id") && has("image")),
        Format::Kalibr => {
            any_entry_has(&["camera_model", "intrinsics"])
                || (has("camera_model") && has("intrinsics") && has("resolution"))
        }
        Format::Camodocal => has("model_type") && has("camera_name"),
        Format::Basalt => any_entry_has(&["intrinsics", "resolution"]),
        Format::WoodScape => field_has("intrinsic", "k1"),
        Format::NvidiaFTheta => has("camera_model_type"),
        Format::PyOCamCalib => has("taylor_coefficient"),
        Format::Moil => has("calibrationRatio") || any_entry_has(&["calibrationRatio"]),
        Format::FisheyeCalibAdapter => has("image") && has("parameter"),
        Format::CameraIntrinsicModel => fields.map.len() == 1 && any_entry_has(&["fx", "width"]),
        Format::Slam => slam::is_settings(fields),
        Format::Nerfstudio => has("fl_x") || first_has("frames", "fl_x"),
        Format::Gyroflow => has("fisheye_params") || has("calibration_data"),
        Format::DepthAi => has("cameraData"),
        Format::OpenSfm => any_entry_has(&["projection_type"]),
        Format::Matlab => {
            let mut names = ocam::MATLAB_FIELDS.iter();
            names.any(|name| has(name) || any_entry_has(&[name]))
        }
        Format::AliceVision => first_has("intrinsics", "intrinsicId"),
        Format::Ros => has("distortion_model") && (has("camera_matrix") || has("K") || has("k")),
        Format::OpenCv => opencv::is_storage(fields),
        Format::OCamCalib | Format::MultiCol | Format::Colmap | Format::Dso => false,
    })
}

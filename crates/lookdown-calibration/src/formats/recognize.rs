//! Recognition of a file's format from its content alone.

use super::{Format, fields::Fields, matlab, opencv, slam};

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

/// The format of a tree.
pub(super) fn recognize_tree(fields: &Fields<'_>) -> Option<Format> {
    let has = |key: &str| fields.has(key);
    let any_entry_has = |keys: &[&str]| {
        let mut entries = fields.map().values();
        entries.any(|entry| keys.iter().all(|key| entry.get(key).is_some()))
    };
    let first_of = |list: &str, key: &str| {
        let first = fields.map().get(list).and_then(|list| list.get(0));
        first.is_some_and(|entry| entry.get(key).is_some())
    };
    Some(if has("lens") || (has("id") && has("image")) {
        Format::Native
    } else if any_entry_has(&["camera_model", "intrinsics"])
        || (has("camera_model") && has("intrinsics") && has("resolution"))
    {
        Format::Kalibr
    } else if has("model_type") && has("camera_name") {
        Format::Camodocal
    } else if any_entry_has(&["intrinsics", "resolution"]) {
        Format::Basalt
    } else if fields
        .map()
        .get("intrinsic")
        .is_some_and(|intrinsic| intrinsic.get("k1").is_some())
    {
        Format::WoodScape
    } else if has("camera_model_type") {
        Format::NvidiaFTheta
    } else if has("taylor_coefficient") {
        Format::PyOCamCalib
    } else if has("calibrationRatio") || any_entry_has(&["calibrationRatio"]) {
        Format::Moil
    } else if has("image") && has("parameter") {
        Format::FisheyeCalibAdapter
    } else if fields.map().len() == 1 && any_entry_has(&["fx", "width"]) {
        Format::CameraIntrinsicModel
    } else if slam::is_settings(fields) {
        Format::Slam
    } else if has("fl_x") || first_of("frames", "fl_x") {
        Format::Nerfstudio
    } else if has("fisheye_params") || has("calibration_data") {
        Format::Gyroflow
    } else if has("cameraData") {
        Format::DepthAi
    } else if any_entry_has(&["projection_type"]) {
        Format::OpenSfm
    } else if has(matlab::POLYNOMIAL) || any_entry_has(&[matlab::POLYNOMIAL]) {
        Format::Matlab
    } else if first_of("intrinsics", "intrinsicId") {
        Format::AliceVision
    } else if has("distortion_model") && (has("camera_matrix") || has("K") || has("k")) {
        Format::Ros
    } else if opencv::is_storage(fields) {
        Format::OpenCv
    } else {
        return None;
    })
}

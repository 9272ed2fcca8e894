//! Files that are taken for calibrations and are something else: what they are, and the file to
//! take instead.

use serde_json::Value;

use super::FormatError;

/// Advice for results that a program of Python holds.
const WRITE_JSON: &str = "write K, D and the frame size as JSON, or with cv2.FileStorage";
/// Advice for archives.
const UNPACK: &str = "unpack it and take the calibration file in it";
/// Advice for recordings of ROS.
const PRINT: &str = "print a camera_info message of it with `ros2 topic echo --once`";
/// Advice for images and documents.
const TAKE_RESULT: &str = "take the file with the result that the calibration program wrote";

/// Beginnings of binary files.
const BEGINNINGS: [(&[u8], &str, &str); 30] = [
    (b"\x93NUMPY", "a NumPy array (.npy)", WRITE_JSON),
    (b"\x1f\x8b", "a gzip archive", UNPACK),
    (b"BZh", "a bzip2 archive", UNPACK),
    (b"\xfd7zXZ", "an xz archive", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"\x80\x02", "a Python pickle", WRITE_JSON),
    (b"\x80\x03", "a Python pickle", WRITE_JSON),
    (b"\x80\x04", "a Python pickle", WRITE_JSON),
    (b"\x80\x05", "a Python pickle", WRITE_JSON),
    (b"(dp", "a Python pickle", WRITE_JSON),
    (b"(lp", "a Python pickle", WRITE_JSON),
    (b"MATLAB ", "a MATLAB file (.mat)", MATLAB),
    (b"\x89HDF", "an HDF5 or MATLAB file (.mat)", MATLAB),
    (b"#ROSBAG", "a recording of ROS", PRINT),
    (b"\x89MCAP", "a recording of ROS", PRINT),
    (
        b"SQLite format 3",
        "a database, as recordings of ROS 2 are",
        PRINT,
    ),
    (b"%PDF", "a PDF report", TAKE_RESULT),
    (b"%!PS", "a PostScript report", TAKE_RESULT),
    (b"\xff\xd8\xff", "a JPEG image", TAKE_RESULT),
    (b"\x89PNG", "a PNG image", TAKE_RESULT),
    (b"GIF8", "a GIF image", TAKE_RESULT),
    (b"BM", "a BMP image", TAKE_RESULT),
    (b"II*\0", "a TIFF image", TAKE_RESULT),
    (b"MM\0*", "a TIFF image", TAKE_RESULT),
    (b"RIFF", "an image or a video", TAKE_RESULT),
    (b"\xd0\xcf\x11\xe0", "an office document", TAKE_RESULT),
    (b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text", "save it as UTF-8"),
];
const MATLAB: &str = "write the intrinsics as JSON with jsonencode in MATLAB";

/// The problem of bytes that are not UTF-8 text.
pub(super) fn binary(bytes: &[u8]) -> FormatError {
    let contains = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    let (kind, advice) = if bytes.starts_with(b"PK\x03\x04") && contains(b".npy") {
        ("a NumPy archive (.npz)", WRITE_JSON)
    } else if bytes.starts_with(b"PK\x03\x04") {
        ("a ZIP archive", UNPACK)
    } else if bytes.get(4..8) == Some(b"ftyp") {
        ("a video or an image", TAKE_RESULT)
    } else if bytes.get(257..262) == Some(b"ustar") {
        ("a tar archive", UNPACK)
    } else if let Some(found) = beginning(bytes) {
        found
    } else if bytes.contains(&0) {
        (
            "a binary file",
            "take the text file, which is cameras.txt for COLMAP",
        )
    } else {
        ("text in another encoding than UTF-8", "save it as UTF-8")
    };
    problem(kind, advice)
}

fn beginning(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let found = BEGINNINGS
        .iter()
        .find(|(begin, ..)| bytes.starts_with(begin));
    found.map(|(_, kind, advice)| (*kind, *advice))
}

/// Parts of texts in no format, in small letters, and the kinds of their files.
const PARTS: &str = "\
calibration results | Kalibr's printed result: take its camchain.yaml
# ost version | the text of ROS' calibrator (ost.txt): take the ost.yaml beside it
camera matrix | the .ini form of ROS' camera_info: take its .yaml form (ost.yaml)
[surface | a configuration of nvdewarper, whose distortion is not OpenCV's: calibrate with cv::fisheye
# image list with | COLMAP's images.txt: take cameras.txt
# 3d point list | COLMAP's points3D.txt: take cameras.txt
!!python/ | settings of a Python program: take its result, as nerfstudio's transforms.json
array( | printed NumPy arrays or code: write K, D and the frame size as JSON, or with cv2.FileStorage
import  | program code: write K, D and the size as JSON, or with cv2.FileStorage
with properties: | MATLAB's printed result: write the intrinsics as JSON with jsonencode
intrinsic and extrinsic camera parameters | a script of MATLAB's toolbox: calibrate with cv::fisheye
# hugin project file | a Hugin project: calibrate with cv::fisheye
<calibration> | Metashape's XML: calibrate with cv::fisheye
<calibration type | Metashape's XML: calibrate with cv::fisheye
<lensdatabase | a database of Lensfun, whose models are not OpenCV's: calibrate with cv::fisheye
# rig calib list | COLMAP's rigs.txt: take cameras.txt
# frame list | COLMAP's frames.txt: take cameras.txt
pix4d | the camera of Pix4D, whose model is not OpenCV's: calibrate with cv::fisheye
[left_cam_ | the calibration of a ZED camera, an ordinary lens: calibrate with cv::fisheye
<html | a web page: take the file with the result that the calibration program wrote";

/// Fields of trees in no format, and the kinds of their files.
const FIELDS: &str = "\
target_type | the target of a Kalibr calibration: take its camchain.yaml
gyroscope_noise_density | the settings of an IMU: take Kalibr's camchain.yaml
R1 | the rotations of a stereo pair: take the file with its matrices (intrinsics.yml)
graph | a Meshroom project: take cameras.sfm of its StructureFromMotion node
shots | OpenSfM's reconstruction.json: take camera_models.json
img_name | cameras.json of Gaussian splatting, whose images are undistorted: take COLMAP's cameras.txt
camera_angle_x | a scene of ordinary images without a lens: take transforms.json with fl_x
sfm_data_version | OpenMVG's sfm_data.json: calibrate with cv::fisheye, or export cameras.txt of COLMAP
RadialDistortion | MATLAB's model of ordinary lenses: calibrate with estimateFisheyeParameters
transform | nerfstudio's dataparser_transforms.json: take transforms.json";

/// The problem of a text in no format: what it is, or the general one.
pub(super) fn text(text: &str, tree: Option<&Value>, general: FormatError) -> FormatError {
    if let Some((kind, advice)) = beginning(text.as_bytes()) {
        return problem(kind, advice);
    }
    let lower = text.to_ascii_lowercase();
    // A list is that of OpenSfM's reconstructions.
    let tree = tree.and_then(|tree| tree.get(0).or(Some(tree)));
    let has = |field: &str| tree.is_some_and(|tree| tree.get(field).is_some());
    let rows = |table: &'static str| table.lines().filter_map(|row| row.split_once(" | "));
    let part = rows(PARTS).find(|(part, _)| lower.contains(part));
    let found = part.or_else(|| rows(FIELDS).find(|(field, _)| has(field)));
    found.map_or(general, |(_, kind)| {
        FormatError::malformed(format!("it is {kind}"))
    })
}

fn problem(kind: &str, advice: &str) -> FormatError {
    FormatError::malformed(format!("it is {kind}: {advice}"))
}

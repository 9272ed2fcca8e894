//! Fuzzes calibration files, one importer at a time, with all uses of their cameras in the server.

use lookdown_calibration::{
    Calibration, CalibrationFile, FormatError,
    export::{Exported, Target},
    formats::{Camera, Format},
    native::NativeImage,
};
use lookdown_lens::geometry::Pixel;
use strum::VariantArray;

/// The importers, with the names of their folders of seeds and corpora.
pub const IMPORTERS: [(&str, Format); 23] = [
    ("native", Format::Native),
    ("kalibr", Format::Kalibr),
    ("opencv", Format::OpenCv),
    ("ros", Format::Ros),
    ("ocamcalib", Format::OCamCalib),
    ("py_ocamcalib", Format::PyOCamCalib),
    ("multicol", Format::MultiCol),
    ("colmap", Format::Colmap),
    ("camodocal", Format::Camodocal),
    ("basalt", Format::Basalt),
    ("woodscape", Format::WoodScape),
    ("nvidia_ftheta", Format::NvidiaFTheta),
    ("moil", Format::Moil),
    ("fisheye_calib_adapter", Format::FisheyeCalibAdapter),
    ("camera_intrinsic_model", Format::CameraIntrinsicModel),
    ("slam", Format::Slam),
    ("nerfstudio", Format::Nerfstudio),
    ("gyroflow", Format::Gyroflow),
    ("depthai", Format::DepthAi),
    ("opensfm", Format::OpenSfm),
    ("matlab", Format::Matlab),
    ("alicevision", Format::AliceVision),
    ("dso", Format::Dso),
];

/// Positions in a frame where its lens is tested, as fractions of its sides.
const PLACES: [f64; 5] = [0.0, 0.3, 0.5, 0.9, 1.0];

/// Reads `content` and uses its cameras; returns true if the importer of `format` read it.
pub fn read(format: Format, content: &[u8]) -> bool {
    let file = match CalibrationFile::parse(content) {
        Ok(file) => file,
        Err(refusal) => {
            check(&refusal);
            return false;
        }
    };
    if file.format != format {
        return false;
    }
    let checked = file.calibrations("fuzzed", content);
    assert_eq!(checked.len(), file.cameras.len());
    for (parsed, (_, checked)) in file.cameras.iter().zip(&checked) {
        match (&parsed.camera, checked) {
            (Ok(camera), Ok(calibration)) => {
                check_lens(calibration);
                write(camera, calibration, content.len());
            }
            (Err(refusal), _) | (_, Err(refusal)) => check(refusal),
        }
    }
    true
}

/// Checks that a refusal has a message of limited length.
fn check(refusal: &FormatError) {
    assert!((1..8_192).contains(&refusal.to_string().len()));
}

/// Writes the camera in one format, chosen by the size of its file, and reads it back: all formats
/// would take five times as long.
fn write(camera: &Camera, calibration: &Calibration, choice: usize) {
    let target = Target::VARIANTS[choice % Target::VARIANTS.len()];
    let (width, height) = calibration.image_size();
    let id = calibration.id().to_string();
    let written = target.write(&camera.to_native(id, NativeImage { width, height }));
    let Ok(Exported { content, .. }) = written else {
        return;
    };
    let again = CalibrationFile::parse(content.as_bytes());
    let again = again.unwrap_or_else(|error| panic!("{error} in {content}"));
    let [(_, checked)] = &again.calibrations("fuzzed", content.as_bytes())[..] else {
        panic!("one camera became several in {content}");
    };
    // Other formats cannot store the border of the lens image, without which it may be refused.
    if target == Target::Native
        && let Err(error) = checked
    {
        panic!("{error} in {content}");
    }
}

/// Checks that rays and pixels are finite wherever the lens is defined.
fn check_lens(calibration: &Calibration) {
    let (width, height) = calibration.image_size();
    assert!(calibration.warnings().len() < 10);
    // Half the size, for smaller frames of the same camera.
    let halved = calibration.for_frame(width.div_ceil(2), height.div_ceil(2));
    let halved = halved.ok().map(|geometry| {
        for mask in &geometry.areas.masks {
            assert!(mask.corners().iter().all(|corner| corner.x.is_finite()));
        }
        geometry.lens
    });
    for lens in std::iter::once(calibration.lens()).chain(&halved) {
        for (x, y) in PLACES.iter().flat_map(|x| PLACES.map(|y| (*x, y))) {
            let pixel = Pixel::new(x * f64::from(width), y * f64::from(height));
            let Some(ray) = lens.unproject(&pixel) else {
                continue;
            };
            assert!((ray.norm() - 1.0).abs() < 1e-6, "{ray} at {pixel}");
            let back = [lens.project(&ray), lens.project_to_rim(&ray)];
            for pixel in back.into_iter().flatten() {
                assert!(pixel.x.is_finite() && pixel.y.is_finite(), "{pixel}");
            }
        }
    }
}

//! Calibration files of every kind: the format is recognized from the content, each has one small
//! reader that turns the file into cameras of the native shape, and some have a writer.
//!
//! Each reader documents its format and the usual mistakes; `docs/calibrate.md` has the table.

mod alicevision;
mod angle_polynomial;
mod camera_file;
mod camera_matrix;
mod camodocal;
mod colmap;
mod document;
mod dso;
mod error;
mod fields;
mod foreign;
mod format;
mod kalibr;
mod named_parameters;
mod native_file;
mod nerfstudio;
mod ocam;
mod opencv;
mod opencv_xml;
mod opensfm;
mod recognize;
mod ros;
mod slam;

use serde_json::Value;

pub use camera_file::{CalibrationFile, Camera, FileCamera};
pub use error::FormatError;
pub use format::Format;

use self::{
    camera_file::{MAX_CAMERAS, alone},
    document::{Document, Syntax},
    fields::Fields,
    recognize::{recognize_lines, recognize_tree},
};
use super::native::NativeImage;

impl CalibrationFile {
    /// Recognizes and reads the content of a calibration file.
    ///
    /// # Errors
    /// [`FormatError`] when the content is in no format that is read, or not whole.
    pub fn parse(content: &[u8]) -> Result<Self, FormatError> {
        let (text, syntax) = document::text_of(content)?;
        let documents = document::documents(text, syntax);
        let file = read_document(documents[0], syntax)?;
        // Messages are printed one after the other; the first one stands for all.
        for text in &documents[1..] {
            if read_document(text, syntax).map(|another| another.format) != Ok(file.format) {
                return Err(FormatError::malformed(
                    "it has several YAML documents of different kinds: keep that of the camera",
                ));
            }
        }
        match file.cameras.len() {
            0 => Err(FormatError::invalid("cameras", "the file holds none")),
            1..=MAX_CAMERAS => Ok(file),
            count => Err(FormatError::invalid(
                "cameras",
                format!("the file holds {count}: at most {MAX_CAMERAS} are read"),
            )),
        }
    }

    /// Gives every camera the size of its frames, where the file has none.
    ///
    /// # Errors
    /// [`FormatError`] when the file has another one.
    pub fn assume_size(&mut self, size: NativeImage) -> Result<(), FormatError> {
        for camera in &mut self.cameras {
            // A camera that cannot be used says so when it is asked for.
            let Ok(camera) = &mut camera.camera else {
                continue;
            };
            let stated = *camera.image.get_or_insert(size);
            if stated != size {
                let NativeImage { width, height } = stated;
                let problem = format!("the file itself says {width}x{height}: leave the size out");
                return Err(FormatError::invalid("image", problem));
            }
        }
        Ok(())
    }
}

/// Reads one document.
fn read_document(text: &str, syntax: Syntax) -> Result<CalibrationFile, FormatError> {
    let document = document::parse(text, syntax);
    let tree = match document.map_err(|error| foreign::text(text, None, error))? {
        Document::Lines(text) => return read_lines(text),
        Document::Tree(tree) => tree,
    };
    let explained = |error| foreign::text(text, Some(&tree), error);
    let fields = Fields::new(&tree);
    let format = fields.as_ref().ok().and_then(recognize_tree);
    let (fields, format) = match (fields, format) {
        (Ok(fields), Some(format)) => (fields, format),
        (fields, _) => {
            // The advice of a file that is something else comes first.
            let unknown = fields.err().unwrap_or_else(unrecognized);
            let advice = explained(unknown.clone());
            if advice != unknown {
                return Err(advice);
            }
            return read_parts(&tree, 2).ok_or(unknown);
        }
    };
    if format == Format::Native {
        return native_file::read(&fields, text, syntax);
    }
    let cameras = read_tree(format, &fields)?;
    Ok(CalibrationFile { format, cameras })
}

/// Reads the entries of a list, or the content of an envelope, as those of a message or a variable,
/// where they are in a format: the first one's, with a camera for each.
fn read_parts(tree: &Value, depth: usize) -> Option<CalibrationFile> {
    let parts: Vec<(String, &Value)> = match tree {
        Value::Object(map) => map.iter().map(|(key, part)| (key.clone(), part)).collect(),
        Value::Array(parts) => (0..)
            .map(|index: usize| index.to_string())
            .zip(parts)
            .collect(),
        _ => Vec::new(),
    };
    let mut file: Option<CalibrationFile> = None;
    for (name, part) in parts {
        let fields = Fields::new(part).ok();
        let format = fields.as_ref().and_then(recognize_tree);
        let read = match (fields, format) {
            (Some(fields), Some(format)) if format != Format::Native => {
                let cameras = read_tree(format, &fields).ok();
                cameras.map(|cameras| CalibrationFile { format, cameras })
            }
            _ if depth > 1 => read_parts(part, depth - 1),
            _ => None,
        };
        let Some(mut read) = read else { continue };
        for camera in &mut read.cameras {
            camera.name.get_or_insert_with(|| name.clone());
        }
        match &mut file {
            None => file = Some(read),
            Some(file) if file.format == read.format => file.cameras.append(&mut read.cameras),
            Some(_) => {}
        }
    }
    file
}

fn unrecognized() -> FormatError {
    FormatError::malformed(
        "its fields are those of no format that is read (the native one, Kalibr, OpenCV, ROS, \
         OCamCalib, py-OCamCalib, COLMAP, camodocal, Basalt, WoodScape, NVIDIA f-theta, MOIL, \
         ORB-SLAM, OpenVSLAM, DSO, nerfstudio, gyroflow, DepthAI, OpenSfM, MATLAB and a few more)",
    )
}

fn read_lines(text: &str) -> Result<CalibrationFile, FormatError> {
    let format = recognize_lines(text).ok_or_else(unrecognized)?;
    let cameras = match format {
        Format::OCamCalib => alone(ocam::read(text)),
        Format::MultiCol => alone(ocam::read_multicol(text)),
        Format::Dso => alone(dso::read(text)),
        _ => colmap::read(text),
    };
    Ok(CalibrationFile { format, cameras })
}

fn read_tree(format: Format, fields: &Fields<'_>) -> Result<Vec<FileCamera>, FormatError> {
    Ok(match format {
        Format::Kalibr => kalibr::read(fields),
        Format::OpenCv => opencv::read(fields),
        Format::Ros => alone(ros::read(fields)),
        Format::PyOCamCalib => alone(ocam::read_python(fields)),
        Format::Camodocal => alone(camodocal::read(fields)),
        Format::Basalt => named_parameters::read_basalt(fields)?,
        Format::WoodScape => alone(angle_polynomial::read_woodscape(fields)),
        Format::NvidiaFTheta => alone(angle_polynomial::read_nvidia(fields)),
        Format::Moil => angle_polynomial::read_moil(fields),
        Format::FisheyeCalibAdapter => alone(named_parameters::read_fisheye_calib_adapter(fields)),
        Format::CameraIntrinsicModel => {
            alone(named_parameters::read_camera_intrinsic_model(fields))
        }
        Format::Slam => slam::read(fields),
        Format::Nerfstudio => nerfstudio::read(fields),
        Format::Gyroflow => alone(camera_matrix::read_gyroflow(fields)),
        Format::DepthAi => camera_matrix::read_depthai(fields)?,
        Format::OpenSfm => opensfm::read(fields),
        Format::Matlab => alone(ocam::read_matlab(fields)),
        Format::AliceVision => alicevision::read(fields),
        Format::Native | Format::OCamCalib | Format::MultiCol | Format::Colmap | Format::Dso => {
            Vec::new()
        }
    })
}

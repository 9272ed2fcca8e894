//! The native format, in JSON, YAML or TOML: the only one with an ID, a mount,
//! zones, lines, masks, areas and ignored places.

use super::{
    CalibrationFile, Camera, FileCamera, Format, FormatError,
    document::{Syntax, yaml},
    fields::Fields,
};
use lookdown_common::StoredFile;

use crate::native::NativeCalibration;

/// Reads the file once more from its text, so that an error names its place. A later version is
/// refused first, because its keys are not known here.
pub(super) fn read(
    fields: &Fields<'_>,
    text: &str,
    syntax: Syntax,
) -> Result<CalibrationFile, FormatError> {
    if let Some(version) = fields.map.get(StoredFile::KEY) {
        let checked = StoredFile::Calibration.check(&version.to_string());
        checked.map_err(|problem| {
            FormatError::invalid(StoredFile::KEY, format!("the calibration {problem}"))
        })?;
    }
    let parsed: Result<NativeCalibration, String> = match syntax {
        Syntax::Toml => toml::from_str(text)
            .map_err(|error| format!("{}: {}", first_line(&error), error.message())),
        Syntax::Yaml => yaml(text).map_err(|error| first_line(&error)),
        Syntax::Json | Syntax::Xml | Syntax::Lines => {
            serde_json::from_str(text).map_err(|error| error.to_string())
        }
    };
    let file = parsed.map_err(FormatError::malformed)?;
    Ok(CalibrationFile {
        format: Format::Native,
        cameras: vec![FileCamera {
            name: Some(file.id),
            camera: Ok(Camera {
                image: Some(file.image),
                lens: file.lens,
                mount: file.mount,
                zones: file.zones,
                lines: file.lines,
                masks: file.masks,
                areas: file.areas,
                ignore: file.ignore,
                detect: file.detect,
                sources: file.sources,
                notes: Vec::new(),
            }),
        }],
    })
}

/// Returns the message of a parser without its drawing of the place.
fn first_line(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

//! Model manifests: what a model is, beside its ONNX file.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::InferenceError;
use crate::imaging::ChannelOrder;

/// The manifest's name in a model's folder.
const FILE_NAME: &str = "model.toml";

/// What a model is and where it comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelManifest {
    /// The model's name in reports.
    pub name: String,
    /// The ONNX file, relative to the manifest.
    pub onnx: PathBuf,
    /// SPDX identifier of the weights' licence.
    pub licence: String,
    /// Where the weights come from.
    pub source: String,
    /// How pixels become network input.
    #[serde(default)]
    pub input: ManifestInput,
}

/// How pixels become network input: `pixel · scale + offset`, per plane.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ManifestInput {
    /// Order of the colour planes.
    pub channel_order: ChannelOrder,
    /// Factor per plane.
    pub scale: [f32; 3],
    /// Offset per plane.
    pub offset: [f32; 3],
}

impl Default for ManifestInput {
    fn default() -> Self {
        Self {
            channel_order: ChannelOrder::Rgb,
            scale: [1.0; 3],
            offset: [0.0; 3],
        }
    }
}

impl ModelManifest {
    /// Reads the manifest of a model's folder, or makes one for a bare ONNX file (RGB, 0 to 255).
    /// The manifest's `onnx` comes back as a path that can be opened.
    ///
    /// # Errors
    /// [`InferenceError`] when the manifest is missing or malformed.
    pub fn locate(model_path: &Path) -> Result<Self, InferenceError> {
        let unreadable = |path: &Path, detail: String| InferenceError::Unreadable {
            path: path.to_owned(),
            detail,
        };
        if model_path
            .extension()
            .is_some_and(|ending| ending == "onnx")
        {
            let stem = model_path.file_stem().unwrap_or_default();
            return Ok(Self {
                name: stem.to_string_lossy().into_owned(),
                onnx: model_path.to_owned(),
                licence: "unknown".to_owned(),
                source: "given by path".to_owned(),
                input: ManifestInput::default(),
            });
        }
        let path = model_path.join(FILE_NAME);
        let text =
            std::fs::read_to_string(&path).map_err(|error| unreadable(&path, error.to_string()))?;
        let manifest: Self =
            toml::from_str(&text).map_err(|error| unreadable(&path, error.to_string()))?;
        Ok(Self {
            onnx: model_path.join(&manifest.onnx),
            ..manifest
        })
    }
}

//! Model manifests, which describe the models in ONNX files.

use std::{
    num::NonZeroU32,
    path::{Component, Path, PathBuf},
};

use lookdown_common::files;
use lookdown_imaging::ChannelOrder;
use serde::Deserialize;
use strum::Display;

use super::{InferenceError, heads::Head};

/// The manifest's name in a model's folder.
pub const FILE_NAME: &str = "model.toml";
/// Longest manifest, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Description and origin of a model. Fields that the ONNX file contains are optional.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelManifest {
    /// The model's name in requests and reports: letters, digits, `_`, `-` and `.`, at most 64.
    pub name: String,
    /// The ONNX file, relative to the manifest and within its folder.
    pub onnx: PathBuf,
    /// The ONNX file's SHA-256, hexadecimal. A file with a different one is refused.
    #[serde(default)]
    pub sha256: Option<String>,
    /// SPDX identifier of the weights' license. Manifests of earlier versions call it `licence`.
    #[serde(default, alias = "licence")]
    pub license: Option<String>,
    /// Origin of the weights.
    #[serde(default)]
    pub source: Option<String>,
    /// Conversion of pixels to network input.
    #[serde(default)]
    pub input: ManifestInput,
    /// Decoder of the outputs.
    #[serde(default)]
    pub output: Head,
}

impl ModelManifest {
    /// Locates and reads the manifest of `model`: a folder with a `model.toml`, that file itself,
    /// or an ONNX file. An ONNX file without a manifest that names it gets a default manifest. The
    /// returned `onnx` is a path that can be opened.
    ///
    /// # Errors
    /// [`InferenceError`] when the manifest is missing or malformed, or names an ONNX file outside
    /// its folder.
    pub fn locate(model: &Path) -> Result<Self, InferenceError> {
        if model.is_dir() {
            return Self::read(model);
        }
        let folder = model.parent().unwrap_or(Path::new(""));
        if model.file_name().is_some_and(|name| name == FILE_NAME) {
            return Self::read(folder);
        }
        if model.extension().is_none_or(|ending| ending != "onnx") {
            return Self::read(model);
        }
        if folder.join(FILE_NAME).is_file() {
            let manifest = Self::read(folder)?;
            if manifest.onnx.file_name() == model.file_name() {
                return Ok(manifest);
            }
        }
        let stem = model.file_stem().unwrap_or_default();
        Ok(Self {
            name: name_from(&stem.to_string_lossy()),
            onnx: model.to_owned(),
            sha256: None,
            license: None,
            source: None,
            input: ManifestInput::default(),
            output: Head::default(),
        })
    }

    fn read(folder: &Path) -> Result<Self, InferenceError> {
        let path = folder.join(FILE_NAME);
        let unreadable = |detail: String| InferenceError::Unreadable {
            path: path.clone(),
            detail,
        };
        let unusable = |problem: String| InferenceError::Unusable {
            path: path.clone(),
            problem,
        };
        if let (false, Some(network)) = (path.exists(), own_model(folder)) {
            return Err(InferenceError::NoManifest { path, network });
        }
        let text =
            files::read_text(&path, MAX_BYTES).map_err(|error| unreadable(error.to_string()))?;
        let manifest: Self =
            toml::from_str(&text).map_err(|error| unusable(one_line(&error, &text)))?;
        manifest.check().map_err(unusable)?;
        let onnx = within(folder, &manifest.onnx).map_err(unusable)?;
        Ok(Self { onnx, ..manifest })
    }

    fn check(&self) -> Result<(), String> {
        if !is_name(&self.name) {
            return Err(format!(
                "name is {:?}: use 1 to {MAX_NAME} letters, digits, _, - and .",
                self.name
            ));
        }
        if let Some(sum) = self.sha256.as_ref().filter(|sum| !is_sum(sum)) {
            return Err(format!("sha256 is {sum:?}: use 64 hexadecimal digits"));
        }
        self.input.normalization().map(drop)
    }
}

/// Returns true for the SHA-256 of a file in hexadecimal digits.
fn is_sum(sum: &str) -> bool {
    sum.len() == 64 && sum.chars().all(|c| c.is_ascii_hexdigit())
}

/// Returns an ONNX file of a folder.
fn own_model(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    paths.find(|path| path.extension().is_some_and(|ending| ending == "onnx"))
}

/// Longest name of a model, characters.
const MAX_NAME: usize = 64;

/// Returns true if the name is valid for a model. It becomes a folder, a label and a part of a URL.
pub(super) fn is_name(name: &str) -> bool {
    let usable = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    (1..=MAX_NAME).contains(&name.len()) && !name.starts_with('.') && name.chars().all(usable)
}

/// Makes a valid name from a file name.
pub fn name_from(stem: &str) -> String {
    let usable = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let name: String = stem
        .chars()
        .take(MAX_NAME)
        .map(|c| if usable(c) { c } else { '_' })
        .collect();
    if name.is_empty() {
        "model".to_owned()
    } else {
        name
    }
}

/// Returns the path of `file` in `folder` with symbolic links resolved, or an error if it is
/// outside.
fn within(folder: &Path, file: &Path) -> Result<PathBuf, String> {
    let outside = || {
        format!(
            "onnx is {:?}: the file must be in the manifest's own folder",
            file.display().to_string()
        )
    };
    let plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if !file.components().all(plain) {
        return Err(outside());
    }
    let path = folder.join(file);
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(real), Ok(folder)) if !real.starts_with(&folder) => Err(outside()),
        // A missing file is reported when it is read.
        _ => Ok(path),
    }
}

/// Formats a TOML error as one sentence with its line.
fn one_line(error: &toml::de::Error, text: &str) -> String {
    let message = error.message().replace('\n', " ");
    let before = error.span().and_then(|span| text.get(..span.start));
    match before {
        Some(before) => format!("line {}: {message}", before.matches('\n').count() + 1),
        None => message,
    }
}

/// Conversion of pixels to network input. With pixels 0 to 255, each value is either
/// `pixel · scale + offset` or `(pixel − mean) / std`, per plane in the network's plane order.
///
/// ```toml
/// [input]                    # optional
/// name = "images"            # default: the model's only input
/// width = 640                # required if the model leaves it open
/// height = 640
/// stride = 32                # sides of open models must be multiples of it
/// batch = 1                  # for models that wrongly declare any number of views
/// layout = "nchw"            # or "nhwc"; default: from the axis with the 3 planes
/// channel_order = "rgb"      # default; or "bgr"
/// scale = [0.00392156863, 0.00392156863, 0.00392156863]   # default: ones
/// offset = [0.0, 0.0, 0.0]                                # default: zeros
/// # or, instead of scale and offset:
/// # mean = [123.675, 116.28, 103.53]
/// # std = [58.395, 57.12, 57.375]
/// ```
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ManifestInput {
    /// The input that takes the image. Default: the only one.
    pub name: Option<String>,
    /// Width, pixels. Required if the model leaves it open.
    pub width: Option<NonZeroU32>,
    /// Height, pixels. Required if the model leaves it open.
    pub height: Option<NonZeroU32>,
    /// Divisor of the input sides, in pixels, for models that leave the sides open.
    pub stride: Option<NonZeroU32>,
    /// Views per run, for models that leave it open. Default: any number.
    pub batch: Option<NonZeroU32>,
    /// Order of the axes, for models that leave them open.
    pub layout: Option<Layout>,
    /// Order of the color planes.
    pub channel_order: ChannelOrder,
    /// Factor per plane.
    pub scale: Option<[f32; 3]>,
    /// Offset per plane.
    pub offset: Option<[f32; 3]>,
    /// Value subtracted per plane.
    pub mean: Option<[f32; 3]>,
    /// Divisor per plane, applied after the subtraction.
    pub std: Option<[f32; 3]>,
}

/// The order of an input's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Layout {
    /// `[views, 3, height, width]`
    Nchw,
    /// `[views, height, width, 3]`
    Nhwc,
}

impl ManifestInput {
    /// Factor and offset per plane.
    ///
    /// # Errors
    /// One sentence when both pairs are used at once, a number is not finite or a divisor is 0.
    pub(in crate::inference) fn normalization(&self) -> Result<([f32; 3], [f32; 3]), String> {
        let one_way = self.scale.is_some() || self.offset.is_some();
        let other_way = self.mean.is_some() || self.std.is_some();
        if one_way && other_way {
            return Err("[input] has scale or offset as well as mean or std: use one pair".into());
        }
        let (scale, offset) = if other_way {
            let mean = self.mean.unwrap_or([0.0; 3]);
            let std = self.std.unwrap_or([1.0; 3]);
            let scale = std.map(|std| 1.0 / std);
            (
                scale,
                std::array::from_fn(|plane| -mean[plane] / std[plane]),
            )
        } else {
            (
                self.scale.unwrap_or([1.0; 3]),
                self.offset.unwrap_or([0.0; 3]),
            )
        };
        let usable = scale
            .iter()
            .all(|factor| factor.is_finite() && *factor != 0.0)
            && offset.iter().all(|offset| offset.is_finite());
        if !usable {
            return Err("[input] has a scale or std of 0, or a number that is not finite".into());
        }
        Ok((scale, offset))
    }
}

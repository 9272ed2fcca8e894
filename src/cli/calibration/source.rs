//! The cameras of the file that a command reads.
//!
//! Frames from image files.
//!
//! The output files of calibrations.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::Args;
use lookdown_calibration::{
    Calibration, CalibrationFile, CalibrationId, FormatError,
    export::Target,
    formats::{FileCamera, Format},
    native::{NativeCalibration, NativeImage},
    read_content,
    warning::Warning,
};
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

use crate::{calibration_store::defaults, cli::progress::write_or_print};

/// The arguments that select a file, and a camera of it.
#[derive(Debug, Args)]
pub(super) struct Source {
    /// A calibration file; its format is detected from its content
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Camera of a file with several cameras
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Frame size in pixels, for formats that do not contain it
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Option<NativeImage>,
}

/// The cameras of a file.
pub(super) struct Cameras {
    pub(super) format: Format,
    pub(super) cameras: Vec<NamedCamera>,
}

/// A camera as stated in the file, and as it was interpreted.
pub(super) struct NamedCamera {
    /// Its ID in a calibration folder.
    pub(super) id: String,
    pub(super) stated: FileCamera,
    pub(super) checked: Result<Calibration, FormatError>,
}

impl Source {
    /// The only camera of a file.
    pub(super) fn new(file: PathBuf) -> Self {
        Self {
            file,
            camera: None,
            size: None,
        }
    }

    /// Reads the file: the requested camera, or all.
    pub(super) fn read(&self) -> anyhow::Result<Cameras> {
        let path = self.file.display();
        let content = read_content(&self.file)?;
        let mut file = CalibrationFile::parse(&content).with_context(|| path.to_string())?;
        if let Some(size) = self.size {
            file.assume_size(size).context("--size")?;
        }
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        let checked = file.calibrations(&stem, &content);
        let cameras = file.cameras.into_iter().zip(checked);
        let mut cameras: Vec<_> = cameras
            .map(|(stated, (id, checked))| NamedCamera {
                id,
                checked: checked.and_then(|calibration| {
                    if let Ok(camera) = &stated.camera {
                        defaults(&camera.detect)?;
                    }
                    Ok(calibration)
                }),
                stated,
            })
            .collect();
        if let Some(wanted) = &self.camera {
            let names: Vec<_> = cameras.iter().map(NamedCamera::name).collect();
            let Some(index) = names.iter().position(|name| name == wanted) else {
                bail!("--camera: {path} holds {}, not {wanted}", names.join(", "));
            };
            cameras = vec![cameras.swap_remove(index)];
        }
        Ok(Cameras {
            format: file.format,
            cameras,
        })
    }

    /// Reads the only camera of the file, or the requested one.
    pub(super) fn read_one(&self) -> anyhow::Result<(Format, NamedCamera)> {
        let Cameras { format, cameras } = self.read()?;
        match <[NamedCamera; 1]>::try_from(cameras) {
            Ok([camera]) => Ok((format, camera)),
            Err(several) => {
                let names: Vec<_> = several.iter().map(NamedCamera::name).collect();
                bail!(
                    "{} holds {} cameras: choose one with --camera: {}",
                    self.file.display(),
                    names.len(),
                    names.join(", ")
                )
            }
        }
    }

    /// Reads the only camera of the file, or the requested one, as the content of a native file
    /// with this ID or its own one. Returns the notes of the reader, too.
    pub(super) fn read_native(
        &self,
        id: Option<&CalibrationId>,
    ) -> anyhow::Result<(NativeCalibration, Vec<Warning>)> {
        let path = self.file.display();
        let (_, camera) = self.read_one()?;
        let calibration = camera.checked.with_context(|| path.to_string())?;
        let stated = camera.stated.camera.with_context(|| path.to_string())?;
        let (width, height) = calibration.image_size();
        let id = id.unwrap_or(calibration.id()).to_string();
        let native = stated.to_native(id, NativeImage { width, height });
        Ok((native, stated.notes))
    }
}

impl NamedCamera {
    fn name(&self) -> String {
        self.stated.name.clone().unwrap_or_else(|| self.id.clone())
    }
}

/// Decodes a frame from an image file.
pub(super) fn read_frame(path: &Path) -> anyhow::Result<Frame> {
    let encoded = files::read(path, MAX_IMAGE_BYTES).context("the file cannot be read")?;
    Ok(decode(&encoded, &DecodeLimits::default())?.frame)
}

/// Reads the frames of one camera, which must have one size.
pub(super) fn read_frames(paths: &[PathBuf]) -> anyhow::Result<(NativeImage, Vec<Frame>)> {
    let mut frames: Vec<Frame> = Vec::with_capacity(paths.len());
    for path in paths {
        let frame = read_frame(path).with_context(|| path.display().to_string())?;
        if let Some(first) = frames.first()
            && (frame.width(), frame.height()) != (first.width(), first.height())
        {
            bail!(
                "{}: {}x{} pixels, but the first frame has {}x{}: give frames of one camera at one \
                 size",
                path.display(),
                frame.width(),
                frame.height(),
                first.width(),
                first.height()
            );
        }
        frames.push(frame);
    }
    let first = frames.first().context("give at least one frame")?;
    let (width, height) = (first.width(), first.height());
    Ok((NativeImage { width, height }, frames))
}

/// Refuses an output file that is one of the frames.
pub(super) fn refuse_input(
    option: &str,
    out: Option<&Path>,
    frames: &[PathBuf],
) -> anyhow::Result<()> {
    let real = |path: &Path| path.canonicalize().ok();
    let Some(written) = out.and_then(real) else {
        return Ok(());
    };
    let is_frame = frames
        .iter()
        .any(|frame| real(frame).as_ref() == Some(&written));
    ensure!(
        !is_frame,
        "{option}: {} is a frame: name another file",
        written.display()
    );
    Ok(())
}

/// Writes a calibration into the file of `--out`, by default to standard output.
pub(super) fn write_native(
    calibration: &NativeCalibration,
    out: Option<&Path>,
) -> anyhow::Result<()> {
    write_or_print("--out", out, &Target::Native.write(calibration)?.content)
}

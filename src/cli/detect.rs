//! `lookdown detect`

mod labels;
mod pictures;

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use anyhow::{Context, bail};
use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use strum::VariantArray;

use self::{
    labels::Labels,
    pictures::{Picture, pictures},
};
use super::{
    SettingsFile, annotate,
    parameters::{ParameterFlags, PictureFlags},
    progress::Progress,
};
use crate::{
    annotation_formats::{AnnotationFormat, BoxKind},
    api::Report,
    app::engine_for,
    calibration::{Calibration, CalibrationId},
    pipeline::{DetectJob, DetectParameters, Detected, Engine, JobImage},
};

/// Arguments of `lookdown detect`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Pictures (JPEG, PNG or WebP), and folders with pictures in them. A report's `request_id`
    /// is the path as given here
    #[arg(required = true, value_name = "IMAGE|FOLDER")]
    images: Vec<PathBuf>,
    /// A calibration file, or the ID of one in the calibration folder [default: the lens circle
    /// is found and an ideal lens assumed]
    #[arg(long, value_name = "FILE|ID")]
    calibration: Option<String>,
    #[command(flatten)]
    parameters: ParameterFlags,
    /// Also draw the persons into the picture; takes a single IMAGE
    #[arg(long, value_name = "OUT.jpg|OUT.png")]
    annotate: Option<PathBuf>,
    #[command(flatten)]
    picture: PictureFlags,
    /// Write annotations to be corrected in the usual tools, into the folder --out, instead of
    /// reports
    #[arg(long, value_name = "FORMAT", requires = "out", value_parser = annotation_format())]
    format: Option<AnnotationFormat>,
    /// The folder for --format
    #[arg(long, value_name = "FOLDER", requires = "format")]
    out: Option<PathBuf>,
    /// Write boxes turned along the persons; with --format cvat
    #[arg(long, requires = "format")]
    oriented: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Parses the name of an annotation format. The help describes each of them.
fn annotation_format() -> impl TypedValueParser<Value = AnnotationFormat> {
    let formats = AnnotationFormat::VARIANTS.iter();
    let values = formats.map(|format| {
        let description = format.description().trim_end_matches('.');
        PossibleValue::new(format.to_string()).help(description)
    });
    PossibleValuesParser::new(values).try_map(|name| name.parse::<AnnotationFormat>())
}

/// Reports on every picture; those that cannot be used cost the exit code, not the others.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let pictures = pictures(&arguments.images)?;
    if arguments.annotate.is_some() && pictures.len() > 1 {
        bail!("--annotate draws one picture: give a single IMAGE, or leave it out");
    }
    let (parameters, calibration) = parameters(arguments)?;
    let options = arguments.picture.check()?;
    let mut labels = labels(arguments, &pictures)?;
    let settings = arguments.settings_file.load()?;
    let max_bytes = settings.server.max_body_bytes as u64;
    let engine = engine_for(&settings, std::slice::from_ref(&parameters))?;
    // Reports show by themselves how far it is.
    let progress = labels
        .as_ref()
        .map(|_| Progress::start(parameters.profile.name(), pictures.len()));
    let mut code = ExitCode::SUCCESS;
    for picture in &pictures {
        let path = &picture.path;
        match detect(&engine, path, max_bytes, &parameters, calibration.clone()) {
            Ok(detected) => {
                match &mut labels {
                    Some(labels) => labels.add(picture, &detected.report),
                    None => print(&detected)?,
                }
                if let Some(path) = &arguments.annotate {
                    annotate::write(detected, &options, path)?;
                }
            }
            Err(error) => {
                eprintln!("lookdown: {}: {error:#}", path.display());
                code = ExitCode::FAILURE;
            }
        }
        if let Some(progress) = &progress {
            progress.advance();
        }
    }
    if let Some(progress) = progress {
        progress.finish();
    }
    if let Some(labels) = labels {
        labels.write()?;
    }
    Ok(code)
}

/// Returns the label output requested by `--format`, `--out` and `--oriented`.
fn labels(arguments: &Arguments, pictures: &[Picture]) -> anyhow::Result<Option<Labels>> {
    let (Some(format), Some(folder)) = (arguments.format, &arguments.out) else {
        return Ok(None);
    };
    let boxes = match arguments.oriented {
        false => BoxKind::AxisParallel,
        true if format.has_oriented_boxes() => BoxKind::Oriented,
        true => bail!("--oriented: {format} has no turned boxes; use --format cvat"),
    };
    Labels::start(format, boxes, folder, pictures).map(Some)
}

/// The checked parameters, with the calibration when `--calibration` names a file.
fn parameters(
    arguments: &Arguments,
) -> anyhow::Result<(DetectParameters, Option<Arc<Calibration>>)> {
    let check = |id| arguments.parameters.check(id);
    let Some(named) = arguments.calibration.as_deref() else {
        return Ok((check(None)?, None));
    };
    let path = Path::new(named);
    if path.is_file() {
        let calibration = Calibration::read(path)?;
        let parameters = check(Some(calibration.id().as_str()))?;
        return Ok((parameters, Some(Arc::new(calibration))));
    }
    if named.parse::<CalibrationId>().is_err() {
        bail!("--calibration: {named:?} is neither a file nor a calibration's ID");
    }
    Ok((check(Some(named))?, None))
}

fn detect(
    engine: &Engine,
    image: &Path,
    max_bytes: u64,
    parameters: &DetectParameters,
    calibration: Option<Arc<Calibration>>,
) -> anyhow::Result<Detected> {
    let bytes = fs::metadata(image)
        .context("the file cannot be read")?
        .len();
    if bytes > max_bytes {
        bail!("the file has {bytes} bytes: server.max_body_bytes allows {max_bytes}");
    }
    let encoded = fs::read(image).context("the file cannot be read")?;
    Ok(engine.detect(&DetectJob::local(
        image.display().to_string(),
        JobImage::Encoded(encoded.into()),
        parameters.clone(),
        calibration,
    ))?)
}

fn print(detected: &Detected) -> anyhow::Result<()> {
    let report = serde_json::to_string(&Report::from(&detected.report))?;
    writeln!(io::stdout(), "{report}").context("standard output cannot be written")
}

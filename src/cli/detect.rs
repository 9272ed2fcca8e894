//! `lookdown detect`
//!
//! The images to detect people in: files as they are named, folders with all that is in them.

pub(super) mod stream;

use std::{
    collections::HashMap,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
    time::Duration,
};

use anyhow::{Context, bail};
use bytes::Bytes;
use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use lookdown_calibration::{Calibration, CalibrationId};
use lookdown_common::files::{self, IMAGE_ENDINGS, has_ending};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectedFrame, DetectionReport, Engine, JobImage},
};
use strum::VariantArray;

use self::stream::{Stream, StreamReader, interval};
use super::{
    SettingsFile,
    annotate::{self, AnnotatedVideo},
    parameters::{AnnotationFlags, ParameterFlags},
    progress::{Progress, UNWRITABLE, with_causes},
};
use crate::{
    annotation_formats::{AnnotatedImage, AnnotationFormat, BoxKind},
    api::to_report,
    app::engine_for,
};

/// Arguments of `lookdown detect`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Images (JPEG, PNG or WebP), and folders with images in them; or a video; or `-` for an image
    /// or JPEG files on standard input. A report's `request_id` is the path as given here, for a
    /// video with the position, such as `clip.mp4#t=2.000`
    #[arg(required = true, value_name = "IMAGE|FOLDER|VIDEO|-")]
    images: Vec<PathBuf>,
    /// The interval between two frames of a video, such as 500ms [default: 1s]
    #[arg(long, value_name = "DURATION", value_parser = interval)]
    every: Option<Duration>,
    /// A calibration file, or the ID of one in the calibration folder [default: the lens circle
    /// is found and an ideal lens assumed]
    #[arg(long, value_name = "FILE|ID")]
    calibration: Option<String>,
    #[command(flatten)]
    parameters: ParameterFlags,
    /// Also draw the persons into the image, or into the frames of a video; takes a single IMAGE or
    /// VIDEO
    #[arg(long, value_name = "OUT.jpg|OUT.png|OUT.mp4")]
    annotate: Option<PathBuf>,
    #[command(flatten)]
    annotation: AnnotationFlags,
    /// Write annotations to be corrected in the usual tools, into the folder --out, instead of
    /// reports
    #[arg(long, value_name = "FORMAT", requires = "out", value_parser = annotation_format())]
    format: Option<AnnotationFormat>,
    /// The folder for --format
    #[arg(long, value_name = "FOLDER", requires = "format")]
    out: Option<PathBuf>,
    /// Write boxes rotated along the persons, for example YOLO OBB with --format yolo
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

/// Reports on every image; those that cannot be used cost the exit code, not the others.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    if let Some(stream) = Stream::among(&arguments.images)? {
        return run_stream(arguments, &stream);
    }
    if arguments.every.is_some() {
        bail!("--every is the interval of a video: leave it out, or give a single video");
    }
    let image_files = image_files(&arguments.images)?;
    if arguments.annotate.is_some() && image_files.len() > 1 {
        bail!("--annotate draws one image: give a single IMAGE, or leave it out");
    }
    arguments
        .annotate
        .as_deref()
        .map(annotate::format_of)
        .transpose()?;
    let (parameters, calibration) = parameters(arguments)?;
    let options = arguments.annotation.check()?;
    let mut labels = labels(arguments, &image_files)?;
    let settings = arguments.settings_file.load()?;
    let max_bytes = settings.server.max_body_bytes as u64;
    let engine = engine_for(&settings, std::slice::from_ref(&parameters))?;
    // Reports show by themselves how far it is.
    let progress = labels
        .as_ref()
        .map(|_| Progress::start(parameters.profile.name(), image_files.len()));
    let mut code = ExitCode::SUCCESS;
    for image_file in &image_files {
        let path = &image_file.path;
        let found = read(path, max_bytes).and_then(|image| {
            let name = path.display().to_string();
            detect(&engine, name, image, &parameters, calibration.clone())
        });
        match found {
            Ok(detected) => {
                match &mut labels {
                    Some(labels) => labels.add(image_file, &detected.report),
                    None => print(&detected)?,
                }
                if let Some(path) = &arguments.annotate {
                    annotate::write(detected, &options, path)?;
                }
            }
            Err(error) => {
                eprintln!("lookdown: {}: {}", path.display(), with_causes(&error));
                code = ExitCode::FAILURE;
            }
        }
        if let Some(progress) = &progress {
            progress.advance();
        }
    }
    if let Some(labels) = labels {
        labels.write()?;
    }
    Ok(code)
}

/// Reports on every frame of a video or of standard input, in order. A frame that cannot be used
/// costs the exit code, not the others.
fn run_stream(arguments: &Arguments, stream: &Stream) -> anyhow::Result<ExitCode> {
    let is_video = matches!(stream, Stream::Video(_));
    if arguments.format.is_some() {
        bail!("--format takes images: leave it out for a video and for standard input");
    }
    if arguments.every.is_some() && !is_video {
        bail!("--every is the interval of a video: leave it out for standard input");
    }
    let (parameters, calibration) = parameters(arguments)?;
    let options = arguments.annotation.check()?;
    let settings = arguments.settings_file.load()?;
    let engine = engine_for(&settings, std::slice::from_ref(&parameters))?;
    let mut reader = StreamReader::open(stream, arguments.every)?;
    let mut video = match &arguments.annotate {
        Some(path) if is_video => {
            Some(AnnotatedVideo::create(path, reader.every, &reader.runtime)?)
        }
        _ => None,
    };
    let mut code = ExitCode::SUCCESS;
    let mut frames = 0_u64;
    while let Some(frame) = reader.next_frame()? {
        frames += 1;
        let name = frame.name;
        let found = detect(
            &engine,
            name.clone(),
            frame.image,
            &parameters,
            calibration.clone(),
        );
        match found {
            Ok(detected) => {
                print(&detected)?;
                match (&mut video, &arguments.annotate) {
                    (Some(video), _) => video.append(detected, &options, &reader.runtime)?,
                    (None, Some(_)) if frames > 1 => {
                        bail!(
                            "--annotate: standard input has several images: give one, or a video"
                        );
                    }
                    (None, Some(path)) => annotate::write(detected, &options, path)?,
                    (None, None) => {}
                }
            }
            Err(error) => {
                eprintln!("lookdown: {name}: {}", with_causes(&error));
                code = ExitCode::FAILURE;
            }
        }
        if let Some(progress) = &reader.progress {
            progress.advance();
        }
    }
    if frames == 0 {
        bail!("there is no image: give a JPEG, PNG or WebP image, or a video");
    }
    if let Some(video) = video {
        video.finish(&reader.runtime)?;
    }
    reader.end();
    Ok(code)
}

/// Returns the label output requested by `--format`, `--out` and `--oriented`.
fn labels(arguments: &Arguments, image_files: &[ImageFile]) -> anyhow::Result<Option<Labels>> {
    let (Some(format), Some(folder)) = (arguments.format, &arguments.out) else {
        return Ok(None);
    };
    let boxes = match arguments.oriented {
        false => BoxKind::AxisParallel,
        true if format.has_oriented_boxes() => BoxKind::Oriented,
        true => bail!(
            "--oriented: {format} has no oriented boxes: use --format with one of {}",
            AnnotationFormat::names_with_oriented_boxes()
        ),
    };
    Labels::start(format, boxes, folder, image_files).map(Some)
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

/// Reads an image file within the limit.
fn read(image: &Path, max_bytes: u64) -> anyhow::Result<Bytes> {
    let bytes = fs::metadata(image)
        .context("the file cannot be read")?
        .len();
    if bytes > max_bytes {
        bail!("the file has {bytes} bytes: server.max_body_bytes allows {max_bytes}");
    }
    let encoded = files::read(image, max_bytes).context("the file cannot be read")?;
    Ok(encoded.into())
}

fn detect(
    engine: &Engine,
    name: String,
    image: Bytes,
    parameters: &DetectParameters,
    calibration: Option<Arc<Calibration>>,
) -> anyhow::Result<DetectedFrame> {
    Ok(engine.detect(&DetectJob::local(
        name,
        JobImage::Encoded(image),
        parameters.clone(),
        calibration,
    ))?)
}

fn print(detected: &DetectedFrame) -> anyhow::Result<()> {
    let report = serde_json::to_string(&to_report(&detected.report))?;
    writeln!(io::stdout(), "{report}").context(UNWRITABLE)
}

/// The annotations of one run.
struct Labels {
    format: AnnotationFormat,
    boxes: BoxKind,
    folder: PathBuf,
    images: Vec<AnnotatedImage>,
}

impl Labels {
    /// No annotations yet. Looking takes long, so that what would fail at the end fails now.
    ///
    /// # Errors
    /// Returns an error if two images would share a name or a file, or `folder` cannot be made.
    fn start(
        format: AnnotationFormat,
        boxes: BoxKind,
        folder: &Path,
        image_files: &[ImageFile],
    ) -> anyhow::Result<Self> {
        let mut taken: HashMap<String, &Path> = HashMap::new();
        for image_file in image_files {
            let own_file = format.own_file(&image_file.name);
            let place = own_file.unwrap_or_else(|| image_file.name.clone());
            if let Some(other) = taken.insert(place, &image_file.path) {
                bail!(
                    "--format {format}: {} and {} would share their annotations: rename one, or \
                     name the folder above both",
                    other.display(),
                    image_file.path.display()
                );
            }
        }
        fs::create_dir_all(folder).with_context(|| unwritable(folder))?;
        Ok(Self {
            format,
            boxes,
            folder: folder.to_owned(),
            images: Vec::with_capacity(image_files.len()),
        })
    }

    /// Takes in what was found in an image.
    fn add(&mut self, image_file: &ImageFile, report: &DetectionReport) {
        let image = AnnotatedImage::new(report, image_file.name.clone());
        self.images.push(image);
    }

    /// Writes the files.
    fn write(&self) -> anyhow::Result<()> {
        for file in self.format.files(&self.images, self.boxes) {
            let path = self.folder.join(&file.path);
            let folder = path.parent().unwrap_or(&self.folder);
            fs::create_dir_all(folder).with_context(|| unwritable(folder))?;
            fs::write(&path, file.content).with_context(|| unwritable(&path))?;
        }
        Ok(())
    }
}

fn unwritable(path: &Path) -> String {
    format!("--out: {} cannot be written", path.display())
}

/// The maximum number of images of one run.
const MAX_IMAGES: usize = 100_000;
/// Most folders within each other.
const MAX_DEPTH: usize = 32;

/// An image to detect people in.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ImageFile {
    /// Its file.
    pub path: PathBuf,
    /// Its path from the folder that was named, with `/` between its parts.
    pub name: String,
}

/// The files among `paths`, and the images below the folders among them in the order of their
/// names. Hidden files and folders are left out, and links to folders are not followed.
fn image_files(paths: &[PathBuf]) -> anyhow::Result<Vec<ImageFile>> {
    let mut image_files = Vec::new();
    for path in paths {
        if path.is_dir() {
            let before = image_files.len();
            walk(path, "", MAX_DEPTH, &mut image_files)?;
            if image_files.len() == before {
                let path = path.display();
                bail!("{path}: there is no .jpg, .jpeg, .png or .webp file in this folder");
            }
        } else {
            let name = path.file_name().unwrap_or(path.as_os_str());
            image_files.push(ImageFile {
                path: path.clone(),
                name: name.to_string_lossy().into_owned(),
            });
        }
    }
    Ok(image_files)
}

fn walk(
    folder: &Path,
    prefix: &str,
    depth: usize,
    image_files: &mut Vec<ImageFile>,
) -> anyhow::Result<()> {
    let shown = folder.display();
    if depth == 0 {
        bail!("{shown}: folders lie more than {MAX_DEPTH} deep; name one further down");
    }
    let unreadable = || format!("{shown}: the folder cannot be read");
    let entries = fs::read_dir(folder).with_context(unreadable)?;
    let mut entries: Vec<_> = entries.collect::<Result<_, _>>().with_context(unreadable)?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        if name.starts_with('.') {
            continue;
        }
        if entry.file_type().with_context(unreadable)?.is_dir() {
            walk(&path, &format!("{prefix}{name}/"), depth - 1, image_files)?;
        } else if has_ending(&path, &IMAGE_ENDINGS) && path.is_file() {
            if image_files.len() >= MAX_IMAGES {
                bail!("{shown}: more than {MAX_IMAGES} images at once; name fewer");
            }
            image_files.push(ImageFile {
                path,
                name: format!("{prefix}{name}"),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        folder
    }

    fn names(paths: &[PathBuf]) -> Vec<String> {
        let image_files = image_files(paths).unwrap();
        image_files
            .into_iter()
            .map(|image_file| image_file.name)
            .collect()
    }

    #[test]
    fn a_folder_lists_its_images_only_in_order_of_name() {
        let folder = folder_with(&[
            "b.JPG",
            "a/2.webp",
            "a/1.png",
            "notes.txt",
            ".x.jpg",
            ".git/y.png",
        ]);
        let path = folder.path().to_owned();
        assert_eq!(names(&[path]), ["a/1.png", "a/2.webp", "b.JPG"]);
    }

    #[test]
    fn a_file_is_taken_as_it_is_named() {
        let folder = folder_with(&["sub/image.dat"]);
        let file = folder.path().join("sub/image.dat");
        assert_eq!(
            names(&[file, "nowhere.jpg".into()]),
            ["image.dat", "nowhere.jpg"]
        );
    }

    #[test]
    fn a_folder_without_images_is_refused() {
        let folder = folder_with(&["notes.txt"]);
        let error = image_files(&[folder.path().to_owned()]).unwrap_err();
        assert!(error.to_string().contains("there is no .jpg"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_linked_into_itself_ends() {
        let folder = folder_with(&["a.jpg"]);
        std::os::unix::fs::symlink(folder.path(), folder.path().join("again")).unwrap();
        assert_eq!(names(&[folder.path().to_owned()]), ["a.jpg"]);
    }
}

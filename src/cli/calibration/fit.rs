//! `lookdown calibration fit`
//!
//! The calibration that is in the output file already: what a fit keeps of it, and what it may not
//! replace.

use std::{collections::BTreeMap, fs, path::PathBuf, process::ExitCode};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_calibration::{
    CalibrationId,
    formats::Format,
    native::{
        NativeCalibration, NativeImage, NativeMount, NativeSource, SourcedValue, ValueSource,
    },
};
use lookdown_imaging::{
    Frame,
    lens_circle::{AgreedCircle, agreed_circle, find_lens_circle},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    geometry::{Lens, Ray},
    self_calibration::{FieldOfView, IdealLens, KnownCamera, RoomFit},
};

use super::{
    people::{PeopleSource, set_height},
    read_frames,
    source::{Source, refuse_input, write_native},
};
use crate::{
    cli::{parameters::one_of, server_flags::SettingsFile},
    room_calibration::{
        checked, draw_preview, give_height, given_lens, known_height, room_calibration, tilt_deg,
    },
    rounding::{meters as thousandths, radians_below},
};

/// Fits the camera, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    for (option, out) in [("--out", &arguments.out), ("--preview", &arguments.preview)] {
        refuse_input(option, out.as_deref(), &arguments.frames)?;
    }
    let existing = existing(arguments)?;
    let (image, frames) = read_frames(&arguments.frames)?;
    let mut calibration = if arguments.circle_only {
        fit_to_circle(arguments, image, &frames)?
    } else {
        fit_to_room(arguments, image, &frames)?
    };
    if let Some(existing) = existing {
        calibration = put_into(existing, calibration)?;
    }
    if let Some(height) = arguments.height {
        give_height(&mut calibration, height);
    }
    let mut height = Ok(());
    if arguments.people {
        let people = PeopleSource {
            frames: &frames,
            reports: &[],
            settings: &arguments.settings_file,
        };
        height = set_height(&mut calibration, &people);
    }
    write_native(&calibration, arguments.out.as_deref())?;
    height.context("the calibration is written without a new height")?;
    Ok(ExitCode::SUCCESS)
}

/// The values that a fit finds.
const FOUND: [SourcedValue; 3] = [
    SourcedValue::Lens,
    SourcedValue::Center,
    SourcedValue::WorldUp,
];

/// Reads the calibration in the output file, if there is one.
///
/// # Errors
/// A file that is not a native calibration, and values that may not be replaced.
fn existing(arguments: &Arguments) -> anyhow::Result<Option<NativeCalibration>> {
    let Some(out) = arguments.out.as_ref().filter(|out| out.is_file()) else {
        return Ok(None);
    };
    let path = out.display();
    let source = Source::new(out.clone());
    let native = source.read_one().and_then(|(format, _)| {
        let (native, _) = source.read_native(None)?;
        if format != Format::Native {
            bail!("the file is not in the native format");
        }
        Ok(native)
    });
    let native = native.with_context(|| format!("--out: {path} exists: name another file"))?;
    let kept: Vec<_> = FOUND
        .iter()
        .filter_map(|value| source_to_keep(&native, *value))
        .collect();
    if !kept.is_empty() && !arguments.replace {
        bail!(
            "--out: {path} has a camera already ({}): name another file, or add --replace to \
             replace lens, center and level; zones, masks, defaults and the height stay",
            kept.join(", ")
        );
    }
    Ok(Some(native))
}

/// The source of a value that is more than an assumption, as text.
fn source_to_keep(native: &NativeCalibration, value: SourcedValue) -> Option<String> {
    match native.sources.get(&value) {
        Some(source) if source.source == ValueSource::Assumed => None,
        Some(source) => Some(format!("{value} {}", source.source)),
        None => Some(format!("{value} of unknown source")),
    }
}

/// Puts the camera that was found into the calibration of the same frames.
///
/// # Errors
/// Frames of another size than that of the calibration.
fn put_into(
    existing: NativeCalibration,
    found: NativeCalibration,
) -> anyhow::Result<NativeCalibration> {
    let NativeImage { width, height } = existing.image;
    if existing.image != found.image {
        bail!(
            "--out: the calibration is of frames of {width}×{height} pixels, and the frames have \
             {}×{}: give frames of that size, or name another file",
            found.image.width,
            found.image.height
        );
    }
    let mut sources = found.sources;
    let others = existing.sources.iter();
    let others = others.filter(|(value, _)| !value.is_of_lens_or_level());
    sources.extend(others.map(|(value, source)| (*value, *source)));
    Ok(NativeCalibration {
        id: found.id,
        lens: found.lens,
        mount: NativeMount {
            world_up: found.mount.world_up,
            ..existing.mount
        },
        sources,
        ..existing
    })
}

/// Arguments of `lookdown calibration fit`.
#[derive(Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "independent flags")]
pub(in crate::cli) struct Arguments {
    /// Frames of one camera: JPEG, PNG or WebP, all of one size. Bright frames work best
    #[arg(required = true, value_name = "FRAME")]
    pub(super) frames: Vec<PathBuf>,
    /// ID of the calibration
    #[arg(long, value_name = "ID", default_value = "camera")]
    pub(super) id: CalibrationId,
    /// Detect the lens circle only; lens, field of view and level are given or assumed
    #[arg(long)]
    pub(super) circle_only: bool,
    /// Projection of the lens, from its data sheet. Cameras that look straight down need it
    /// [default: found; equidistant with --circle-only]
    #[arg(long, value_name = "MODEL", value_parser = one_of::<IdealLens>())]
    pub(super) lens: Option<IdealLens>,
    /// Field of view of the circle in degrees, from the data sheet [default: found; 180 with
    /// --circle-only]
    #[arg(long, value_name = "DEGREES")]
    pub(super) field_of_view: Option<FieldOfView>,
    /// The camera is on a ceiling, even if one wall fills the image
    #[arg(long, conflicts_with = "circle_only")]
    pub(super) ceiling: bool,
    /// Height of the camera above the floor: enables floor positions of persons
    #[arg(long, value_name = "METERS", value_parser = height)]
    pub(super) height: Option<f64>,
    /// Find the height of the camera from the people in the frames
    #[arg(long, conflicts_with = "height")]
    pub(super) people: bool,
    /// Output file. Zones, masks, defaults and the height of a calibration there are kept [default:
    /// standard output]
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Replace the lens and level of the calibration in the output file, though they were measured
    /// or given
    #[arg(long, requires = "out")]
    pub(super) replace: bool,
    /// Output file of the preview, JPEG: straightened views before and after the fit, and the edges
    /// of the room
    #[arg(long, value_name = "OUT.jpg", conflicts_with = "circle_only")]
    pub(super) preview: Option<PathBuf>,
    #[command(flatten)]
    pub(super) settings_file: SettingsFile,
}

impl Arguments {
    /// Returns what the user knows of the camera.
    pub(super) fn known(&self) -> KnownCamera {
        KnownCamera {
            lens: self.lens,
            field_of_view: self.field_of_view,
            is_on_ceiling: self.ceiling,
        }
    }
}

fn height(text: &str) -> anyhow::Result<f64> {
    known_height(text.parse().context("give meters, such as 2.8")?)
}

/// The lens and the field of view that are assumed.
const LENS: IdealLens = IdealLens::Equidistant;
const FIELD_OF_VIEW: FieldOfView = FieldOfView::HEMISPHERE;

/// Fits the circle and reports its accuracy.
fn fit_to_circle(
    arguments: &Arguments,
    image: NativeImage,
    frames: &[Frame],
) -> anyhow::Result<NativeCalibration> {
    let mut circles = Vec::with_capacity(frames.len());
    for (frame, path) in frames.iter().zip(&arguments.frames) {
        match find_lens_circle(frame) {
            Some(circle) => circles.push(circle),
            None => eprintln!("lookdown: {}: no lens circle found", path.display()),
        }
    }
    let agreed = agreed_circle(&circles).context(
        "no frame shows a lens circle: give brighter frames, with black around the lens image",
    )?;
    let calibration = calibration(arguments, image, &agreed)?;
    eprintln!("lookdown: {}", verdict(arguments, &agreed));
    Ok(calibration)
}

fn sources(arguments: &Arguments, agreed: &AgreedCircle) -> BTreeMap<SourcedValue, NativeSource> {
    let spread = (agreed.agreeing > 1).then_some(thousandths(agreed.spread));
    let mut sources = given_lens(arguments.known());
    sources
        .entry(SourcedValue::Lens)
        .or_insert(NativeSource::ASSUMED);
    sources.insert(SourcedValue::Center, NativeSource::measured(spread));
    sources.insert(SourcedValue::WorldUp, NativeSource::ASSUMED);
    sources
}

fn calibration(
    arguments: &Arguments,
    image: NativeImage,
    agreed: &AgreedCircle,
) -> anyhow::Result<NativeCalibration> {
    let field_of_view = arguments.field_of_view.unwrap_or(FIELD_OF_VIEW);
    let max_theta = radians_below(field_of_view.max_theta());
    let circle = agreed.circle;
    let (cx, cy) = (thousandths(circle.cx), thousandths(circle.cy));
    let lens = |focal: f64| {
        arguments
            .lens
            .unwrap_or(LENS)
            .with(focal, cx, cy, max_theta)
    };
    let of_one_pixel = Lens::new(&lens(1.0)).context(
        "--field-of-view: no lens of this model sees so much; equidistant has no such limit",
    )?;
    let rim = Ray::new(max_theta.sin(), 0.0, max_theta.cos());
    let rim = of_one_pixel.project_to_rim(&rim);
    let rim = rim.context("--field-of-view: the rim of this lens cannot be calculated")?;
    let radius_in_focal_lengths = rim.x - of_one_pixel.principal_point().x;
    let lens = lens(thousandths(circle.radius / radius_in_focal_lengths));
    Ok(NativeCalibration {
        sources: sources(arguments, agreed),
        ..NativeCalibration::new(arguments.id.to_string(), image, lens)
    })
}

/// Describes the measurements, the assumptions, and a way to check them.
fn verdict(arguments: &Arguments, agreed: &AgreedCircle) -> String {
    let AgreedCircle {
        circle,
        agreeing,
        spread,
    } = agreed;
    let frames = arguments.frames.len();
    let how_sure = match (frames, *agreeing) {
        (1, _) => "found in one frame: give a second one to measure the accuracy".to_owned(),
        (_, agreeing) if 2 * agreeing > frames => {
            format!("{agreeing} of {frames} frames agree within {spread:.1} pixels")
        }
        (_, agreeing) => format!(
            "unsure: only {agreeing} of {frames} frames agree; are they of one camera, and bright?"
        ),
    };
    format!(
        "circle: center {:.1}, {:.1}, radius {:.1} pixels, {how_sure}; the lens ({}) and the field \
         of view of {}° were not measured, and the camera is assumed to look straight \
         down; check it with `lookdown calibration check FILE --preview FRAME --out P.jpg`",
        circle.cx,
        circle.cy,
        circle.radius,
        arguments.lens.unwrap_or(LENS),
        arguments.field_of_view.unwrap_or(FIELD_OF_VIEW).degrees(),
    )
}

/// Fits the camera and reports its values.
fn fit_to_room(
    arguments: &Arguments,
    image: NativeImage,
    frames: &[Frame],
) -> anyhow::Result<NativeCalibration> {
    let known = arguments.known();
    let edges: Vec<_> = frames.iter().map(RoomFrame::new).collect();
    let fit = fit_room(&edges, known).context(
        "the camera cannot be fitted; --lens, --field-of-view and --ceiling take what is known of it, and --circle-only \
         detects the lens circle and assumes the rest",
    )?;
    let calibration = room_calibration(&arguments.id, image, &fit, known);
    report(arguments, &fit, &calibration.sources);
    let first = frames.first().zip(edges.first());
    if let (Some(out), Some((frame, edges))) = (&arguments.preview, first) {
        let drawn = draw_preview(&checked(&calibration)?, &fit, frame, edges)?;
        fs::write(out, drawn)
            .with_context(|| format!("--preview: {} cannot be written", out.display()))?;
    }
    Ok(calibration)
}

/// Prints the values with their uncertainty and source.
fn report(arguments: &Arguments, fit: &RoomFit, sources: &BTreeMap<SourcedValue, NativeSource>) {
    let tilt = tilt_deg(fit);
    let [cx, cy] = fit.center;
    eprintln!(
        "{:<14} {:<42} {:<24} source",
        "value", "found", "standard deviation"
    );
    let line = |value: SourcedValue, found: String, source: &NativeSource| {
        let deviation = source.uncertainty;
        let deviation = deviation.map(|deviation| format!("{deviation:.2}{}", value.unit()));
        let deviation = deviation.unwrap_or_else(|| "-".to_owned());
        let name = value.to_string();
        eprintln!("{name:<14} {found:<42} {deviation:<24} {}", source.source);
    };
    let field_of_view = 2.0 * fit.max_theta.to_degrees();
    for (value, source) in sources {
        let found = match value {
            SourcedValue::Lens => format!(
                "focal length {:.1} pixels, circle {field_of_view:.1}°",
                fit.focal
            ),
            SourcedValue::LensModel => arguments
                .lens
                .map(|lens| lens.to_string())
                .unwrap_or_default(),
            SourcedValue::FieldOfView => format!("{field_of_view:.1}°"),
            SourcedValue::Center => format!("{cx:.1}, {cy:.1}"),
            SourcedValue::WorldUp => format!("tilted by {tilt:.1}°"),
            // The fit says nothing about them.
            SourcedValue::HeightM | SourcedValue::PositionM | SourcedValue::YawDeg => continue,
        };
        line(*value, found, source);
    }
    if let Some(height) = arguments.height {
        line(
            SourcedValue::HeightM,
            format!("{height} m"),
            &NativeSource::GIVEN,
        );
    }
    if !fit.is_circle_detected {
        eprintln!(
            "lookdown: the frames show no lens circle, so the field of view is a guess: give bright frames with black \
             around the lens image, or --field-of-view"
        );
    }
    eprintln!(
        "lookdown: {:.0} % of {} edges follow three orthogonal directions; check the calibration \
         with --preview OUT.jpg: walls and door frames must be straight and upright",
        100.0 * fit.explained,
        fit.edges
    );
}

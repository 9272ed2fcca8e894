//! `lookdown calibration fit`

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use lookdown_detect::imaging::lens_circle::{AgreedCircle, agreed_circle, find_lens_circle};
use lookdown_lens::{
    calibration::{
        CalibrationId,
        export::Target,
        native::{NativeCalibration, NativeImage, NativeMount},
    },
    geometry::{
        Lens, Ray,
        lens::{Equidistant, Equisolid, LensModel, Orthographic, Stereographic},
    },
};

use super::read_frame;
use crate::cli::output::UNWRITABLE;

/// Arguments of `lookdown calibration fit`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// Frames of one camera: JPEG, PNG or WebP, all of one size. Bright frames work best
    #[arg(required = true, value_name = "FRAME")]
    frames: Vec<PathBuf>,
    /// ID of the calibration
    #[arg(long, value_name = "ID", default_value = "camera")]
    id: CalibrationId,
    /// Projection of the lens: the growth of the radius with the angle, see its data sheet
    #[arg(long, value_name = "MODEL", default_value = "equidistant")]
    lens: IdealLens,
    /// Field of view of the circle in degrees, as in the data sheet
    #[arg(long, value_name = "DEGREES", default_value_t = 180.0, value_parser = field_of_view)]
    field_of_view: f64,
    /// Height of the camera above the floor: enables floor positions of persons
    #[arg(long, value_name = "METRES", value_parser = height)]
    height: Option<f64>,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Lenses that are determined by a circle and a field of view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum IdealLens {
    /// `r = f theta`: most ceiling cameras
    Equidistant,
    /// `r = 2 f sin(theta / 2)`
    Equisolid,
    /// `r = 2 f tan(theta / 2)`
    Stereographic,
    /// `r = f sin(theta)`
    Orthographic,
}

impl IdealLens {
    fn with(self, focal: f64, cx: f64, cy: f64, max_theta: f64) -> LensModel {
        match self {
            Self::Equidistant => Equidistant::with_focal(focal, cx, cy, max_theta).into(),
            Self::Equisolid => Equisolid::with_focal(focal, cx, cy, max_theta).into(),
            Self::Stereographic => Stereographic::with_focal(focal, cx, cy, max_theta).into(),
            Self::Orthographic => Orthographic::with_focal(focal, cx, cy, max_theta).into(),
        }
    }
}

/// Fits the circle, writes the calibration, and describes the accuracy on standard error.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (image, agreed) = circle(&arguments.frames)?;
    let calibration = calibration(arguments, image, &agreed)?;
    let written = Target::Native.write(&calibration)?.content;
    eprintln!("lookdown: {}", verdict(arguments, &agreed));
    match &arguments.out {
        Some(out) => fs::write(out, written)
            .with_context(|| format!("--out: {} cannot be written", out.display()))?,
        None => write!(io::stdout(), "{written}").context(UNWRITABLE)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the size of the frames, and the circle on which most of them agree.
fn circle(frames: &[PathBuf]) -> anyhow::Result<(NativeImage, AgreedCircle)> {
    let mut size = None;
    let mut circles = Vec::with_capacity(frames.len());
    for path in frames {
        let frame = read_frame(path).with_context(|| path.display().to_string())?;
        let (width, height) = (frame.width(), frame.height());
        let NativeImage {
            width: first_width,
            height: first_height,
        } = *size.get_or_insert(NativeImage { width, height });
        if (width, height) != (first_width, first_height) {
            bail!(
                "{}: {width}x{height} pixels, but the first frame has {first_width}x{first_height}: \
                 give frames of one camera at one size",
                path.display()
            );
        }
        match find_lens_circle(&frame) {
            Some(circle) => circles.push(circle),
            None => eprintln!("lookdown: {}: no lens circle found", path.display()),
        }
    }
    size.zip(agreed_circle(&circles)).context(
        "no frame shows a lens circle: give brighter frames, with black around the lens image",
    )
}

fn calibration(
    arguments: &Arguments,
    image: NativeImage,
    agreed: &AgreedCircle,
) -> anyhow::Result<NativeCalibration> {
    let max_theta = (arguments.field_of_view.to_radians() / 2.0 * 1e6).floor() / 1e6;
    let circle = agreed.circle;
    let thousandths = |pixels: f64| (pixels * 1000.0).round() / 1000.0;
    let (cx, cy) = (thousandths(circle.cx), thousandths(circle.cy));
    let lens = |focal: f64| arguments.lens.with(focal, cx, cy, max_theta);
    let of_one_pixel = Lens::new(&lens(1.0)).context(
        "--field-of-view: no lens of this model sees so much; equidistant has no such limit",
    )?;
    let rim = Ray::new(max_theta.sin(), 0.0, max_theta.cos());
    let rim = of_one_pixel.project_to_rim(&rim);
    let rim = rim.context("--field-of-view: the rim of this lens cannot be calculated")?;
    let radius_in_focal_lengths = rim.x - of_one_pixel.principal_point().x;
    let lens = lens(thousandths(circle.radius / radius_in_focal_lengths));
    Ok(NativeCalibration {
        id: arguments.id.to_string(),
        image,
        lens,
        mount: NativeMount {
            height_m: arguments.height,
            ..NativeMount::default()
        },
        zones: Vec::new(),
        lines: Vec::new(),
        masks: Vec::new(),
        areas: Vec::new(),
        ignore: Vec::new(),
        detect: BTreeMap::new(),
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
        "circle: centre {:.1}, {:.1}, radius {:.1} pixels, {how_sure}; the lens ({}) and the field \
         of view of {}° were given, not measured, and the camera is assumed to look straight \
         down; check it with `lookdown calibration check FILE --preview FRAME --out P.jpg`",
        circle.cx + 0.5,
        circle.cy + 0.5,
        circle.radius,
        arguments
            .lens
            .to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned()),
        arguments.field_of_view,
    )
}

fn field_of_view(text: &str) -> Result<f64, &'static str> {
    let degrees = text.parse().ok();
    degrees
        .filter(|degrees| (60.0..=300.0).contains(degrees))
        .ok_or("give 60 to 300 degrees")
}

fn height(text: &str) -> Result<f64, &'static str> {
    let metres = text.parse().ok();
    metres
        .filter(|metres| *metres > 0.0 && *metres <= 100.0)
        .ok_or("give metres above 0, at most 100")
}

//! `lookdown calibration check`

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_calibration::{
    AreaShare, Areas, Calibration, CameraGeometry,
    native::{NativeSource, SourcedValue},
};
use lookdown_imaging::{
    MaskedPixels,
    annotate::{encode_jpeg, sketch_areas, sketch_foot_filter, sketch_lens, sketch_lines},
};
use lookdown_lens::geometry::{
    Lens, Pixel, Ray, ViewPlan, VirtualView, ZoneArea, view_plan::Coverage,
};

use super::{
    read_frame,
    source::{NamedCamera, Source, refuse_input},
};
use crate::cli::progress::UNWRITABLE;

/// The resolution of the plan's views: the input side of the default network, pixels.
const VIEW_SIDE: u32 = 416;
const JPEG_QUALITY: u8 = 92;

/// Arguments of `lookdown calibration check`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Draw the lens, the balanced view plan, zones and masks into this frame of the camera
    #[arg(long, value_name = "FRAME", requires = "out")]
    preview: Option<PathBuf>,
    /// Output file of the drawing, JPEG
    #[arg(long, value_name = "OUT.jpg", requires = "preview")]
    out: Option<PathBuf>,
}

/// Reports on every camera of the file. A camera that cannot be used results in exit code 1.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    if let (Some(frame), Some(out)) = (&arguments.preview, &arguments.out) {
        refuse_input("--out", Some(out), std::slice::from_ref(frame))?;
        let (_, camera) = arguments.source.read_one()?;
        let calibration = camera
            .checked
            .with_context(|| arguments.source.file.display().to_string())?;
        draw(&calibration, frame, out)?;
    }
    let found = arguments.source.read()?;
    let mut out = io::stdout().lock();
    let mut line =
        |label: &str, text: String| writeln!(out, "{label:<12} {text}").context(UNWRITABLE);
    let count = match found.cameras.len() {
        1 => "1 camera".to_owned(),
        count => format!("{count} cameras"),
    };
    let path = arguments.source.file.display();
    line("file", format!("{path}: {}, {count}", found.format.name()))?;
    let mut code = ExitCode::SUCCESS;
    for camera in &found.cameras {
        line("calibration", camera.id.clone())?;
        match &camera.checked {
            Ok(calibration) => {
                for (label, text) in report(camera, calibration) {
                    line(label, text)?;
                }
            }
            Err(error) => {
                line("  refused", error.to_string())?;
                code = ExitCode::FAILURE;
            }
        }
    }
    Ok(code)
}

fn views(calibration: &Calibration) -> Vec<VirtualView> {
    ViewPlan::balanced().views(calibration.mount(), VIEW_SIDE, VIEW_SIDE)
}

/// Describes one camera in lines.
fn report(camera: &NamedCamera, calibration: &Calibration) -> Vec<(&'static str, String)> {
    let lens = calibration.lens();
    let (width, height) = calibration.image_size();
    let stated = camera.stated.camera.as_ref().ok();
    let end = match stated.and_then(|stated| stated.lens.max_theta()) {
        Some(_) => "",
        None => ", up to the farthest corner of the frame or the end of the curve",
    };
    let views = views(calibration);
    let coverage = Coverage::new(lens, &views, width, height);
    let mut lines = vec![
        ("  lens", lens.model().to_owned()),
        ("  frame", format!("{width}×{height} pixels")),
        (
            "  sees",
            format!("{:.1}°{end}", 2.0 * lens.max_theta().to_degrees()),
        ),
        ("  circle", circle(lens, width, height)),
        ("  mount", mount(calibration)),
        (
            "  plan",
            format!(
                "balanced, {} views: {:.1} % of the lens image is covered, each point by {:.1} \
                 views on average",
                views.len(),
                100.0 * coverage.seen_share,
                coverage.mean_views
            ),
        ),
    ];
    lines.extend(
        stated
            .into_iter()
            .flat_map(|stated| &stated.sources)
            .map(sourced),
    );
    lines.extend(areas(calibration));
    let notes = stated
        .into_iter()
        .flat_map(|stated| stated.notes.iter().cloned());
    let warnings = notes.chain(calibration.warnings());
    lines.extend(warnings.map(|warning| ("  warning", warning.to_string())));
    lines
}

/// Describes the source of a value.
fn sourced((value, source): (&SourcedValue, &NativeSource)) -> (&'static str, String) {
    let kind = source.source;
    let deviation = source.uncertainty.map_or_else(String::new, |deviation| {
        format!(" ± {deviation}{}", value.unit())
    });
    ("  source", format!("{value}: {kind}{deviation}"))
}

/// Describes the rim of the lens image, and its position in the frame.
fn circle(lens: &Lens, width: u32, height: u32) -> String {
    const AZIMUTHS: u32 = 72;
    let center = lens.principal_point();
    let rim: Vec<Pixel> = (0..AZIMUTHS)
        .filter_map(|step| {
            let azimuth = std::f64::consts::TAU * f64::from(step) / f64::from(AZIMUTHS);
            let (sin, cos) = lens.max_theta().sin_cos();
            lens.project_to_rim(&Ray::new(sin * azimuth.cos(), sin * azimuth.sin(), cos))
        })
        .collect();
    let radii = rim.iter().map(|pixel| (pixel - center).norm());
    let (least, most) = radii.fold((f64::INFINITY, 0.0_f64), |(least, most), radius| {
        (least.min(radius), most.max(radius))
    });
    let radius = if most - least < 1.0 {
        format!("{most:.1}")
    } else {
        format!("{least:.1} to {most:.1}")
    };
    let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
    let is_inside =
        |pixel: &Pixel| (-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y);
    let held = match rim.iter().filter(|pixel| is_inside(pixel)).count() {
        0 => "outside the frame on every side",
        inside if inside == rim.len() => "completely in the frame",
        _ => "cut off by the frame",
    };
    format!(
        "center {:.1}, {:.1}; radius {radius} pixels, {held}",
        center.x, center.y
    )
}

fn mount(calibration: &Calibration) -> String {
    let mount = calibration.mount();
    let tilt = mount.nadir().angle(&Ray::z()).to_degrees();
    let looks = if tilt < 0.05 {
        "looks straight down".to_owned()
    } else {
        format!("looks {tilt:.1}° away from straight down")
    };
    let site = calibration.site().map(|placement| {
        let [x, y] = placement.position_m;
        let (site, yaw) = (&placement.site, placement.yaw_deg);
        format!(", at {x}, {y} m of the site {site}, turned by {yaw}°")
    });
    let site = site.unwrap_or_default();
    match mount.height_m() {
        Some(height) => format!("{looks} from {height} m{site}"),
        None => format!("{looks}, height unknown: persons have no floor position"),
    }
}

/// Describes the zones, lines and masks, if there are any.
fn areas(calibration: &Calibration) -> Vec<(&'static str, String)> {
    let Areas {
        zones,
        lines,
        masks,
        foot_filter,
    } = calibration.areas();
    let (width, height) = calibration.image_size();
    let zones = zones.iter().map(|zone| match zone.area {
        ZoneArea::Frame(_) => format!("{} (in the frame)", zone.name),
        ZoneArea::Floor(_) => format!("{} (on the floor)", zone.name),
    });
    let lines = lines.iter().map(|line| {
        let [left_to_right, right_to_left] = &line.directions;
        format!("{} ({left_to_right}, {right_to_left})", line.name)
    });
    let masked = (!masks.is_empty()).then(|| {
        let hidden = MaskedPixels::new(masks, width, height).count();
        let percent = 100.0 * hidden as f64 / (f64::from(width) * f64::from(height));
        format!("{}, which hide {percent:.1} % of the frame", masks.len())
    });
    let counted = |areas: &[ZoneArea]| {
        let is_on_floor = |area: &&ZoneArea| matches!(area, ZoneArea::Floor(_));
        let on_floor = areas.iter().filter(is_on_floor).count();
        let in_frame = areas.len() - on_floor;
        (!areas.is_empty()).then(|| format!("{on_floor} on the floor, {in_frame} in the frame"))
    };
    let shares = calibration.areas().shares(width, height).into_iter();
    let shares = shares.map(|AreaShare { field, percent }| format!("{field} {percent:.1} %"));
    let joined = |texts: Vec<String>| (!texts.is_empty()).then(|| texts.join(", "));
    let lines = [
        ("  zones", joined(zones.collect())),
        ("  lines", joined(lines.collect())),
        ("  masks", masked),
        ("  areas", counted(&foot_filter.areas)),
        ("  ignore", counted(&foot_filter.ignore)),
        ("  of the frame", joined(shares.collect())),
    ];
    let lines = lines.into_iter();
    lines
        .filter_map(|(title, text)| Some((title, text?)))
        .collect()
}

fn draw(calibration: &Calibration, frame: &Path, out: &Path) -> anyhow::Result<()> {
    let mut preview =
        read_frame(frame).with_context(|| format!("--preview: {}", frame.display()))?;
    let (width, height) = (preview.width(), preview.height());
    let Ok(geometry) = calibration.for_frame(width, height) else {
        let (calibrated_width, calibrated_height) = calibration.image_size();
        bail!(
            "--preview: the frame has {width}×{height} pixels, another shape than the \
             {calibrated_width}×{calibrated_height} of the calibration: give a frame of its camera"
        );
    };
    let CameraGeometry { lens, mount, areas } = &geometry;
    sketch_areas(&mut preview, &areas.zones, &areas.masks, lens, mount);
    sketch_foot_filter(&mut preview, &areas.foot_filter, lens, mount);
    sketch_lines(&mut preview, &areas.lines, lens, mount);
    sketch_lens(&mut preview, lens, &views(calibration));
    fs::write(out, encode_jpeg(&preview, JPEG_QUALITY)?)
        .with_context(|| format!("--out: {} cannot be written", out.display()))
}

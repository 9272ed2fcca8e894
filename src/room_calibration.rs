//! The calibration of a camera that was fitted to the edges of a room, with its height from people.
//!
//! The preview of a fit: straightened views of the room with an assumed lens and with the found
//! one, and the frame with the edges that follow the room.

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2, ops::RangeInclusive, str::FromStr};

use anyhow::{Context, ensure};
use lookdown_calibration::{
    Calibration, CalibrationFile, CalibrationId,
    export::Target,
    native::{
        NativeCalibration, NativeImage, NativeMount, NativeSource, SourcedValue, ValueSource,
    },
};
use lookdown_detect::parameters::ParameterError;
use lookdown_imaging::{
    Frame, FrameError,
    annotate::{Caption, ROOM_LEGEND, encode_jpeg, sketch_room},
    lens_circle, narrowed,
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    geometry::{
        Lens, Mount, Pixel, Ray, VirtualView,
        lens::{KannalaBrandt, LensModel},
    },
    saturating::to_u32,
    self_calibration::{CameraHeight, FieldOfView, IdealLens, KnownCamera, RoomFit},
};
use strum::VariantNames;

use crate::rounding::{meters as thousandths, pixels as hundredths, radians_below};

/// A camera that was calibrated from its frames.
pub struct RoomCalibration {
    /// The camera.
    pub calibration: Calibration,
    /// Its native file, JSON.
    pub file: String,
    /// The preview of the fit with the first frame, JPEG: straightened views before and after, and
    /// the edges that follow the room.
    pub preview: Vec<u8>,
}

/// Calibrates a camera from frames of one size.
///
/// # Errors
/// The reason why the frames do not determine the camera, with the remedy.
pub fn calibrate(
    id: &CalibrationId,
    frames: &[Frame],
    known: KnownCamera,
    height_m: Option<f64>,
) -> anyhow::Result<RoomCalibration> {
    let first = frames.first().context("no frame: give at least one")?;
    let height_m = height_m.map(known_height).transpose()?;
    let image = NativeImage {
        width: first.width(),
        height: first.height(),
    };
    let is_other = |frame: &&Frame| (frame.width(), frame.height()) != (image.width, image.height);
    if let Some(other) = frames.iter().find(is_other) {
        anyhow::bail!(
            "a frame of {} by {} pixels is not of the camera of the first one, which has {} by {}: \
             give frames of one size",
            other.width(),
            other.height(),
            image.width,
            image.height
        );
    }
    let edges: Vec<_> = frames.iter().map(RoomFrame::new).collect();
    let fit = fit_room(&edges, known)?;
    let mut native = room_calibration(id, image, &fit, known);
    if let Some(height_m) = height_m {
        give_height(&mut native, height_m);
    }
    let calibration = checked(&native)?;
    Ok(RoomCalibration {
        preview: draw_preview(&calibration, &fit, first, &edges[0])?,
        file: Target::Native.write(&native)?.content,
        calibration,
    })
}

/// Returns the calibration of a fit to what was known. Center and level are measured, and so is the
/// lens unless model and field of view are known. The height is unknown.
pub(crate) fn room_calibration(
    id: &CalibrationId,
    image: NativeImage,
    fit: &RoomFit,
    known: KnownCamera,
) -> NativeCalibration {
    let [cx, cy] = fit.center.map(thousandths);
    let focal = thousandths(fit.focal);
    let max_theta = known
        .field_of_view
        .map_or(fit.max_theta, FieldOfView::max_theta);
    let max_theta = radians_below(max_theta);
    let lens = match known.lens {
        Some(model) => model.with(focal, cx, cy, max_theta),
        None => LensModel::from(KannalaBrandt {
            fx: focal,
            fy: focal,
            cx,
            cy,
            skew: 0.0,
            max_theta: Some(max_theta),
            k: fit.k.map(|k| (k * 1e8).round() / 1e8),
        }),
    };
    let up = fit.directions[0].map(|value| (-value * 1e8).round() / 1e8);
    NativeCalibration {
        mount: NativeMount {
            world_up: up.into(),
            ..NativeMount::default()
        },
        sources: sources(fit, known),
        ..NativeCalibration::new(id.to_string(), image, lens)
    }
}

/// Returns the camera of a calibration in the native format.
///
/// # Errors
/// Values that are not those of a camera.
pub(crate) fn checked(native: &NativeCalibration) -> anyhow::Result<Calibration> {
    let written = Target::Native.write(native)?.content;
    let file = CalibrationFile::parse(written.as_bytes())?;
    let mut cameras = file.calibrations(&native.id, written.as_bytes());
    Ok(cameras.swap_remove(0).1?)
}

/// Returns true if the height of a calibration may be set from people: a height that was measured
/// or given is kept.
pub(crate) fn may_set_height(native: &NativeCalibration) -> bool {
    let source = native.sources.get(&SourcedValue::HeightM);
    let is_open = |source: &NativeSource| {
        matches!(
            source.source,
            ValueSource::FromPeople | ValueSource::Assumed
        )
    };
    native.mount.height_m.is_none() || source.is_some_and(is_open)
}

/// Sets the height of a calibration, which people gave.
pub(crate) fn set_height(native: &mut NativeCalibration, height: &CameraHeight) {
    native.mount.height_m = Some(hundredths(height.height_m));
    let source = NativeSource::from_people(hundredths(height.sd_m));
    native.sources.insert(SourcedValue::HeightM, source);
}

/// Sets the height of a calibration, which the user gave.
pub(crate) fn give_height(native: &mut NativeCalibration, height_m: f64) {
    native.mount.height_m = Some((height_m * 1e6).round() / 1e6);
    native
        .sources
        .insert(SourcedValue::HeightM, NativeSource::GIVEN);
}

/// Returns the angle between the camera's axis and straight down, degrees.
pub(crate) fn tilt_deg(fit: &RoomFit) -> f64 {
    fit.directions[0].z.clamp(-1.0, 1.0).acos().to_degrees()
}

fn sources(fit: &RoomFit, known: KnownCamera) -> BTreeMap<SourcedValue, NativeSource> {
    let measured = |deviation: f64| NativeSource::measured(Some(thousandths(deviation)));
    let mut sources = given_lens(known);
    sources
        .entry(SourcedValue::Lens)
        .or_insert_with(|| measured(100.0 * fit.uncertainty.radius));
    sources.insert(SourcedValue::Center, measured(fit.uncertainty.center));
    sources.insert(SourcedValue::WorldUp, measured(fit.uncertainty.level_deg));
    sources
}

/// Returns the sources of what the user knows of the lens. Without model or field of view, the lens
/// has another source.
pub(crate) fn given_lens(known: KnownCamera) -> BTreeMap<SourcedValue, NativeSource> {
    let given: &[SourcedValue] = match (known.lens, known.field_of_view) {
        (Some(_), Some(_)) => &[SourcedValue::Lens],
        (Some(_), None) => &[SourcedValue::LensModel],
        (None, Some(_)) => &[SourcedValue::FieldOfView],
        (None, None) => &[],
    };
    given
        .iter()
        .map(|value| (*value, NativeSource::GIVEN))
        .collect()
}

/// The parameter of the projection of the lens.
pub(crate) const LENS: &str = "lens";
/// The parameter of the field of view of the lens circle.
pub(crate) const FIELD_OF_VIEW_DEG: &str = "field_of_view_deg";

/// The heights of cameras above the floor that can be given, meters.
const HEIGHTS_M: RangeInclusive<f64> = 0.01..=100.0;

/// Returns a height of a camera above the floor that was given, meters.
///
/// # Errors
/// A height that no camera has.
pub(crate) fn known_height(meters: f64) -> anyhow::Result<f64> {
    let (min, max) = (HEIGHTS_M.start(), HEIGHTS_M.end());
    ensure!(
        HEIGHTS_M.contains(&meters),
        "the height is {meters} m: give {min} to {max} meters"
    );
    Ok(meters)
}

/// Parses the known values of a camera: the name of an ideal lens and a field of view in degrees.
///
/// # Errors
/// [`ParameterError`] with the accepted values.
pub fn known_camera(
    lens: Option<&str>,
    field_of_view_deg: Option<&str>,
    is_on_ceiling: bool,
) -> Result<KnownCamera, ParameterError> {
    let lenses = format!("one of {}", IdealLens::VARIANTS.join(", "));
    let (min, max) = (FieldOfView::MIN_DEGREES, FieldOfView::MAX_DEGREES);
    let fields_of_view = format!("a number from {min} to {max}");
    Ok(KnownCamera {
        lens: parsed(LENS, lens, &lenses)?,
        field_of_view: parsed(FIELD_OF_VIEW_DEG, field_of_view_deg, &fields_of_view)?,
        is_on_ceiling,
    })
}

/// Parses an optional value; `rule` completes "… is not".
pub(crate) fn parsed<T: FromStr>(
    name: &str,
    value: Option<&str>,
    rule: &str,
) -> Result<Option<T>, ParameterError> {
    let refused = |value| ParameterError::is_not(name, value, rule);
    value
        .map(|value| value.parse().map_err(|_| refused(value)))
        .transpose()
}

/// Height of a line of text, pixels.
const TEXT_HEIGHT: f64 = 28.0;
/// Distance of captions from the left and the upper edge of their row, pixels.
const MARGIN: f64 = 12.0;
const CAPTION_COLOR: [u8; 3] = [255; 3];
const JPEG_QUALITY: u8 = 90;

/// A row of the preview.
struct Row {
    /// At most as wide as the preview.
    image: Frame,
    /// Lines of text with their colors.
    caption: &'static [(&'static str, [u8; 3])],
}

/// Draws three rows: views toward the four walls with an equidistant lens of 180° that looks
/// straight down, the same views with the fitted camera, and the frame with the edges that follow
/// the room, the horizon, and the point straight below the camera.
pub(crate) fn draw_preview(
    calibration: &Calibration,
    fit: &RoomFit,
    frame: &Frame,
    edges: &RoomFrame,
) -> anyhow::Result<Vec<u8>> {
    let circle = lens_circle::find_lens_circle(frame)
        .unwrap_or_else(|| lens_circle::assumed_circle(frame.width(), frame.height()));
    let assumed = Lens::equidistant_circle(circle.cx, circle.cy, circle.radius, FRAC_PI_2)
        .context("--preview: the lens circle has no lens")?;
    let (lens, mount) = (calibration.lens(), calibration.mount());
    let wall = &fit.directions[1];
    let mut room = frame.clone();
    sketch_room(&mut room, &edges.edges_along(fit), lens, mount);
    let rows = [
        Row {
            image: wall_views(frame, &assumed, &Mount::default(), wall)?,
            caption: &[("assumed lens", CAPTION_COLOR)],
        },
        Row {
            image: wall_views(frame, lens, mount, wall)?,
            caption: &[("found lens", CAPTION_COLOR)],
        },
        Row {
            image: narrowed(&room, WIDTH),
            caption: &ROOM_LEGEND,
        },
    ];
    Ok(encode_jpeg(&stacked(&rows)?, JPEG_QUALITY)?)
}

/// Stacks rows: each image in the middle, and the caption in the corner.
fn stacked(rows: &[Row]) -> anyhow::Result<Frame> {
    let height = rows.iter().map(|row| row.image.height()).sum();
    let mut pixels = Vec::with_capacity(3 * WIDTH as usize * height as usize);
    for Row { image, .. } in rows {
        let width = 3 * image.width() as usize;
        let left = 3 * ((WIDTH - image.width()) / 2) as usize;
        for row in image.pixels().chunks_exact(width) {
            let start = pixels.len();
            pixels.resize(start + left, 0);
            pixels.extend_from_slice(row);
            pixels.resize(start + 3 * WIDTH as usize, 0);
        }
    }
    let mut stacked = Frame::new(WIDTH, height, pixels)?;
    let mut top = 0;
    for Row { image, caption } in rows {
        let caption = Caption {
            lines: caption,
            corner: [MARGIN, f64::from(top) + MARGIN],
            text_height: TEXT_HEIGHT,
        };
        caption.draw(&mut stacked);
        top += image.height();
    }
    Ok(stacked)
}

/// Side of a view in pixels.
const SIDE: u32 = 480;
/// Width of the four views, pixels.
const WIDTH: u32 = 4 * SIDE;
/// Focal length of a view in pixels: 90° across.
const FOCAL: f64 = 240.0;
/// Angle of the axes of the views from the nadir, degrees.
const OFF_NADIR: f64 = 50.0;

/// Renders views along a horizontal direction of the room, which may be off by the tilt of the
/// mount, and across it. They are lowered toward the nadir.
fn wall_views(
    frame: &Frame,
    lens: &Lens,
    mount: &Mount,
    direction: &Ray,
) -> Result<Frame, FrameError> {
    let nadir = mount.nadir();
    let wall = (direction - nadir * nadir.dot(direction)).normalize();
    let (sin, cos) = OFF_NADIR.to_radians().sin_cos();
    let mut pixels = vec![0; 3 * WIDTH as usize * SIDE as usize];
    let walls = [wall, nadir.cross(&wall), -wall, -nadir.cross(&wall)];
    for (column, wall) in (0_u32..).zip(walls) {
        let axis = nadir * cos + wall * sin;
        let view = VirtualView::looking_along(&axis, FOCAL, mount, SIDE, SIDE);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                let color = lens.project(&ray).and_then(|at| nearest(frame, &at));
                let start = 3 * (y as usize * WIDTH as usize + (column * SIDE + x) as usize);
                pixels[start..start + 3].copy_from_slice(&color.unwrap_or_default());
            }
        }
    }
    Frame::new(WIDTH, SIDE, pixels)
}

/// The pixel at a position, or `None` outside the frame.
fn nearest(frame: &Frame, at: &Pixel) -> Option<[u8; 3]> {
    let (x, y) = (at.x.round(), at.y.round());
    let is_inside =
        x >= 0.0 && y >= 0.0 && x < f64::from(frame.width()) && y < f64::from(frame.height());
    is_inside.then(|| frame.pixel(to_u32(x), to_u32(y)))
}

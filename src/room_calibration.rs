//! The calibration of a camera that was fitted to the edges of a room, with its height from people.

pub(crate) mod known;
pub(crate) mod preview;

use std::collections::BTreeMap;

use anyhow::Context;
use lookdown_calibration::{
    Calibration, CalibrationFile, CalibrationId,
    export::Target,
    native::{
        NativeCalibration, NativeImage, NativeMount, NativeSource, SourcedValue, ValueSource,
    },
};
use lookdown_imaging::{
    Frame,
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    geometry::lens::{KannalaBrandt, LensModel},
    self_calibration::{CameraHeight, FieldOfView, KnownCamera, RoomFit},
};

pub use known::known_camera;
use known::known_height;

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
        preview: preview::draw(&calibration, &fit, first, &edges[0])?,
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

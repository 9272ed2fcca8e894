//! The calibration of a camera that was fitted to the edges of a room.

use std::collections::BTreeMap;

use lookdown_lens::{
    calibration::{
        CalibrationId,
        native::{NativeCalibration, NativeImage, NativeMount, NativeSource, ValueSource},
    },
    geometry::lens::KannalaBrandt,
    self_calibration::RoomFit,
};

use crate::rounding::metres as thousandths;

/// Returns the calibration of a fit. Lens, center and level are measured, the height is unknown.
pub(crate) fn room_calibration(
    id: &CalibrationId,
    image: NativeImage,
    fit: &RoomFit,
) -> NativeCalibration {
    let [cx, cy] = fit.center.map(thousandths);
    let focal = thousandths(fit.focal);
    let lens = KannalaBrandt {
        fx: focal,
        fy: focal,
        cx,
        cy,
        skew: 0.0,
        max_theta: Some(max_theta(fit)),
        k: fit.k.map(|k| (k * 1e8).round() / 1e8),
    };
    let up = fit.directions[0].map(|value| (-value * 1e8).round() / 1e8);
    NativeCalibration {
        mount: NativeMount {
            world_up: up.into(),
            ..NativeMount::default()
        },
        sources: sources(fit),
        ..NativeCalibration::new(id.to_string(), image, lens.into())
    }
}

/// Returns the angle at the lens circle, radians. It is rounded down, so that the lens model is valid there.
pub(crate) fn max_theta(fit: &RoomFit) -> f64 {
    (fit.max_theta * 1e6).floor() / 1e6
}

/// Returns the angle between the camera's axis and straight down, degrees.
pub(crate) fn tilt_deg(fit: &RoomFit) -> f64 {
    fit.directions[0].z.clamp(-1.0, 1.0).acos().to_degrees()
}

fn sources(fit: &RoomFit) -> BTreeMap<String, NativeSource> {
    let measured = |uncertainty: f64| NativeSource {
        source: ValueSource::Measured,
        uncertainty: Some(thousandths(uncertainty)),
    };
    BTreeMap::from([
        ("lens".to_owned(), measured(100.0 * fit.uncertainty.radius)),
        ("center".to_owned(), measured(fit.uncertainty.center)),
        ("world_up".to_owned(), measured(fit.uncertainty.level_deg)),
    ])
}

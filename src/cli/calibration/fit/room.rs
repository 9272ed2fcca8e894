//! Lens, center and level from the straight edges of the room.

use std::{collections::BTreeMap, fs};

use anyhow::Context;
use lookdown_calibration::native::{NativeCalibration, NativeImage, NativeSource, SourcedValue};
use lookdown_imaging::{
    Frame,
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::self_calibration::RoomFit;

use super::arguments::Arguments;
use crate::room_calibration::{checked, preview, room_calibration, tilt_deg};

/// Fits the camera and reports its values.
pub(super) fn fit(
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
        let drawn = preview::draw(&checked(&calibration)?, &fit, frame, edges)?;
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

//! Lens, center and level from the straight edges of the room.

use std::{collections::BTreeMap, fs};

use anyhow::Context;
use lookdown_detect::imaging::{
    Frame,
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    calibration::native::{NativeCalibration, NativeImage, NativeSource},
    self_calibration::{KnownCamera, RoomFit},
};

use super::arguments::Arguments;
use crate::room_calibration::{checked, give_height, preview, room_calibration, tilt_deg};

/// Fits the camera and reports its values.
pub(super) fn fit(
    arguments: &Arguments,
    image: NativeImage,
    frames: &[Frame],
) -> anyhow::Result<NativeCalibration> {
    let known = KnownCamera {
        lens: arguments.lens,
        field_of_view: arguments.field_of_view,
        is_on_ceiling: arguments.ceiling,
    };
    let edges: Vec<_> = frames.iter().map(RoomFrame::of).collect();
    let fit = fit_room(&edges, known).context(
        "the camera cannot be fitted; --circle-only detects the lens circle and assumes the rest",
    )?;
    let mut calibration = room_calibration(&arguments.id, image, &fit, known);
    if let Some(height) = arguments.height {
        give_height(&mut calibration, height);
    }
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
fn report(arguments: &Arguments, fit: &RoomFit, sources: &BTreeMap<String, NativeSource>) {
    let tilt = tilt_deg(fit);
    let [cx, cy] = fit.center;
    let mut rows = vec![
        (
            "lens",
            format!(
                "focal length {:.1} pixels, circle {:.1}°",
                fit.focal,
                2.0 * fit.max_theta.to_degrees()
            ),
            "% of the radius",
        ),
        (
            "center",
            format!("{:.1}, {:.1}", cx + 0.5, cy + 0.5),
            " pixels",
        ),
        ("world_up", format!("tilted by {tilt:.1}°"), "°"),
    ];
    rows.extend(
        arguments
            .height
            .map(|height| ("height_m", format!("{height} m"), " m")),
    );
    eprintln!(
        "{:<10} {:<42} {:<24} source",
        "value", "found", "standard deviation"
    );
    for (name, found, unit) in rows {
        let Some(value) = sources.get(name) else {
            continue;
        };
        let deviation = value.uncertainty.map(|value| format!("{value:.2}{unit}"));
        let deviation = deviation.unwrap_or_else(|| "-".to_owned());
        eprintln!("{name:<10} {found:<42} {deviation:<24} {}", value.source);
    }
    eprintln!(
        "lookdown: {:.0} % of {} edges follow three orthogonal directions; check the calibration \
         with --preview OUT.jpg: walls and door frames must be straight and upright",
        100.0 * fit.explained,
        fit.edges
    );
}

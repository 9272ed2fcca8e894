//! Lens, center and level from the straight edges of the room.

use std::{collections::BTreeMap, fs};

use anyhow::Context;
use lookdown_detect::imaging::{Frame, room_fit::fit_room};
use lookdown_lens::{
    calibration::{
        CalibrationFile,
        export::Target,
        native::{NativeCalibration, NativeImage, NativeMount, NativeSource, ValueSource},
    },
    geometry::lens::{KannalaBrandt, LensModel},
    self_calibration::{KnownLens, RoomFit},
};

use super::{
    arguments::{Arguments, IdealLens, thousandths},
    preview,
};

/// Fits the camera and reports its values.
pub(super) fn fit(
    arguments: &Arguments,
    image: NativeImage,
    frames: &[Frame],
) -> anyhow::Result<NativeCalibration> {
    let known = KnownLens {
        field_of_view: arguments.field_of_view.map(f64::to_radians),
        k1: arguments.lens.map(IdealLens::k1),
    };
    let fit = fit_room(frames, known).context(
        "the camera cannot be fitted; --circle-only detects the lens circle and assumes the rest",
    )?;
    let millionths = |value: f64| (value * 1e6).round() / 1e6;
    let up = fit.directions[0].map(|value| (-value * 1e8).round() / 1e8);
    let sources = sources(arguments, &fit);
    report(arguments, &fit, &sources);
    let calibration = NativeCalibration {
        mount: NativeMount {
            world_up: up.into(),
            height_m: arguments.height.map(millionths),
            ..NativeMount::default()
        },
        sources,
        ..NativeCalibration::new(arguments.id.to_string(), image, lens(arguments, &fit))
    };
    if let (Some(out), Some(frame)) = (&arguments.preview, frames.first()) {
        let written = Target::Native.write(&calibration)?.content;
        let file = CalibrationFile::parse(written.as_bytes())?;
        let mut checked = file.calibrations(&calibration.id, written.as_bytes());
        let drawn = preview::draw(&checked.swap_remove(0).1?, &fit, frame)?;
        fs::write(out, drawn)
            .with_context(|| format!("--preview: {} cannot be written", out.display()))?;
    }
    Ok(calibration)
}

/// The lens of a fit: a given model, or a polynomial.
fn lens(arguments: &Arguments, fit: &RoomFit) -> LensModel {
    let [cx, cy] = fit.center.map(thousandths);
    let focal = thousandths(fit.focal);
    let max_theta = (fit.max_theta * 1e6).floor() / 1e6;
    match arguments.lens {
        Some(model) => model.with(focal, cx, cy, max_theta),
        None => KannalaBrandt {
            fx: focal,
            fy: focal,
            cx,
            cy,
            skew: 0.0,
            max_theta: Some(max_theta),
            k: fit.k.map(|k| (k * 1e8).round() / 1e8),
        }
        .into(),
    }
}

fn sources(arguments: &Arguments, fit: &RoomFit) -> BTreeMap<String, NativeSource> {
    let is_given = arguments.lens.is_some() && arguments.field_of_view.is_some();
    let measured = |uncertainty: f64| NativeSource {
        source: ValueSource::Measured,
        uncertainty: Some(thousandths(uncertainty)),
    };
    let given = NativeSource {
        source: ValueSource::Given,
        uncertainty: None,
    };
    let lens = if is_given {
        given
    } else {
        measured(100.0 * fit.uncertainty.radius)
    };
    let mut sources = BTreeMap::from([
        ("lens".to_owned(), lens),
        ("center".to_owned(), measured(fit.uncertainty.center)),
        ("world_up".to_owned(), measured(fit.uncertainty.level_deg)),
    ]);
    if arguments.height.is_some() {
        sources.insert("height_m".to_owned(), given);
    }
    sources
}

/// Prints the values with their uncertainty and source.
fn report(arguments: &Arguments, fit: &RoomFit, sources: &BTreeMap<String, NativeSource>) {
    let tilt = fit.directions[0].z.clamp(-1.0, 1.0).acos().to_degrees();
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

//! The lens circle alone: an ideal lens of a given field of view is put on it.

use std::collections::BTreeMap;

use anyhow::Context;
use lookdown_calibration::native::{NativeCalibration, NativeImage, NativeSource, SourcedValue};
use lookdown_imaging::{
    Frame,
    lens_circle::{AgreedCircle, agreed_circle, find_lens_circle},
};
use lookdown_lens::{
    geometry::{Lens, Ray},
    self_calibration::{FieldOfView, IdealLens},
};

use super::arguments::Arguments;
use crate::{
    room_calibration::given_lens,
    rounding::{meters as thousandths, radians_below},
};

/// The lens and the field of view that are assumed.
const LENS: IdealLens = IdealLens::Equidistant;
const FIELD_OF_VIEW: FieldOfView = FieldOfView::HEMISPHERE;

/// Fits the circle and reports its accuracy.
pub(super) fn fit(
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

//! Found persons drawn into their frame, as a picture to send or to save: what is drawn, how large
//! and in which file format.

mod marks;
mod options;

use std::sync::Arc;

use crate::{
    imaging::{
        Frame,
        annotate::{Drawing, EncodeError, annotate, encode_jpeg, encode_png},
        narrowed,
    },
    pipeline::{Detected, DetectionReport},
};

pub use options::{Layer, PictureOptions};

/// A file format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// JPEG, in the quality of the options.
    Jpeg,
    /// PNG, without loss.
    Png,
}

/// Draws what was found into its frame. Takes tens of milliseconds for a large frame: keep it off
/// the async runtime.
///
/// # Errors
/// [`EncodeError`] when the frame is larger than the format allows.
pub fn annotated_picture(
    detected: Detected,
    format: PictureFormat,
    options: &PictureOptions,
) -> Result<Vec<u8>, EncodeError> {
    let drawing = drawing(&detected, options);
    let frame = detected.frame;
    let width = options.width.unwrap_or(u32::MAX);
    let mut picture = if frame.width() > width {
        narrowed(&frame, width)
    } else {
        Arc::unwrap_or_clone(frame)
    };
    annotate(&mut picture, &drawing);
    encode(&picture, format, options.quality)
}

fn encode(picture: &Frame, format: PictureFormat, quality: u8) -> Result<Vec<u8>, EncodeError> {
    match format {
        PictureFormat::Jpeg => encode_jpeg(picture, quality),
        PictureFormat::Png => encode_png(picture),
    }
}

/// What is drawn, in pixels of the picture.
fn drawing(detected: &Detected, options: &PictureOptions) -> Drawing {
    let (report, frame_width) = (&detected.report, f64::from(detected.frame.width()));
    let width = options.width.map_or(frame_width, f64::from);
    let factor = (width / frame_width).min(1.0);
    let draws = |layer| options.layers.contains(&layer);
    let persons = report.persons.iter();
    let marks = persons.map(|person| marks::mark(person, draws(Layer::Scores)).scaled(factor));
    let outlines = draws(Layer::Views).then(|| detected.view_outlines());
    let lines = outlines.into_iter().flatten().map(|outline| {
        let points = outline.iter();
        points.map(|at| [at.x * factor, at.y * factor]).collect()
    });
    Drawing {
        marks: marks.collect(),
        boxes: draws(Layer::Boxes),
        oriented: draws(Layer::Oriented),
        lines: lines.collect(),
        caption: if draws(Layer::Timestamp) {
            timestamp(report)
        } else {
            String::new()
        },
    }
}

/// When the frame was taken, or came, to the second.
fn timestamp(report: &DetectionReport) -> String {
    let time = report.captured_at.unwrap_or(report.received_at);
    time.strftime("%Y-%m-%d %H:%M:%S UTC").to_string()
}

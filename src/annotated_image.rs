//! Annotated images: detected persons drawn into their frame, with options for layers, size and
//! file format. Frames can also be kept to be drawn into later.
//!
//! The drawings for a frame, stored separately from the frame.
//!
//! A frame that is kept with its sketch, so that it can be drawn later with other options, also on
//! another server.

use std::{str::FromStr, sync::Arc};

use bytes::Bytes;
use lookdown_common::JPEG_START;
use lookdown_detect::{
    parameter_table,
    parameters::{
        GivenParameters, Interface, ParameterDefault, ParameterError, ParameterKind, ParameterSpec,
    },
    pipeline::{DetectedFrame, DetectionReport, Person},
};
use lookdown_imaging::{
    Frame,
    annotate::{
        Cancelled, Concealment, Drawing, EncodeError, Head, Mark, OrientedMark, ZoneOutline,
        annotate_unless, conceal, encode_jpeg, encode_png,
    },
    decode::{DecodeError, DecodeLimits, decode},
    narrowed,
};
use lookdown_lens::geometry::OrientedBox;
use serde::{Deserialize, Serialize};
use strum::{EnumString, VariantArray, VariantNames};

/// A file format of images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageFormat {
    /// JPEG, in the quality of the options.
    Jpeg,
    /// PNG, lossless.
    Png,
}

/// The reason why there is no annotated image.
#[derive(Debug, thiserror::Error)]
pub enum AnnotationError {
    /// The client no longer waits for it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The frame is larger than the format allows.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// Draws the persons into their frame. Takes tens of milliseconds for a large frame: keep it off
/// the async runtime. Stops when the job is withdrawn.
///
/// # Errors
/// [`AnnotationError`] if the frame is larger than the format allows, or the job was withdrawn.
pub fn annotated_image(
    detected: DetectedFrame,
    format: ImageFormat,
    options: &AnnotationOptions,
) -> Result<Vec<u8>, AnnotationError> {
    let sketch = Sketch::new(&detected, &options.layers);
    let is_cancelled = || detected.withdrawn.is_cancelled();
    drawn(detected.frame, &sketch, format, options, &is_cancelled)
}

/// Returns the marks of all people to be concealed, in pixels of the frame: also of those that are
/// in no result.
pub(crate) fn marks_to_conceal(detected: &DetectedFrame) -> Vec<Mark> {
    Sketch::new(detected, &[]).concealed(detected.frame.width())
}

/// Draws into a frame, which may be smaller than the one that the sketch was made of.
fn drawn(
    frame: Arc<Frame>,
    sketch: &Sketch,
    format: ImageFormat,
    options: &AnnotationOptions,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Vec<u8>, AnnotationError> {
    let mut image = if frame.width() > options.width {
        narrowed(&frame, options.width)
    } else {
        Arc::unwrap_or_clone(frame)
    };
    let drawing = sketch.drawing(image.width(), &options.layers);
    for (layer, concealment) in [
        (Layer::Blur, Concealment::Blur),
        (Layer::Silhouette, Concealment::Silhouette),
    ] {
        if options.layers.contains(&layer) {
            let marks = sketch.concealed(image.width());
            conceal(&mut image, &marks, concealment, is_cancelled)?;
        }
    }
    annotate_unless(&mut image, &drawing, is_cancelled)?;
    let encoded = match format {
        ImageFormat::Jpeg => encode_jpeg(&image, options.quality),
        ImageFormat::Png => encode_png(&image),
    };
    Ok(encoded?)
}

const NO_LAYER: &str = "none";
const INTERFACES: &[Interface] = &[Interface::Http, Interface::CommandLine];

parameter_table! {
    /// The parameters of an annotated image.
    const TABLE;

    DRAW = ParameterSpec {
        name: "draw",
        kind: ParameterKind::Choices {
            names: <Layer as VariantNames>::VARIANTS,
            none: NO_LAYER,
        },
        default: ParameterDefault::Value("oriented,scores"),
        help: "Layers that are drawn into an annotated image, separated by commas. `blur` and \
               `silhouette` conceal the persons of the report, below the other layers.",
        example: None,
        interfaces: INTERFACES,
    };
    // More than a screen shows, and small enough that drawing costs no more than decoding.
    WIDTH = ParameterSpec {
        name: "width",
        kind: ParameterKind::Whole { min: 64, max: 8192 },
        default: ParameterDefault::Value("2048"),
        help: "Maximum width of an annotated image, pixels. A narrower frame is not enlarged.",
        example: Some("640"),
        interfaces: INTERFACES,
    };
    // Hardly distinguishable from the original.
    QUALITY = ParameterSpec {
        name: "quality",
        kind: ParameterKind::Whole { min: 1, max: 100 },
        default: ParameterDefault::Value("88"),
        help: "Quality of a JPEG.",
        example: None,
        interfaces: INTERFACES,
    };
}

/// Something that can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, EnumString, VariantArray, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Layer {
    /// The area of each person is blurred.
    Blur,
    /// The area of each person is filled with one color.
    Silhouette,
    /// Axis-parallel boxes.
    Boxes,
    /// Boxes turned along the persons.
    Oriented,
    /// The score of each person.
    Scores,
    /// The borders of the zones of the frame's calibration, with their names.
    Zones,
    /// The borders of the views through which the frame was seen.
    Views,
    /// The time at which the frame was captured, or else at which it arrived.
    Timestamp,
}

/// The drawings and the size of an annotated image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnnotationOptions {
    /// The layers, each once.
    pub layers: Vec<Layer>,
    /// Maximum width in pixels. A narrower frame is not enlarged.
    pub width: u32,
    /// Quality of a JPEG, 1 to 100.
    pub quality: u8,
}

impl AnnotationOptions {
    /// The specifications, in the order in which they are listed to users.
    pub const TABLE: &'static [ParameterSpec] = TABLE;

    /// Checks `(name, value)` pairs.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown or repeated name and for a value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        let given = GivenParameters::read(TABLE, pairs)?;
        let Layers(layers) = given.value(&DRAW)?;
        Ok(Self {
            layers,
            width: given.value(&WIDTH)?,
            quality: given.value(&QUALITY)?,
        })
    }
}

/// The value of `draw`.
struct Layers(Vec<Layer>);

impl FromStr for Layers {
    type Err = strum::ParseError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut layers = Vec::new();
        if text == NO_LAYER {
            return Ok(Self(layers));
        }
        for name in text.split(',') {
            let layer = name.parse()?;
            if !layers.contains(&layer) {
                layers.push(layer);
            }
        }
        Ok(Self(layers))
    }
}

/// The drawings for a frame. All positions are corner-origin pixels of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Sketch {
    frame_width: u32,
    /// The persons, with their scores.
    marks: Vec<Mark>,
    /// Boxes that hide people who are in no result; frames of earlier versions have none.
    #[serde(default)]
    others: Vec<[f64; 4]>,
    views: Vec<Vec<[f64; 2]>>,
    zones: Vec<ZoneOutline>,
    timestamp: String,
}

impl Sketch {
    /// Selects what these layers need from a detection.
    fn new(detected: &DetectedFrame, layers: &[Layer]) -> Self {
        let report = &detected.report;
        let views = layers.contains(&Layer::Views);
        let views = views.then(|| detected.view_outlines());
        let views = views.into_iter().flatten();
        let zones = layers.contains(&Layer::Zones);
        let zones = zones.then(|| detected.zone_outlines());
        Self {
            frame_width: detected.frame.width(),
            marks: report.persons.iter().map(mark).collect(),
            others: detected.boxes_of_others(),
            views: views
                .map(|outline| outline.iter().map(|at| [at.x, at.y]).collect())
                .collect(),
            zones: zones.unwrap_or_default(),
            timestamp: timestamp(report),
        }
    }

    /// Rounds lines to a tenth of a pixel: the error is invisible, and the text takes a third of
    /// the space.
    fn rounded(mut self) -> Self {
        for coordinate in self.lines().flatten().flatten() {
            *coordinate = (*coordinate * 10.0).round() / 10.0;
        }
        self
    }

    /// The marks of all people to be concealed, in pixels of an image of this width: also of those
    /// who are in no result.
    fn concealed(&self, image_width: u32) -> Vec<Mark> {
        let factor = f64::from(image_width) / f64::from(self.frame_width.max(1));
        let others = self.others.iter().map(|&bbox| Mark::new(bbox, ""));
        let marks = self.marks.iter().cloned().chain(others);
        marks.map(|mark| mark.scaled(factor)).collect()
    }

    /// The drawing of these layers, in pixels of an image of this width.
    fn drawing(&self, image_width: u32, layers: &[Layer]) -> Drawing {
        let factor = f64::from(image_width) / f64::from(self.frame_width.max(1));
        let draws = |layer| layers.contains(&layer);
        let mut sketch = self.clone();
        for coordinate in sketch.lines().flatten().flatten() {
            *coordinate *= factor;
        }
        let marks = sketch.marks.into_iter().map(|mark| {
            let mark = mark.scaled(factor);
            let label = if draws(Layer::Scores) {
                mark.label
            } else {
                String::new()
            };
            Mark { label, ..mark }
        });
        Drawing {
            marks: marks.collect(),
            boxes: draws(Layer::Boxes),
            oriented: draws(Layer::Oriented),
            lines: wanted(draws(Layer::Views), sketch.views),
            zones: wanted(draws(Layer::Zones), sketch.zones),
            caption: wanted(draws(Layer::Timestamp), sketch.timestamp),
        }
    }

    fn lines(&mut self) -> impl Iterator<Item = &mut Vec<[f64; 2]>> {
        let zones = self.zones.iter_mut().flat_map(|zone| &mut zone.lines);
        self.views.iter_mut().chain(zones)
    }
}

fn wanted<T: Default>(is_wanted: bool, what: T) -> T {
    if is_wanted { what } else { T::default() }
}

/// The time at which the frame was taken, or else received, to the second.
fn timestamp(report: &DetectionReport) -> String {
    let time = report.captured_at.unwrap_or(report.received_at);
    time.strftime("%Y-%m-%d %H:%M:%S UTC").to_string()
}

/// The person's mark, with the score on its label.
fn mark(person: &Person) -> Mark {
    let oriented = &person.oriented_box;
    Mark {
        bbox: person.bbox.corners(),
        oriented: Some(OrientedMark {
            cx: oriented.center.x,
            cy: oriented.center.y,
            width: oriented.width,
            height: oriented.height,
            angle_deg: oriented.angle.to_degrees(),
        }),
        head: Some(head(oriented)),
        label: format!("{:.2}", person.score),
    }
}

/// The circle that touches the upper short side and both long sides of the box.
fn head(oriented: &OrientedBox) -> Head {
    let radius = oriented.width.min(oriented.height) / 2.0;
    let center = oriented.center + oriented.up * (oriented.height / 2.0 - radius);
    Head {
        cx: center.x,
        cy: center.y,
        radius,
    }
}

/// Wider frames are scaled down to the first of these widths, and to the next one while their files
/// are too large.
const KEPT_WIDTHS: [u32; 3] = [2560, 1280, 640];
/// High enough that the loss is hardly visible, even after a second encoding.
const KEPT_QUALITY: u8 = 92;
/// 4 MiB: cameras deliver smaller frames.
const MAX_BYTES: usize = 4 << 20;

/// A kept frame. Areas that the calibration masks are masked in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredFrame {
    /// The frame, at most 4 MiB.
    pub jpeg: Bytes,
    /// The drawings that can be added to it, JSON.
    pub sketch: Bytes,
}

/// The reason why a frame cannot be kept or drawn.
#[derive(Debug, thiserror::Error)]
pub enum StoredFrameError {
    /// The sketch cannot be serialized or parsed.
    #[error("the sketch of a kept frame is invalid: {0}")]
    Sketch(#[from] serde_json::Error),
    /// The frame cannot be decoded.
    #[error("a kept frame cannot be decoded: {0}")]
    Frame(#[from] DecodeError),
    /// The frame cannot be encoded.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The image cannot be drawn.
    #[error(transparent)]
    Annotation(#[from] AnnotationError),
    /// The frame is too large at every width.
    #[error("a frame takes more than {MAX_BYTES} bytes as a JPEG of {} pixels across", KEPT_WIDTHS[2])]
    TooLarge,
}

impl StoredFrame {
    /// Keeps a frame, with its persons concealed if `concealment` is given: its original JPEG, if
    /// that is small enough and nothing is masked or concealed, else a new one. A new one takes
    /// tens of milliseconds for a large frame: keep it off the async runtime.
    ///
    /// # Errors
    /// [`StoredFrameError`] for a frame that cannot be kept.
    pub fn new(
        detected: &DetectedFrame,
        concealment: Option<Concealment>,
    ) -> Result<Self, StoredFrameError> {
        let sketch = Sketch::new(detected, <Layer as VariantArray>::VARIANTS).rounded();
        let jpeg = match (concealment, &detected.encoded) {
            (Some(concealment), _) => {
                let mut frame = Frame::clone(&detected.frame);
                let marks = sketch.concealed(frame.width());
                let is_cancelled = || detected.withdrawn.is_cancelled();
                conceal(&mut frame, &marks, concealment, &is_cancelled)
                    .map_err(AnnotationError::from)?;
                jpeg_of(&frame)?
            }
            (None, Some(encoded)) if is_kept_as_it_is(encoded, &detected.frame) => {
                // A copy, so that the rest of the request body can be freed.
                Bytes::copy_from_slice(encoded)
            }
            _ => jpeg_of(&detected.frame)?,
        };
        let sketch = serde_json::to_vec(&sketch)?.into();
        Ok(Self { jpeg, sketch })
    }

    /// Returns the memory that it takes, bytes.
    pub fn bytes(&self) -> usize {
        self.jpeg.len() + self.sketch.len()
    }

    /// Returns the frame as JPEG with the drawings that the options select. Takes as long as
    /// keeping it, and stops when `is_cancelled` returns true.
    ///
    /// # Errors
    /// [`StoredFrameError`] for data that [`StoredFrame::new`] has not made.
    pub fn annotated(
        &self,
        options: &AnnotationOptions,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<u8>, StoredFrameError> {
        let sketch: Sketch = serde_json::from_slice(&self.sketch)?;
        let frame = decode(&self.jpeg, &DecodeLimits::default())?.frame;
        Ok(drawn(
            Arc::new(frame),
            &sketch,
            ImageFormat::Jpeg,
            options,
            is_cancelled,
        )?)
    }
}

fn is_kept_as_it_is(encoded: &[u8], frame: &Frame) -> bool {
    encoded.starts_with(JPEG_START) && encoded.len() <= MAX_BYTES && frame.width() <= KEPT_WIDTHS[0]
}

/// Encodes a frame as JPEG, scaled down until it is small enough.
fn jpeg_of(frame: &Frame) -> Result<Bytes, StoredFrameError> {
    for width in KEPT_WIDTHS {
        let jpeg = if frame.width() > width {
            encode_jpeg(&narrowed(frame, width), KEPT_QUALITY)?
        } else {
            encode_jpeg(frame, KEPT_QUALITY)?
        };
        if jpeg.len() <= MAX_BYTES {
            return Ok(jpeg.into());
        }
    }
    Err(StoredFrameError::TooLarge)
}

#[cfg(test)]
mod tests {
    use lookdown_detect::parameters::ParameterFault;

    use super::*;

    #[test]
    fn every_layer_is_read_by_its_name_once() {
        let names = <Layer as VariantNames>::VARIANTS.join(",") + ",boxes";
        let pairs = [("draw", &*names), ("width", "640"), ("quality", "100")];
        let options = AnnotationOptions::parse(pairs).unwrap();
        assert_eq!(options.layers, <Layer as VariantArray>::VARIANTS);
        assert_eq!((options.width, options.quality), (640, 100));
    }

    #[test]
    fn defaults_are_those_of_the_table() {
        let default = AnnotationOptions::parse([]).unwrap();
        assert_eq!(default.layers, [Layer::Oriented, Layer::Scores]);
        assert_eq!((default.width, default.quality), (2048, 88));
        let none = AnnotationOptions::parse([("draw", "none")]).unwrap();
        assert!(none.layers.is_empty());
    }

    #[test]
    fn values_out_of_range_are_refused_by_name() {
        for (name, value) in [
            ("draw", "hats"),
            ("draw", ""),
            ("draw", "none,boxes"),
            ("width", "63"),
            ("width", "8193"),
            ("width", "-1"),
            ("quality", "0"),
            ("quality", "101"),
            ("quality", "1000"),
            ("quality", "high"),
        ] {
            let error = AnnotationOptions::parse([(name, value)]).unwrap_err();
            assert_eq!(error.name, name, "{value:?}");
            assert_eq!(error.fault, ParameterFault::BadValue);
        }
        let error = AnnotationOptions::parse([("draw", "hats")]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "draw: \"hats\" is not none or a comma-separated list of blur, silhouette, boxes, oriented, scores, \
             zones, views, timestamp"
        );
    }
}

//! A small detector for tests. It detects bright blobs instead of persons, so that geometry,
//! merging and scheduling can be tested without weights.

use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;
use jiff::Timestamp;
use lookdown_calibration::{Calibration, CalibrationFile, CalibrationId};
use lookdown_lens::geometry::Posture;

use super::{
    BatchOptions, CalibrationLookup, DetectJob, Engine, EngineOptions, JobImage, Ticket,
    UnusableCalibration,
};
use crate::{
    detection::{BBox, ViewPixels},
    inference::{Detector, HeadOutput, InferenceError, Model, ModelRegistry, ViewDetection},
    parameters::DetectParameters,
};
use lookdown_imaging::{Frame, NetworkInput, ViewBatch, annotate::encode_png};

pub(super) struct BlobDetector {
    pub(super) name: &'static str,
    /// Finds the bounding box of all pixels in a view that are brighter than this.
    pub(super) bright: f32,
    /// True if it tells postures.
    pub(super) tells_postures: bool,
    /// A posture for everyone who is found, with a score of its own.
    pub(super) posture: Option<Posture>,
    pub(super) input: NetworkInput,
    /// Called before each batch.
    pub(super) before: Box<dyn FnMut() -> Result<(), InferenceError> + Send>,
}

impl Default for BlobDetector {
    fn default() -> Self {
        Self {
            name: "blob",
            bright: 200.0,
            tells_postures: false,
            posture: None,
            input: NetworkInput::plain(96, 96),
            before: Box::new(|| Ok(())),
        }
    }
}

impl Detector for BlobDetector {
    fn name(&self) -> &'static str {
        self.name
    }

    fn revision(&self) -> &'static str {
        "1"
    }

    fn input(&self) -> &NetworkInput {
        &self.input
    }

    fn tells_postures(&self) -> bool {
        self.tells_postures
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        (self.before)()?;
        let views = batch.values().chunks_exact(self.input.view_len());
        Ok(HeadOutput {
            per_view: views.map(|view| self.find(view)).collect(),
            non_finite: 0,
        })
    }
}

impl BlobDetector {
    fn find(&self, view: &[f32]) -> Vec<ViewDetection> {
        let width = self.input.width;
        let bright = (0..)
            .zip(&view[..self.input.plane_len()])
            .filter(|&(_, &value)| value > self.bright)
            .map(|(index, _)| [index % width, index / width].map(f64::from));
        let hull = bright
            .map(|[x, y]| [x, y, x + 1.0, y + 1.0])
            .reduce(|a, b| {
                [
                    a[0].min(b[0]),
                    a[1].min(b[1]),
                    a[2].max(b[2]),
                    a[3].max(b[3]),
                ]
            });
        let found = hull.and_then(|sides| BBox::new(sides).ok());
        // A blob cut off by the border gets a lower score, as from a real detector.
        let whole = |bbox: &BBox<ViewPixels>| {
            let sides = bbox.corners();
            let right = f64::from(self.input.width);
            sides.iter().all(|&side| side > 0.0 && side < right)
        };
        let postures = [Some(None), self.posture.map(Some)];
        let postures = postures.into_iter().flatten();
        found.map_or_else(Vec::new, |bbox| {
            let detection = |posture: Option<Posture>| ViewDetection {
                // Votes for people on the floor are about .5.
                score: if whole(&bbox) { 0.9 } else { 0.2 } * posture.map_or(1.0, |_| 0.6),
                bbox,
                posture,
            };
            postures.map(detection).collect()
        })
    }
}

/// Returns the calibration `lobby` for frames of 600 × 600 pixels, 3 m above the floor, with these
/// areas.
pub(super) fn calibration(areas: &str) -> Arc<Calibration> {
    let content = format!(
        r#"{{ "id": "lobby", "image": {{"width": 600, "height": 600}},
             "lens": {{"model": "equidistant", "focal": 190.9859, "cx": 299.5, "cy": 299.5,
                       "max_theta": 1.5707}},
             "mount": {{"world_up": [0, 0, -1], "height_m": 3}} {areas} }}"#
    );
    let file = CalibrationFile::parse(content.as_bytes()).unwrap();
    let (_, checked) = file
        .calibrations("lobby", content.as_bytes())
        .swap_remove(0);
    Arc::new(checked.unwrap())
}

/// A lookup that knows one calibration.
impl CalibrationLookup for Calibration {
    fn get(&self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, UnusableCalibration> {
        Ok((self.id() == id).then(|| Arc::new(self.clone())))
    }
}

pub(super) fn engine(
    detector: BlobDetector,
    calibrations: Option<Arc<dyn CalibrationLookup>>,
) -> Engine {
    let options = EngineOptions {
        batches: BatchOptions {
            max_views: NonZeroUsize::new(5).unwrap(),
            max_delay: Duration::ZERO,
        },
        remap_threads: NonZeroUsize::new(2).unwrap(),
        ..EngineOptions::for_testing("blob")
    };
    let models = ModelRegistry::default();
    models
        .put(Arc::new(Model::new(Box::new(detector))))
        .unwrap();
    Engine::new(Arc::new(models), calibrations, options, Arc::default()).unwrap()
}

/// A gray lens image on black, `side` pixels wide, with a white disc.
pub(super) fn frame_with_disc(side: u32, center: [f64; 2], radius: f64) -> Bytes {
    frame_with_bar(side, center, [0.0; 2], radius)
}

/// The same with a white bar, which reaches as far as `half` and back from its middle.
pub(super) fn frame_with_bar(side: u32, center: [f64; 2], half: [f64; 2], radius: f64) -> Bytes {
    let length2 = half[0].powi(2) + half[1].powi(2);
    let middle = f64::from(side) / 2.0;
    let mut pixels = Vec::with_capacity(side as usize * side as usize * 3);
    for y in 0..side {
        for x in 0..side {
            let at = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let within = |c: [f64; 2], r: f64| (at[0] - c[0]).hypot(at[1] - c[1]) <= r;
            let along = (at[0] - center[0]) * half[0] + (at[1] - center[1]) * half[1];
            let share = (along / length2.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            let nearest = [0, 1].map(|axis| center[axis] + share * half[axis]);
            let value = if within(nearest, radius) {
                255
            } else if within([middle, middle], middle - 1.0) {
                110
            } else {
                0
            };
            pixels.extend([value; 3]);
        }
    }
    encode_png(&Frame::new(side, side, pixels).unwrap())
        .unwrap()
        .into()
}

pub(super) fn job(image: Bytes, parameters: &[(&str, &str)]) -> DetectJob {
    DetectJob {
        request_id: "test".to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        arrived: Instant::now(),
        ticket: Ticket::default(),
        image: JobImage::Encoded(image),
        parameters: DetectParameters::parse(parameters.iter().copied()).unwrap(),
        calibration: None,
    }
}

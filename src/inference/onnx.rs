//! Detectors run by ONNX Runtime. The only module that names `ort`.

mod environment;

use std::{num::NonZeroUsize, path::Path};

use ort::{
    session::Session,
    value::{TensorRef, ValueType},
};

use super::{Detector, InferenceError, ModelManifest, ViewDetection};
use crate::{
    detection::BBox,
    imaging::{NetworkInput, ViewBatch},
    revision::revision_of,
};

/// Network input sides accepted, pixels.
const INPUT_SIDE: std::ops::RangeInclusive<i64> = 32..=4096;

/// How a model is run.
#[derive(Debug, Clone, PartialEq)]
pub struct OnnxOptions {
    /// Threads within one run of the network.
    pub threads: NonZeroUsize,
    /// Boxes with a lower score are dropped, 0 to 1.
    pub score_floor: f64,
    /// The best so many boxes of a view are kept.
    pub max_detections_per_view: usize,
}

/// A model with the outputs `boxes` `[views, candidates, 4]` (`x_min, y_min, x_max, y_max`, view
/// pixels) and `scores` `[views, candidates]` (of being a person, 0 to 1).
pub struct OnnxDetector {
    session: Session,
    name: String,
    revision: String,
    input_name: String,
    input: NetworkInput,
    options: OnnxOptions,
}

impl OnnxDetector {
    /// Loads ONNX Runtime from `library` (once per process) and the model at `model`: a folder
    /// with a `model.toml`, or an ONNX file.
    ///
    /// # Errors
    /// [`InferenceError`] when the library or the model cannot be used.
    pub fn load(
        library: &Path,
        model: &Path,
        options: OnnxOptions,
    ) -> Result<Self, InferenceError> {
        let environment = environment::load(library)?;
        let manifest = ModelManifest::locate(model)?;
        let path = manifest.onnx.as_path();
        let bytes = std::fs::read(path).map_err(|error| InferenceError::Unreadable {
            path: path.to_owned(),
            detail: error.to_string(),
        })?;
        let unusable = |problem: String| InferenceError::Unusable {
            path: path.to_owned(),
            problem,
        };
        let session = build_session(environment, &bytes, options.threads)
            .map_err(|error| unusable(error.to_string()))?;
        let (input_name, width, height) = check_input(&session).map_err(unusable)?;
        check_outputs(&session).map_err(unusable)?;
        Ok(Self {
            session,
            name: manifest.name,
            revision: revision_of(&bytes),
            input_name,
            input: NetworkInput {
                width,
                height,
                channel_order: manifest.input.channel_order,
                scale: manifest.input.scale,
                offset: manifest.input.offset,
            },
            options,
        })
    }
}

fn build_session(
    environment: &ort::environment::Environment,
    model: &[u8],
    threads: NonZeroUsize,
) -> Result<Session, ort::Error> {
    // Idle pool threads must not spin: they would steal the cores that decode and remap.
    Session::builder(environment)?
        .with_intra_threads(threads.get())?
        .with_intra_op_spinning(false)?
        .commit_from_memory(model)
}

/// The name, width and height of the model's only input, `[views, 3, height, width]` of `f32`.
fn check_input(session: &Session) -> Result<(String, u32, u32), String> {
    let [input] = session.inputs() else {
        let count = session.inputs().len();
        return Err(format!(
            "it has {count} inputs; one picture input is needed"
        ));
    };
    let wanted = "[views, 3, height, width] of 32-bit floats";
    let ValueType::Tensor { ty, shape, .. } = input.dtype() else {
        return Err(format!(
            "its input {:?} is no tensor; {wanted} is needed",
            input.name()
        ));
    };
    let dimensions: &[i64] = shape;
    let sides = match *dimensions {
        [views, 3, height, width] if views != 0 => Some((width, height)),
        _ => None,
    };
    match sides {
        Some((width, height))
            if *ty == ort::value::TensorElementType::Float32
                && INPUT_SIDE.contains(&width)
                && INPUT_SIDE.contains(&height) =>
        {
            let side = |pixels: i64| u32::try_from(pixels).unwrap_or(u32::MAX);
            Ok((input.name().to_owned(), side(width), side(height)))
        }
        _ => Err(format!(
            "its input {:?} is {ty:?} {dimensions:?}; {wanted} with fixed sides of {} to {} is \
             needed",
            input.name(),
            INPUT_SIDE.start(),
            INPUT_SIDE.end()
        )),
    }
}

fn check_outputs(session: &Session) -> Result<(), String> {
    for name in ["boxes", "scores"] {
        if !session.outputs().iter().any(|output| output.name() == name) {
            let found: Vec<_> = session
                .outputs()
                .iter()
                .map(ort::value::Outlet::name)
                .collect();
            return Err(format!(
                "it has the outputs {}; `boxes` and `scores` are needed",
                found.join(", ")
            ));
        }
    }
    Ok(())
}

impl Detector for OnnxDetector {
    fn name(&self) -> &str {
        &self.name
    }

    fn revision(&self) -> &str {
        &self.revision
    }

    fn input(&self) -> &NetworkInput {
        &self.input
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<Vec<Vec<ViewDetection>>, InferenceError> {
        let failed = |error: ort::Error| InferenceError::Run(error.to_string());
        let shape = [
            batch.views(),
            3,
            self.input.height as usize,
            self.input.width as usize,
        ];
        let tensor = TensorRef::from_array_view((shape, batch.values())).map_err(failed)?;
        let outputs = self
            .session
            .run(ort::inputs![self.input_name.as_str() => tensor])
            .map_err(failed)?;
        let (_, boxes) = outputs["boxes"]
            .try_extract_tensor::<f32>()
            .map_err(failed)?;
        let (_, scores) = outputs["scores"]
            .try_extract_tensor::<f32>()
            .map_err(failed)?;
        let candidates = scores.len() / batch.views().max(1);
        if candidates * batch.views() != scores.len() || boxes.len() != scores.len() * 4 {
            return Err(InferenceError::Run(format!(
                "{} scores and {} box sides came back for {} views",
                scores.len(),
                boxes.len(),
                batch.views()
            )));
        }
        let per_view = boxes
            .chunks_exact(candidates.max(1) * 4)
            .zip(scores.chunks_exact(candidates.max(1)));
        Ok(per_view
            .map(|(boxes, scores)| decode_view(boxes, scores, &self.input, &self.options))
            .collect())
    }
}

/// Keeps the best boxes above the floor, clipped to the view. Values that are not finite are
/// dropped here, where they arise.
fn decode_view(
    boxes: &[f32],
    scores: &[f32],
    input: &NetworkInput,
    options: &OnnxOptions,
) -> Vec<ViewDetection> {
    let view = BBox::new([0.0, 0.0, f64::from(input.width), f64::from(input.height)]).ok();
    let mut found: Vec<ViewDetection> = boxes
        .chunks_exact(4)
        .zip(scores)
        .filter(|&(_, &score)| f64::from(score) >= options.score_floor && score <= 1.0)
        .filter_map(|(sides, &score)| {
            let sides = [0, 1, 2, 3].map(|side| f64::from(sides[side]));
            let bbox = BBox::new(sides).ok()?.clipped_to(&view?)?;
            Some(ViewDetection {
                bbox,
                score: f64::from(score),
            })
        })
        .collect();
    if found.len() > options.max_detections_per_view {
        found.select_nth_unstable_by(options.max_detections_per_view, |a, b| {
            b.score.total_cmp(&a.score)
        });
        found.truncate(options.max_detections_per_view);
    }
    found
}

#[cfg(test)]
mod tests;

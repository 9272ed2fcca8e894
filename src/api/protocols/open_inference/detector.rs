//! The loaded detectors: accept views and return the detections in each.

use std::{sync::Arc, time::Instant};

use lookdown_detect::{
    inference::{HeadOutput, Model},
    open_inference::{Datatype, metadata::ModelMetadata},
    parameters::{DetectParameters, Interface, ParameterError},
    pipeline::ClientViewsJob,
};

use super::{
    answer::{Answerer, InferAnswer, Output, OutputValues},
    infer_parameters::{TIMEOUT, as_texts},
    own_metadata::{NAME, tensor},
    request::InferRequest,
    tensor::{Tensor, Values, misfit},
};
use crate::api::{
    ApiState,
    detect::run::wait_for_workers,
    http::{context::RequestContext, problem::Problem, query::pairs, request_body::Held},
};

const INPUT: &str = "views";
const OUTPUTS: [&str; 2] = ["boxes", "scores"];

/// Returns the inputs and outputs of a detector.
pub(super) fn metadata(model: &Model) -> ModelMetadata {
    let input = model.input();
    let (width, height) = (input.width.into(), input.height.into());
    let [boxes, scores] = OUTPUTS;
    ModelMetadata {
        name: model.name().to_owned(),
        versions: vec![model.revision().to_owned()],
        platform: NAME.to_owned(),
        inputs: vec![tensor(INPUT, Datatype::Fp32, [-1, 3, height, width])],
        outputs: vec![
            tensor(boxes, Datatype::Fp32, [-1, -1, 4]),
            tensor(scores, Datatype::Fp32, [-1, -1]),
        ],
    }
}

pub(super) async fn infer(
    state: &ApiState,
    context: &RequestContext,
    model: Arc<Model>,
    mut request: InferRequest,
    arrived: Instant,
) -> Result<InferAnswer, Problem> {
    request.wanted.check(&OUTPUTS)?;
    let pixels = Box::new(pixels(request.only_input(INPUT)?, &model)?);
    let parameters = view_parameters(&request)?;
    let ticket = context.caller.ticket_at(parameters.priority)?;
    let timeline = ticket.timeline.clone();
    let job = ClientViewsJob {
        arrived,
        ticket,
        model: Arc::clone(&model),
        pixels,
    };
    let work = state.workers.infer_and(job, move |found| {
        let answerer = Answerer {
            model: model.name(),
            version: model.revision(),
            id: request.id.as_deref(),
        };
        InferAnswer::write(&answerer, &outputs(&found), &request.wanted)
    });
    wait_for_workers(context, parameters.timeout, &timeline, work).await?
}

/// Returns the pixels of views of the model's input size.
fn pixels(views: Tensor, model: &Model) -> Result<Held<Vec<f32>>, Problem> {
    let (width, height) = (model.input().width, model.input().height);
    let sides = [3, height as usize, width as usize];
    let shape = views.shape;
    match views.values {
        Values::Numbers(numbers) if shape.len() == 4 && shape[0] > 0 && shape[1..] == sides => {
            Ok(numbers)
        }
        Values::Numbers(_) => {
            let wrong = format!(
                "its shape is {shape:?}: send [views, 3, {height}, {width}] with at least one view"
            );
            Err(misfit(INPUT, &wrong))
        }
        Values::Frames(_) => {
            let wrong = "send the datatype FP32 or UINT8: planes of red, green and blue, 0 to 255";
            Err(misfit(INPUT, wrong))
        }
    }
}

/// Checks the parameters of a request. A detector has few of them.
fn view_parameters(request: &InferRequest) -> Result<DetectParameters, Problem> {
    let offered = DetectParameters::TABLE.iter();
    let offered = offered.filter(|spec| spec.is_offered_by(Interface::Detector));
    let known: Vec<_> = offered.map(|spec| spec.name).chain([TIMEOUT]).collect();
    let mut names = request.parameters.iter().map(|(name, _)| name.as_str());
    if let Some(other) = names.find(|name| !known.contains(name)) {
        let known = known.join(", ");
        let problem = format!("a detector has no such parameter; the parameters are {known}");
        return Err(ParameterError::unknown(other, problem).into());
    }
    let given = as_texts(&request.parameters)?;
    Ok(DetectParameters::parse(pairs(&given))?)
}

/// Returns `[views, candidates, 4]` and `[views, candidates]`, padded to the largest number of
/// candidates.
#[expect(
    clippy::cast_possible_truncation,
    reason = "FP32 outputs have this precision"
)]
fn outputs(found: &HeadOutput) -> [Output; 2] {
    let views = found.per_view.len();
    let candidates = found.per_view.iter().map(Vec::len).max().unwrap_or(0);
    let mut boxes = vec![0.0; views * candidates * 4];
    let mut scores = vec![0.0; views * candidates];
    for (view, found) in found.per_view.iter().enumerate() {
        for (index, detection) in found.iter().enumerate() {
            let place = view * candidates + index;
            let corners = detection.bbox.corners().map(|side| side as f32);
            boxes[4 * place..][..4].copy_from_slice(&corners);
            scores[place] = detection.score as f32;
        }
    }
    let output = |name, shape, values| Output {
        name,
        shape,
        values: OutputValues::Floats(values),
    };
    [
        output(OUTPUTS[0], vec![views, candidates, 4], boxes),
        output(OUTPUTS[1], vec![views, candidates], scores),
    ]
}

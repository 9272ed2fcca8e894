//! The model `lookdown`: accepts a frame and returns its persons.

use std::time::Instant;

use jiff::Timestamp;

use super::{
    answer::{Answerer, InferAnswer, Output, OutputValues},
    infer_parameters::as_texts,
    own_metadata::{NAME, tensor},
    request::InferRequest,
    tensor::{Values, misfit},
};
use crate::{
    api::{
        ApiState,
        caller::Caller,
        detect_parameters::detect_parameters,
        http::{deadline::Deadline, problem::Problem, query::pairs},
        report::ReportPerson,
        report_headers::report_headers,
        run_detection::{DetectionOutcome, run_detection},
    },
    open_inference::{Datatype, metadata::ModelMetadata},
    pipeline::DetectJob,
    telemetry::RequestTrace,
};

/// The model that detects persons in frames.
pub(super) const FRAME_MODEL: &str = "lookdown";
/// The version of its inputs and outputs.
pub(super) const FRAME_MODEL_VERSION: &str = "1";
const INPUT: &str = "image";
const OUTPUTS: [&str; 5] = ["boxes", "scores", "oriented_boxes", "views", "report"];

/// Returns the inputs and outputs of the model.
pub(super) fn metadata() -> ModelMetadata {
    let [boxes, scores, oriented_boxes, views, report] = OUTPUTS;
    ModelMetadata {
        name: FRAME_MODEL.to_owned(),
        versions: vec![FRAME_MODEL_VERSION.to_owned()],
        platform: NAME.to_owned(),
        inputs: vec![tensor(INPUT, Datatype::Bytes, [1])],
        outputs: vec![
            tensor(boxes, Datatype::Fp32, [-1, 4]),
            tensor(scores, Datatype::Fp32, [-1]),
            tensor(oriented_boxes, Datatype::Fp32, [-1, 5]),
            tensor(views, Datatype::Int32, [-1]),
            tensor(report, Datatype::Bytes, [1]),
        ],
    }
}

pub(super) async fn infer(
    state: &ApiState,
    caller: &Caller,
    trace: &RequestTrace,
    mut request: InferRequest,
    (deadline, received_at, arrived): (Deadline, Timestamp, Instant),
) -> Result<InferAnswer, Problem> {
    request.wanted.check(&OUTPUTS)?;
    let Values::Frame(image) = request.only_input(INPUT)?.values else {
        return Err(misfit(INPUT, "send the datatype BYTES: an encoded frame"));
    };
    if image.is_empty() {
        return Err(misfit(INPUT, "it is empty: send an encoded frame"));
    }
    let given = as_texts(&request.parameters)?;
    let parameters = detect_parameters(state, pairs(&given).collect(), &[])?;
    let ticket = caller.ticket_at(parameters.priority)?;
    let job = DetectJob::sent(image, parameters, ticket, received_at, arrived);
    let write = move |found: DetectionOutcome<'_>| {
        let answerer = Answerer {
            model: FRAME_MODEL,
            version: FRAME_MODEL_VERSION,
            id: request.id.as_deref(),
        };
        let report = OutputValues::Text(found.json.clone());
        let outputs = outputs(&found.report.persons, report);
        InferAnswer::write(&answerer, &outputs, &request.wanted)
    };
    let (report, mut answer) = run_detection(state, trace, deadline, job, write).await?;
    answer.report_headers = report_headers(&report).into();
    Ok(answer)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "FP32 outputs have this precision"
)]
fn outputs(persons: &[ReportPerson], report: OutputValues) -> Vec<Output> {
    let count = persons.len();
    let floats = |of: fn(&ReportPerson) -> Vec<f64>| {
        let values = persons.iter().flat_map(of).map(|value| value as f32);
        OutputValues::Floats(values.collect())
    };
    let boxes = floats(|person| {
        let bbox = &person.bbox;
        vec![bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max]
    });
    let oriented_boxes = floats(|person| {
        let turned = &person.oriented_box;
        let [cx, cy] = [turned.cx, turned.cy];
        vec![cx, cy, turned.width, turned.height, turned.angle_deg]
    });
    let views = persons.iter().map(|person| person.views);
    let views = views.map(|views| i32::try_from(views).unwrap_or(i32::MAX));
    let shapes_and_values = [
        (vec![count, 4], boxes),
        (vec![count], floats(|person| vec![person.score])),
        (vec![count, 5], oriented_boxes),
        (vec![count], OutputValues::Integers(views.collect())),
        (vec![1], report),
    ];
    let named = OUTPUTS.into_iter().zip(shapes_and_values);
    let output = |(name, (shape, values))| Output {
        name,
        shape,
        values,
    };
    named.map(output).collect()
}

//! The model `lookdown`: a frame in, its persons out.

use std::time::Instant;

use jiff::Timestamp;

use super::{
    FRAME_MODEL, FRAME_MODEL_VERSION,
    answer::{Answerer, InferAnswer, Output, OutputValues},
    metadata::{ModelMetadata, tensor},
    request::InferRequest,
    request_head::Parameter,
    tensor::{Values, misfit},
};
use crate::{
    api::{
        ApiState,
        deadline::Deadline,
        detect::{DEFAULT_SCORE_THRESHOLD, facts},
        find::{Found, find},
        problem::Problem,
        report::ReportPerson,
        request_id::RequestId,
    },
    open_inference::Datatype,
    pipeline::{DetectJob, DetectParameters, ParameterError},
    telemetry::RequestTrace,
};

const INPUT: &str = "image";
const OUTPUTS: [&str; 5] = ["boxes", "scores", "oriented_boxes", "views", "report"];
/// The protocol's own name of `timeout_millis`; it counts microseconds.
const TIMEOUT: &str = "timeout";
const MICROS_PER_MILLI: u64 = 1000;

/// What it takes and answers.
pub(super) fn metadata() -> ModelMetadata {
    let [boxes, scores, oriented_boxes, views, report] = OUTPUTS;
    ModelMetadata {
        name: FRAME_MODEL.to_owned(),
        versions: [FRAME_MODEL_VERSION.to_owned()],
        platform: "lookdown",
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
    request_id: &RequestId,
    trace: &RequestTrace,
    mut request: InferRequest,
    (deadline, received_at, arrived): (Deadline, Timestamp, Instant),
) -> Result<InferAnswer, Problem> {
    request.wanted.check(&OUTPUTS)?;
    let Values::Frame(image) = request.only_input(INPUT)?.values else {
        return Err(misfit(INPUT, "its datatype is BYTES: an encoded frame"));
    };
    if image.is_empty() {
        return Err(misfit(INPUT, "it is empty: send an encoded frame"));
    }
    let parameters = parameters(&request.parameters)?;
    let job = DetectJob::sent(image, parameters, request_id.as_str(), received_at, arrived);
    let write = move |found: Found<'_>| {
        let answerer = Answerer {
            model: FRAME_MODEL,
            version: FRAME_MODEL_VERSION,
            id: request.id.as_deref(),
        };
        let report = OutputValues::Text(found.json.clone());
        let outputs = outputs(&found.report.persons, report);
        InferAnswer::write(&answerer, &outputs, &request.wanted)
    };
    let (report, mut answer) = find(state, trace, deadline, job, write).await?;
    answer.facts = facts(&report).into();
    Ok(answer)
}

#[expect(clippy::cast_possible_truncation, reason = "this is what FP32 means")]
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

/// The parameters of `/detect` from those of a request.
pub(super) fn parameters(
    given: &[(String, Parameter)],
) -> Result<DetectParameters, ParameterError> {
    let texts = given.iter().map(|(name, value)| as_text(name, value));
    let texts = texts.collect::<Result<Vec<_>, _>>()?;
    let pairs = texts.iter().map(|(name, value)| (*name, value.as_str()));
    DetectParameters::parse(pairs, DEFAULT_SCORE_THRESHOLD)
}

/// A parameter as it would be written in a query.
fn as_text<'a>(name: &'a str, value: &Parameter) -> Result<(&'a str, String), ParameterError> {
    let wanted = match name {
        "calibration" | "camera" | "profile" | "refine" | "model" | "captured_at" => "a text",
        "motion" | "remember" => "true or false",
        _ => "a number",
    };
    let text = match (value, wanted) {
        (Parameter::Text(text), "a text") => text.clone(),
        (Parameter::Flag(flag), "true or false") => flag.to_string(),
        (Parameter::Number(number), "a number") => number.clone(),
        // Who asks for what is not there hears that first.
        _ if name != TIMEOUT && !DetectParameters::NAMES.contains(&name) => String::new(),
        _ => {
            return Err(ParameterError::bad_value(
                name,
                format!("{wanted} is needed"),
            ));
        }
    };
    if name != TIMEOUT {
        return Ok((name, text));
    }
    let micros = text.parse::<u64>();
    let micros = micros.map_err(|_| {
        ParameterError::bad_value(name, format!("{text} is no whole number of microseconds"))
    });
    Ok((
        "timeout_millis",
        micros?.div_ceil(MICROS_PER_MILLI).to_string(),
    ))
}

//! The model `lookdown`: accepts a frame and returns its persons.

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
        caller::Caller,
        deadline::Deadline,
        detect::facts,
        parameters::pairs,
        problem::Problem,
        report::ReportPerson,
        run_detection::{DetectionOutcome, run_detection},
    },
    open_inference::Datatype,
    pipeline::{DetectJob, DetectParameters, JsonType, ParameterError},
    telemetry::RequestTrace,
};

const INPUT: &str = "image";
const OUTPUTS: [&str; 5] = ["boxes", "scores", "oriented_boxes", "views", "report"];
/// The name of [`TIMEOUT_MILLIS`] in the protocol; its unit is microseconds.
pub(super) const TIMEOUT: &str = "timeout";
const TIMEOUT_MILLIS: &str = "timeout_millis";
const MICROS_PER_MILLI: u64 = 1000;

/// Returns the inputs and outputs of the model.
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
    let parameters = parameters(&request.parameters)?;
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
    answer.facts = facts(&report).into();
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

/// Returns the parameters of `/detect` among those of a request.
pub(super) fn parameters(
    given: &[(String, Parameter)],
) -> Result<DetectParameters, ParameterError> {
    let texts = given.iter().map(|(name, value)| match name.as_str() {
        TIMEOUT => timeout(value),
        _ => as_text(name, value),
    });
    let texts = texts.collect::<Result<Vec<_>, _>>()?;
    DetectParameters::parse(pairs(&texts))
}

/// Returns a parameter as text, as in a query. The value of an unknown one is omitted: its name is
/// refused.
fn as_text(name: &str, value: &Parameter) -> Result<(String, String), ParameterError> {
    let spec = DetectParameters::TABLE
        .iter()
        .find(|spec| spec.name == name);
    let text = match spec {
        Some(spec) => text_of(name, value, spec.kind.json_type())?,
        None => "",
    };
    Ok((name.to_owned(), text.to_owned()))
}

/// Converts the protocol's `timeout` to `timeout_millis`.
fn timeout(value: &Parameter) -> Result<(String, String), ParameterError> {
    let text = text_of(TIMEOUT, value, JsonType::Number)?;
    let micros: u64 = text
        .parse()
        .map_err(|_| ParameterError::is_not(TIMEOUT, text, "a whole number of microseconds"))?;
    let millis = micros.div_ceil(MICROS_PER_MILLI);
    Ok((TIMEOUT_MILLIS.to_owned(), millis.to_string()))
}

/// Returns the text of a value of a JSON type.
fn text_of<'a>(
    name: &str,
    value: &'a Parameter,
    wanted: JsonType,
) -> Result<&'a str, ParameterError> {
    match (value, wanted) {
        (Parameter::Text(text), JsonType::Text) | (Parameter::Number(text), JsonType::Number) => {
            Ok(text)
        }
        (Parameter::Flag(true), JsonType::Switch) => Ok("true"),
        (Parameter::Flag(false), JsonType::Switch) => Ok("false"),
        _ => {
            let problem = format!("{} is needed", wanted.described());
            Err(ParameterError::bad_value(name, problem))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_parameter_is_read_as_its_json_type() {
        for spec in DetectParameters::TABLE {
            let values = [
                (JsonType::Text, Parameter::Text("1".to_owned())),
                (JsonType::Number, Parameter::Number("1".to_owned())),
                (JsonType::Switch, Parameter::Flag(true)),
            ];
            for (json_type, value) in values {
                let read = as_text(spec.name, &value);
                let is_right = json_type == spec.kind.json_type();
                assert_eq!(read.is_ok(), is_right, "{}: {value:?}", spec.name);
            }
        }
    }

    #[test]
    fn timeout_in_microseconds_is_rounded_up() {
        let given = [("timeout".to_owned(), Parameter::Number("1500".to_owned()))];
        let timeout = parameters(&given).unwrap().timeout;
        assert_eq!(timeout, Some(std::time::Duration::from_millis(2)));
    }
}

//! The model `lookdown`: accepts frames and returns their persons.

use std::time::Instant;

use axum::{
    Json,
    extract::{Path, State},
    http::{HeaderName, HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse, Response},
};
use bytes::Bytes;
use jiff::Timestamp;
use lookdown_common::{report::ReportPerson, text::Quoted};
use lookdown_detect::{
    open_inference::{
        BINARY_EXTENSION, Datatype, HEAD_LENGTH, TensorValues,
        message::{Entries, InferResponse, Message, OutputParameters, OutputTensor, Parameter},
        metadata::{
            ModelMetadata, ModelReady, ServerLive, ServerMetadata, ServerReady, TensorMetadata,
        },
    },
    parameters::{DetectParameters, JsonType, ParameterError},
    pipeline::DetectJob,
};

use super::{
    request::InferRequest,
    tensor::{Wanted, misfit},
};
use crate::api::{
    ApiState,
    detect::{
        report::{PERSON_COUNT, report_headers},
        run::{AnswerInput, Answered, detect_parameters, run_detection},
    },
    http::{
        context::RequestContext,
        problem::{Problem, ProblemKind},
        query::pairs,
        rate_limit::RequestTokens,
    },
    require_scope::RequireDetect,
};

const INPUT: &str = "image";
const OUTPUTS: [&str; 6] = [
    "boxes",
    "scores",
    "oriented_boxes",
    "views",
    "counts",
    "report",
];

/// Returns the inputs and outputs of the model.
pub(super) fn metadata() -> ModelMetadata {
    let [boxes, scores, oriented_boxes, views, counts, report] = OUTPUTS;
    ModelMetadata {
        name: FRAME_MODEL.to_owned(),
        versions: vec![FRAME_MODEL_VERSION.to_owned()],
        platform: NAME.to_owned(),
        inputs: vec![tensor(INPUT, Datatype::Bytes, [-1])],
        outputs: vec![
            tensor(boxes, Datatype::Fp32, [-1, 4]),
            tensor(scores, Datatype::Fp32, [-1]),
            tensor(oriented_boxes, Datatype::Fp32, [-1, 5]),
            tensor(views, Datatype::Int32, [-1]),
            tensor(counts, Datatype::Int32, [-1]),
            tensor(report, Datatype::Bytes, [-1]),
        ],
    }
}

/// The times of the arrival of a frame.
#[derive(Clone, Copy)]
pub(super) struct ArrivalTimes {
    /// Time at which the request of the frame arrived.
    pub(super) received_at: Timestamp,
    /// Time at which the frame was in memory.
    pub(super) arrived: Instant,
}

/// Detects the persons in each frame of a request, one after another. A frame after the first is
/// admitted like a request of its own. The first failure ends the request.
pub(super) async fn infer(
    state: &ApiState,
    context: &RequestContext,
    mut request: InferRequest,
    mut times: ArrivalTimes,
    tokens: Option<RequestTokens>,
) -> Result<InferAnswer, Problem> {
    request.wanted.check(&OUTPUTS)?;
    let frames = request.only_input(INPUT)?.frames;
    if let Some(index) = frames.iter().position(Bytes::is_empty) {
        let wrong = format!("element {index} is empty: send an encoded frame");
        return Err(misfit(INPUT, &wrong));
    }
    let given = as_texts(&request.parameters)?;
    let parameters = detect_parameters(state, pairs(&given).collect(), &[])?;
    let is_batch = frames.len() > 1;
    let mut found = FrameOutputs::default();
    let mut headers = Vec::new();
    for (index, frame) in frames.into_iter().enumerate() {
        let ticket = context.caller.ticket_at(parameters.priority)?;
        let parameters = parameters.clone();
        let job = DetectJob::sent(frame, parameters, ticket, times.received_at, times.arrived);
        let tokens = tokens.as_ref().filter(|_| index > 0);
        let done = detect(state, context, job, tokens).await;
        let answered = done.map_err(|problem| {
            if is_batch {
                problem.for_element(INPUT, index)
            } else {
                problem
            }
        })?;
        headers = report_headers(&answered.report).into();
        found.append(answered.answer);
        times = ArrivalTimes {
            received_at: Timestamp::now(),
            arrived: Instant::now(),
        };
    }
    if is_batch {
        headers = vec![(PERSON_COUNT, HeaderValue::from(found.scores.len()))];
    }
    let write = move || InferAnswer::write(request.id, &found, &request.wanted, headers);
    context.deadline.blocking(write).await
}

/// Detects the persons in a frame, which takes one of the `tokens` of a rate limit.
async fn detect(
    state: &ApiState,
    context: &RequestContext,
    job: DetectJob,
    tokens: Option<&RequestTokens>,
) -> Result<Answered<FrameOutputs>, Problem> {
    if let Some(tokens) = tokens {
        tokens.take()?;
    }
    let write =
        |found: AnswerInput<'_>| Ok(FrameOutputs::new(&found.report.persons, found.json.clone()));
    run_detection(state, context, job, write).await
}

/// The outputs for the persons of one frame or several.
#[derive(Default)]
struct FrameOutputs {
    boxes: Vec<f32>,
    scores: Vec<f32>,
    oriented_boxes: Vec<f32>,
    views: Vec<i32>,
    /// The number of persons in each frame.
    counts: Vec<i32>,
    /// The report of each frame.
    reports: Vec<Bytes>,
}

impl FrameOutputs {
    /// Returns the outputs of one frame.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "FP32 outputs have this precision"
    )]
    fn new(persons: &[ReportPerson], report: Bytes) -> Self {
        let floats = |of: fn(&ReportPerson) -> Vec<f64>| {
            let values = persons.iter().flat_map(of);
            values.map(|value| value as f32).collect()
        };
        let integer = |count| i32::try_from(count).unwrap_or(i32::MAX);
        Self {
            boxes: floats(|person| {
                let bbox = &person.bbox;
                vec![bbox.x_min, bbox.y_min, bbox.x_max, bbox.y_max]
            }),
            scores: floats(|person| vec![person.score]),
            oriented_boxes: floats(|person| {
                let turned = &person.oriented_box;
                let [cx, cy] = [turned.cx, turned.cy];
                vec![cx, cy, turned.width, turned.height, turned.angle_deg]
            }),
            views: persons.iter().map(|person| integer(person.views)).collect(),
            counts: vec![integer(persons.len())],
            reports: vec![report],
        }
    }

    /// Adds the outputs of the next frame.
    fn append(&mut self, mut next: Self) {
        self.boxes.append(&mut next.boxes);
        self.scores.append(&mut next.scores);
        self.oriented_boxes.append(&mut next.oriented_boxes);
        self.views.append(&mut next.views);
        self.counts.append(&mut next.counts);
        self.reports.append(&mut next.reports);
    }

    /// Returns the shapes and the values, in the order of [`OUTPUTS`].
    fn tensors(&self) -> Result<[(Vec<usize>, TensorValues<'_>); 6], Problem> {
        let (persons, frames) = (self.scores.len(), self.reports.len());
        let reports = self.reports.iter().map(|report| str::from_utf8(report));
        let reports = reports.collect::<Result<_, _>>();
        let reports = reports.map_err(Problem::internal)?;
        Ok([
            (vec![persons, 4], TensorValues::Floats(&self.boxes)),
            (vec![persons], TensorValues::Floats(&self.scores)),
            (vec![persons, 5], TensorValues::Floats(&self.oriented_boxes)),
            (vec![persons], TensorValues::Integers(&self.views)),
            (vec![frames], TensorValues::Integers(&self.counts)),
            (vec![frames], TensorValues::Texts(reports)),
        ])
    }
}

/// The name of [`TIMEOUT_MILLIS`] in the protocol; its unit is microseconds.
const TIMEOUT: &str = "timeout";
const TIMEOUT_MILLIS: &str = "timeout_millis";
const MICROS_PER_MILLI: u64 = 1000;

/// Returns the parameters of a request as names and values of `/detect`.
fn as_texts(given: &[(String, Parameter)]) -> Result<Vec<(String, String)>, ParameterError> {
    let texts = given.iter().map(|(name, value)| match name.as_str() {
        TIMEOUT => timeout(value),
        _ => as_text(name, value),
    });
    texts.collect()
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

/// An inference response.
pub(super) struct InferAnswer {
    message: Message,
    /// The headers about a report.
    report_headers: Vec<(HeaderName, HeaderValue)>,
}

impl InferAnswer {
    /// Writes the requested outputs; `id` is that of the request.
    fn write(
        id: Option<String>,
        found: &FrameOutputs,
        wanted: &Wanted,
        report_headers: Vec<(HeaderName, HeaderValue)>,
    ) -> Result<Self, Problem> {
        let mut behind = Vec::new();
        let mut written = Vec::with_capacity(OUTPUTS.len());
        for (name, (shape, values)) in OUTPUTS.into_iter().zip(found.tensors()?) {
            let Some(binary) = wanted.how(name) else {
                continue;
            };
            if binary {
                behind.push(values.clone());
            }
            written.push(OutputTensor {
                name: name.to_owned(),
                datatype: values.datatype().to_string(),
                shape: Entries(shape),
                parameters: binary.then(|| OutputParameters {
                    binary_data_size: Some(values.byte_count()),
                }),
                data: (!binary).then_some(values),
            });
        }
        let response = InferResponse {
            model_name: FRAME_MODEL.to_owned(),
            model_version: Some(FRAME_MODEL_VERSION.to_owned()),
            id,
            outputs: Entries(written),
        };
        let message = Message::write(&response, &behind).map_err(Problem::internal)?;
        Ok(Self {
            message,
            report_headers,
        })
    }
}

impl IntoResponse for InferAnswer {
    fn into_response(self) -> Response {
        let Message { body, head_length } = self.message;
        let media_type = match head_length {
            Some(_) => "application/octet-stream",
            None => "application/json",
        };
        let mut response = (AppendHeaders(self.report_headers), body).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
        if let Some(length) = head_length {
            headers.insert(
                HeaderName::from_static(HEAD_LENGTH),
                HeaderValue::from(length),
            );
        }
        response
    }
}

/// The name of the server, and the platform of its model.
pub(super) const NAME: &str = "lookdown";
/// The supported extensions of the protocol.
pub(super) const EXTENSIONS: [&str; 1] = [BINARY_EXTENSION];
/// The model that detects persons in frames.
pub(super) const FRAME_MODEL: &str = "lookdown";
/// The version of its inputs and outputs.
pub(super) const FRAME_MODEL_VERSION: &str = "1";

/// Refuses the name of any other model.
pub(super) fn require_frame_model(name: &str) -> Result<(), Problem> {
    if name == FRAME_MODEL {
        return Ok(());
    }
    let name = Quoted(name);
    let detail =
        format!("model: there is no model {name}: use {FRAME_MODEL}, which accepts frames");
    Err(Problem::new(ProblemKind::UnknownModel, detail))
}

/// Returns the metadata of a tensor.
pub(super) fn tensor(name: &str, datatype: Datatype, shape: impl Into<Vec<i64>>) -> TensorMetadata {
    TensorMetadata {
        name: name.to_owned(),
        datatype: datatype.to_string(),
        shape: shape.into(),
    }
}

/// Get server metadata
#[utoipa::path(
    get, path = "/v2", tag = "operation", operation_id = "get_server_metadata",
    responses((status = OK, description = "The name, version, extensions and default of `follow` of the server.", body = ServerMetadata))
)]
pub(in crate::api) async fn server(State(state): State<ApiState>) -> Json<ServerMetadata> {
    Json(ServerMetadata {
        name: NAME.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        extensions: EXTENSIONS.map(ToOwned::to_owned).into(),
        follow: state.options.settings.detect.follow(),
    })
}

/// Check liveness (Open Inference Protocol)
///
/// Equivalent to `/livez`.
#[utoipa::path(
    get, path = "/v2/health/live", tag = "operation", operation_id = "get_server_liveness",
    responses((status = OK, description = "The process is alive.", body = ServerLive))
)]
pub(in crate::api) async fn live() -> Json<ServerLive> {
    Json(ServerLive { live: true })
}

/// Check readiness (Open Inference Protocol)
///
/// Equivalent to `/readyz`.
#[utoipa::path(
    get, path = "/v2/health/ready", tag = "operation", operation_id = "get_server_readiness",
    responses(
        (status = OK, description = "The server accepts frames.", body = ServerReady),
    )
)]
pub(in crate::api) async fn ready(
    State(state): State<ApiState>,
) -> Result<Json<ServerReady>, Problem> {
    state.require_ready()?;
    Ok(Json(ServerReady { ready: true }))
}

/// Get model metadata
///
/// The only model, `lookdown`, accepts a frame and returns persons.
#[utoipa::path(
    get, path = "/v2/models/{name}", tag = "inference", operation_id = "get_model",
    params(("name" = String, Path, description = "`lookdown`.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The inputs and outputs of the model.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model(
    _scope: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelMetadata>, Problem> {
    require_frame_model(&name)?;
    Ok(Json(metadata()))
}

/// Check the readiness of a model
#[utoipa::path(
    get, path = "/v2/models/{name}/ready", tag = "inference", operation_id = "get_model_readiness",
    params(("name" = String, Path, description = "`lookdown`.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
    )
)]
pub(in crate::api) async fn model_ready(
    State(state): State<ApiState>,
    _scope: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelReady>, Problem> {
    require_frame_model(&name)?;
    state.require_ready()?;
    Ok(Json(ModelReady {
        name: FRAME_MODEL.to_owned(),
        ready: true,
    }))
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
        let texts = as_texts(&given).unwrap();
        assert_eq!(texts, [(TIMEOUT_MILLIS.to_owned(), "2".to_owned())]);
    }
}

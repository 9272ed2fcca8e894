//! The OpenAPI document. Each route describes its own parameters and responses. This module adds
//! the common parts.

use indexmap::IndexMap;
use lookdown_detect::parameters::{
    DetectParameters, Interface, JsonType, ParameterDefault, ParameterKind, ParameterSpec,
};
use lookdown_http::openapi::Keys;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        self, Components, KnownFormat, ObjectBuilder, OpenApi, Ref, RefOr, Required, Schema,
        SchemaFormat,
        path::{Operation, Parameter, ParameterBuilder, ParameterIn},
        schema::{AdditionalProperties, Type},
    },
};

use super::{http::problem::ProblemBody, parameters};
use crate::annotated_image::AnnotationOptions;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Lookdown",
        description = "Detects persons in the frames of ceiling fisheye cameras. Every failure is a \
                       problem document (RFC 9457).",
        contact(name = "The Lookdown authors")
    ),
    external_docs(url = "/problems", description = "Problems and their remedies"),
    servers((url = "/", description = "This server")),
    tags(
        (name = "detection", description = "Frames in, persons out."),
        (name = "deepstack", description = "Detection for clients of DeepStack, such as Home Assistant and Blue Iris."),
        (name = "inference", description = "Detection for clients of the Open Inference Protocol (KServe V2)."),
        (name = "results", description = "Stored reports and images, for dashboards. In memory or in a shared Redis, within limits."),
        (name = "calibrations", description = "Calibrations of the cameras. Changes need the scope `admin`."),
        (name = "cameras", description = "Cameras of `lookdown run`. Changes need the scope `admin`."),
        (name = "operation", description = "Health checks, metrics and documentation."),
    ),
    components(schemas(ProblemBody)),
    modifiers(&Keys)
)]
pub(super) struct Common;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub(super) fn complete(mut document: openapi::OpenApi) -> openapi::OpenApi {
    add_choices(document.components.get_or_insert_default());
    add_examples(&mut document);
    lookdown_http::openapi::complete(&mut document);
    document
}

const FORM: &str = "multipart/form-data";
const JSON: &str = "application/json";
const EVENTS: &str = "text/event-stream";

/// The OpenAPI document as it is published: the form is the first media type of a body.
#[derive(Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(Node);

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Node {
    Object(IndexMap<String, Node>),
    Array(Vec<Node>),
    Scalar(Value),
}

impl Document {
    /// Orders the media types of a document.
    ///
    /// # Errors
    /// A document that is not JSON.
    pub fn from_document(document: &OpenApi) -> serde_json::Result<Self> {
        let mut root: Node = serde_json::from_str(&document.to_json()?)?;
        root.put_forms_first();
        Ok(Self(root))
    }
}

impl Node {
    fn put_forms_first(&mut self) {
        match self {
            Self::Object(fields) => {
                if let Some(index) = fields.get_index_of(FORM) {
                    fields.move_index(index, 0);
                }
                fields.values_mut().for_each(Self::put_forms_first);
            }
            Self::Array(items) => items.iter_mut().for_each(Self::put_forms_first),
            Self::Scalar(_) => {}
        }
    }
}

/// The method and path of an operation, the media type of a body of it, and an example of that.
type Row = (&'static str, &'static str, &'static str, Value);

/// Adds examples for bodies whose schemas have none: files, forms and streams.
fn add_examples(document: &mut OpenApi) {
    for (method, path, media_type, example) in requests() {
        if let Some(operation) = operation(document, method, path)
            && let Some(RefOr::T(body)) = &mut operation.request_body
            && let Some(RefOr::T(content)) = body.content.get_mut(media_type)
        {
            content.example = Some(example);
        }
    }
    for (method, path, media_type, example) in responses() {
        if let Some(operation) = operation(document, method, path)
            && let Some(RefOr::T(response)) = operation.responses.responses.get_mut("200")
            && let Some(RefOr::T(content)) = response.content.get_mut(media_type)
        {
            content.example = Some(example);
        }
    }
}

fn requests() -> Vec<Row> {
    let frame = "the bytes of frame.jpg";
    vec![
        ("put", "/calibrations/{id}", JSON, calibration()),
        ("post", "/calibrations/{id}/views", JSON, calibration()),
        (
            "post",
            "/detect",
            FORM,
            json!({"img": frame, "calibration": "lobby"}),
        ),
        ("post", "/v1/vision/detection", FORM, deepstack(frame)),
        (
            "post",
            "/v1/vision/custom/{calibration}",
            FORM,
            deepstack(frame),
        ),
        ("post", "/v2/models/{name}/infer", JSON, infer_request()),
    ]
}

/// The request of a frame, whose bytes JSON carries in Base64.
fn infer_request() -> Value {
    json!({
        "id": "17",
        "parameters": {"calibration": "lobby", "profile": "fast"},
        "inputs": [{"name": "image", "datatype": "BYTES", "shape": [1], "data": ["/9j/4AAQSkZJRg…"]}]
    })
}

fn responses() -> Vec<Row> {
    let events =
        "id: 1763717400412345\ndata: {\"request_id\":\"0197a3c5-…\",\"camera\":\"lobby\"}\n\n";
    vec![
        ("get", "/calibrations/{id}", JSON, calibration()),
        ("get", "/events", EVENTS, json!(events)),
        ("get", "/results/{camera}/events", EVENTS, json!(events)),
        (
            "get",
            "/v2",
            JSON,
            json!({
                "name": "lookdown", "version": env!("CARGO_PKG_VERSION"),
                "extensions": ["binary_tensor_data"], "follow": false
            }),
        ),
        ("get", "/v2/health/live", JSON, json!({"live": true})),
        ("get", "/v2/health/ready", JSON, json!({"ready": true})),
        ("get", "/v2/models/{name}/ready", JSON, model_ready()),
    ]
}

fn operation<'a>(document: &'a mut OpenApi, method: &str, path: &str) -> Option<&'a mut Operation> {
    let item = document.paths.paths.get_mut(path)?;
    match method {
        "get" => item.get.as_mut(),
        "put" => item.put.as_mut(),
        _ => item.post.as_mut(),
    }
}

fn calibration() -> Value {
    json!({
        "id": "lobby",
        "image": {"width": 1680, "height": 1680},
        "lens": {
            "model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5
        },
        "mount": {"world_up": [0, 0, -1], "height_m": 2.8},
        "zones": [{"name": "till", "floor_m": [[1, -0.5], [2.5, -0.5], [2.5, 1], [1, 1]]}],
        "detect": {"profile": "fast", "score_threshold": 0.4}
    })
}

fn deepstack(frame: &str) -> Value {
    json!({"image": frame, "min_confidence": 0.4})
}

fn model_ready() -> Value {
    json!({"name": "lookdown", "ready": true})
}

// The OpenAPI descriptions of the request parameters, from the tables of their specifications.
// Defaults are in the descriptions alone: generated clients would send a `default`, in the query
// and in the form, and a repeated parameter is refused.

/// Declares the parameters of a query by their specifications.
macro_rules! queries {
    ($($(#[doc = $description:literal])+ $name:ident = $specs:expr;)+) => {$(
        $(#[doc = $description])+
        pub(in crate::api) struct $name;

        impl IntoParams for $name {
            fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
                $specs.map(in_query).collect()
            }
        }
    )+};
}

queries! {
    /// The parameters of `POST /detect` in the query.
    DetectQuery = parameters::all();
    /// The parameters of a detection without those of the response, in the query.
    DetectionQuery = DetectParameters::TABLE.iter();
    /// [`DetectionQuery`] without the calibration, which the path names.
    CalibratedDetectionQuery = DetectParameters::TABLE
        .iter()
        .filter(|spec| spec.name != DetectParameters::CALIBRATION);
    /// The parameters of an annotated image in the query.
    AnnotationQuery = AnnotationOptions::TABLE.iter();
}

/// The frame and parameters in a form: what `detect::upload::form` reads.
pub(in crate::api) struct DetectForm;

impl ToSchema for DetectForm {}

impl PartialSchema for DetectForm {
    /// Returns the schema with the query parameters and the frame, and no other field.
    fn schema() -> RefOr<Schema> {
        let frame = "The frame: a JPEG, PNG or WebP file. `image` is accepted as another name of this field.";
        let frame = binary()
            .content_media_type("application/octet-stream")
            .description(Some(frame));
        let form = ObjectBuilder::new()
            .description(Some("The frame, and any parameter of the query."))
            .property("img", frame)
            .required("img")
            .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)));
        let form =
            fields(Interface::Http).fold(form, |form, (name, field)| form.property(name, field));
        form.into()
    }
}

/// The names of schemas for parameters with a fixed choice of values. Generated clients have one
/// type for each.
const CHOICE_SCHEMAS: [(&str, &str); 3] = [
    ("profile", "Profile"),
    ("refine", "Refinement"),
    ("format", "AnswerFormat"),
];

/// Adds the schemas of parameters with a fixed choice of values.
fn add_choices(components: &mut Components) {
    let names = CHOICE_SCHEMAS.iter();
    for (spec, (_, schema)) in names.filter_map(|row| Some((named(row.0)?, row))) {
        let values = value_schema(spec.kind).description(Some(spec.help));
        components
            .schemas
            .insert((*schema).to_owned(), values.into());
    }
}

fn named(name: &str) -> Option<&'static ParameterSpec> {
    parameters::all().find(|spec| spec.name == name)
}

/// Returns the parameters of an interface as fields of an object.
pub(in crate::api) fn fields(
    interface: Interface,
) -> impl Iterator<Item = (&'static str, RefOr<Schema>)> {
    let offered = parameters::all().filter(move |spec| spec.is_offered_by(interface));
    offered.map(|spec| (spec.name, schema(spec, Some(description(spec)))))
}

fn in_query(spec: &ParameterSpec) -> Parameter {
    ParameterBuilder::new()
        .name(spec.name)
        .parameter_in(ParameterIn::Query)
        .required(Required::False)
        .description(Some(description(spec)))
        .schema(Some(schema(spec, None)))
        .example(spec.example.map(|example| json(spec.kind, example)))
        .build()
}

fn description(spec: &ParameterSpec) -> String {
    let help = spec.help;
    match spec.default {
        ParameterDefault::Value(default) => format!("{help} Default: `{default}`."),
        ParameterDefault::Described(default) => format!("{help} Default: {default}."),
        ParameterDefault::None => help.to_owned(),
    }
}

/// Returns a value as JSON.
fn json(kind: ParameterKind, value: &str) -> Value {
    let text = || Value::from(value);
    match kind.json_type() {
        JsonType::Text => text(),
        JsonType::Switch | JsonType::Number => value.parse().unwrap_or_else(|_| text()),
    }
}

/// Returns a reference to the named schema of the values, or the schema itself.
fn schema(spec: &ParameterSpec, description: Option<String>) -> RefOr<Schema> {
    let choice = CHOICE_SCHEMAS.iter().find(|(name, _)| *name == spec.name);
    match choice {
        Some((_, schema)) => {
            let mut reference = Ref::from_schema_name(*schema);
            reference.description = description.unwrap_or_default();
            reference.into()
        }
        None => value_schema(spec.kind).description(description).into(),
    }
}

fn value_schema(kind: ParameterKind) -> ObjectBuilder {
    let of_type = |schema_type| ObjectBuilder::new().schema_type(schema_type);
    let format = |format| Some(SchemaFormat::KnownFormat(format));
    let number = || of_type(Type::Number).format(format(KnownFormat::Double));
    match kind {
        ParameterKind::Text => of_type(Type::String),
        ParameterKind::Name { max_chars } => of_type(Type::String).max_length(Some(max_chars)),
        ParameterKind::Pattern { regex, .. } => of_type(Type::String).pattern(Some(regex)),
        ParameterKind::Choice(names) => {
            of_type(Type::String).enum_values(Some(names.iter().copied()))
        }
        ParameterKind::Choices { names, none } => {
            let names = names.join("|");
            let list = format!("^({none}|({names})(,({names}))*)$");
            of_type(Type::String).pattern(Some(list))
        }
        ParameterKind::Switch => of_type(Type::Boolean),
        ParameterKind::Whole { min, max } => of_type(Type::Integer)
            .format(format(KnownFormat::Int32))
            .minimum(Some(min))
            .maximum(Some(max)),
        ParameterKind::Fraction => number().minimum(Some(0)).maximum(Some(1)),
        ParameterKind::Positive => number().exclusive_minimum(Some(0)),
        ParameterKind::Time => of_type(Type::String).format(format(KnownFormat::DateTime)),
    }
}

/// A binary body.
pub(in crate::api) struct RawBytes;

impl ToSchema for RawBytes {}

impl PartialSchema for RawBytes {
    fn schema() -> RefOr<Schema> {
        binary().into()
    }
}

fn binary() -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
}

#[cfg(test)]
mod tests {
    use lookdown_calibration::CalibrationFile;

    use super::*;

    #[test]
    fn the_example_calibration_is_accepted() {
        let content = calibration().to_string();
        let file = CalibrationFile::parse(content.as_bytes()).unwrap();
        let (_, checked) = file.calibrations("lobby", content.as_bytes()).remove(0);
        assert!(checked.is_ok());
    }

    #[test]
    fn every_example_has_a_place_in_the_document() {
        let document = crate::api::openapi_document(None).unwrap();
        let text = serde_json::to_string(&document).unwrap();
        assert_eq!(text.matches("the bytes of frame.jpg").count(), 3);
        assert_eq!(text.matches("\"focal\":534.76").count(), 3);
        assert_eq!(text.matches("data: {\\\"request_id").count(), 2);
    }

    fn names(parameters: &[Parameter]) -> Vec<&str> {
        parameters
            .iter()
            .map(|parameter| &*parameter.name)
            .collect()
    }

    #[test]
    fn query_and_form_describe_every_parameter_once() {
        let expected: Vec<_> = parameters::all().map(|spec| spec.name).collect();
        assert_eq!(names(&DetectQuery::into_params(|| None)), expected);
        let form: Vec<_> = fields(Interface::Http).map(|(name, _)| name).collect();
        assert_eq!(form, expected);
        let mut distinct = expected.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), expected.len());
    }

    #[test]
    fn every_choice_of_values_has_a_named_schema() {
        let choices = parameters::all()
            .filter(|spec| matches!(spec.kind, ParameterKind::Choice(_)))
            .map(|spec| spec.name);
        assert!(choices.eq(CHOICE_SCHEMAS.iter().map(|(name, _)| *name)));
    }

    #[test]
    fn examples_are_values_that_are_accepted() {
        for spec in parameters::all() {
            let Some(example) = spec.example else {
                continue;
            };
            let accepted: Result<String, _> = spec.parse(example);
            assert!(accepted.is_ok(), "{}: {example}", spec.name);
            let is_text = spec.kind.json_type() == JsonType::Text;
            assert_eq!(json(spec.kind, example).is_string(), is_text);
        }
    }
}

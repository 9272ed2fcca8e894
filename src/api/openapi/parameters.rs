//! The OpenAPI descriptions of the request parameters, from the tables of their specifications.
//! Defaults are in the descriptions alone: generated clients would send a `default`, in the query
//! and in the form, and a repeated parameter is refused.

use lookdown_detect::parameters::{
    DetectParameters, Interface, JsonType, ParameterDefault, ParameterKind, ParameterSpec,
};
use serde_json::Value;
use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        Components, KnownFormat, ObjectBuilder, Ref, RefOr, Required, Schema, SchemaFormat,
        path::{Parameter, ParameterBuilder, ParameterIn},
        schema::{AdditionalProperties, Type},
    },
};

use crate::{annotated_image::AnnotationOptions, api::parameters};

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
pub(super) fn add_choices(components: &mut Components) {
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
    use super::*;

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

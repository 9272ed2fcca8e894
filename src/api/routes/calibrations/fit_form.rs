//! The OpenAPI description of what `POST /calibrations/{id}/fit` takes.

use lookdown_lens::self_calibration::{FieldOfView, IdealLens};
use strum::VariantNames;
use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        KnownFormat, Object, ObjectBuilder, RefOr, Required, Schema, SchemaFormat,
        path::{Parameter, ParameterBuilder, ParameterIn},
        schema::{AdditionalProperties, ArrayBuilder, Type},
    },
};

use crate::{
    api::openapi::RawBytes,
    room_calibration::known::{FIELD_OF_VIEW_DEG, LENS},
    suggestions::FRAMES,
};

/// The parameter of cameras on a ceiling.
pub(super) const CEILING: &str = "ceiling";

/// Returns the known values of a camera, from its data sheet, by the name of their parameter.
fn known_values() -> [(&'static str, Object); 3] {
    let lenses = ObjectBuilder::new()
        .schema_type(Type::String)
        .pattern(Some(format!("^({})$", IdealLens::VARIANTS.join("|"))))
        .description(Some(
            "The projection of the lens, from its data sheet. Cameras that look straight down \
             need it.",
        ));
    let field_of_view = ObjectBuilder::new()
        .schema_type(Type::Number)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)))
        .minimum(Some(FieldOfView::MIN_DEGREES))
        .maximum(Some(FieldOfView::MAX_DEGREES))
        .description(Some("The field of view of the lens circle, degrees."));
    let ceiling = ObjectBuilder::new()
        .schema_type(Type::Boolean)
        .description(Some(
            "`true`: the camera is on a ceiling, even if one wall fills the image. Otherwise, a \
             camera that may be on a wall is refused.",
        ));
    [
        (LENS, lenses.build()),
        (FIELD_OF_VIEW_DEG, field_of_view.build()),
        (CEILING, ceiling.build()),
    ]
}

/// The known values in the query.
pub(super) struct KnownCameraQuery;

impl IntoParams for KnownCameraQuery {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let in_query = |(name, mut value): (&str, Object)| {
            ParameterBuilder::new()
                .name(name)
                .parameter_in(ParameterIn::Query)
                .required(Required::False)
                .description(value.description.take())
                .schema(Some(value))
                .build()
        };
        known_values().map(in_query).into()
    }
}

/// Frames in a form, with the known values as further fields.
pub(super) struct FitForm;

impl ToSchema for FitForm {
    fn schemas(_: &mut Vec<(String, RefOr<Schema>)>) {}
}

impl PartialSchema for FitForm {
    fn schema() -> RefOr<Schema> {
        // Clients in Go of openapi-generator do not compile with limits on the number of files.
        let frames = ArrayBuilder::new()
            .description(Some(format!(
                "1 to {FRAMES} frames of one camera at different times: JPEG, PNG or WebP files."
            )))
            .items(RawBytes::schema());
        let form = ObjectBuilder::new()
            .description(Some("Frames, and the known values of the query."))
            .property("img", frames)
            .required("img")
            .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)));
        let values = known_values().into_iter();
        values
            .fold(form, |form, (name, value)| form.property(name, value))
            .into()
    }
}

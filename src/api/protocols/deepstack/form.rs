//! The form that DeepStack's clients send: the frame in `image`, `min_confidence` and `api_key`.
//! The query may have the parameters of `POST /detect`.

use axum::extract::{FromRequest, Request};
use lookdown_detect::{
    parameters::{DetectParameters, ParameterError},
    pipeline::DetectJob,
};
use utoipa::ToSchema;

use crate::{
    access::Scope,
    api::{
        ApiState,
        detect::defaults::detect_parameters,
        detect::upload::{FieldUse, Upload, is_multipart},
        http::{
            access,
            context::RequestContext,
            problem::{Problem, ProblemKind},
            query::query_parameters,
        },
    },
};

const MIN_CONFIDENCE: &str = "min_confidence";
const API_KEY: &str = "api_key";
/// The default of DeepStack's server.
const DEFAULT_MIN_CONFIDENCE: &str = "0.4";
/// The name of `min_confidence` in this API.
const SCORE_THRESHOLD: &str = DetectParameters::SCORE_THRESHOLD;

/// A frame in DeepStack's form.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the form that is parsed below")]
pub(in crate::api) struct DeepStackForm {
    /// The frame: a JPEG, PNG or WebP file.
    #[schema(value_type = String, format = Binary, content_media_type = "application/octet-stream")]
    image: Vec<u8>,
    /// Least confidence; persons with a lower one are omitted.
    #[schema(nullable = false, minimum = 0, maximum = 1, default = 0.4)]
    min_confidence: Option<f64>,
    /// An API key with the scope `detect`, for clients that cannot send it in a header. Empty for
    /// none.
    #[schema(nullable = false)]
    api_key: Option<String>,
}

/// A frame in DeepStack's form, whose key has been checked.
pub(in crate::api) struct DeepStackUpload {
    pub(super) upload: Upload,
    /// The parameters of the query, by name. Neither names nor values are checked.
    query: Vec<(String, String)>,
}

impl FromRequest<ApiState> for DeepStackUpload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let known = &state.options.access;
        let headers = request.headers();
        let is_form = is_multipart(headers);
        // A key in a header is checked before the body is read. Other keys are in the form. That
        // form is read within a small memory budget of its own, so clients without a key cannot use
        // up the memory of the others.
        let mut budget = &state.uploads;
        if !is_form || access::shows_key(headers) {
            let context = RequestContext::from_extensions(request.extensions())?;
            known.check(headers, &context.identity, Scope::Detect)?;
        } else if known.needs_keys() {
            budget = &state.unauthenticated_uploads;
        }
        if !is_form {
            return Err(no_form());
        }
        let query = query_parameters(request.uri())?;
        let mut upload = Upload::receive(request, state, budget, use_of).await?;
        let mut keys = upload
            .form
            .parameters
            .extract_if(.., |(name, _)| name == API_KEY);
        // Clients without a key send an empty field.
        let key = keys.next().filter(|(_, key)| !key.is_empty());
        if keys.next().is_some() {
            return Err(ParameterError::repeated(API_KEY).into());
        }
        drop(keys);
        let key = key.as_ref().map(|(_, key)| key.as_str());
        let holder = known.check_with(
            &upload.headers,
            &upload.context.identity,
            key,
            Scope::Detect,
        )?;
        upload.caller = upload.caller.with_holder(known, holder.as_ref());
        Ok(Self { upload, query })
    }
}

#[expect(
    clippy::unnecessary_wraps,
    reason = "other forms refuse unknown fields"
)]
fn use_of(name: &str) -> Result<FieldUse, Problem> {
    Ok(match name {
        "image" => FieldUse::Frame,
        MIN_CONFIDENCE | API_KEY => FieldUse::Parameter,
        // DeepStack ignores unknown fields, and its clients rely on that.
        _ => FieldUse::None,
    })
}

fn no_form() -> Problem {
    let fault = "send the frame in a form (multipart/form-data), as in curl -F \
                 image=@frame.jpg";
    Problem::for_parameter(ProblemKind::MissingImage, "image", fault)
}

impl DeepStackUpload {
    /// Returns the detection job of this form. `calibration` is that of the path.
    pub(super) fn job(
        self,
        state: &ApiState,
        calibration: Option<&str>,
    ) -> Result<DetectJob, Problem> {
        let Self { upload, query } = self;
        let query = query.iter();
        let mut given: Vec<_> = query.map(|(name, value)| (&**name, &**value)).collect();
        given.extend(calibration.map(|id| (DetectParameters::CALIBRATION, id)));
        let is_in_query = given.iter().any(|(name, _)| *name == SCORE_THRESHOLD);
        // All remaining fields have this name. Clients without a threshold send an empty field.
        let confidences = upload.form.parameters.iter().map(|(_, value)| &**value);
        let confidences = confidences.filter(|value| !value.is_empty());
        given.extend(confidences.map(|value| (SCORE_THRESHOLD, value)));
        let protocol = [(SCORE_THRESHOLD, DEFAULT_MIN_CONFIDENCE)];
        let parameters =
            detect_parameters(state, given, &protocol).map_err(|error| match &*error.name {
                SCORE_THRESHOLD if !is_in_query => renamed(error),
                _ => error,
            })?;
        upload.job(parameters)
    }
}

/// Replaces the parameter name in an error by the name that the client sent.
fn renamed(error: ParameterError) -> ParameterError {
    ParameterError {
        name: MIN_CONFIDENCE.to_owned(),
        ..error
    }
}

//! `POST /detect`: detects the persons in one frame.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse},
};
use lookdown_common::report::Report;
use lookdown_detect::pipeline::DetectJob;

use super::{
    answer::{AnswerOptions, Content},
    report::report_headers,
    run::{AnswerInput, detect_parameters, run_detection},
    upload::Upload,
};
use crate::api::{
    ApiState,
    http::{problem::Problem, query::pairs},
    openapi::{DetectForm, DetectQuery, RawBytes},
};

/// Detect persons
///
/// Send the frame as the form field `img` with parameters as further fields, or as the body with
/// parameters in the query. JPEG, PNG and WebP are accepted, whatever the content type. Without
/// `calibration`, the lens circle is detected in the frame, and an ideal 180° equidistant lens that
/// points straight down is assumed.
///
/// The response is the report as JSON. `format` or `Accept` selects the annotated image or a file
/// for annotation tools instead.
#[utoipa::path(
    post, path = "/detect", tag = "detection", operation_id = "detect_persons",
    params(DetectQuery),
    request_body(
        description = "The frame: a form, or the file alone (JPEG, PNG or WebP, with any other content type).",
        content(
            (DetectForm = "multipart/form-data"),
            (inline(RawBytes) = "application/octet-stream"),
        )
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.",
         content(
            (Report = "application/json"),
            (inline(RawBytes) = "image/jpeg"), (inline(RawBytes) = "image/png"),
            (Object = "application/geo+json"), (Object = "application/x.coco+json"),
            (Object = "application/x.cepdof+json"), (Object = "application/x.label-studio+json"),
            (String = "application/xml"), (String = "text/plain"),
         ),
         headers(
            ("X-Person-Count" = u64, description = "The number of detected persons."),
            ("X-Request-Id" = String, description = "The ID of the request, or a generated one."),
            ("Server-Timing" = String, description = "The stages, milliseconds."),
         )),
    )
)]
pub(in crate::api) async fn detect_persons(
    State(state): State<ApiState>,
    mut upload: Upload,
) -> Result<impl IntoResponse, Problem> {
    let context = Arc::clone(&upload.context);
    let field = upload.form.field.take();
    context.note_upload(upload.arrived);
    let (job, answer) = job(&state, upload)?;
    let write = move |input: AnswerInput<'_>| answer.content(input.frame, input.json);
    let answered = run_detection(&state, &context, job, write).await;
    let answered = answered.map_err(|problem| problem.for_frame_field(field))?;
    let headers = AppendHeaders(report_headers(&answered.report));
    let Content { media_type, bytes } = answered.answer;
    let media_type = [(CONTENT_TYPE, HeaderValue::from_static(media_type))];
    Ok((headers, media_type, bytes))
}

fn job(state: &ApiState, mut upload: Upload) -> Result<(DetectJob, AnswerOptions), Problem> {
    let parameters = &mut upload.form.parameters;
    let answer =
        AnswerOptions::take_from(parameters, &upload.headers, upload.form.file_name.take())?;
    let parameters = detect_parameters(state, pairs(parameters).collect(), &[])?;
    let mut job = upload.job(parameters)?;
    job.ticket.drawn_width = answer.drawn_width();
    Ok((job, answer))
}

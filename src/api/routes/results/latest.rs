//! The latest report of a camera, with an optional wait for a newer one.

use std::{sync::Arc, time::Duration};

use axum::{
    extract::State,
    http::{
        HeaderMap, StatusCode, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE, ETAG},
    },
    response::{IntoResponse, Response},
};
use lookdown_common::report::Report;
use lookdown_detect::parameters::whole_number;
use lookdown_http::entity_tags::{entity_tag, is_unmodified};
use tokio::time::timeout_at;

use super::{NO_CACHE, address::CameraAddress, unknown};
use crate::{
    api::{
        ApiState,
        http::{caller::Caller, deadline::Deadline, problem::Problem, query::parameters_named},
        require_scope::RequireRead,
    },
    results::{Cameras, StoredReport},
};

/// Ten minutes, as for `timeout_millis`.
const MAX_WAIT_SECONDS: u64 = 600;

/// Get the latest report
///
/// `If-None-Match` with the `ETag` of a known report returns 304 while that is the latest. With
/// `wait`, the response waits for a newer report; 304 then means that none arrived in time.
#[utoipa::path(
    get, path = "/results/{camera}/latest", tag = "results", operation_id = "get_latest_result",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        ("wait" = Option<u64>, Query, nullable = false, minimum = 0, maximum = 600,
            description = "Time to wait for a report other than that of `If-None-Match`, seconds; no \
                longer than the server's request timeout."),
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known report."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The report.", body = Report,
         headers(
            ("ETag" = String, description = "The report's ID."),
            ("Cache-Control" = String, description = "`no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is no newer report."),
    )
)]
pub(in crate::api) async fn get_latest(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let [wait] = parameters_named(&uri, ["wait"])?;
    let seconds = wait.map_or(Ok(0), |wait| {
        whole_number("wait", &wait, 0..=MAX_WAIT_SECONDS)
    })?;
    let wait = Duration::from_secs(seconds);
    let report = if wait.is_zero() {
        state.results.latest(&camera).await?
    } else {
        let limit = deadline.within(Some(wait), "wait");
        let report = wait_for_newer(&state, &caller, &camera, &headers, limit).await?;
        // The key may have been removed during the wait.
        RequireRead::check_again(&state, &headers)?;
        report
    };
    let report = report.ok_or_else(|| unknown(&camera))?;
    let id = report.id.to_string();
    let about = [(ETAG, entity_tag(&id)), (CACHE_CONTROL, NO_CACHE)];
    if is_unmodified(&headers, &id)? {
        return Ok((StatusCode::NOT_MODIFIED, about).into_response());
    }
    let content_type = [(CONTENT_TYPE, "application/json")];
    Ok((about, content_type, report.report.json.clone()).into_response())
}

/// Returns the first report that the client does not have, or the latest one if none arrives in
/// time.
async fn wait_for_newer(
    state: &ApiState,
    caller: &Caller,
    camera: &str,
    headers: &HeaderMap,
    limit: Deadline,
) -> Result<Option<Arc<StoredReport>>, Problem> {
    // Subscribes before the first read, so no report is missed in between.
    let cameras = Cameras::One(camera.to_owned());
    let mut listening = state.results.listen(&caller.client, cameras).await?;
    let mut report = state.results.latest(camera).await?;
    let is_new = |report: &StoredReport| {
        let known = is_unmodified(headers, &report.id.to_string());
        known.map(|known| !known)
    };
    while !report.as_deref().map_or(Ok(false), is_new)?
        && let Ok(Some(notified)) = timeout_at(limit.at(), listening.next()).await
    {
        // A notification may be older than the report that was read.
        if report.as_ref().is_none_or(|now| notified.id > now.id) {
            report = Some(notified);
        }
    }
    Ok(report)
}

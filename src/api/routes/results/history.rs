//! The stored reports of a camera, page by page.

use std::num::NonZeroUsize;

use axum::{
    extract::State,
    http::{
        Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    response::IntoResponse,
};
use bytes::{BufMut, Bytes, BytesMut};
use jiff::Timestamp;
use lookdown_common::report::Report;
use lookdown_detect::parameters::{ParameterError, whole_number};
use lookdown_tracking::taught::NumberWithBar;
use utoipa::ToSchema;

use super::{CameraAddress, NO_CACHE, unknown};
use crate::{
    api::{
        ApiState,
        http::{problem::Problem, query::parameters_named},
        require_scope::RequireRead,
    },
    results::{Cameras, ReportId, StoredReport, medians},
};

const DEFAULT_LIMIT: usize = 100;
const MAX_LIMIT: usize = 1000;
/// Size at which a page ends. A response holds at most this size plus one report in memory.
const PAGE_BYTES: usize = 4 << 20;

/// A stored report.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the output of `write`")]
pub(in crate::api) struct PastReport {
    /// The ID: the value for `since`, and the `ETag` of the latest report.
    #[schema(example = "1763717400412345")]
    id: String,
    /// Median of the persons in the reports of the 5 s up to this one, as far as this page has
    /// them.
    #[schema(example = 3)]
    persons: usize,
    /// In 90 % of frames, the true number is at least this one.
    #[schema(example = 2)]
    persons_low: usize,
    /// In 90 % of frames, the true number is at most this one.
    #[schema(example = 5)]
    persons_high: usize,
    /// The report.
    report: Report,
}

/// List past reports
///
/// Returns the stored reports of a camera, oldest first. A page ends after `limit` reports or 4
/// MiB. The ID of its last report is `since` of the next page. An empty page is the end.
#[utoipa::path(
    get, path = "/results/{camera}/history", tag = "results", operation_id = "list_past_results",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        ("since" = Option<String>, Query, nullable = false, example = "2026-11-21T09:30:00Z",
            description = "Only what was reported later: than the report of this ID, or than this time \
                (RFC 3339)."),
        ("limit" = Option<u64>, Query, nullable = false, minimum = 1, maximum = 1000,
            description = "Largest number of reports; 100 by default."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "Oldest first.", body = Vec<PastReport>,
         headers(("Cache-Control" = String, description = "`no-cache`."))),
    )
)]
pub(in crate::api) async fn get_history(
    State(state): State<ApiState>,
    _reader: RequireRead,
    CameraAddress(camera): CameraAddress,
    uri: Uri,
) -> Result<impl IntoResponse, Problem> {
    let [since, limit] = parameters_named(&uri, ["since", "limit"])?;
    let since = since.map_or(Ok(ReportId::default()), |since| parse_since(&since))?;
    let limit = parse_limit(limit.as_deref())?;
    if state.results.latest(&camera).await?.is_none() {
        return Err(unknown(&camera));
    }
    let taught = state.references.number(&camera);
    let camera = Cameras::One(camera);
    let page = state.results.since(&camera, since, limit).await?;
    let content_type = [(CONTENT_TYPE, "application/json")];
    let cache = [(CACHE_CONTROL, NO_CACHE)];
    let persons = medians(&page, taught.as_deref());
    let body = write(page.iter().map(AsRef::as_ref).zip(persons));
    Ok((content_type, cache, body))
}

/// Writes a JSON array of the reports with their IDs and medians. The stored JSON of each report is
/// copied unchanged.
fn write<'a>(page: impl Iterator<Item = (&'a StoredReport, NumberWithBar)>) -> Bytes {
    let mut text = BytesMut::new();
    for (stored, NumberWithBar { persons, low, high }) in page {
        if text.len() > PAGE_BYTES {
            break;
        }
        text.put_u8(if text.is_empty() { b'[' } else { b',' });
        let start = format!(
            "{{\"id\":\"{}\",\"persons\":{persons},\"persons_low\":{low},\"persons_high\":{high},\
             \"report\":",
            stored.id
        );
        text.put_slice(start.as_bytes());
        text.put_slice(&stored.report.json);
        text.put_u8(b'}');
    }
    if text.is_empty() {
        text.put_u8(b'[');
    }
    text.put_u8(b']');
    text.freeze()
}

fn parse_since(text: &str) -> Result<ReportId, Problem> {
    let of_time = || text.parse::<Timestamp>().map(ReportId::at);
    text.parse().or_else(|_| of_time()).map_err(|_| {
        let rule = "the ID of a report, nor an RFC 3339 time with an offset, such as \
                    2026-11-21T09:30:00Z";
        ParameterError::is_not("since", text, rule).into()
    })
}

fn parse_limit(text: Option<&str>) -> Result<NonZeroUsize, Problem> {
    let Some(text) = text else {
        return Ok(NonZeroUsize::new(DEFAULT_LIMIT).unwrap_or(NonZeroUsize::MIN));
    };
    let limit = whole_number("limit", text, 1..=MAX_LIMIT)?;
    Ok(NonZeroUsize::new(limit).unwrap_or(NonZeroUsize::MIN))
}

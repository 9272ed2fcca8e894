//! The documentation of problems: the pages that `type` of a problem document refers to, and the
//! table in docs/http.md.

use std::fmt::Write;

use axum::{
    extract::Path,
    http::{
        HeaderMap, HeaderValue,
        header::{CACHE_CONTROL, CONTENT_TYPE, VARY},
    },
    response::{IntoResponse, Response},
};

use crate::api::http::{
    accept::Accepted,
    problem::{Problem, ProblemKind},
};

/// The pages change with the version of the server only.
const CACHED_FOR_AN_HOUR: HeaderValue = HeaderValue::from_static("public, max-age=3600");

/// The format of a page. Browsers ask for HTML by name; other clients get Markdown.
#[derive(Clone, Copy)]
enum PageFormat {
    Markdown,
    Html,
}

/// List problem types
///
/// The `type` of every problem document is the path of one of them.
#[utoipa::path(
    get, path = "/problems", tag = "operation", operation_id = "list_problems",
    responses((
        status = OK, description = "A table of all problem types.",
        content((String = "text/markdown"), (String = "text/html")),
    ))
)]
pub(in crate::api) async fn list_problems(headers: HeaderMap) -> Response {
    match format_for(&headers) {
        PageFormat::Markdown => markdown(format!("# Problems\n\n{}", problem_table())),
        PageFormat::Html => html("Problems", &html_table()),
    }
}

/// Get a problem type
///
/// The cause and the remedy of the problem, for people.
#[utoipa::path(
    get, path = "/problems/{name}", tag = "operation", operation_id = "get_problem",
    params(("name" = String, Path, description = "The last segment of `type`.")),
    responses((
        status = OK, description = "The documentation of the problem type.",
        content((String = "text/markdown"), (String = "text/html")),
    ))
)]
pub(in crate::api) async fn get_problem(
    Path(name): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let kind = ProblemKind::from_name(&name).ok_or_else(|| {
        let detail = "there is no problem with this name: GET /problems lists all names";
        Problem::new(ProblemKind::NotFound, detail)
    })?;
    let entry = kind.entry();
    let (title, name, status) = (entry.title, entry.name, entry.status.as_u16());
    let (description, remedy) = (entry.description, entry.remedy);
    let retry = entry.retry_after_seconds.map_or(
        "",
        |_| "The header `Retry-After` has the time before a retry, in seconds.",
    );
    Ok(match format_for(&headers) {
        PageFormat::Markdown => markdown(format!(
            "# {title}\n\n`{name}`, HTTP status {status}\n\n{description}\n\n**Remedy:** {remedy} {retry}\n"
        )),
        PageFormat::Html => html(
            title,
            &format!(
                "<p><code>{name}</code>, HTTP status {status}</p>\n<p>{}</p>\n<p><strong>Remedy:</strong> {} {}</p>\n\
                 <p><a href=\"../problems\">All problems</a></p>",
                marked_up(description),
                marked_up(remedy),
                marked_up(retry),
            ),
        ),
    })
}

/// Returns the table of all problem types with their remedies as Markdown.
pub fn problem_table() -> String {
    let mut table = "| type | status | remedy |\n|---|---|---|\n".to_owned();
    for kind in ProblemKind::ALL {
        let (path, entry) = (kind.path(), kind.entry());
        let (status, remedy) = (entry.status.as_u16(), entry.remedy);
        // Writing to a string cannot fail.
        let _ = writeln!(table, "| `{path}` | {status} | {remedy} |");
    }
    table
}

fn html_table() -> String {
    let mut table = "<table>\n<tr><th>Type<th>Status<th>Title<th>Cause<th>Remedy</tr>\n".to_owned();
    for kind in ProblemKind::ALL {
        let entry = kind.entry();
        let _ = writeln!(
            table,
            "<tr><td><a href=\"problems/{name}\"><code>{name}</code></a><td>{}<td>{}<td>{}<td>{}</tr>",
            entry.status.as_u16(),
            entry.title,
            marked_up(entry.description),
            marked_up(entry.remedy),
            name = entry.name,
        );
    }
    table + "</table>"
}

/// Replaces pairs of backticks by `code` elements. The texts of the table have no character to
/// escape.
fn marked_up(text: &str) -> String {
    let mut parts = text.split('`');
    let mut marked = parts.next().unwrap_or_default().to_owned();
    for (index, part) in parts.enumerate() {
        marked += if index % 2 == 0 { "<code>" } else { "</code>" };
        marked += part;
    }
    marked
}

fn format_for(headers: &HeaderMap) -> PageFormat {
    let offers = [
        (PageFormat::Markdown, "text/markdown"),
        (PageFormat::Html, "text/html"),
    ];
    let best = Accepted::from_headers(headers).best_of(&offers);
    // A page in another format helps more than a refusal.
    best.unwrap_or(PageFormat::Markdown)
}

fn markdown(text: String) -> Response {
    page("text/markdown; charset=utf-8", text)
}

fn html(title: &str, body: &str) -> Response {
    let text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title} – Lookdown</title>\n<h1>{title}</h1>\n{body}\n</html>\n"
    );
    page("text/html; charset=utf-8", text)
}

fn page(media_type: &'static str, text: String) -> Response {
    let headers = [
        (CONTENT_TYPE, HeaderValue::from_static(media_type)),
        (CACHE_CONTROL, CACHED_FOR_AN_HOUR),
        (VARY, HeaderValue::from_static("accept")),
    ];
    (headers, text).into_response()
}

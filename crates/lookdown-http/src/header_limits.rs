//! Limits of request heads. The HTTP parser refuses much larger heads before this layer, with a
//! status and without a problem document.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::Response,
};

use crate::{
    problem::{Kind, Problem},
    server::ConnectionLimits,
};

/// Bytes of a header line besides name and value: `: ` and the line end.
const SEPARATORS: usize = 4;

/// Refuses a request with too many headers or too large a head.
///
/// # Errors
/// The refusal.
pub async fn within_bounds(
    State(limits): State<ConnectionLimits>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let too_large = if request.headers().len() > limits.max_headers {
        Some(("headers", limits.max_headers))
    } else if bytes_of_head(&request) > limits.max_header_bytes {
        Some(("bytes of path and headers", limits.max_header_bytes))
    } else {
        None
    };
    if let Some((what, most)) = too_large {
        let detail = format!("the request has more than {most} {what}: send fewer");
        return Err(Problem::new(Kind::HeadersTooLarge, detail));
    }
    Ok(next.run(request).await)
}

fn bytes_of_head(request: &Request) -> usize {
    let query = request.uri().query().map_or(0, str::len);
    let headers = request.headers().iter();
    let headers = headers.map(|(name, value)| name.as_str().len() + value.len() + SEPARATORS);
    request.uri().path().len() + query + headers.sum::<usize>()
}

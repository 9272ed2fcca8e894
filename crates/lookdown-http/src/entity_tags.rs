//! Entity tags and conditional requests (RFC 9110, sections 8.8.3 and 13.1.2).

use axum::{
    http::{
        HeaderMap, HeaderName, HeaderValue, StatusCode,
        header::{CACHE_CONTROL, ETAG, IF_NONE_MATCH},
    },
    response::{IntoResponse, IntoResponseParts, Response},
};

use crate::problem::{Kind, Problem};

/// The entity tags that a header lists.
#[derive(Debug)]
pub enum Named {
    /// `*`: any tag.
    Any,
    /// These tags, without their quotes.
    Tags(Vec<String>),
}

/// Returns the entity tag of an opaque value.
pub fn entity_tag(value: &str) -> HeaderValue {
    // Revisions and report IDs are digits.
    HeaderValue::from_str(&format!("\"{value}\"")).unwrap_or(HeaderValue::from_static("\"\""))
}

/// Returns the weak entity tag of an opaque value, for responses that are the same but for times.
pub fn weak_entity_tag(value: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("W/\"{value}\"")).unwrap_or(HeaderValue::from_static("W/\"\""))
}

/// Returns the headers of a response that clients may cache, but must revalidate before use.
pub fn revalidated(tag: HeaderValue) -> [(HeaderName, HeaderValue); 2] {
    [
        (ETAG, tag),
        (CACHE_CONTROL, HeaderValue::from_static("no-cache")),
    ]
}

/// Returns the headers of a response that only the client may cache, and must revalidate.
pub fn private(value: &str) -> [(HeaderName, HeaderValue); 2] {
    let cache_control = HeaderValue::from_static("private, no-cache");
    [(ETAG, entity_tag(value)), (CACHE_CONTROL, cache_control)]
}

/// Returns the response with the headers `about` its version, which is `value`: without content and
/// with the status 304 for a client that has this version. Only others need the `response`.
///
/// # Errors
/// A [`Problem`] for a header that is malformed.
pub fn unless_known<R: IntoResponse>(
    headers: &HeaderMap,
    value: &str,
    about: impl IntoResponseParts,
    response: impl FnOnce() -> R,
) -> Result<Response, Problem> {
    if is_unmodified(headers, value)? {
        return Ok((StatusCode::NOT_MODIFIED, about, ()).into_response());
    }
    Ok((about, response()).into_response())
}

/// Returns `true` if `If-None-Match` lists this value: the client has the current version.
///
/// # Errors
/// A [`Problem`] for a header that is malformed.
pub fn is_unmodified(headers: &HeaderMap, value: &str) -> Result<bool, Problem> {
    Ok(match named(headers, &IF_NONE_MATCH, true)? {
        None => false,
        Some(Named::Any) => true,
        Some(Named::Tags(tags)) => tags.iter().any(|tag| tag == value),
    })
}

/// Parses the entity tags of a header. Weak tags match nothing unless `weak` allows them. Empty
/// list elements are ignored (RFC 9110, section 5.6.1.2).
///
/// # Errors
/// A [`Problem`] for a header that is malformed or has no tag.
pub fn named(
    headers: &HeaderMap,
    header: &HeaderName,
    weak: bool,
) -> Result<Option<Named>, Problem> {
    if !headers.contains_key(header) {
        return Ok(None);
    }
    let (mut tags, mut any, mut is_empty) = (Vec::new(), false, true);
    for value in headers.get_all(header) {
        // A comma may be part of a tag.
        let mut in_tag = false;
        let is_between = |byte: &u8| {
            in_tag ^= *byte == b'"';
            *byte == b',' && !in_tag
        };
        let elements = value.as_bytes().split(is_between);
        for element in elements.filter(|element| !element.trim_ascii().is_empty()) {
            is_empty = false;
            let tag = std::str::from_utf8(element).map_or("", str::trim);
            let weak_tag = tag.strip_prefix("W/");
            let (is_weak, opaque) = (weak_tag.is_some(), weak_tag.unwrap_or(tag));
            let quoted = opaque.strip_prefix('"');
            let inner = quoted.and_then(|quoted| quoted.strip_suffix('"'));
            match inner {
                Some(inner) if weak || !is_weak => tags.push(inner.to_owned()),
                // A weak tag does not promise equal bytes.
                Some(_) => {}
                None if tag == "*" => any = true,
                None => return Err(no_entity_tag(header, tag)),
            }
        }
    }
    if is_empty {
        return Err(no_entity_tag(header, ""));
    }
    Ok(Some(if any { Named::Any } else { Named::Tags(tags) }))
}

fn no_entity_tag(header: &HeaderName, text: &str) -> Problem {
    let detail = format!(
        "{header}: {text:?} is not an entity tag: repeat the ETag of a response with its quotes, or send *"
    );
    Problem::new(Kind::MalformedRequest, detail)
}

#[cfg(test)]
mod tests;

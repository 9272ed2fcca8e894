//! Entity tags, and readers that have something already (RFC 9110, sections 8.8.3 and 13.1.2).

use axum::http::{HeaderMap, HeaderName, HeaderValue, header::IF_NONE_MATCH};

use super::problem::{Problem, ProblemKind};

/// What a header names.
pub(super) enum Named {
    Any,
    Tags(Vec<String>),
}

/// The entity tag around an opaque value.
pub(super) fn entity_tag(value: &str) -> HeaderValue {
    // Revisions and report IDs are digits.
    HeaderValue::from_str(&format!("\"{value}\"")).unwrap_or(HeaderValue::from_static("\"\""))
}

/// Whether a reader has what this value stands for already.
pub(super) fn is_unmodified(headers: &HeaderMap, value: &str) -> Result<bool, Problem> {
    Ok(match named(headers, &IF_NONE_MATCH, true)? {
        None => false,
        Some(Named::Any) => true,
        Some(Named::Tags(tags)) => tags.iter().any(|tag| tag == value),
    })
}

/// The entity tags in a header. Weak ones are equal to nothing unless `weak` allows them. Empty elements are
/// passed over (RFC 9110, section 5.6.1.2), but not a header without any other: its sender has lost the tag.
pub(super) fn named(
    headers: &HeaderMap,
    header: &HeaderName,
    weak: bool,
) -> Result<Option<Named>, Problem> {
    if !headers.contains_key(header) {
        return Ok(None);
    }
    let mut tags = Vec::new();
    let mut any = false;
    let mut is_empty = true;
    for value in headers.get_all(header) {
        // A comma may also be a character of a tag.
        let mut in_tag = false;
        let is_between = |byte: &u8| {
            in_tag ^= *byte == b'"';
            *byte == b',' && !in_tag
        };
        let elements = value.as_bytes().split(is_between);
        for element in elements.filter(|element| !element.trim_ascii().is_empty()) {
            is_empty = false;
            let tag = std::str::from_utf8(element).map_or("", str::trim);
            let (is_weak, opaque) = match tag.strip_prefix("W/") {
                Some(opaque) => (true, opaque),
                None => (false, tag),
            };
            let inner = opaque
                .strip_prefix('"')
                .and_then(|opaque| opaque.strip_suffix('"'));
            match inner {
                Some(inner) if weak || !is_weak => tags.push(inner.to_owned()),
                // A weak tag is no promise about every byte.
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
        "{header}: {text:?} is no entity tag: repeat the ETag of an answer with its quotes, or give *"
    );
    Problem::new(ProblemKind::MalformedRequest, detail)
}

#[cfg(test)]
mod tests;

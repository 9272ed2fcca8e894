use axum::http::header::IF_MATCH;

use super::*;

/// Parses `If-Match` from these lines: `*` for any, `None` when it is refused.
fn named_in(lines: &[&'static str]) -> Option<Vec<String>> {
    let mut headers = HeaderMap::new();
    for line in lines {
        headers.append(IF_MATCH, HeaderValue::from_static(line));
    }
    match named(&headers, &IF_MATCH, false).ok()?.unwrap() {
        Named::Any => Some(vec!["*".to_owned()]),
        Named::Tags(tags) => Some(tags),
    }
}

#[test]
fn empty_list_elements_are_ignored() {
    for (lines, tags) in [
        (&["\"a\","][..], &["a"][..]),
        (&["\"a\",,\"b\""], &["a", "b"]),
        (&[", \"a\" ,\t, \"b\" , "], &["a", "b"]),
        (&["", "\"a\""], &["a"]),
        (&["\"\","], &[""]),
        (&["\",,\""], &[",,"]),
        (&["*,"], &["*"]),
        (&["W/\"a\","], &[]),
    ] {
        let named = named_in(lines).unwrap_or_else(|| panic!("{lines:?} is refused"));
        assert_eq!(named, tags, "{lines:?}");
    }
}

#[test]
fn empty_headers_and_invalid_tags_are_refused() {
    for lines in [
        &[""][..],
        &[" , "],
        &["", ","],
        &["a,"],
        &["\"a\", b"],
        &["\"a"],
    ] {
        assert_eq!(named_in(lines), None, "{lines:?}");
    }
    let mut headers = HeaderMap::new();
    let bytes = HeaderValue::from_bytes(b"\xff").unwrap();
    headers.insert(IF_MATCH, bytes);
    assert!(named(&headers, &IF_MATCH, false).is_err());
    headers.clear();
    assert!(matches!(named(&headers, &IF_MATCH, false), Ok(None)));
}

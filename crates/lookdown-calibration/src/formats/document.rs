//! From bytes to a document: JSON, YAML, TOML and XML all become one kind of tree, bounded in size
//! and depth; line-based formats stay text.

use serde_json::Value;

use super::{CalibrationFile, FormatError, opencv_xml};

/// Deepest nesting that is read; real files have about six levels.
const MAX_DEPTH: usize = 32;
/// Most values in one file.
const MAX_NODES: usize = 100_000;

/// The content of a file before its format is recognized.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Document<'a> {
    /// Maps, lists, texts and numbers.
    Tree(Value),
    /// Lines.
    Lines(&'a str),
}

/// The syntax of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Syntax {
    Json,
    Yaml,
    Toml,
    Xml,
    Lines,
}

/// The text of a file and how it is written, judged by its content.
pub(super) fn text_of(bytes: &[u8]) -> Result<(&str, Syntax), FormatError> {
    if bytes.len() > CalibrationFile::MAX_BYTES {
        return Err(FormatError::malformed(format!(
            "it has more than {} bytes, and no calibration needs as many",
            CalibrationFile::MAX_BYTES
        )));
    }
    let text = std::str::from_utf8(bytes)
        .map_err(|error| FormatError::malformed(format!("it is not UTF-8 text: {error}")))?;
    let text = text.trim_start_matches('\u{feff}');
    Ok((text, syntax_of(text)))
}

fn syntax_of(text: &str) -> Syntax {
    match text.trim_start().chars().next() {
        Some('{') => return Syntax::Json,
        Some('<') => return Syntax::Xml,
        _ => {}
    }
    if super::recognize_lines(text).is_some() {
        return Syntax::Lines;
    }
    let first_line = text
        .lines()
        .map(str::trim)
        .find(|line| !(line.is_empty() || line.starts_with('#')));
    let is_toml = first_line.is_some_and(|line| {
        let before_colon = line.split(':').next().unwrap_or(line);
        before_colon.contains('=') || (line.starts_with('[') && line.ends_with(']'))
    });
    if is_toml { Syntax::Toml } else { Syntax::Yaml }
}

/// Reads the tree, or hands out the lines.
pub(super) fn parse(text: &str, syntax: Syntax) -> Result<Document<'_>, FormatError> {
    if most_nodes(text, syntax) > MAX_NODES {
        return Err(FormatError::malformed(format!(
            "it has more than {MAX_NODES} values, and no calibration needs as many"
        )));
    }
    let tree = match syntax {
        // Its parser stops at 128 levels by itself.
        Syntax::Json => serde_json::from_str(text).map_err(|error| error.to_string()),
        Syntax::Yaml => yaml(text),
        Syntax::Toml => toml(text),
        Syntax::Xml => opencv_xml::parse(text, MAX_DEPTH, MAX_NODES),
        Syntax::Lines => return Ok(Document::Lines(text)),
    };
    tree.map(Document::Tree).map_err(FormatError::malformed)
}

/// At most as many values has a text whose parser does not count them itself. In TOML a table,
/// which takes a kibibyte, is as short as `.a`.
fn most_nodes(text: &str, syntax: Syntax) -> usize {
    let begins: &[u8] = match syntax {
        Syntax::Json => b"{[,",
        Syntax::Toml => b"{[,.=",
        Syntax::Yaml | Syntax::Xml | Syntax::Lines => return 0,
    };
    text.bytes().filter(|byte| begins.contains(byte)).count()
}

/// Reads YAML into any shape.
pub(super) fn yaml<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    let options = serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_depth: MAX_DEPTH,
            max_nodes: MAX_NODES,
            max_documents: 1,
            max_anchors: 16,
            max_aliases: 16,
        },
        with_snippet: false,
    };
    let text = without_directive(text);
    serde_saphyr::from_str_with_options(&text, options).map_err(|error| first_line(&error))
}

/// Reads TOML into any shape.
pub(super) fn toml<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, String> {
    toml::from_str(text).map_err(|error| format!("{}: {}", first_line(&error), error.message()))
}

/// Returns the message of a parser without its drawing of the place.
fn first_line(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

/// OpenCV up to 4 begins its files with `%YAML:1.0`, which is not a YAML directive, and others
/// leave out the `---` that has to follow one; as a comment it does no harm and lines keep their
/// numbers.
fn without_directive(text: &str) -> String {
    if text.starts_with("%YAML") {
        format!("#{text}")
    } else {
        text.to_owned()
    }
}

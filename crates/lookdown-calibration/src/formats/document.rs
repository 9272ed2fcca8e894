//! From bytes to a document: JSON, YAML, TOML and XML all become one kind of tree, bounded in size
//! and depth; line-based formats stay text.

use serde_json::Value;

use super::{CalibrationFile, FormatError, foreign, opencv_xml};

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
        .ok()
        .filter(|text| !text.contains('\0'));
    let text = text.ok_or_else(|| foreign::binary(bytes))?;
    let text = text.trim_start_matches('\u{feff}');
    Ok((text, syntax_of(text)))
}

fn syntax_of(text: &str) -> Syntax {
    let mut begin = text.chars().filter(|letter| !letter.is_whitespace());
    match (begin.next(), begin.next()) {
        (Some('{'), _) | (Some('['), Some('{')) => return Syntax::Json,
        (Some('<'), _) => return Syntax::Xml,
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
    // The words of the parsers are not repeated: they are about syntax, and the text may be none.
    let (name, place) = match syntax {
        // Its parser stops at 128 levels by itself.
        Syntax::Json => match serde_json::from_str(text) {
            Ok(tree) => return Ok(Document::Tree(tree)),
            Err(error) if error.is_eof() => {
                let problem = "its JSON ends early: take the whole file";
                return Err(FormatError::malformed(problem));
            }
            Err(error) => ("JSON", error.line() as u64),
        },
        Syntax::Yaml => match yaml(text) {
            Ok(tree) => return Ok(Document::Tree(tree)),
            Err(error) => ("YAML", error.location().map_or(0, |place| place.line())),
        },
        Syntax::Toml => match toml::from_str(text) {
            Ok(tree) => return Ok(Document::Tree(tree)),
            Err(error) => {
                let before = error.span().and_then(|span| text.get(..span.start));
                (
                    "TOML",
                    before.map_or(0, |before| before.matches('\n').count() as u64 + 1),
                )
            }
        },
        Syntax::Xml => {
            let tree = opencv_xml::parse(text, MAX_DEPTH, MAX_NODES);
            return tree.map(Document::Tree).map_err(FormatError::malformed);
        }
        Syntax::Lines => return Ok(Document::Lines(text)),
    };
    Err(FormatError::malformed(format!(
        "it is not valid {name} at line {place}: correct that line, or take the file that the \
         calibration program wrote"
    )))
}

/// The documents of a YAML text that have content, with the lines before them; other syntaxes have
/// one. Markers end a document wherever they stand, also in texts.
pub(super) fn documents(text: &str, syntax: Syntax) -> Vec<&str> {
    if syntax != Syntax::Yaml {
        return vec![text];
    }
    let mut documents = Vec::new();
    let (mut begin, mut position, mut has_content) = (0, 0, false);
    for line in text.split_inclusive('\n') {
        let is_marker = line.starts_with("---") || line.starts_with("...");
        if is_marker && has_content {
            documents.push(&text[begin..position]);
            (begin, has_content) = (position, false);
        }
        position += line.len();
        let written = line.trim_start_matches(['-', '.']).trim();
        let is_comment = written.is_empty() || written.starts_with(['#', '%']);
        has_content |= !is_comment;
    }
    if has_content || documents.is_empty() {
        documents.push(&text[begin..]);
    }
    documents
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
pub(super) fn yaml<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, serde_saphyr::Error> {
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
    serde_saphyr::from_str_with_options(&text, options)
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

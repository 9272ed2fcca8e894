//! A minimal writer of XML for annotation files. Its output is always well-formed.

use std::{borrow::Cow, fmt::Write};

const INDENT: &str = "  ";

/// A document to which elements are appended.
pub(super) struct Xml {
    text: String,
    depth: usize,
}

impl Xml {
    /// Creates an empty document.
    pub(super) fn document() -> Self {
        Self {
            text: "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n".to_owned(),
            depth: 0,
        }
    }

    /// Opens an element that contains others.
    pub(super) fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.begin(name, attributes);
        self.text.push_str(">\n");
        self.depth += 1;
    }

    /// Closes the element that was opened last.
    pub(super) fn close(&mut self, name: &str) {
        self.depth = self.depth.saturating_sub(1);
        self.indent();
        self.end(name);
    }

    /// Appends an element with text and attributes.
    pub(super) fn element(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) {
        self.begin(name, attributes);
        self.text.push('>');
        self.text.push_str(&escaped(text));
        self.end(name);
    }

    /// Appends an element with text only.
    pub(super) fn text(&mut self, name: &str, text: &str) {
        self.element(name, &[], text);
    }

    /// Returns the complete document.
    pub(super) fn finish(self) -> String {
        self.text
    }

    fn begin(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.indent();
        self.text.push('<');
        self.text.push_str(name);
        for (attribute, value) in attributes {
            // Writing to a string cannot fail.
            let _ = write!(self.text, " {attribute}=\"{}\"", escaped(value));
        }
    }

    fn end(&mut self, name: &str) {
        // As above.
        let _ = writeln!(self.text, "</{name}>");
    }

    fn indent(&mut self) {
        self.text.push_str(&INDENT.repeat(self.depth));
    }
}

/// Escapes characters that have a meaning in XML, and replaces those that XML cannot contain (XML
/// 1.0, section 2.2) by U+FFFD.
fn escaped(text: &str) -> Cow<'_, str> {
    let is_plain = |c: char| c >= ' ' && !"&<>\"'\u{fffe}\u{ffff}".contains(c);
    if text.chars().all(is_plain) {
        return Cow::Borrowed(text);
    }
    let mut result = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        match character {
            '&' => result.push_str("&amp;"),
            '<' => result.push_str("&lt;"),
            '>' => result.push_str("&gt;"),
            '"' => result.push_str("&quot;"),
            '\'' => result.push_str("&apos;"),
            // A parser would normalise them to spaces.
            '\t' => result.push_str("&#9;"),
            '\n' => result.push_str("&#10;"),
            '\r' => result.push_str("&#13;"),
            other if is_plain(other) => result.push(other),
            _ => result.push(char::REPLACEMENT_CHARACTER),
        }
    }
    Cow::Owned(result)
}

//! XML documents of annotation files.

use quick_xml::se::Serializer;
use serde::Serialize;

const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

/// Returns the document with the root element `root`.
pub(super) fn document(root: &str, content: &impl Serialize) -> String {
    let mut text = DECLARATION.to_owned();
    let written = Serializer::with_root(&mut text, Some(root)).and_then(|mut serializer| {
        serializer.indent(' ', 2).expand_empty_elements(true);
        content.serialize(serializer)
    });
    debug_assert!(written.is_ok(), "{written:?}");
    text.push('\n');
    text
}

/// Text in which U+FFFD replaces control characters and others that XML cannot contain (XML 1.0,
/// section 2.2), or that a parser would change.
#[derive(Serialize)]
#[serde(transparent)]
pub(super) struct Text(String);

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        let is_kept = |c: char| c >= ' ' && !"\u{fffe}\u{ffff}".contains(c);
        let kept = |c: char| {
            if is_kept(c) {
                c
            } else {
                char::REPLACEMENT_CHARACTER
            }
        };
        Self(text.chars().map(kept).collect())
    }
}

//! XML documents of annotation files.

use quick_xml::escape::escape;

/// The first line of a document.
pub(super) const DECLARATION: &str = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

/// Returns escaped text in which U+FFFD replaces control characters and others that XML cannot
/// contain (XML 1.0, section 2.2), or that a parser would change.
pub(super) fn escaped(text: &str) -> String {
    let is_refused = |c: char| c < ' ' || "\u{fffe}\u{ffff}".contains(c);
    let replaced = text.replace(is_refused, "\u{fffd}");
    escape(replaced).into_owned()
}

//! Text of clients and other programs, as problems and log lines repeat it.

use std::{error::Error, fmt};

/// Largest number of characters of a client's text that are repeated.
const MAX_CHARS: usize = 64;
/// Largest number of characters of a line.
const MAX_LINE_CHARS: usize = 300;

/// Displays a text in quotation marks with its control characters escaped, cut after 64 characters:
/// enough to recognize it, too short to fill a log.
#[derive(Debug, Clone, Copy)]
pub struct Quoted<'a>(pub &'a str);

impl fmt::Display for Quoted<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kept = shortened(self.0);
        let ellipsis = if kept.len() < self.0.len() { "…" } else { "" };
        write!(formatter, "{kept:?}{ellipsis}")
    }
}

/// Returns true for characters that a name must not have: control characters, and invisible ones
/// that join, hide or reorder the others (Unicode category Cf), such as U+202E, and fillers.
pub fn is_invisible(character: char) -> bool {
    character.is_control()
        || matches!(
            character,
            '\u{ad}' | '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{3164}' | '\u{ffa0}'
                | '\u{600}'..='\u{605}'
                | '\u{61c}'
                | '\u{6dd}'
                | '\u{70f}'
                | '\u{180e}'
                | '\u{200b}'..='\u{200f}'
                | '\u{2028}'..='\u{202e}'
                | '\u{2060}'..='\u{206f}'
                | '\u{feff}'
                | '\u{fff9}'..='\u{fffb}'
                | '\u{e0000}'..='\u{e007f}'
        )
}

/// Most characters of the name of a camera.
pub const MAX_CAMERA_CHARS: usize = 128;

/// Returns true if a camera may have this name.
pub fn is_camera_name(name: &str) -> bool {
    let is_shown = !name.trim().is_empty() && !name.contains(is_invisible);
    is_shown && name.chars().count() <= MAX_CAMERA_CHARS
}

/// Formats a text as one line of at most 300 characters, so that it can neither forge nor fill log
/// lines.
pub fn one_line(text: &(impl fmt::Display + ?Sized)) -> String {
    let text = text.to_string();
    let text = text.trim().chars().take(MAX_LINE_CHARS);
    text.map(|c| if is_invisible(c) { ' ' } else { c })
        .collect()
}

/// Formats an error with its causes in one line.
pub fn with_causes(error: &(dyn Error + 'static)) -> String {
    one_line(
        &causes(error)
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(": "),
    )
}

/// Returns an error and its causes, the innermost last.
pub fn causes<'a>(
    error: &'a (dyn Error + 'static),
) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
    std::iter::successors(Some(error), |&error| error.source())
}

/// Returns the first 64 characters of a text.
pub fn shortened(text: &str) -> &str {
    let end = text.char_indices().nth(MAX_CHARS);
    end.map_or(text, |(end, _)| &text[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_reorder_a_line_are_replaced() {
        assert_eq!(one_line("a\u{202e}b\u{feff}c\nd"), "a b c d");
        assert!(!is_invisible('ä') && !is_invisible('走') && !is_invisible(' '));
        assert!(is_camera_name("Eingang, 2. OG") && !is_camera_name("\u{202e}llah"));
        assert!(!is_camera_name("hall\u{3164}") && !is_camera_name(" "));
    }

    #[test]
    fn short_text_is_quoted_whole() {
        assert_eq!(Quoted("1.5").to_string(), "\"1.5\"");
        assert_eq!(Quoted("").to_string(), "\"\"");
        assert_eq!(Quoted("a\n\"b").to_string(), r#""a\n\"b""#);
    }

    #[test]
    fn an_error_is_one_line_of_limited_length() {
        let error = "refused\r\n2026-11-22 WARN\tforged\u{1b}[31m";
        assert_eq!(one_line(&error), "refused  2026-11-22 WARN forged [31m");
        assert_eq!(one_line(&"ä".repeat(1000)).chars().count(), 300);
    }

    #[test]
    fn long_text_is_cut_between_characters() {
        let quoted = Quoted(&"ä".repeat(65)).to_string();
        assert_eq!(quoted, format!("\"{}\"…", "ä".repeat(64)));
        assert!(!Quoted(&"ä".repeat(64)).to_string().contains('…'));
    }
}

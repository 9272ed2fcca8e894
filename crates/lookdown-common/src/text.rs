//! Text of other programs, as log lines repeat it.

/// Most characters of such a text.
const MAX_CHARS: usize = 300;

/// Formats a text as one line of at most 300 characters, so that it can neither forge nor fill log
/// lines.
#[must_use]
pub fn one_line(text: &str) -> String {
    let text = text.trim().chars().take(MAX_CHARS);
    text.map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Formats an error with its causes in one line.
#[must_use]
pub fn with_causes(error: &dyn std::error::Error) -> String {
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        message = format!("{message}: {error}");
        cause = error.source();
    }
    one_line(&message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_one_line_of_limited_length() {
        assert_eq!(
            one_line("refused\r\n2026 WARN forged\n"),
            "refused  2026 WARN forged"
        );
        assert_eq!(one_line(&"x".repeat(1000)).len(), MAX_CHARS);
    }
}

//! Messages of the runtime.

/// The runtime's error message without its call stack.
pub(super) fn first_line(error: &ort::Error) -> String {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default().trim();
    line.trim_end_matches('.').to_owned()
}

//! Plain names, `[a-z0-9][a-z0-9_-]{0,63}`: safe in file names, URLs, labels and TOML keys.

/// Most characters of a plain name.
pub const MAX_CHARS: usize = 64;

/// Returns true if the name is plain.
pub fn is_plain(name: &str) -> bool {
    let letter_or_digit = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    name.len() <= MAX_CHARS
        && name.starts_with(letter_or_digit)
        && name
            .chars()
            .all(|c| letter_or_digit(c) || c == '_' || c == '-')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_names_are_accepted() {
        for plain in ["lobby", "0", "a-b_c", &"x".repeat(MAX_CHARS)] {
            assert!(is_plain(plain), "{plain}");
        }
        for other in [
            "",
            "../etc",
            "Lobby",
            "-x",
            "_x",
            "a.b",
            "a/b",
            "ä",
            &"x".repeat(65),
        ] {
            assert!(!is_plain(other), "{other}");
        }
    }
}

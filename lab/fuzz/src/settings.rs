//! Fuzzes environment variables, a line `KEY=VALUE` each.

use lookdown::settings::load;

/// Loads the settings; returns true if they are valid.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let variables = text.lines().filter_map(|line| line.split_once('='));
    let variables = variables.map(|(key, value)| (key.to_owned(), value.to_owned()));
    match load(None, variables) {
        Ok(_) => true,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

//! The web page.

use super::{
    declare::settings,
    form::{Form, optional, text},
};

settings! {
    /// The web page.
    #[derive(Debug, Clone, PartialEq)]
    pub struct PageSettings in "page" {
        /// The path of this origin at which a proxy serves `/counts` of `lookdown count`, such as
        /// `/counts`. The page then draws tracks, lines, zones and heat maps over the cameras
        /// (docs/web-page.md). Empty: none.
        counts_path: Option<String> = None => optional(origin_path());
    }
}

/// A path of the origin of the page.
fn origin_path() -> Form<String> {
    text("a path such as /counts, without query", |path| {
        let is_plain = |character: char| {
            character.is_ascii_alphanumeric() || matches!(character, '/' | '-' | '_' | '.' | '~')
        };
        // Two slashes would name another host.
        path.starts_with('/')
            && !path.contains("//")
            && !path.ends_with('/')
            && path.chars().all(is_plain)
    })
}

#[cfg(test)]
mod tests {
    use crate::settings::load;

    #[test]
    fn counts_path_is_a_path_of_this_origin() {
        let read = |value: &str| {
            let variable = "LOOKDOWN__PAGE__COUNTS_PATH".to_owned();
            load(None, [(variable, value.to_owned())]).map(|settings| settings.page.counts_path)
        };
        assert_eq!(read("/counts").unwrap().as_deref(), Some("/counts"));
        assert_eq!(read("").unwrap(), None);
        for refused in [
            "counts",
            "//host/counts",
            "/counts/",
            "http://host/counts",
            "/a?b",
        ] {
            let error = read(refused).unwrap_err().to_string();
            assert!(
                error.contains("page.counts_path") || error.contains("PAGE__COUNTS_PATH"),
                "{error}"
            );
        }
    }
}

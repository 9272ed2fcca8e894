//! The state that is changed over HTTP.

use std::path::PathBuf;

use super::{declare::settings, form::path};

settings! {
    /// The state that is changed over HTTP.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StateSettings in "state" {
        /// The folder of the views, and of the cameras of `lookdown run` that are added over HTTP,
        /// with each password in a file that only its user can read. It is created when it is
        /// needed.
        path: PathBuf = "state".into() => path();
    }
}

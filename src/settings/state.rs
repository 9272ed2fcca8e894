//! The state of `lookdown run`.

use std::path::PathBuf;

use super::{declare::settings, form::path};

settings! {
    /// The state of `lookdown run`.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StateSettings in "state" {
        /// The folder in which `lookdown run` stores the cameras that are added over HTTP, with
        /// each password in a file that only its user can read. It is created when it is needed.
        path: PathBuf = "state".into() => path();
    }
}

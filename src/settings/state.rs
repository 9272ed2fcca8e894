//! The state that is changed over HTTP.

use std::path::PathBuf;

use super::{declare::settings, form::path};

settings! {
    /// The state that is changed over HTTP.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StateSettings in "state" {
        /// The folder of views, of reference counts, and of the cameras that are added to
        /// `lookdown run` over HTTP, with each password in a file that only its user can read. It
        /// is created when it is needed.
        path: PathBuf = "state".into() => path();
    }
}

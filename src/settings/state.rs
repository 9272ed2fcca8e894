//! The state of the server.

use std::path::PathBuf;

use super::{declare::settings, form::path};

settings! {
    /// The state of the server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct StateSettings in "state" {
        /// The folder of reference counts, and of the cameras that are added to `lookdown run` over
        /// HTTP, with each password in a file that only its user can read. It is created when it is
        /// needed.
        path: PathBuf = "state".into() => path();
    }
}

//! The models.

use std::{num::NonZeroU64, path::PathBuf};

use super::{
    declare::settings,
    form::{names, optional, path, poll_seconds},
    locate::DEFAULT_REPOSITORY,
};

settings! {
    /// The models.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ModelSettings in "model" {
        /// One model for all profiles: a model folder or an ONNX file. Empty: each profile has its
        /// own.
        path: Option<PathBuf> = None => optional(path());
        /// The folder of models, each in a folder of its name. The default folder is also searched
        /// for in the folders above the executable.
        repository: PathBuf = DEFAULT_REPOSITORY.into() => path();
        /// Names of models to load at the start in addition to those of the profiles.
        also_load: Vec<String> = Vec::new() => names();
        /// The interval in seconds at which the files of loaded models are checked for changes. 0:
        /// never. A changed model is used once it has passed its check.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(5) => poll_seconds();
    }
}

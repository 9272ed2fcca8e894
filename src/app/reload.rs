//! The reload that SIGHUP requests: the files that the pollers check, at once.

use std::sync::Arc;

use lookdown_detect::inference::ModelRepository;

use super::App;
use crate::{access::AccessKeys, calibration_store::Calibrations, tls::Tls};

/// Reads again what may change while the server runs. Clones share it.
#[derive(Clone)]
pub struct Reloader {
    keys: Option<Arc<AccessKeys>>,
    tls: Option<Arc<Tls>>,
    calibrations: Arc<Calibrations>,
    models: Arc<ModelRepository>,
}

impl App {
    /// The reloader of the files that the app uses.
    #[must_use]
    pub fn reloader(&self) -> Reloader {
        Reloader {
            keys: self.keys.clone(),
            tls: self.tls.clone(),
            calibrations: Arc::clone(&self.calibrations),
            models: Arc::clone(&self.models),
        }
    }
}

impl Reloader {
    /// Loads the files that have changed. A file that cannot be used is logged, and the previous
    /// version stays in use. Blocks.
    pub fn reload(&self) {
        if let Some(keys) = &self.keys {
            keys.refresh();
        }
        if let Some(tls) = &self.tls {
            tls.refresh();
        }
        self.calibrations.refresh();
        // The second check finds the files of models unchanged since the first, and loads them.
        self.models.reload_changed();
        self.models.reload_changed();
        tracing::info!(
            "SIGHUP: the files of keys, certificates, calibrations and models were checked for \
             changes"
        );
    }
}

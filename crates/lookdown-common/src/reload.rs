//! Settings that are read again while a program runs.

use std::{sync::Arc, time::Duration};

use tokio::{task::spawn_blocking, time::sleep};

use crate::{ConfigError, LogOnce};

/// Interval of the checks for changed settings.
const CHECK: Duration = Duration::from_secs(2);

/// Settings that are read again. Clones share the reader.
pub struct Reload<T>(Arc<dyn Fn() -> Result<T, ConfigError> + Send + Sync>);

impl<T> Clone for Reload<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: PartialEq + Send + 'static> Reload<T> {
    /// Creates settings that `read` reads. It may block.
    pub fn new(read: impl Fn() -> Result<T, ConfigError> + Send + Sync + 'static) -> Self {
        Self(Arc::new(read))
    }

    /// Reads the settings without blocking the runtime.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub async fn load(&self) -> Result<T, ConfigError> {
        let read = Arc::clone(&self.0);
        let loaded = spawn_blocking(move || read()).await;
        loaded.unwrap_or_else(|error| Err(ConfigError::problem("settings", &error)))
    }

    /// Waits until the settings differ from `current`, and returns them. Invalid settings are
    /// logged once, and the current ones stay in use.
    pub async fn changed(&self, current: &T) -> T {
        let mut log = LogOnce::default();
        loop {
            sleep(CHECK).await;
            match self.load().await {
                Ok(settings) if settings != *current => return settings,
                Ok(_) => drop(log.clear()),
                Err(problem) => {
                    if log.should_log(&problem.to_string()) {
                        tracing::warn!("{problem}; the last valid settings stay in use");
                    }
                }
            }
        }
    }
}

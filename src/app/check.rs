//! The report of `lookdown serve --check`.

use std::{fmt::Write as _, thread};

use anyhow::bail;
use lookdown_detect::parameters::Priority;

use super::{App, CALIBRATIONS_CHECK};
use crate::access::Scope;

impl App {
    /// Loads every model that is served, and describes the server that could start: a line on
    /// models and calibrations, and lines on the clients that have access. Blocks.
    ///
    /// # Errors
    /// Returns an error if a model cannot be loaded, or if the calibration store cannot be read.
    pub fn check(&self) -> anyhow::Result<String> {
        for name in &self.to_load {
            self.state.models.load(name)?;
        }
        while !self.state.calibrations.is_read() {
            thread::sleep(CALIBRATIONS_CHECK);
        }
        let health = self.state.calibrations.health();
        if let Some(problem) = health.store_problem {
            bail!("calibrations.path: {problem}");
        }
        Ok(format!(
            "ready to serve on {}: the models {} and {} calibrations can be used\n{}",
            self.settings.server.listen,
            self.to_load.join(", "),
            health.serving,
            self.access_report(),
        ))
    }

    fn access_report(&self) -> String {
        let address = self.settings.server.listen;
        let mut report = match &self.keys {
            None if !self.settings.access.open => format!(
                "access: open, without API keys: every client on this machine may send frames, read \
                 and change everything at {address}"
            ),
            None => format!(
                "access: open (access.open), without API keys: every client that reaches {address} \
                 may send frames and read calibrations and reports; changes are refused; set \
                 access.keys_file to need keys"
            ),
            Some(keys) => {
                let keys = keys.known();
                let mut report =
                    format!("access: {address} needs an API key; {} known", keys.len());
                for holder in keys.holders() {
                    let scopes = holder.scopes.joined(", ");
                    let _ = write!(report, "\n  {}: {scopes}", holder.name);
                    if holder.scopes.allow(Scope::Detect) {
                        let highest = Priority::from_level(holder.highest_priority.get());
                        let _ = write!(report, "; priorities {} to 9", highest.highest_level());
                    }
                }
                report
            }
        };
        let public = match self.settings.server.metrics_listen {
            Some(address) => {
                format!("\nwithout a key: health checks and the API page, and metrics at {address}")
            }
            None => "\nwithout a key: health checks, metrics and the API page".to_owned(),
        };
        report.push_str(&public);
        report
    }
}

//! Logs on standard error. Standard output is reserved for reports.

use std::io::IsTerminal;

use tracing::{Subscriber, level_filters::LevelFilter};
use tracing_subscriber::{
    filter::Targets,
    fmt::{self, MakeWriter},
    layer::SubscriberExt,
    util::{SubscriberInitExt, TryInitError},
};

use crate::settings::{LogFormat, LogSettings};

/// Starts logging, including that of panics.
///
/// # Errors
/// If logging was already started in this process.
pub fn start_logs(settings: &LogSettings) -> Result<(), TryInitError> {
    let in_color = std::io::stderr().is_terminal();
    log_subscriber(settings, std::io::stderr, in_color).try_init()?;
    std::panic::set_hook(Box::new(|panic| {
        let thread = std::thread::current();
        tracing::error!(thread = thread.name().unwrap_or("unnamed"), "{panic}");
    }));
    Ok(())
}

/// Returns the subscriber that writes log lines according to the settings. Lines of a request carry
/// its fields: in text before the message, in JSON in the object `span`.
pub fn log_subscriber(
    settings: &LogSettings,
    writer: impl for<'writer> MakeWriter<'writer> + Send + Sync + 'static,
    in_color: bool,
) -> Box<dyn Subscriber + Send + Sync> {
    let logs = fmt::Subscriber::builder()
        .with_writer(writer)
        .with_ansi(in_color)
        .with_max_level(LevelFilter::TRACE);
    // The setting was parsed when it was read.
    let filter: Targets = settings.filter.parse().unwrap_or_default();
    match settings.format {
        LogFormat::Text => Box::new(logs.finish().with(filter)),
        LogFormat::Json => {
            let logs = logs.json().flatten_event(true).with_span_list(false);
            Box::new(logs.finish().with(filter))
        }
    }
}

//! The log and traces.

use tracing_subscriber::filter::Targets;
use url::Url;

use super::{
    declare::settings,
    form::{Form, Refusal, choice, optional, parsed, share, text},
};

settings! {
    /// The log, on standard error.
    #[derive(Debug, Clone, PartialEq)]
    pub struct LogSettings in "log" {
        /// The format of a log line: `text` for reading, `json` for machines.
        format: LogFormat = LogFormat::Text
            => choice(&[("text", LogFormat::Text), ("json", LogFormat::Json)]);
        /// The events that are logged: a level, or levels per module. `ort` is ONNX Runtime, which
        /// logs much.
        filter: String = "info,ort=warn".to_owned() => filter();
    }
}

settings! {
    /// Traces.
    #[derive(Debug, Clone, PartialEq)]
    pub struct TraceSettings in "telemetry" {
        /// The collector of traces with OTLP over HTTP, such as `http://127.0.0.1:4318`, without
        /// `/v1/traces` (docs/observability.md). Empty: no traces. Its credentials come from the
        /// variable `OTEL_EXPORTER_OTLP_HEADERS`.
        otlp_endpoint: Option<Url> = None => optional(endpoint());
        /// The share of the requests that is traced, where the caller's `traceparent` does not
        /// decide.
        sample_ratio: f64 = 1.0 => share();
        /// The service name of the traces.
        service_name: String = "lookdown".to_owned() => text("a name", |name| !name.trim().is_empty());
    }
}

/// The format of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFormat {
    /// For reading.
    Text,
    /// One JSON object per line.
    Json,
}

fn filter() -> Form<String> {
    parsed(
        "log filter",
        |text| match text.parse::<Targets>() {
            Ok(_) => Ok(text.to_owned()),
            Err(error) => Err(Refusal::Shown(format!(
                "{error}; give a level such as info, or info,lookdown=debug"
            ))),
        },
        String::clone,
    )
}

/// The collector's address. One with a password is refused: addresses are shown.
fn endpoint() -> Form<Url> {
    parsed(
        "URL",
        |text| {
            let refused = || {
                let remedy = "give an address for OTLP over HTTP such as http://127.0.0.1:4318";
                Refusal::Shown(remedy.to_owned())
            };
            let url: Url = text.parse().map_err(|_| refused())?;
            if !url.username().is_empty() || url.password().is_some() {
                let problem = "credentials belong into the variable OTEL_EXPORTER_OTLP_HEADERS";
                return Err(Refusal::Hidden(problem.to_owned()));
            }
            let is_plain = url.query().is_none() && url.fragment().is_none();
            let is_http = matches!(url.scheme(), "http" | "https");
            (is_plain && is_http).then_some(url).ok_or_else(refused)
        },
        Url::to_string,
    )
}

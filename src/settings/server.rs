//! The HTTP server, its TLS, its connections, its limits and its end.
//!
//! The cost of one frame, and of all frames together.
//!
//! TLS: a certificate and its private key, given together or not at all.
//!
//! API keys, and the web pages that may call the server.
//!
//! The log and traces.

use std::{
    net::SocketAddr,
    num::{NonZeroU32, NonZeroU64, NonZeroUsize},
    path::PathBuf,
    time::Duration,
};

use lookdown_http::server::ConnectionLimits;
use tracing_subscriber::filter::Targets;
use url::{Origin, Url};

use super::{
    SettingsError,
    declare::settings,
    form::{
        Form, MAX_BYTES, MAX_TIMEOUT_MILLIS, Refusal, address, choice, count, flag, given_path,
        list, millis, optional, parsed, path, poll_seconds, rate, share, text, whole, zero_is_none,
    },
};
use crate::{access::KeyList, tls::TlsOptions};

settings! {
    /// The HTTP server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ServerSettings in "server" {
        /// The IP address and port to listen on. `[::]:8080` is every address of the machine.
        listen: SocketAddr = SocketAddr::from(([127, 0, 0, 1], 8080)) => address();
        /// The IP address and port for `/metrics` and the health checks alone; `/metrics` is then
        /// not served elsewhere. Empty: `/metrics` is served with all other routes.
        metrics_listen: Option<SocketAddr> = None => optional(address());
        /// The largest request body in bytes. A larger one is answered with 413. The smallest
        /// setting still holds an image, and the largest, 2 GiB, is more than any image within the
        /// pixel limits.
        max_body_bytes: usize = 32 << 20 => whole(1024..=2 << 30);
        /// The longest time for a request. A slower upload is answered with 408, a slower detection
        /// with 504.
        request_timeout as "request_timeout_millis": Duration = Duration::from_secs(30)
            => millis(1..=MAX_TIMEOUT_MILLIS);
    }
}

settings! {
    in "server" fill ConnectionLimits {
        /// The largest number of open connections. Further ones wait until one is closed. Health
        /// checks that must not wait need `metrics_listen`.
        max_connections => count();
        /// The longest time for the path and the headers of a request to arrive.
        header_timeout as "header_timeout_millis" => millis(1..=MAX_TIMEOUT_MILLIS);
        /// The longest time that a connection stays open between two requests, or while its client
        /// reads less than 64 KiB of a response. A proxy that keeps connections should close its
        /// own earlier.
        idle_timeout as "idle_timeout_millis" => millis(1..=MAX_TIMEOUT_MILLIS);
        /// The most bytes of the path and all headers. More are answered with 431.
        max_header_bytes => whole(1024..=128 * 1024);
        /// The most headers of a request; browsers send about twenty. More are answered with 431.
        max_headers => whole(16..=1024);
    }
}

settings! {
    /// The end of the server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ShutdownSettings in "shutdown" {
        /// The time after a termination signal (SIGTERM) during which everything is still served
        /// while `/readyz` answers 503, so that load balancers notice. Ctrl-C skips it.
        grace as "grace_millis": Duration = Duration::from_secs(5) => millis(0..=MAX_TIMEOUT_MILLIS);
        /// The longest time after that for the requests that have arrived. 0: as long as for any
        /// request.
        drain_timeout as "drain_timeout_millis": Option<Duration> = None
            => zero_is_none(millis(0..=MAX_TIMEOUT_MILLIS));
    }
}

/// The longest side that the JPEG format can state.
const MAX_IMAGE_SIDE: u64 = 65_535;

settings! {
    /// The cost of one frame, and of all frames together.
    #[derive(Debug, Clone, PartialEq)]
    pub struct LimitSettings in "limits" {
        /// The longest side of a frame in pixels, checked before it is decoded.
        max_image_side: u32 = 8192 => whole(1..=MAX_IMAGE_SIDE);
        /// The most pixels of a frame, checked before it is decoded.
        max_image_pixels: u64 = 50_000_000 => whole(1..=MAX_IMAGE_SIDE * MAX_IMAGE_SIDE);
        /// The most memory for decoding one frame, in bytes.
        max_decode_bytes: u64 = 512 << 20 => whole(1..=MAX_BYTES);
        /// The most frames that wait for a worker or are processed. Further ones are answered with
        /// 429. One of several clients may have half of them. A frame counts 1 more for each 8
        /// megapixels that are decoded or drawn, and for each 32 inputs of the network, half of
        /// the limit at most.
        max_frames_in_flight: NonZeroUsize = NonZeroUsize::new(16).unwrap_or(NonZeroUsize::MIN)
            => count();
        /// The most memory for all request bodies together, and for the tensors that are unpacked
        /// from them (four bytes a number), in bytes. Further ones are answered with 429. Responses
        /// of more than 64 KiB that clients have not read yet may use as much again. At least
        /// `server.max_body_bytes`. One of several clients may use half of it.
        max_upload_bytes: usize = 256 << 20 => whole(1024..=MAX_BYTES);
        /// The least bytes a second of a request body, over five seconds. A slower one is answered
        /// with 408. 0: no limit.
        min_upload_bytes_per_second: Option<NonZeroU64> = NonZeroU64::new(1024) => whole(0..=2 << 30);
        /// The requests a second that a client may send in the long run. Further ones are answered
        /// with 429. 0: no limit. A client is an API key, and without one an address. Health
        /// checks, metrics and pages are not counted.
        requests_per_second: Option<f64> = None => rate(0.02..=100_000.0);
        /// The requests that a client may send at once after a pause.
        request_burst: NonZeroU32 = NonZeroU32::new(20).unwrap_or(NonZeroU32::MIN) => count();
    }
}

impl LimitSettings {
    /// The limits, if they leave room for the largest body.
    pub(super) fn checked(self, server: &ServerSettings) -> Result<Self, SettingsError> {
        if self.max_upload_bytes < server.max_body_bytes {
            return Err(SettingsError::value(
                "limits.max_upload_bytes",
                self.max_upload_bytes.to_string(),
                format!(
                    "give at least server.max_body_bytes, {}",
                    server.max_body_bytes
                ),
            ));
        }
        Ok(self)
    }
}

/// A minute: no client needs longer for a handshake.
const MAX_HANDSHAKE_MILLIS: u64 = 60_000;

settings! {
    /// TLS as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct TlsKeys in "server.tls" {
        /// The PEM file of the server's certificate, followed by the intermediate certificates.
        /// With a certificate and a private key the server speaks HTTPS, without them plain HTTP.
        certificate: Option<PathBuf> = None => optional(path());
        /// The PEM file of the certificate's private key.
        private_key: Option<PathBuf> = None => optional(path());
        /// The PEM file of certificate authorities. Each client must then show a certificate of one
        /// of them.
        client_certificates: Option<PathBuf> = None => optional(path());
        /// The interval in seconds at which these files are checked for changes. 0: never. An
        /// invalid new version leaves the old one in use and shows in the metrics and in the log.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// The longest time for a TLS handshake.
        handshake_timeout as "handshake_timeout_millis": Duration = Duration::from_secs(10)
            => millis(1..=MAX_HANDSHAKE_MILLIS);
    }
}

impl TlsKeys {
    /// The options of TLS; `None` for plain HTTP.
    pub(super) fn checked(self) -> Result<Option<TlsOptions>, SettingsError> {
        let missing = |key, remedy| Err(SettingsError::value(key, "empty", remedy));
        match (self.certificate, self.private_key) {
            (Some(certificate), Some(private_key)) => Ok(Some(TlsOptions {
                certificate,
                private_key,
                client_certificates: self.client_certificates,
                poll_seconds: self.poll_seconds,
                handshake_timeout: self.handshake_timeout,
            })),
            (Some(_), None) => missing(
                "server.tls.private_key",
                "give the file of the certificate's private key, or leave the certificate out",
            ),
            (None, Some(_)) => missing(
                "server.tls.certificate",
                "give the file of the private key's certificate, or leave the private key out",
            ),
            (None, None) if self.client_certificates.is_some() => missing(
                "server.tls.certificate",
                "clients show certificates over TLS only: give the server's certificate and private \
                 key, or leave client_certificates out",
            ),
            (None, None) => Ok(None),
        }
    }
}

settings! {
    /// API keys, and the web pages that may call the server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct AccessSettings in "access" {
        /// The file of API keys, one line each as `lookdown key new` prints it
        /// (docs/deployment.md). With keys, every request except health checks, metrics and the API
        /// page needs one. Without keys, the server starts only on a loopback address or with
        /// `access.open`. Leave it out for none: an empty value is refused.
        keys_file: Option<PathBuf> = None => given_path("/etc/lookdown/keys.toml");
        /// The interval in seconds at which that file is checked for changes. 0: never. A line that
        /// is not a key is left out; an unreadable file changes nothing; the log says so.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// Keys in addition to those of the file, each as `name:scope+scope:sha256`, with
        /// `:highest_priority` behind it where that is not 5.
        keys: KeyList = KeyList::default() => keys();
        /// Lets every client that reaches a server without keys detect and read; changes are
        /// refused. Such a server needs it to start on an address that is not loopback. Has no
        /// effect when there are keys.
        open: bool = false => flag();
        /// Names of a server without keys, beside those that no stranger can own: addresses, names
        /// without a dot, and names below `.local`, `.internal`, `.home.arpa` and `.localhost`. A
        /// request for another name may come from a web page whose owner made its name resolve to
        /// this server (DNS rebinding). `"*.example.org"` is every name below it, `"*"` every name.
        hosts: Vec<String> = Vec::new() => hosts();
        /// Origins of web pages that may call the server from a browser, such as
        /// `https://dashboard.example`.
        cors_origins: Vec<String> = Vec::new() => origins();
    }
}

impl AccessSettings {
    /// Returns `true` if requests need an API key.
    pub fn needs_keys(&self) -> bool {
        !self.keys.is_empty() || self.keys_file.is_some()
    }

    /// Checks that a server may listen on this address: other machines reach a server without keys
    /// only if the operator says so.
    ///
    /// # Errors
    /// One sentence with both remedies.
    pub fn check_exposure(&self, listen: SocketAddr) -> Result<(), SettingsError> {
        if listen.ip().is_loopback() || self.needs_keys() || self.open {
            return Ok(());
        }
        Err(SettingsError::value(
            "server.listen",
            listen,
            "other machines reach this address and no API keys are set: set \
                     access.keys_file, or set access.open to true to let every client detect and \
                     read",
        ))
    }
}

fn keys() -> Form<KeyList> {
    list(
        "API keys",
        |entries| {
            let keys = entries.join(",").parse();
            keys.map_err(|error: anyhow::Error| Refusal::Hidden(error.to_string()))
        },
        // No key is a default.
        |_| Vec::new(),
    )
}

/// Host names without a port, or patterns of them.
fn hosts() -> Form<Vec<String>> {
    list(
        "host names",
        |texts| texts.iter().map(|&text| host(text)).collect(),
        Vec::clone,
    )
}

fn host(text: &str) -> Result<String, Refusal> {
    let name = text.strip_prefix("*.").unwrap_or(text);
    let is_label = |label: &str| {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        !label.is_empty() && label.chars().all(is_word)
    };
    if text == "*" || name.split('.').all(is_label) {
        return Ok(text.to_ascii_lowercase());
    }
    Err(Refusal::Part(
        format!("{text:?}"),
        "give a host name without scheme and port, such as lookdown.example or *.example.org"
            .to_owned(),
    ))
}

/// Origins as browsers write them: any other text would never match.
fn origins() -> Form<Vec<String>> {
    list(
        "origins",
        |texts| texts.iter().map(|&text| origin(text)).collect(),
        Vec::clone,
    )
}

fn origin(text: &str) -> Result<String, Refusal> {
    let url = Url::parse(text).ok();
    match url.map(|url| url.origin()) {
        Some(origin @ Origin::Tuple(..)) if origin.ascii_serialization() == text => {
            Ok(text.to_owned())
        }
        _ => Err(Refusal::Part(
            format!("{text:?}"),
            "give scheme, host and, unless it is the usual one, port, such as \
             https://dashboard.example, with nothing behind them"
                .to_owned(),
        )),
    }
}

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

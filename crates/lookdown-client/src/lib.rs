//! The parts that the companions of a Lookdown server share: settings files, the server and its key,
//! HTTP requests with limits, an HTTP server with limits, backoff, and logging.

mod abort_on_drop;
mod backoff;
mod config;
mod http_client;
pub mod http_server;
mod in_process;
mod log_once;
mod reload;
mod server_entry;
pub mod text;

pub use abort_on_drop::AbortOnDrop;
pub use backoff::Backoff;
pub use config::{ConfigError, parse_toml, read_file, read_secret};
pub use http_client::{ClientError, ServerClient, client_builder, read_body, retry_after};
pub use in_process::InProcess;
pub use log_once::LogOnce;
pub use reload::Reload;
pub use server_entry::{ServerEntry, ServerOptions};

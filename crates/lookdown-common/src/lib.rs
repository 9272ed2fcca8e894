//! The parts that the companions of a Lookdown server share: settings files, the server and its key,
//! HTTP requests with limits, backoff, and logging.

mod abort_on_drop;
mod backoff;
mod config;
mod http_client;
mod log_once;
mod server_entry;
pub mod text;

pub use abort_on_drop::AbortOnDrop;
pub use backoff::Backoff;
pub use config::{ConfigError, parse_toml, read_file, read_secret};
pub use http_client::{ClientError, ServerClient, client_builder, read_body, retry_after};
pub use log_once::LogOnce;
pub use server_entry::{ServerEntry, ServerOptions};

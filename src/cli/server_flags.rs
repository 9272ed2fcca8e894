//! The flags of the companions for the server that they are clients of.

use std::path::PathBuf;

use clap::Args;
use lookdown_common::ServerEntry;

/// The server of a companion.
#[derive(Debug, Args)]
pub(super) struct ServerFlags {
    /// The URL of the server [default: port 8080 on this machine]
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    /// A file with the API key for the server
    #[arg(long, value_name = "FILE")]
    api_key_file: Option<PathBuf>,
    /// A PEM file with the authorities of the server's certificate [default: those of the system]
    #[arg(long, value_name = "FILE")]
    authorities: Option<PathBuf>,
}

impl ServerFlags {
    /// Returns the flags as an entry of a settings file.
    pub(super) fn entry(&self) -> ServerEntry {
        ServerEntry {
            url: self.server.clone(),
            api_key_file: self.api_key_file.clone(),
            authorities: self.authorities.clone(),
        }
    }
}

//! API keys, and the web pages that may call the server.

use std::{net::SocketAddr, num::NonZeroU64, path::PathBuf};

use url::{Origin, Url};

use super::{
    SettingsError,
    declare::settings,
    form::{Form, Refusal, flag, given_path, list, poll_seconds},
};
use crate::access::KeyList;

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

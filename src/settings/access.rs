//! API keys, and the web pages that may call the server.

use std::{num::NonZeroU64, path::PathBuf};

use url::{Origin, Url};

use super::{
    declare::settings,
    form::{Form, Refusal, given_path, list, poll_seconds},
};
use crate::access::{KeyError, KeyList};

settings! {
    /// API keys, and the web pages that may call the server.
    #[derive(Debug, Clone, PartialEq)]
    pub struct AccessSettings in "access" {
        /// The file of API keys, one line each as `lookdown key new` prints it
        /// (docs/deployment.md). With keys, every request except health checks, metrics and the API
        /// page needs one. Without keys, only clients on the same machine should reach the server.
        /// Leave it out for none: an empty value is refused.
        keys_file: Option<PathBuf> = None => given_path("/etc/lookdown/keys.toml");
        /// The interval in seconds at which that file is checked for changes. 0: never. An invalid
        /// new version leaves the old keys in use and shows in the log.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// Keys in addition to those of the file, each as `name:scope+scope:sha256`, with
        /// `:highest_priority` behind it where that is not 5.
        keys: KeyList = KeyList::default() => keys();
        /// Origins of web pages that may call the server from a browser, such as
        /// `https://dashboard.example`.
        cors_origins: Vec<String> = Vec::new() => origins();
    }
}

fn keys() -> Form<KeyList> {
    list(
        "API keys",
        |entries| {
            let keys = entries.join(",").parse();
            keys.map_err(|error: KeyError| Refusal::Hidden(error.to_string()))
        },
        // No key is a default.
        |_| Vec::new(),
    )
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

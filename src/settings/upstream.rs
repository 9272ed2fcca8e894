//! The server of `lookdown watch` and `lookdown count` on another machine.

use std::path::PathBuf;

use lookdown_common::ServerEntry;

use super::{
    declare::settings,
    form::{optional, path, text},
};

settings! {
    /// The server that `lookdown watch` and `lookdown count` are clients of.
    #[derive(Debug, Clone)]
    pub(super) struct UpstreamKeys in "upstream" {
        /// The URL of the server that `lookdown watch` and `lookdown count` use. `lookdown run`
        /// uses its own server instead.
        url: String = "http://127.0.0.1:8080".to_owned()
            => text("a URL such as http://127.0.0.1:8080", |url| !url.is_empty());
        /// The file with the API key for that server. The first line is the key. `watch` needs the
        /// scope `detect`, `count` the scope `read`. Empty: none.
        api_key_file: Option<PathBuf> = None => optional(path());
        /// The PEM file of the certificate authorities of that server. Empty: those that the system
        /// trusts.
        authorities: Option<PathBuf> = None => optional(path());
    }
}

impl UpstreamKeys {
    /// The server, not checked yet.
    pub(super) fn entry(self) -> ServerEntry {
        ServerEntry {
            url: Some(self.url),
            api_key_file: self.api_key_file,
            authorities: self.authorities,
        }
    }
}

//! The counts: those of `lookdown run` and `lookdown count`, and the `count` that a server forwards
//! to.
//!
//! The server of `lookdown watch` and `lookdown count` on another machine.

use std::{net::SocketAddr, path::PathBuf, time::Duration};

use lookdown_common::ServerEntry;
use lookdown_count::CountEntry;
use url::Url;

use super::{
    declare::settings,
    form::{address, duration, flag, optional, path, text, web_address, whole},
};

settings! {
    /// The counts.
    #[derive(Debug, Clone, PartialEq)]
    pub struct CountSettings in "counts" {
        /// The file in which `lookdown run` and `lookdown count` store the counts (docs/count.md).
        path: PathBuf = "counts.sqlite".into() => path();
        /// The days after which counts are removed. Totals stay.
        retention_days: u32 = 90 => whole(1..=3660);
        /// The longest interval between two transactions of the store. Crossings and entries are
        /// stored at once.
        commit_every: Duration = Duration::from_secs(2)
            => duration(Duration::from_millis(100)..=Duration::from_mins(1));
        /// The longest known time between two reports of a camera. Counts of a longer gap are
        /// unknown.
        longest_gap: Duration = Duration::from_secs(10)
            => duration(Duration::from_secs(1)..=Duration::from_mins(10));
        /// The most cameras that are counted, beside those that this process reads. A silent camera
        /// without a calibration makes room for a new one.
        max_cameras: usize = 64 => whole(1..=1024);
        /// The address of `lookdown count`. `lookdown run` serves the counts on `server.listen`.
        listen: SocketAddr = SocketAddr::from(([127, 0, 0, 1], 8090)) => address();
        /// The address of a `lookdown count` to which `lookdown serve` forwards requests to
        /// `/counts`, `/sites` and `/cameras/{camera}/furniture`, such as `http://10.0.0.3:8090`,
        /// and whose numbers of persons it shows. A caller needs the scope `read` of this server.
        /// Empty: none.
        url: Option<Url> = None => optional(web_address());
        /// The file with the key of `lookdown count`, at least 16 characters on the first line:
        /// `count` requires it of its clients, and `serve` sends it to `counts.url`. Empty: none.
        api_key_file: Option<PathBuf> = None => optional(path());
        /// Lets every client of a `counts.listen` that other machines reach read the counts without
        /// a key.
        open: bool = false => flag();
        /// Reports people who lie on the floor, outside of zones where that is expected
        /// (docs/count.md#people-on-the-floor).
        floor_alert: bool = false => flag();
        /// The time on the floor after which there is an alert.
        floor_alert_after: Duration = Duration::from_secs(20)
            => duration(Duration::from_secs(1)..=Duration::from_hours(1));
    }
}

impl CountSettings {
    /// The settings of the counts, not checked yet.
    pub fn entry(&self) -> CountEntry {
        CountEntry {
            listen: Some(self.listen),
            api_key_file: self.api_key_file.clone(),
            open: self.open,
            store: self.path.clone(),
            retention: Duration::from_hours(24) * self.retention_days,
            commit_every: self.commit_every,
            longest_gap: self.longest_gap,
            max_cameras: self.max_cameras,
            floor_alert_after: self.floor_alert.then_some(self.floor_alert_after),
            ..CountEntry::default()
        }
    }
}

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

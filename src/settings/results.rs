//! The result store: the memory of this process, or a Redis that several servers share.
//!
//! The MQTT broker; enabled by its URL.
//!
//! The counts: those of `lookdown run` and `lookdown count`, and the `count` that a server forwards
//! to.
//!
//! The server of `lookdown watch` and `lookdown count` on another machine.

use std::{
    collections::BTreeSet, net::SocketAddr, num::NonZeroUsize, ops::RangeInclusive, path::PathBuf,
    time::Duration,
};

use lookdown_common::{Secret, ServerEntry, read_secret, report::MAX_REPORT_BYTES};
use lookdown_count::CountEntry;
use lookdown_imaging::annotate::Concealment;
use secrecy::{ExposeSecret, SecretString};
use url::Url;

use super::{
    SettingsError,
    declare::settings,
    form::{
        Form, MAX_BYTES, address, choice, count, duration, flag, list, optional, path, seconds,
        secret, text, web_address, whole, zero_is_none,
    },
};
use crate::{
    mqtt::{Broker, BrokerError, Discovery, MqttOptions},
    results::{ImagesOf, RedisAddress, RedisAddressError, RedisOptions, ResultLimits},
};

/// Enough for any single report.
const MIN_BYTES: u64 = MAX_REPORT_BYTES;
/// From a minute to a year.
const AGES: RangeInclusive<u64> = 60..=366 * 86_400;

/// The result store.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultSettings {
    /// The Redis that servers share; `None` for the memory of this process.
    pub redis: Option<RedisOptions>,
    /// The cameras whose latest image is kept as well.
    pub images_of: ImagesOf,
    /// The concealment of persons in these images.
    pub conceal_images: Option<Concealment>,
    /// True if the persons of each camera are a metric.
    pub camera_metrics: bool,
    /// The limits of the store.
    pub limits: ResultLimits,
}

settings! {
    /// The result store as it is written, beside its limits.
    #[derive(Debug, Clone)]
    pub(super) struct ResultKeys in "results" {
        /// The Redis in which several servers keep their reports (docs/results-api.md), as
        /// `redis://user:password@host:6379/0`, or `rediss://` for TLS. Empty: reports are kept in
        /// memory. A URL with a password is better kept in the variable than in a file.
        url: Option<SecretString> = None => secret("URL of a Redis");
        /// The prefix of all keys in that Redis. Servers with the same prefix share their reports.
        key_prefix: String = "lookdown".to_owned() => key_prefix();
        /// The cameras whose latest image is kept for `/results/{camera}/latest.jpg`, by name;
        /// `"*"` is all. Images show persons. Each takes 4 MiB at most.
        images: ImagesOf = ImagesOf::default() => images();
        /// The concealment of the persons of the report in these images before they are stored:
        /// `none`, `blur` or `silhouette`.
        conceal_images: Option<Concealment> = None => choice(&[
            ("none", None),
            ("blur", Some(Concealment::Blur)),
            ("silhouette", Some(Concealment::Silhouette)),
        ]);
        /// `true` if `/metrics` shows the number of persons of each camera and the time of its
        /// latest report, with its name as a label: 1000 cameras at most. `lookdown run` always
        /// does.
        camera_metrics: bool = false => flag();
    }
}

settings! {
    in "results" fill ResultLimits {
        /// The most cameras whose reports are kept. The one without reports for longest goes first.
        max_cameras => count();
        /// The most reports of one camera, its latest included.
        history_per_camera => count();
        /// The most reports of all cameras. The oldest that is not its camera's latest goes first.
        max_reports => count();
        /// The most bytes of all reports. The oldest that is not its camera's latest goes first.
        max_bytes => whole(MIN_BYTES..=MAX_BYTES);
        /// The longest time that a report and its image are stored. With a Redis, all its servers
        /// need the same value.
        max_age as "max_age_seconds" => seconds(AGES);
        /// The most cameras whose latest image is kept. The one without reports for longest goes
        /// first.
        max_images => count();
        /// The most event streams and requests that wait for a newer report. Further ones are
        /// answered with 429. One of several clients may have half of them.
        max_listeners => count();
    }
}

impl ResultKeys {
    /// The store, within `limits`.
    pub(super) fn checked(self, limits: ResultLimits) -> Result<ResultSettings, SettingsError> {
        let address = self
            .url
            .map(|url| url.expose_secret().parse::<RedisAddress>());
        let address = address.transpose().map_err(|error: RedisAddressError| {
            SettingsError::value("results.url", "not a URL of a Redis", error.to_string())
        })?;
        Ok(ResultSettings {
            redis: address.map(|address| RedisOptions {
                address,
                key_prefix: self.key_prefix,
            }),
            images_of: self.images,
            conceal_images: self.conceal_images,
            camera_metrics: self.camera_metrics,
            limits,
        })
    }
}

fn key_prefix() -> Form<String> {
    text("1 to 64 of a-z, A-Z, 0-9, '_', '.' and '-'", |prefix| {
        let is_word = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
        (1..=64).contains(&prefix.len()) && prefix.chars().all(is_word)
    })
}

/// `*` is every camera.
fn images() -> Form<ImagesOf> {
    list(
        "names of cameras",
        |cameras| {
            Ok(if cameras.contains(&"*") {
                ImagesOf::All
            } else {
                ImagesOf::Some(cameras.iter().map(|&camera| camera.to_owned()).collect())
            })
        },
        |images| match images {
            ImagesOf::All => vec!["*".to_owned()],
            ImagesOf::Some(cameras) => BTreeSet::clone(cameras).into_iter().collect(),
        },
    )
}

/// Most bytes of a prefix: a topic has 65,535.
const MAX_PREFIX_BYTES: usize = 256;
/// A week, seconds.
const MAX_EXPIRY: u64 = 7 * 86_400;

settings! {
    /// The MQTT broker as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct MqttKeys in "mqtt" {
        /// The broker that counts and reports are published to (docs/home-automation.md), such as
        /// `mqtt://user@192.168.1.10:1883`, or `mqtts://` for TLS. Empty: none. It may hold the
        /// password, percent-encoded: `mqtt://user:password@…`.
        url: Option<SecretString> = None => secret("URL of a broker");
        /// The password of the user in that URL, as it is. Empty: the password of the URL. It is
        /// better kept in the variable than in a file that others can read.
        password: Option<SecretString> = None => secret("password");
        /// The file with that password on its first line, instead of `mqtt.password`. Empty: none.
        password_file: Option<PathBuf> = None => optional(path());
        /// The PEM file of the certificate authorities of a broker with TLS. Empty: those that the
        /// system trusts.
        authorities: Option<PathBuf> = None => optional(path());
        /// The prefix of all topics.
        topic_prefix: String = "lookdown".to_owned() => topic();
        /// The prefix of the topics on which Home Assistant discovers entities. Empty: nothing is
        /// announced.
        discovery_prefix: Option<String> = Some("homeassistant".to_owned()) => optional(topic());
        /// The most cameras that are published, beside those that this process reads. Each is a
        /// device in Home Assistant.
        max_cameras: NonZeroUsize = NonZeroUsize::new(100).unwrap_or(NonZeroUsize::MIN) => count();
        /// The time without a person after which occupancy is off: single frames that miss a person
        /// change nothing. 0: each frame counts.
        hold as "hold_seconds": Duration = Duration::from_secs(5) => seconds(0..=3600);
        /// The shortest time between two images of a camera or of one of its views that are
        /// published, for cameras in `results.images`. Images show persons, unless
        /// `results.conceal_images` conceals them. 0: no images.
        image_every as "image_every_seconds": Option<Duration> = None
            => zero_is_none(seconds(0..=86_400));
        /// The time without a report after which a camera is unavailable. It must be longer than
        /// the interval of its frames. Retained topics of removed cameras are withdrawn as long
        /// after a connection. 0: cameras stay available.
        expire_after as "expire_after_seconds": Option<Duration> = Some(Duration::from_mins(10))
            => zero_is_none(seconds(0..=MAX_EXPIRY));
        /// The address of the server's web page, which Home Assistant shows with each camera.
        /// Empty: none.
        configuration_url: Option<Url> = None => optional(web_address());
        /// The address at which users of this installation get help, which Home Assistant shows
        /// with its logs. Empty: none.
        support_url: Option<Url> = None => optional(web_address());
    }
}

impl MqttKeys {
    /// The options of the publisher; `None` where there is no broker.
    pub(super) fn checked(self) -> Result<Option<MqttOptions>, SettingsError> {
        let broker = self.url.map(|url| url.expose_secret().parse::<Broker>());
        let mut broker = broker
            .transpose()
            .map_err(|error: BrokerError| SettingsError::hidden("mqtt.url", error))?;
        let in_file = self.password_file.as_deref();
        let in_file = in_file.map(|path| read_secret("mqtt.password_file", path));
        if let Some(password) = self.password.map(Secret::from).or(in_file.transpose()?) {
            let with_password = |broker: Broker| broker.with_password(password.expose_secret());
            broker = broker
                .map(with_password)
                .transpose()
                .map_err(|error| SettingsError::hidden("mqtt.password", error))?;
        }
        Ok(broker.map(|broker| MqttOptions {
            broker,
            authorities: self.authorities,
            topic_prefix: self.topic_prefix,
            discovery_prefix: self.discovery_prefix,
            max_cameras: self.max_cameras,
            hold: self.hold,
            image_every: self.image_every,
            discovery: Discovery {
                expire_after: self.expire_after,
                configuration_url: self.configuration_url,
                support_url: self.support_url,
                // `results.images` says which, where all settings are known.
                images: ImagesOf::default(),
            },
        }))
    }
}

/// The beginning of topics (MQTT 3.1.1, section 4.7): no wildcard, no empty level, and none of the
/// broker's own topics.
fn topic() -> Form<String> {
    let remedy = "a topic such as lookdown or home/lookdown, without + and #";
    text(remedy, |topic| {
        let is_level = |level: &str| {
            let mut characters = level.chars();
            !level.is_empty() && !characters.any(|c| c.is_control() || c == '+' || c == '#')
        };
        let fits = topic.len() <= MAX_PREFIX_BYTES && !topic.starts_with('$');
        fits && topic.split('/').all(is_level)
    })
}

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

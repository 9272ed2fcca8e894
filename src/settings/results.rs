//! The result store: the memory of this process, or a Redis that several servers share.

use std::{collections::BTreeSet, ops::RangeInclusive};

use lookdown_common::report::MAX_REPORT_BYTES;
use lookdown_imaging::annotate::Concealment;
use secrecy::{ExposeSecret, SecretString};

use super::{
    SettingsError,
    declare::settings,
    form::{Form, MAX_BYTES, choice, count, flag, list, seconds, secret, text, whole},
};
use crate::results::{ImagesOf, RedisAddress, RedisAddressError, RedisOptions, ResultLimits};

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

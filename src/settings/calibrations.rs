//! The calibration store: a folder or a bucket, and the memory for what is computed from it.

use std::{fmt, num::NonZeroU64, path::PathBuf};

use lookdown_detect::pipeline::EngineOptions;
use lookdown_lens::self_calibration::IdealLens;
use url::Url;

use super::{
    declare::settings,
    form::{Form, MAX_BYTES, Refusal, flag, optional, parsed, poll_seconds, variant, whole},
    locate::DEFAULT_CALIBRATIONS,
};

settings! {
    /// The calibration store.
    #[derive(Debug, Clone, PartialEq)]
    pub struct CalibrationSettings in "calibrations" {
        /// The folder of calibration files (docs/calibrate.md). The default folder may be missing,
        /// any other must exist; `lookdown run` creates one with an absolute path in an existing
        /// folder. Or the URL of a bucket: `s3://bucket/prefix`, `gs://bucket/prefix`
        /// or `az://container/prefix`; its credentials come from the provider's variables, such as
        /// `AWS_ACCESS_KEY_ID`.
        path: CalibrationPlace = CalibrationPlace::Folder(DEFAULT_CALIBRATIONS.into()) => place();
        /// The interval in seconds at which the store is checked for changes. 0: never. Each check
        /// of a bucket is one request or more, for which providers charge. An invalid new version
        /// leaves the old one in use and shows in `/readyz`, in the metrics and in the log.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// `true` if calibrations can be changed over HTTP by clients with the scope `admin`;
        /// `false` for replicas that only read.
        writable: bool = true => flag();
        /// The projection of the lenses of cameras without a calibration, from their data sheet.
        /// The server can find the calibration of a camera that looks straight down only with it.
        lens: Option<IdealLens> = None => optional(variant());
        /// `true` if a calibration that the server finds in five frames of a named camera is stored
        /// under the name of the camera, if it has none. `false`: it is only offered
        /// (docs/calibrate.md).
        apply_suggested: bool = false => flag();
        /// `true` if `/metrics` shows the number of persons in each zone, with the names of its
        /// camera and of the zone as labels: 1000 zones at most.
        zone_metrics: bool = false => flag();
        /// The most memory for the remap tables of cameras, in bytes. The least recently used go
        /// first.
        cache_bytes: usize = EngineOptions::RIG_CACHE_BYTES => whole(0..=MAX_BYTES);
    }
}

/// The location of the calibrations.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationPlace {
    /// A folder. The default folder may be missing.
    Folder(PathBuf),
    /// A bucket of an object store, or a prefix in one, by its URL, which holds no secrets.
    Bucket(Url),
}

fn place() -> Form<CalibrationPlace> {
    parsed(
        "path or URL of a bucket",
        parse,
        CalibrationPlace::to_string,
    )
}

fn parse(text: &str) -> Result<CalibrationPlace, Refusal> {
    if text.is_empty() {
        let remedy = "give a path, or leave the key out";
        return Err(Refusal::Shown(remedy.to_owned()));
    }
    if !text.contains("://") {
        return Ok(CalibrationPlace::Folder(text.into()));
    }
    // A URL that may hold a secret is not repeated.
    let refused = |value: &str, remedy: &str| Refusal::Part(value.to_owned(), remedy.to_owned());
    let url = Url::parse(text).map_err(|error| {
        let remedy = format!("{error}: give one such as s3://bucket/calibrations");
        refused("a URL that cannot be read", &remedy)
    })?;
    // The user name of abfs://container@account.dfs.core.windows.net is the container.
    let has_user = !url.username().is_empty() && !url.scheme().starts_with("abfs");
    if has_user || url.password().is_some() || url.query().is_some() || url.fragment().is_some() {
        return Err(refused(
            "a URL with more than a host and a path",
            "leave out the parts after ? or # and before @, and give credentials in the environment, \
             such as AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY",
        ));
    }
    if url.scheme() == "file" {
        let path = url.to_file_path().map_err(|()| {
            let remedy = "give a path on this machine, as in file:///srv/calibrations";
            refused(text, remedy)
        })?;
        return Ok(CalibrationPlace::Folder(path));
    }
    Ok(CalibrationPlace::Bucket(url))
}

impl fmt::Display for CalibrationPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(path) => path.display().fmt(formatter),
            Self::Bucket(url) => url.fmt(formatter),
        }
    }
}

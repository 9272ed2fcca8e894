//! Where calibrations are kept: from a path or a URL as it is written to a folder or a bucket.

use std::{fmt, path::PathBuf, str::FromStr};

use url::Url;

use super::SettingsError;

/// Where calibrations are kept.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationPlace {
    /// A folder. At its default place it may be missing.
    Folder(PathBuf),
    /// A bucket of an object store, or a level of one, by its URL, which holds no secrets.
    Bucket(Url),
}

impl FromStr for CalibrationPlace {
    type Err = SettingsError;

    fn from_str(text: &str) -> Result<Self, SettingsError> {
        let refused = |value: &str, remedy: &str| SettingsError::Value {
            key: "calibrations.path".to_owned(),
            value: value.to_owned(),
            remedy: remedy.to_owned(),
        };
        if text.is_empty() {
            return Err(refused("empty", "give a path, or leave the key out"));
        }
        if !text.contains("://") {
            return Ok(Self::Folder(text.into()));
        }
        // What may hold secrets is not repeated.
        let url = Url::parse(text).map_err(|error| {
            let remedy = format!("{error}: give one such as s3://bucket/calibrations");
            refused("a URL that cannot be read", &remedy)
        })?;
        // abfs://container@account.dfs.core.windows.net has a name there.
        let has_user = !url.username().is_empty() && !url.scheme().starts_with("abfs");
        if has_user || url.password().is_some() || url.query().is_some() || url.fragment().is_some()
        {
            return Err(refused(
                "a URL with more than a host and a path",
                "leave out what follows ? or # and comes before @, and give credentials in the \
                 environment, such as AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY",
            ));
        }
        if url.scheme() == "file" {
            let path = url.to_file_path().map_err(|()| {
                refused(
                    text,
                    "give a path on this machine, as in file:///srv/calibrations",
                )
            })?;
            return Ok(Self::Folder(path));
        }
        Ok(Self::Bucket(url))
    }
}

impl fmt::Display for CalibrationPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(path) => path.display().fmt(formatter),
            Self::Bucket(url) => url.fmt(formatter),
        }
    }
}

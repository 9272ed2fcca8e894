//! The place of a camera's frames: a URL, a folder, a video file or standard input.

use std::{fmt, path::PathBuf};

use percent_encoding::percent_decode_str;
use reqwest::Url;

use crate::Credentials;

/// The source of frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// A snapshot or a stream of JPEG files over HTTP, without credentials in the URL.
    Http(Url),
    /// A stream over RTSP, without credentials in the URL.
    Rtsp(Url),
    /// A folder into which image files are dropped.
    Folder(PathBuf),
    /// A video file.
    Video(PathBuf),
    /// Standard input.
    StandardInput,
}

const INVALID_URL: &str = "it is not a valid URL: give it as scheme://host/path, with special \
                           characters percent-encoded";

impl Location {
    /// Parses a location, and separates the credentials of a URL.
    ///
    /// # Errors
    /// The reason why the text is not a location. It does not repeat the text, which may hold a
    /// password.
    pub fn parse(text: &str) -> Result<(Self, Option<Credentials>), &'static str> {
        if text == "-" {
            return Ok((Self::StandardInput, None));
        }
        if text.contains("://") {
            let url = Url::parse(text).map_err(|_| INVALID_URL)?;
            return Self::from_url(url);
        }
        let path = PathBuf::from(text);
        if path.is_dir() {
            Ok((Self::Folder(path), None))
        } else if path.is_file() {
            Ok((Self::Video(path), None))
        } else if path.exists() {
            Err("it is not a regular file or a folder: give a file, a folder, or - for a pipe")
        } else {
            Err(
                "there is no such file or folder: give a URL with its scheme, an existing path, or - \
                 for standard input",
            )
        }
    }

    fn from_url(mut url: Url) -> Result<(Self, Option<Credentials>), &'static str> {
        let decoded = |text: &str| percent_decode_str(text).decode_utf8_lossy().into_owned();
        let credentials = match (url.username(), url.password()) {
            ("", None) => None,
            (user, password) => Some(Credentials {
                user: decoded(user),
                password: decoded(password.unwrap_or_default()).into(),
            }),
        };
        if url.host().is_none() {
            return Err(INVALID_URL);
        }
        // A URL with a host can have or lose both.
        let _ = (url.set_username(""), url.set_password(None));
        let location = match url.scheme() {
            "http" | "https" => Self::Http(url),
            "rtsp" | "rtsps" => Self::Rtsp(url),
            _ => {
                return Err(
                    "its scheme is unknown: use http, https, rtsp or rtsps, a folder, a video file, or \
                     - for standard input",
                );
            }
        };
        Ok((location, credentials))
    }

    /// Returns true if the frames end, so that the source is not started again after its end.
    pub fn is_finite(&self) -> bool {
        matches!(self, Self::Video(_) | Self::StandardInput)
    }
}

/// Displays the location without credentials: without the query, which may hold a token, and up to
/// the first value in the path, where some cameras have their password.
impl fmt::Display for Location {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Http(url) | Self::Rtsp(url) => {
                let mut shown = url.clone();
                shown.set_query(None);
                shown.set_fragment(None);
                match shown.as_str().split_once('=') {
                    Some((before, _)) => write!(formatter, "{before}=…"),
                    None => shown.fmt(formatter),
                }
            }
            Self::Folder(path) | Self::Video(path) => path.display().fmt(formatter),
            Self::StandardInput => formatter.write_str("standard input"),
        }
    }
}

#[cfg(test)]
mod tests {
    use secrecy::ExposeSecret;

    use super::*;

    #[test]
    fn credentials_are_separated_from_the_url() {
        let (location, credentials) =
            Location::parse("rtsp://viewer:p%40ss%2F@10.0.0.8:554/s1?token=t").unwrap();
        let credentials = credentials.unwrap();
        assert_eq!(credentials.user, "viewer");
        assert_eq!(credentials.password.expose_secret(), "p@ss/");
        assert_eq!(location.to_string(), "rtsp://10.0.0.8:554/s1");
        assert!(!format!("{location:?} {credentials:?}").contains("p@ss"));
        let of_path = "rtsp://10.0.0.8/user=admin&password=geheim&channel=1.sdp?real_stream#x";
        let (location, _) = Location::parse(of_path).unwrap();
        assert_eq!(location.to_string(), "rtsp://10.0.0.8/user=…");
    }

    #[test]
    fn kinds_are_recognized() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("clip.mp4");
        std::fs::write(&file, "").unwrap();
        let parse = |text: &str| Location::parse(text).map(|(location, _)| location);
        assert_eq!(parse("-"), Ok(Location::StandardInput));
        assert!(matches!(
            parse("http://camera/snap.jpg"),
            Ok(Location::Http(_))
        ));
        assert!(matches!(parse("rtsps://camera/s"), Ok(Location::Rtsp(_))));
        let folder = folder.path().to_str().unwrap();
        assert!(matches!(parse(folder), Ok(Location::Folder(_))));
        assert!(matches!(
            parse(file.to_str().unwrap()),
            Ok(Location::Video(_))
        ));
        for (text, problem) in [
            ("/dev/null", "it is not a regular file"),
            ("/nowhere", "there is no such file or folder"),
            ("ftp://camera/x", "its scheme is unknown"),
            ("rtsp://", "it is not a valid URL"),
        ] {
            assert!(parse(text).unwrap_err().starts_with(problem), "{text}");
        }
    }
}

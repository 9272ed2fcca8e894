//! The reasons why a source of frames ends.

use std::time::Duration;

use crate::FrameError;

/// The reason why a source ended. Its text holds no credentials.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// Wrong credentials.
    #[error("the camera refuses the user name {user:?} or its password: correct them")]
    CredentialsRefused {
        /// The user name.
        user: String,
    },
    /// Credentials are missing.
    #[error("the camera requires a user name and a password: set user and password_file")]
    CredentialsMissing,
    /// The camera requires an unknown authentication scheme.
    #[error(
        "the camera requires an authentication other than Basic, and Digest with qop=auth: select one of them in the camera"
    )]
    UnknownAuthentication,
    /// A challenge for the password in plain text, after one for its digest.
    #[error(
        "the camera asks for the password in plain text (Basic), although it asked for its digest before: check that it is the camera, and restart this program"
    )]
    BasicAfterDigest,
    /// The camera serves too many clients.
    #[error("the camera is busy (status {0}): reduce the number of its clients, or raise every")]
    Busy(u16),
    /// Another status than 200, and the camera's words.
    #[error(
        "the camera answered with the status {0:?}: check the path of the URL in the camera's manual, the rights of its user, and the camera"
    )]
    Status(String),
    /// A redirection.
    #[error("the camera redirects to another URL: give that URL, which `curl -i` shows")]
    Redirect,
    /// Neither an image nor a stream of images.
    #[error(
        "the camera sends {0:?} instead of an image: give the URL of a JPEG snapshot, an MJPEG stream or RTSP"
    )]
    ContentType(String),
    /// A frame that cannot be used.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A damaged stream.
    #[error("{0}")]
    Stream(String),
    /// A frame beyond the limit.
    #[error("the camera's image has more than 32 MiB: reduce its resolution or quality")]
    TooLarge,
    /// The frames of all cameras exceed their budget.
    #[error(
        "the frames of all cameras together take more than 512 MiB: reduce their resolution or quality"
    )]
    Memory,
    /// The decoders of all cameras exceed their budget.
    #[error(
        "the decoders of all cameras take more than half of the memory, and that of this camera the most: reduce its resolution"
    )]
    DecoderMemory,
    /// A decoder exceeds its share of CPU time.
    #[error("the decoder of the camera uses {0:.1} cores: reduce its resolution or frame rate")]
    DecoderTime(f64),
    /// A file that names other files, or of an unknown format.
    #[error(
        "the file is not a video: playlists and unknown formats are not read: give an MP4, MKV, AVI or TS file"
    )]
    NotAVideo,
    /// No frame within the limit.
    #[error("no whole frame arrived within {0:?}: check the camera, or raise stall_after")]
    Stalled(Duration),
    /// The stream ended.
    #[error("the camera ended the stream: check it if this is logged again")]
    Closed,
    /// The connection ended with a challenge, and so did another one.
    #[error(
        "the camera closed the connection after asking for the password: check that its user may read this stream"
    )]
    ClosedAfterChallenge,
    /// The camera cannot be reached.
    #[error("the camera cannot be reached: {0}: check its address and the network")]
    Unreachable(String),
    /// `ffmpeg` cannot be started.
    #[error(
        "{program} cannot be started: {problem}: install ffmpeg 5.1 or newer, or set its path with the key ffmpeg"
    )]
    NoFfmpeg {
        /// The program.
        program: String,
        /// The cause.
        problem: String,
    },
    /// `ffmpeg` failed, with its last line.
    #[error("ffmpeg ended: {0}: check the URL and the codec with ffprobe")]
    Ffmpeg(String),
    /// A file or a folder cannot be read.
    #[error("{0} cannot be read: {1}: check the path and its permissions")]
    Unreadable(String, String),
}

impl SourceError {
    /// Returns true if the camera refuses the credentials.
    pub(crate) fn is_refused_login(&self) -> bool {
        matches!(
            self,
            Self::CredentialsRefused { .. }
                | Self::CredentialsMissing
                | Self::UnknownAuthentication
                | Self::BasicAfterDigest
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_error_ends_with_a_remedy() {
        let text = || "a.b".to_owned();
        let errors = [
            SourceError::CredentialsRefused { user: text() },
            SourceError::CredentialsMissing,
            SourceError::UnknownAuthentication,
            SourceError::BasicAfterDigest,
            SourceError::Busy(503),
            SourceError::Status(text()),
            SourceError::Redirect,
            SourceError::ContentType(text()),
            SourceError::TooLarge,
            SourceError::Memory,
            SourceError::DecoderMemory,
            SourceError::DecoderTime(1.5),
            SourceError::NotAVideo,
            SourceError::Stalled(Duration::from_secs(1)),
            SourceError::Closed,
            SourceError::ClosedAfterChallenge,
            SourceError::Unreachable(text()),
            SourceError::NoFfmpeg {
                program: text(),
                problem: text(),
            },
            SourceError::Ffmpeg(text()),
            SourceError::Unreadable(text(), text()),
        ];
        let verbs = [
            "check", "correct", "give", "install", "reduce", "select", "set",
        ];
        for error in errors {
            let message = error.to_string();
            let (_, remedy) = message.rsplit_once(": ").unwrap();
            let verb = remedy.split(' ').next().unwrap();
            assert!(verbs.contains(&verb), "{message}");
        }
    }
}

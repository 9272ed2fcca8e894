//! The requests of `ffmpeg` in flight, and the changes to messages on their way.

use std::{
    collections::VecDeque,
    net::IpAddr,
    time::{Duration, Instant},
};

use bytes::BytesMut;

use super::message::Message;
use crate::{SourceError, credentials::Login};

/// Most requests of `ffmpeg` without a response.
const MAX_PENDING: usize = 16;
/// Requests for one response: the second one answers the challenge of the first.
const ATTEMPTS: u32 = 2;
/// Most messages within [`UNASKED_PERIOD`] that answer no request. Cameras send one or two a
/// minute.
const MAX_UNASKED: u32 = 100;
/// The period in which such messages are counted.
const UNASKED_PERIOD: Duration = Duration::from_secs(10);
/// The redirection to another server, as a request of the camera (RFC 2326, section 10.10).
const REDIRECT: &str = "REDIRECT";

/// The state of a connection.
pub(super) struct Exchange<'a> {
    /// The URL of the relay, which `ffmpeg` has.
    pub(super) inner: String,
    /// The URL of the camera without credentials.
    pub(super) outer: String,
    /// The address of the camera.
    pub(super) peer: IpAddr,
    pub(super) login: &'a mut Login,
    pending: VecDeque<Pending>,
    next_sequence: u32,
    /// The messages that answer no request, and the start of their period.
    unasked: (u32, Instant),
}

/// A request without a response.
struct Pending {
    message: Message,
    /// The number that `ffmpeg` gave it.
    sequence: Option<u32>,
    attempts: u32,
}

impl<'a> Exchange<'a> {
    pub(super) fn new(inner: String, outer: String, peer: IpAddr, login: &'a mut Login) -> Self {
        Self {
            inner,
            outer,
            peer,
            login,
            pending: VecDeque::new(),
            next_sequence: 1,
            unasked: (0, Instant::now()),
        }
    }

    /// Appends a request of `ffmpeg` to the bytes for the camera.
    pub(super) fn accept_request(
        &mut self,
        mut message: Message,
        to_camera: &mut BytesMut,
    ) -> Result<(), SourceError> {
        let Some((method, address)) = message.request() else {
            // No request of the camera reaches `ffmpeg`, so it sends no response.
            return Ok(());
        };
        let address = match address.strip_prefix(&self.inner) {
            Some(rest) => format!("{}{rest}", self.outer),
            None => address.to_owned(),
        };
        message.start = format!("{method} {address} RTSP/1.0");
        let sequence = message.sequence();
        if self.pending.len() >= MAX_PENDING {
            return Err(SourceError::Closed);
        }
        let pending = Pending {
            message,
            sequence,
            attempts: 0,
        };
        self.send(pending, to_camera);
        Ok(())
    }

    fn send(&mut self, mut request: Pending, to_camera: &mut BytesMut) {
        request.attempts += 1;
        request
            .message
            .set("CSeq", Some(self.next_sequence.to_string()));
        self.next_sequence += 1;
        if let Some((method, address)) = request.message.request() {
            let authorization = self.login.respond(method, address);
            request.message.set("Authorization", authorization);
        }
        request.message.write(to_camera);
        self.pending.push_back(request);
    }

    /// Returns true if a request with the answer to a challenge has no response.
    pub(super) fn awaits_login(&self) -> bool {
        self.pending.iter().any(|request| request.attempts > 1)
    }

    /// Appends the requests without a response to the bytes for another connection.
    pub(super) fn send_again(&mut self, to_camera: &mut BytesMut) {
        for request in std::mem::take(&mut self.pending) {
            self.send(request, to_camera);
        }
    }

    /// Appends a message of the camera to the bytes for `ffmpeg`, or an answer to those for the
    /// camera.
    pub(super) fn accept_answer(
        &mut self,
        mut message: Message,
        to_ffmpeg: &mut BytesMut,
        to_camera: &mut BytesMut,
    ) -> Result<(), SourceError> {
        if let Some((method, _)) = message.request() {
            if method == REDIRECT {
                return Err(SourceError::Redirect);
            }
            self.count_unasked()?;
            let sequence = message.sequence().unwrap_or_default();
            let answer = format!("RTSP/1.0 200 OK\r\nCSeq: {sequence}\r\n\r\n");
            to_camera.extend_from_slice(answer.as_bytes());
            return Ok(());
        }
        let sequence = message.sequence();
        let is_answered = |pending: &Pending| pending.message.sequence() == sequence;
        let Some(found) = self.pending.iter().position(is_answered) else {
            return self.count_unasked();
        };
        let Some(request) = self.pending.remove(found) else {
            return Ok(());
        };
        match message.status() {
            Some(300..=399) => return Err(SourceError::Redirect),
            Some(401) => {
                self.login.check_challenge(&message, request.attempts)?;
                self.send(request, to_camera);
                return Ok(());
            }
            _ => {}
        }
        if let Some(transport) = message.header("transport") {
            let transport = with_source(transport, self.peer);
            message.set("Transport", Some(transport));
        }
        message.set(
            "CSeq",
            request.sequence.map(|sequence| sequence.to_string()),
        );
        message.write(to_ffmpeg);
        Ok(())
    }

    /// Counts a message that answers no request: one after another would keep a core busy.
    fn count_unasked(&mut self) -> Result<(), SourceError> {
        let (count, since) = &mut self.unasked;
        if since.elapsed() >= UNASKED_PERIOD {
            (*count, *since) = (0, Instant::now());
        }
        *count += 1;
        if *count > MAX_UNASKED {
            return Err(SourceError::Stream(format!(
                "the camera sent more than {MAX_UNASKED} RTSP messages within {UNASKED_PERIOD:?} that \
                 answer no request: check that it is a camera"
            )));
        }
        Ok(())
    }
}

impl Login {
    /// Takes the challenge of a response. Returns an error if no request can answer it.
    fn check_challenge(&mut self, message: &Message, attempts: u32) -> Result<(), SourceError> {
        let Some(user) = self.user() else {
            return Err(SourceError::CredentialsMissing);
        };
        if attempts >= ATTEMPTS {
            let user = user.to_owned();
            return Err(SourceError::CredentialsRefused { user });
        }
        let challenges = message.headers.iter();
        let challenges =
            challenges.filter(|(name, _)| name.eq_ignore_ascii_case("WWW-Authenticate"));
        self.accept_challenges(challenges.map(|(_, value)| &**value))
    }
}

/// Returns the parameters of a transport with the camera as the source of the media, so that
/// `ffmpeg` sends nothing to other hosts.
fn with_source(transport: &str, peer: IpAddr) -> String {
    let is_place = |part: &&str| {
        let part = part.trim();
        part.starts_with("source=") || part.starts_with("destination=")
    };
    let parts = transport.split(';').filter(|part| !is_place(part));
    let parts: Vec<_> = parts.collect();
    format!("{};source={peer}", parts.join(";"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_of_the_media_is_the_camera() {
        let given = "RTP/AVP;unicast;client_port=4-5;source=10.9.9.9;server_port=6-7";
        let expected = "RTP/AVP;unicast;client_port=4-5;server_port=6-7;source=192.0.2.1";
        assert_eq!(with_source(given, "192.0.2.1".parse().unwrap()), expected);
    }
}

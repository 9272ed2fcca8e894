//! The messages on the channels: new reports, as `record.lua` publishes them.

use bytes::Bytes;
use lookdown_common::text::is_camera_name;

use crate::results::{NewReport, StoredReport};

/// Parses a message: the ID, the time of arrival, the number of persons, the JSON and the camera,
/// in lines of their own. Returns `None` for the message of another program.
pub(super) fn parse(message: Vec<u8>) -> Option<StoredReport> {
    let message = Bytes::from(message);
    let mut parts = message.splitn(5, |&byte| byte == b'\n');
    let id = text(parts.next()?)?.parse().ok()?;
    let received_at = text(parts.next()?)?.parse().ok()?;
    let persons = text(parts.next()?)?.parse().ok()?;
    let json = parts.next()?;
    let camera = text(parts.next()?)?.to_owned();
    let is_report = is_one_line(json) && is_camera_name(&camera);
    is_report.then(|| StoredReport {
        id,
        report: NewReport {
            camera,
            received_at,
            persons,
            scores: None,
            json: message.slice_ref(json),
        },
    })
}

/// Returns false for JSON with line ends: each line would be an event of its own in an event
/// stream.
pub(super) fn is_one_line(json: &[u8]) -> bool {
    !json.iter().any(|byte| matches!(byte, b'\r' | b'\n'))
}

fn text(part: &[u8]) -> Option<&str> {
    str::from_utf8(part).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_of_the_script_is_a_report() {
        let message = "7\n2026-11-22T09:30:00Z\n2\n{\"persons\":[]}\nhall of mirrors";
        let stored = parse(message.into()).unwrap();
        assert_eq!(stored.id.to_string(), "7");
        assert_eq!(stored.report.camera, "hall of mirrors");
        assert_eq!(stored.report.persons, 2);
        assert_eq!(&stored.report.json[..], b"{\"persons\":[]}");
    }

    #[test]
    fn messages_of_other_programs_are_ignored() {
        for message in [
            "",
            "7",
            "7\n2026-11-22T09:30:00Z\n2\n{}",
            "seven\n2026-11-22T09:30:00Z\n2\n{}\nhall",
            "7\nyesterday\n2\n{}\nhall",
            "7\n2026-11-22T09:30:00Z\n-2\n{}\nhall",
            "7\n2026-11-22T09:30:00Z\n2\n{}\r\nhall",
            "7\n2026-11-22T09:30:00Z\n2\n{}\nhall\nof mirrors",
            "7\n2026-11-22T09:30:00Z\n2\n{}\n\u{202e}llah",
        ] {
            assert!(parse(message.into()).is_none(), "{message:?}");
        }
        assert!(parse(b"7\n2026-11-22T09:30:00Z\n2\n{}\n\xff".to_vec()).is_none());
    }
}

//! Queries to Redis, and the parsing of its answers into reports. Entries that are not reports of
//! Lookdown are skipped.
//!
//! The messages on the channels: new reports, as `record.lua` publishes them.

use std::{num::NonZeroUsize, sync::Arc};

use bytes::Bytes;
use lookdown_common::text::is_camera_name;
use lookdown_lens::saturating::to_u64;
use redis::{
    FromRedisValue, Pipeline, RedisResult, Script, Value,
    aio::MultiplexedConnection,
    cmd, pipe,
    streams::{StreamId, StreamRangeReply},
};

use super::shared::Keys;
use crate::{
    annotated_image::StoredFrame,
    results::{Cameras, NewReport, ReportId, ResultUse, StoredImage, StoredReport},
};

/// The script that deletes a camera.
const DELETE: &str = concat!(include_str!("forget.lua"), include_str!("delete.lua"));

/// The place of a report: its camera, and its ID in the stream of the camera.
type Place = (ReportId, String);

/// A connection to Redis, and its keys.
pub(super) struct Reader<'a> {
    connection: MultiplexedConnection,
    keys: &'a Keys,
}

impl<'a> Reader<'a> {
    pub(super) fn new(connection: &MultiplexedConnection, keys: &'a Keys) -> Self {
        Self {
            connection: connection.clone(),
            keys,
        }
    }

    pub(super) async fn latest(&mut self, camera: &str) -> RedisResult<Option<Arc<StoredReport>>> {
        let mut last = cmd("XREVRANGE");
        last.arg(self.keys.camera(camera));
        last.arg("+").arg("-").arg("COUNT").arg(1);
        let found: StreamRangeReply = last.query_async(&mut self.connection).await?;
        Ok(reports(camera, found).pop())
    }

    /// The cameras with the latest reports, at most `most`: those that other programs added beyond
    /// the limit are not read, nor those with names that the server refuses.
    pub(super) async fn cameras(&mut self, most: NonZeroUsize) -> RedisResult<Vec<String>> {
        let mut last = cmd("ZRANGE");
        last.arg(self.keys.key("cameras"))
            .arg(format!("-{most}"))
            .arg(-1);
        // The bytes of another program may be no text.
        let cameras: Vec<Vec<u8>> = last.query_async(&mut self.connection).await?;
        let names = cameras
            .into_iter()
            .filter_map(|name| String::from_utf8(name).ok());
        Ok(names.filter(|name| is_camera_name(name)).collect())
    }

    /// Deletes all reports of a camera. Returns false if it had none.
    pub(super) async fn delete(&mut self, camera: &str) -> RedisResult<bool> {
        let script = Script::new(DELETE);
        let keys = self.keys;
        let mut call = script.prepare_invoke();
        call.key(&keys.index()[..]);
        call.arg(keys.prefix_of_cameras());
        call.arg(keys.prefix_of_images()).arg(camera);
        call.invoke_async(&mut self.connection).await
    }

    pub(super) async fn delete_image(&mut self, camera: &str) -> RedisResult<()> {
        let mut both = atomic();
        both.cmd("DEL").arg(self.keys.image(camera));
        both.cmd("ZREM").arg(self.keys.key("images")).arg(camera);
        both.ignore().query_async(&mut self.connection).await
    }

    pub(super) async fn latest_of_all(
        &mut self,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        let cameras = self.cameras(most).await?;
        let mut each = atomic();
        for camera in &cameras {
            let last = each.cmd("XREVRANGE").arg(self.keys.camera(camera));
            last.arg("+").arg("-").arg("COUNT").arg(1);
        }
        let mut latest = self.found(each, cameras).await?;
        // One may have been replaced after the cameras were listed.
        latest.sort_unstable_by_key(|report| report.id);
        Ok(latest)
    }

    /// The first reports after `after`, oldest first, at most `most`.
    pub(super) async fn since(
        &mut self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        match cameras {
            Cameras::One(camera) => self.since_of(camera, after, most).await,
            Cameras::All => {
                let places = self.places_after(after, most).await?;
                self.reports_at(places).await
            }
        }
    }

    async fn since_of(
        &mut self,
        camera: &str,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        // An ID in Redis has two parts: the ID of the report, and 0. This range begins directly
        // after it.
        let mut range = cmd("XRANGE");
        range.arg(self.keys.camera(camera));
        range.arg(format!("{after}-1")).arg("+");
        range.arg("COUNT").arg(most.get());
        let found = range.query_async(&mut self.connection).await?;
        Ok(reports(camera, found))
    }

    /// The first reports of all cameras after `after`, in order. The latest of each camera are in
    /// one set, all others in another.
    async fn places_after(
        &mut self,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Place>> {
        let mut both = atomic();
        for key in [self.keys.key("earlier"), self.keys.key("cameras")] {
            let first = both.cmd("ZRANGE").arg(key);
            first.arg(format!("({after}")).arg("+inf").arg("BYSCORE");
            first.arg("LIMIT").arg(0).arg(most.get()).arg("WITHSCORES");
        }
        let sets = both.query_async(&mut self.connection);
        let [earlier, latest]: [Vec<(Vec<u8>, f64)>; 2] = sets.await?;
        // Whole microseconds are exact; the scores of another program may be any number.
        let place = |(element, score): (Vec<u8>, f64)| {
            let element = String::from_utf8(element).ok()?;
            Some((ReportId::from_micros(to_u64(score)), element))
        };
        let earlier = earlier.into_iter().filter_map(place);
        let earlier = earlier.filter_map(|(id, element)| {
            // The ID, the size and the camera.
            let camera = element.splitn(3, ':').nth(2)?.to_owned();
            Some((id, camera))
        });
        let latest = latest.into_iter().filter_map(place);
        let mut places: Vec<Place> = earlier.chain(latest).collect();
        places.sort_unstable();
        places.truncate(most.get());
        Ok(places)
    }

    /// The reports at these places, as far as they are still kept.
    async fn reports_at(&mut self, places: Vec<Place>) -> RedisResult<Vec<Arc<StoredReport>>> {
        let mut each = atomic();
        for (id, camera) in &places {
            let id = format!("{id}-0");
            let one = each.cmd("XRANGE").arg(self.keys.camera(camera));
            one.arg(&id).arg(&id);
        }
        let cameras = places.into_iter().map(|(_, camera)| camera);
        self.found(each, cameras.collect()).await
    }

    pub(super) async fn image(&mut self, camera: &str) -> RedisResult<Option<Arc<StoredImage>>> {
        let mut parts = cmd("HMGET");
        parts.arg(self.keys.image(camera));
        parts.arg("id").arg("frame").arg("sketch");
        let parts = parts.query_async(&mut self.connection);
        let (id, frame, sketch): (Option<String>, Option<Vec<u8>>, Option<Vec<u8>>) = parts.await?;
        let stored = || {
            Some(Arc::new(StoredImage {
                id: id?.parse().ok()?,
                frame: StoredFrame {
                    jpeg: frame?.into(),
                    sketch: sketch?.into(),
                },
            }))
        };
        Ok(stored())
    }

    /// The newest ID that was ever assigned.
    pub(super) async fn newest(&mut self) -> RedisResult<ReportId> {
        let mut last = cmd("HGET");
        last.arg(self.keys.key("totals")).arg("last");
        let last: Option<String> = last.query_async(&mut self.connection).await?;
        Ok(last.and_then(|id| id.parse().ok()).unwrap_or_default())
    }

    pub(super) async fn usage(&mut self) -> RedisResult<ResultUse> {
        let mut counts = atomic();
        counts.cmd("ZCARD").arg(self.keys.key("cameras"));
        counts.cmd("ZCARD").arg(self.keys.key("earlier"));
        counts.cmd("HGET").arg(self.keys.key("totals")).arg("bytes");
        counts.cmd("ZCARD").arg(self.keys.key("images"));
        let counts = counts.query_async(&mut self.connection);
        let (cameras, earlier, bytes, images): (usize, usize, Option<String>, usize) =
            counts.await?;
        Ok(ResultUse {
            cameras,
            reports: cameras + earlier,
            bytes: bytes
                .and_then(|bytes| bytes.parse().ok())
                .unwrap_or_default(),
            images,
        })
    }

    /// The reports that a pipeline with one query per camera returns. A camera whose key another
    /// program has overwritten has none.
    async fn found(
        &mut self,
        mut each: Pipeline,
        cameras: Vec<String>,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        if cameras.is_empty() {
            return Ok(Vec::new());
        }
        let replies = each.ignore_errors().query_async(&mut self.connection);
        let found: Vec<RedisResult<StreamRangeReply>> = replies.await?;
        let found = cameras.into_iter().zip(found);
        Ok(found
            .filter_map(|(camera, found)| Some(reports(&camera, found.ok()?)))
            .flatten()
            .collect())
    }
}

/// A pipeline whose commands Redis runs in one atomic step.
fn atomic() -> Pipeline {
    let mut pipeline = pipe();
    pipeline.atomic();
    pipeline
}

fn reports(camera: &str, found: StreamRangeReply) -> Vec<Arc<StoredReport>> {
    let found = found.ids.into_iter();
    found.filter_map(|entry| report(camera, entry)).collect()
}

fn report(camera: &str, mut entry: StreamId) -> Option<Arc<StoredReport>> {
    let id = id_of(&entry)?;
    let Value::BulkString(json) = entry.map.remove("json")? else {
        return None;
    };
    if !is_one_line(&json) || !is_camera_name(camera) {
        return None;
    }
    Some(Arc::new(StoredReport {
        id,
        report: NewReport {
            camera: camera.to_owned(),
            received_at: text(&entry, "received_at")?.parse().ok()?,
            persons: text(&entry, "persons")?.parse().ok()?,
            scores: None,
            json: Bytes::from(json),
        },
    }))
}

fn text(entry: &StreamId, field: &str) -> Option<String> {
    String::from_redis_value_ref(entry.map.get(field)?).ok()
}

fn id_of(entry: &StreamId) -> Option<ReportId> {
    entry.id.strip_suffix("-0")?.parse().ok()
}

/// Parses a message: the ID, the time of arrival, the number of persons, the JSON and the camera,
/// in lines of their own. Returns `None` for the message of another program.
pub(super) fn parse_message(message: Vec<u8>) -> Option<StoredReport> {
    let message = Bytes::from(message);
    let mut parts = message.splitn(5, |&byte| byte == b'\n');
    let id = str::from_utf8(parts.next()?).ok()?.parse().ok()?;
    let received_at = str::from_utf8(parts.next()?).ok()?.parse().ok()?;
    let persons = str::from_utf8(parts.next()?).ok()?.parse().ok()?;
    let json = parts.next()?;
    let camera = str::from_utf8(parts.next()?).ok()?.to_owned();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_of_the_script_is_a_report() {
        let message = "7\n2026-11-22T09:30:00Z\n2\n{\"persons\":[]}\nhall of mirrors";
        let stored = parse_message(message.into()).unwrap();
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
            assert!(parse_message(message.into()).is_none(), "{message:?}");
        }
        assert!(parse_message(b"7\n2026-11-22T09:30:00Z\n2\n{}\n\xff".to_vec()).is_none());
    }
}

//! Queries to Redis, and the parsing of its answers into reports. Entries that are no reports of
//! Lookdown are skipped.

use std::{num::NonZeroUsize, sync::Arc};

use bytes::Bytes;
use redis::{
    FromRedisValue, Pipeline, RedisResult, Script, Value,
    aio::MultiplexedConnection,
    cmd, pipe,
    streams::{StreamId, StreamRangeReply},
};

use super::keys::Keys;
use crate::results::{NewPicture, NewReport, ReportId, ResultUse, StoredPicture, StoredReport};

/// The script that deletes a camera.
const DELETE: &str = include_str!("delete.lua");

/// An entry of the stream of all reports.
pub(super) struct Entry {
    pub(super) id: ReportId,
    pub(super) camera: String,
}

/// A connection to Redis, and its keys.
pub(super) struct Reader<'a> {
    pub(super) connection: MultiplexedConnection,
    pub(super) keys: &'a Keys,
}

impl Reader<'_> {
    pub(super) async fn latest(&mut self, camera: &str) -> RedisResult<Option<Arc<StoredReport>>> {
        let mut last = cmd("XREVRANGE");
        last.arg(self.keys.camera(camera));
        last.arg("+").arg("-").arg("COUNT").arg(1);
        let found: StreamRangeReply = last.query_async(&mut self.connection).await?;
        Ok(reports(camera, found).pop())
    }

    pub(super) async fn cameras(&mut self) -> RedisResult<Vec<String>> {
        let mut all = cmd("ZRANGE");
        all.arg(self.keys.cameras()).arg(0).arg(-1);
        all.query_async(&mut self.connection).await
    }

    /// Deletes all reports of a camera. Returns false if it had none.
    pub(super) async fn delete(&mut self, camera: &str) -> RedisResult<bool> {
        let script = Script::new(DELETE);
        let keys = self.keys;
        let mut call = script.prepare_invoke();
        for key in [
            keys.reports(),
            keys.earlier(),
            keys.cameras(),
            keys.totals(),
            keys.pictures(),
        ] {
            call.key(key);
        }
        call.arg(keys.camera(camera));
        call.arg(keys.picture(camera)).arg(camera);
        call.invoke_async(&mut self.connection).await
    }

    pub(super) async fn latest_of_all(&mut self) -> RedisResult<Vec<Arc<StoredReport>>> {
        let cameras = self.cameras().await?;
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

    pub(super) async fn since_of(
        &mut self,
        camera: &str,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        let key = self.keys.camera(camera);
        let found = self.range(key, after, most).await?;
        Ok(reports(camera, found))
    }

    pub(super) async fn since(
        &mut self,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        let found = self.range(self.keys.reports(), after, most).await?;
        self.reports_at(entries(found.ids)).await
    }

    /// The reports of these entries, as far as they are still kept.
    pub(super) async fn reports_at(
        &mut self,
        entries: Vec<Entry>,
    ) -> RedisResult<Vec<Arc<StoredReport>>> {
        let mut each = atomic();
        for entry in &entries {
            let id = format!("{}-0", entry.id);
            let one = each.cmd("XRANGE").arg(self.keys.camera(&entry.camera));
            one.arg(&id).arg(&id);
        }
        let cameras = entries.into_iter().map(|entry| entry.camera);
        self.found(each, cameras.collect()).await
    }

    pub(super) async fn picture(
        &mut self,
        camera: &str,
    ) -> RedisResult<Option<Arc<StoredPicture>>> {
        let mut parts = cmd("HMGET");
        parts.arg(self.keys.picture(camera));
        parts.arg("id").arg("frame").arg("sketch");
        let parts = parts.query_async(&mut self.connection);
        let (id, frame, sketch): (Option<String>, Option<Vec<u8>>, Option<Vec<u8>>) = parts.await?;
        let stored = || {
            Some(Arc::new(StoredPicture {
                id: id?.parse().ok()?,
                picture: NewPicture {
                    frame: frame?.into(),
                    sketch: sketch?.into(),
                },
            }))
        };
        Ok(stored())
    }

    /// The newest ID that was ever assigned.
    pub(super) async fn newest(&mut self) -> RedisResult<ReportId> {
        let mut last = cmd("HGET");
        last.arg(self.keys.totals()).arg("last");
        let last: Option<String> = last.query_async(&mut self.connection).await?;
        Ok(last.and_then(|id| id.parse().ok()).unwrap_or_default())
    }

    pub(super) async fn usage(&mut self) -> RedisResult<ResultUse> {
        let mut counts = atomic();
        counts.cmd("ZCARD").arg(self.keys.cameras());
        counts.cmd("XLEN").arg(self.keys.reports());
        counts.cmd("HGET").arg(self.keys.totals()).arg("bytes");
        counts.cmd("ZCARD").arg(self.keys.pictures());
        let counts = counts.query_async(&mut self.connection);
        let (cameras, reports, bytes, pictures): (usize, usize, Option<usize>, usize) =
            counts.await?;
        Ok(ResultUse {
            cameras,
            reports,
            bytes: bytes.unwrap_or_default(),
            pictures,
        })
    }

    async fn range(
        &mut self,
        key: String,
        after: ReportId,
        most: NonZeroUsize,
    ) -> RedisResult<StreamRangeReply> {
        // An ID in Redis has two parts: the ID of the report, and 0. This range begins directly
        // after it.
        let mut range = cmd("XRANGE");
        range.arg(key).arg(format!("{after}-1")).arg("+");
        range.arg("COUNT").arg(most.get());
        range.query_async(&mut self.connection).await
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

/// A pipeline whose replies are one reply, so that the limit of one holds for all of them.
fn atomic() -> Pipeline {
    let mut pipeline = pipe();
    pipeline.atomic();
    pipeline
}

/// The entries of a range of the stream of all reports.
pub(super) fn entries(found: Vec<StreamId>) -> Vec<Entry> {
    let entries = found.into_iter().filter_map(|entry| {
        Some(Entry {
            id: id_of(&entry)?,
            camera: entry.get("camera")?,
        })
    });
    entries.collect()
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
    // Lines of their own would be events of their own in an event stream.
    if json.iter().any(|byte| matches!(byte, b'\r' | b'\n')) {
        return None;
    }
    Some(Arc::new(StoredReport {
        id,
        report: NewReport {
            camera: camera.to_owned(),
            received_at: text(&entry, "received_at")?.parse().ok()?,
            persons: text(&entry, "persons")?.parse().ok()?,
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

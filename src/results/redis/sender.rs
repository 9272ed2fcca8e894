//! Sends reports from the outbox to Redis, one after the other. Each report is stored atomically
//! and exactly once: after a lost answer, Redis recognizes the report by its number.

use std::sync::Arc;

use jiff::Timestamp;
use lookdown_common::text::one_line;
use lookdown_http::request_id::new_id;
use redis::{RedisResult, Script, aio::MultiplexedConnection};

use super::{Shared, outbox::PendingReport, shared::is_refusal};
use crate::results::Cameras;

/// The script that stores a report in Redis.
const RECORD: &str = concat!(include_str!("forget.lua"), include_str!("record.lua"));

/// Sends reports for as long as the server runs. The first of consecutive refusals is logged.
pub(super) async fn run(shared: Arc<Shared>) {
    let sender = Sender {
        script: Script::new(RECORD),
        id: new_id().into_bytes(),
        shared: &shared,
    };
    let mut last_was_refused = false;
    let mut number = 0;
    loop {
        let pending = shared.outbox.first().await;
        // Increases also beyond the numbers of servers that have ended, so that theirs are
        // forgotten first.
        number = now_micros().max(number + 1);
        let refusal = sender.send(&pending, number).await.err();
        if let Some(refusal) = &refusal
            && !last_was_refused
        {
            let address = &shared.options.address;
            let refusal = one_line(refusal);
            tracing::warn!("Redis at {address} refuses reports: {refusal}");
        }
        last_was_refused = refusal.is_some();
        if !last_was_refused {
            shared.stored.inc();
        }
        shared.outbox.done(last_was_refused);
    }
}

struct Sender<'a> {
    script: Script,
    /// Identifies this server.
    id: [u8; 16],
    shared: &'a Shared,
}

impl Sender<'_> {
    /// Sends a report until Redis has answered. Fails only with a refusal.
    async fn send(&self, pending: &PendingReport, number: u64) -> RedisResult<()> {
        loop {
            let line = self.shared.link.next_line().await;
            let outcome = self.record(line.connection.clone(), pending, number).await;
            match outcome {
                Err(error) if !is_refusal(&error) => {
                    // Waits for the next connection.
                    let _ = self.shared.link.outcome(&line, Err::<(), _>(error));
                }
                outcome => return outcome,
            }
        }
    }

    async fn record(
        &self,
        mut connection: MultiplexedConnection,
        PendingReport { report, image }: &PendingReport,
        number: u64,
    ) -> RedisResult<()> {
        let (keys, limits) = (&self.shared.keys, &self.shared.limits);
        let mut call = self.script.prepare_invoke();
        call.key(&keys.index()[..]).key(keys.senders());
        call.arg(keys.prefix_of_cameras());
        call.arg(keys.prefix_of_images()).arg(&report.camera);
        call.arg(keys.channel(&Cameras::One(report.camera.clone())));
        call.arg(keys.channel(&Cameras::All));
        call.arg(&self.id[..]).arg(number);
        call.arg(report.received_at.to_string());
        call.arg(report.persons).arg(&report.json[..]);
        // An empty image means that there is none.
        let parts = image.as_ref().map(|it| [&it.jpeg[..], &it.sketch[..]]);
        let [frame, sketch] = parts.unwrap_or_default();
        call.arg(frame).arg(sketch);
        call.arg(report.bytes());
        for limit in [
            limits.max_cameras.get(),
            limits.history_per_camera.get(),
            limits.max_reports.get(),
            limits.max_bytes,
            limits.max_images.get(),
        ] {
            call.arg(limit);
        }
        call.arg(limits.max_age.as_secs());
        call.invoke_async(&mut connection).await
    }
}

fn now_micros() -> u64 {
    u64::try_from(Timestamp::now().as_microsecond()).unwrap_or_default()
}

//! Transactions of the store.

use std::collections::BTreeSet;

use rusqlite::{Transaction, params};

use super::{STATE_VERSION, Store, StoreError};
use crate::{
    scene::Batch,
    sums::{DAY_MS, LineDirection, MINUTE_MS, Owner, Sums, ZoneSum},
};

/// Most hours with reference crossings of a camera.
const MAX_REFERENCE_HOURS: usize = 60;

impl Owner {
    /// Returns the key of the store.
    pub(super) fn key(&self) -> String {
        match self {
            Self::Camera(name) => format!("camera:{name}"),
            Self::Site(name) => format!("site:{name}"),
        }
    }
}

impl Store {
    /// Stores sums, states, the ID of the last report, and the messages and conditions that follow
    /// from them in one transaction. `held` are all conditions that hold, or `None` if they are as
    /// stored. Blocks.
    pub(crate) fn commit(
        &self,
        batch: &Batch,
        messages: &[Message],
        held: Option<&BTreeSet<HeldCondition>>,
    ) -> Result<(), StoreError> {
        let mut connection = self.writer.lock();
        let transaction = connection.transaction()?;
        add(&transaction, &batch.sums)?;
        for (owner, state) in &batch.scenes {
            match state {
                Some(state) => {
                    let state = postcard::to_extend(state, vec![STATE_VERSION])?;
                    transaction
                        .prepare_cached("INSERT OR REPLACE INTO scenes VALUES (?, ?)")?
                        .execute(params![owner.key(), state])?;
                }
                None => {
                    transaction.execute("DELETE FROM scenes WHERE owner = ?", [owner.key()])?;
                }
            }
        }
        for message in messages {
            transaction
                .prepare_cached("INSERT OR IGNORE INTO deliveries VALUES (?, ?, ?, ?)")?
                .execute(params![
                    message.id,
                    message.webhook,
                    message.body,
                    message.created_s
                ])?;
        }
        if let Some(held) = held {
            transaction.execute("DELETE FROM conditions", [])?;
            for condition in held {
                transaction
                    .prepare_cached("INSERT INTO conditions VALUES (?, ?)")?
                    .execute(params![condition.webhook, condition.camera])?;
            }
        }
        transaction.execute(
            "INSERT OR REPLACE INTO progress VALUES (1, ?)",
            [batch.last_event],
        )?;
        Ok(transaction.commit()?)
    }

    /// Stores a calibration, and removes those that are forgotten. `content` is `None` if the
    /// server has none with this ID. Blocks.
    pub(crate) fn put_calibration(
        &self,
        id: &str,
        revision: &str,
        content: Option<&[u8]>,
        forgotten: &[String],
    ) -> Result<(), StoreError> {
        let mut connection = self.writer.lock();
        let transaction = connection.transaction()?;
        for id in forgotten {
            transaction.execute("DELETE FROM calibrations WHERE id = ?", [id])?;
        }
        transaction.execute(
            "INSERT OR REPLACE INTO calibrations VALUES (?, ?, ?)",
            params![id, revision, content],
        )?;
        Ok(transaction.commit()?)
    }

    /// Removes a message that was delivered or given up. Blocks.
    pub(crate) fn remove_message(&self, id: &str) -> Result<(), StoreError> {
        self.writer
            .lock()
            .execute("DELETE FROM deliveries WHERE id = ?", [id])?;
        Ok(())
    }

    /// Stores the crossings of an hour that a person counted; the oldest hours make room. Blocks.
    pub(crate) fn put_reference_crossings(
        &self,
        of: &LineDirection,
        minute: i64,
        crossings: u64,
    ) -> Result<(), StoreError> {
        let mut connection = self.writer.lock();
        let transaction = connection.transaction()?;
        transaction.execute(
            "INSERT OR REPLACE INTO reference_crossings VALUES (?, ?, ?, ?, ?)",
            params![of.camera, of.line, of.direction, minute, crossings],
        )?;
        transaction.execute(
            "DELETE FROM reference_crossings WHERE camera = ?1 AND minute NOT IN (SELECT DISTINCT
             minute FROM reference_crossings WHERE camera = ?1 ORDER BY minute DESC LIMIT ?2)",
            params![of.camera, MAX_REFERENCE_HOURS],
        )?;
        Ok(transaction.commit()?)
    }

    /// Removes the reference crossings of an hour. Returns false if it has none. Blocks.
    pub(crate) fn remove_reference_crossings(
        &self,
        camera: &str,
        minute: i64,
    ) -> Result<bool, StoreError> {
        let removed = self.writer.lock().execute(
            "DELETE FROM reference_crossings WHERE camera = ? AND minute = ?",
            params![camera, minute],
        )?;
        Ok(removed > 0)
    }

    /// Removes all sums of a camera. Blocks.
    pub(crate) fn remove(&self, camera: &str) -> Result<(), StoreError> {
        let owner = Owner::Camera(camera.to_owned()).key();
        let mut connection = self.writer.lock();
        let transaction = connection.transaction()?;
        for (table, column, of) in [
            ("presence", "owner", owner.as_str()),
            ("bars", "owner", &owner),
            ("cells", "owner", &owner),
            ("slow", "camera", camera),
            ("crossings", "camera", camera),
            ("reference_crossings", "camera", camera),
            ("zones", "camera", camera),
            ("line_totals", "camera", camera),
            ("zone_totals", "camera", camera),
        ] {
            let statement = format!("DELETE FROM {table} WHERE {column} = ?");
            transaction.execute(&statement, [of])?;
        }
        Ok(transaction.commit()?)
    }

    /// Removes sums of minutes and days that ended before this time: those of the oldest day at
    /// most, so that a clock that is ahead for a while does not remove all of them. Blocks.
    pub(crate) fn expire(&self, before_ms: i64) -> Result<(), StoreError> {
        const MINUTES_OF_A_DAY: i64 = DAY_MS / MINUTE_MS;
        let minute = before_ms.div_euclid(MINUTE_MS);
        let day = before_ms.div_euclid(DAY_MS);
        let mut connection = self.writer.lock();
        let transaction = connection.transaction()?;
        for (table, column, before, at_most) in [
            ("presence", "minute", minute, MINUTES_OF_A_DAY),
            ("bars", "minute", minute, MINUTES_OF_A_DAY),
            ("slow", "minute", minute, MINUTES_OF_A_DAY),
            ("crossings", "minute", minute, MINUTES_OF_A_DAY),
            ("reference_crossings", "minute", minute, MINUTES_OF_A_DAY),
            ("zones", "minute", minute, MINUTES_OF_A_DAY),
            ("cells", "day", day, 1),
        ] {
            let statement = format!(
                "DELETE FROM {table} WHERE {column} < min(?, (SELECT min({column}) FROM {table}) + ?)"
            );
            transaction.execute(&statement, [before, at_most])?;
        }
        Ok(transaction.commit()?)
    }
}

/// Adds sums to those of the store.
fn add(transaction: &Transaction<'_>, sums: &Sums) -> rusqlite::Result<()> {
    let mut presence = transaction.prepare_cached(
        "INSERT INTO presence VALUES (?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         known_ms = known_ms + excluded.known_ms, person_ms = person_ms + excluded.person_ms,
         most = max(most, excluded.most)",
    )?;
    let mut bars = transaction.prepare_cached(
        "INSERT INTO bars VALUES (?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         known_ms = known_ms + excluded.known_ms, low_ms = low_ms + excluded.low_ms,
         high_ms = high_ms + excluded.high_ms",
    )?;
    for ((owner, minute), sum) in &sums.presence {
        if let Some([low_ms, high_ms]) = sum.bar_ms {
            bars.execute(params![owner.key(), minute, sum.known_ms, low_ms, high_ms])?;
        }
        presence.execute(params![
            owner.key(),
            minute,
            sum.known_ms,
            sum.person_ms,
            sum.most
        ])?;
    }
    let mut slow = transaction.prepare_cached(
        "INSERT INTO slow VALUES (?, ?, ?) ON CONFLICT DO UPDATE SET
         slow_ms = slow_ms + excluded.slow_ms",
    )?;
    for ((camera, minute), slow_ms) in &sums.slow {
        slow.execute(params![camera, minute, slow_ms])?;
    }
    let mut crossings = transaction.prepare_cached(
        "INSERT INTO crossings VALUES (?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         crossings = crossings + excluded.crossings",
    )?;
    let mut line_totals = transaction.prepare_cached(
        "INSERT INTO line_totals VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         crossings = crossings + excluded.crossings",
    )?;
    for ((of, minute), count) in &sums.crossings {
        crossings.execute(params![of.camera, of.line, of.direction, minute, count])?;
        line_totals.execute(params![of.camera, of.line, of.direction, count])?;
    }
    let mut zones = transaction.prepare_cached(
        "INSERT INTO zones VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         entries = entries + excluded.entries, visits = visits + excluded.visits,
         visit_ms = visit_ms + excluded.visit_ms, person_ms = person_ms + excluded.person_ms,
         most = max(most, excluded.most)",
    )?;
    let mut zone_totals = transaction.prepare_cached(
        "INSERT INTO zone_totals VALUES (?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         entries = entries + excluded.entries, person_ms = person_ms + excluded.person_ms",
    )?;
    for ((of, minute), sum) in &sums.zones {
        let ZoneSum {
            entries,
            visits,
            visit_ms,
            person_ms,
            most,
        } = sum;
        zones.execute(params![
            of.camera, of.zone, minute, entries, visits, visit_ms, person_ms, most
        ])?;
        zone_totals.execute(params![of.camera, of.zone, entries, person_ms])?;
    }
    let mut cells = transaction.prepare_cached(
        "INSERT INTO cells VALUES (?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET
         milliseconds = milliseconds + excluded.milliseconds",
    )?;
    for ((owner, day, cell), milliseconds) in &sums.cells {
        cells.execute(params![
            owner.key(),
            day,
            cell.column,
            cell.row,
            milliseconds
        ])?;
    }
    Ok(())
}

/// A message to be delivered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    /// The same for every attempt.
    pub(crate) id: String,
    /// The digest of its webhook. The URL of the receiver may hold a password or a token.
    pub(crate) webhook: String,
    /// JSON.
    pub(crate) body: String,
    /// Time of the message, seconds since the Unix epoch.
    pub(crate) created_s: i64,
}

/// A condition that holds, as it is stored.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HeldCondition {
    /// The digest of the webhook.
    pub(crate) webhook: String,
    pub(crate) camera: String,
}

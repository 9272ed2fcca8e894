//! Queries of the store.

use std::collections::BTreeMap;

use jiff::Timestamp;
use lookdown_tracking::heat_map::Cell;
use rusqlite::{Connection, OptionalExtension, params};

use super::{
    STATE_VERSION, Store, StoreError,
    write::{HeldCondition, Message},
};
use crate::{
    now::time_of,
    scene::SceneState,
    sums::{
        DAY_MS, LineDirection, MINUTE_MS, Owner, PresenceSum, TimeSpan, Totals, ZoneOf, ZoneSum,
        ZoneTotal,
    },
};

/// The content of the store at the start.
pub(crate) struct Resumed {
    pub(crate) last_event: u64,
    pub(crate) totals: Totals,
    pub(crate) scenes: Vec<SceneState>,
    pub(crate) calibrations: StoredCalibrations,
    pub(crate) messages: Vec<Message>,
    pub(crate) held: Vec<HeldCondition>,
}

/// The calibrations by ID: the revision, and the content if the server has one.
pub(crate) type StoredCalibrations = BTreeMap<String, (String, Option<Vec<u8>>)>;

/// The minutes of an hour.
pub(crate) const HOUR_MINUTES: i64 = 60;

/// A time in whole minutes, in steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) from_minute: i64,
    /// Minute after the last.
    pub(crate) to_minute: i64,
    pub(crate) step_minutes: i64,
}

impl Span {
    /// Returns its first and last moment.
    pub(crate) fn time(self) -> TimeSpan {
        TimeSpan {
            from_ms: self.from_minute * MINUTE_MS,
            to_ms: self.to_minute * MINUTE_MS,
        }
    }
}

/// The sums of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Step {
    pub(crate) presence: PresenceSum,
    /// Milliseconds with fewer frames than lines need.
    pub(crate) slow_ms: u64,
    /// Crossings per line and direction.
    pub(crate) crossings: BTreeMap<(String, String), u64>,
    /// Sums per zone.
    pub(crate) zones: BTreeMap<String, ZoneSum>,
}

/// The crossings of a line in a direction in an hour.
pub(crate) struct ReferenceHour {
    /// The begin of the hour.
    pub(crate) from: Timestamp,
    pub(crate) line: String,
    pub(crate) direction: String,
    /// The crossings that a person counted.
    pub(crate) crossings: u64,
    /// The crossings that the camera counted.
    pub(crate) counted: u64,
}

impl Store {
    /// Reads what a start continues from. A state of another version is left out. Blocks.
    pub(crate) fn resumed(&self) -> Result<Resumed, StoreError> {
        let connection = self.reader.lock();
        let last_event = connection
            .query_row("SELECT last_event FROM progress", [], |row| row.get(0))
            .optional()?;
        Ok(Resumed {
            last_event: last_event.unwrap_or_default(),
            totals: totals(&connection)?,
            scenes: scenes(&connection)?,
            calibrations: calibrations(&connection)?,
            messages: messages(&connection)?,
            held: held(&connection)?,
        })
    }

    /// Returns the sums of the steps of a time that have any, by the number of the step. `None` if
    /// they have more values than `most`. Blocks.
    pub(crate) fn steps(
        &self,
        owner: &Owner,
        span: Span,
        most: usize,
    ) -> Result<Option<BTreeMap<i64, Step>>, StoreError> {
        let mut values = 0;
        let connection = self.reader.lock();
        let Span {
            from_minute: from,
            to_minute: to,
            step_minutes: step,
        } = span;
        let mut steps = BTreeMap::<i64, Step>::new();
        let mut statement = connection.prepare_cached(
            "SELECT (minute - ?2) / ?4, sum(p.known_ms), sum(person_ms), max(most),
             CASE sum(b.known_ms) WHEN sum(p.known_ms) THEN sum(low_ms) END, sum(high_ms)
             FROM presence p LEFT JOIN bars b USING (owner, minute)
             WHERE owner = ?1 AND minute >= ?2 AND minute < ?3 GROUP BY 1",
        )?;
        let mut rows = statement.query(params![owner.key(), from, to, step])?;
        while let Some(row) = rows.next()? {
            steps.entry(row.get(0)?).or_default().presence = PresenceSum {
                known_ms: row.get(1)?,
                person_ms: row.get(2)?,
                most: row.get(3)?,
                bar_ms: match row.get(4)? {
                    Some(low_ms) => Some([low_ms, row.get(5)?]),
                    None => None,
                },
            };
        }
        let Owner::Camera(camera) = owner else {
            return Ok(Some(steps));
        };
        let mut statement = connection.prepare_cached(
            "SELECT (minute - ?2) / ?4, sum(slow_ms) FROM slow
             WHERE camera = ?1 AND minute >= ?2 AND minute < ?3 GROUP BY 1",
        )?;
        let mut rows = statement.query(params![camera, from, to, step])?;
        while let Some(row) = rows.next()? {
            steps.entry(row.get(0)?).or_default().slow_ms = row.get(1)?;
        }
        let mut statement = connection.prepare_cached(
            "SELECT (minute - ?2) / ?4, line, direction, sum(crossings) FROM crossings
             WHERE camera = ?1 AND minute >= ?2 AND minute < ?3 GROUP BY 1, 2, 3",
        )?;
        let mut rows = statement.query(params![camera, from, to, step])?;
        while let Some(row) = rows.next()? {
            values += 1;
            if values > most {
                return Ok(None);
            }
            let crossings = &mut steps.entry(row.get(0)?).or_default().crossings;
            crossings.insert((row.get(1)?, row.get(2)?), row.get(3)?);
        }
        let mut statement = connection.prepare_cached(
            "SELECT (minute - ?2) / ?4, zone, sum(entries), sum(visits), sum(visit_ms), sum(person_ms),
             max(most) FROM zones WHERE camera = ?1 AND minute >= ?2 AND minute < ?3 GROUP BY 1, 2",
        )?;
        let mut rows = statement.query(params![camera, from, to, step])?;
        while let Some(row) = rows.next()? {
            values += 1;
            if values > most {
                return Ok(None);
            }
            let zones = &mut steps.entry(row.get(0)?).or_default().zones;
            let sum = ZoneSum {
                entries: row.get(2)?,
                visits: row.get(3)?,
                visit_ms: row.get(4)?,
                person_ms: row.get(5)?,
                most: row.get(6)?,
            };
            zones.insert(row.get(1)?, sum);
        }
        Ok(Some(steps))
    }

    /// Returns the hours whose crossings a person counted, oldest first. Blocks.
    pub(crate) fn reference_crossings(
        &self,
        camera: &str,
    ) -> Result<Vec<ReferenceHour>, StoreError> {
        let connection = self.reader.lock();
        let mut statement = connection.prepare_cached(
            "SELECT minute, line, direction, crossings, coalesce((SELECT sum(crossings) FROM crossings c
             WHERE c.camera = r.camera AND c.line = r.line AND c.direction = r.direction
             AND c.minute >= r.minute AND c.minute < r.minute + ?2), 0)
             FROM reference_crossings r WHERE camera = ?1 ORDER BY 1, 2, 3",
        )?;
        let rows = statement.query_map(params![camera, HOUR_MINUTES], |row| {
            Ok(ReferenceHour {
                from: time_of(row.get::<_, i64>(0)? * MINUTE_MS),
                line: row.get(1)?,
                direction: row.get(2)?,
                crossings: row.get(3)?,
                counted: row.get(4)?,
            })
        })?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    /// Returns the milliseconds of presence per cell in whole days. Blocks.
    pub(crate) fn cells(
        &self,
        owner: &Owner,
        time: TimeSpan,
    ) -> Result<BTreeMap<Cell, u64>, StoreError> {
        let connection = self.reader.lock();
        let mut statement = connection.prepare_cached(
            "SELECT cell_column, cell_row, sum(milliseconds) FROM cells
             WHERE owner = ? AND day >= ? AND day < ? GROUP BY 1, 2",
        )?;
        let days = (
            time.from_ms.div_euclid(DAY_MS),
            (time.to_ms + DAY_MS - 1).div_euclid(DAY_MS),
        );
        let mut rows = statement.query(params![owner.key(), days.0, days.1])?;
        let mut cells = BTreeMap::new();
        while let Some(row) = rows.next()? {
            let cell = Cell {
                column: row.get(0)?,
                row: row.get(1)?,
            };
            cells.insert(cell, row.get(2)?);
        }
        Ok(cells)
    }

    /// Returns true if there are sums of the owner. Blocks.
    pub(crate) fn has(&self, owner: &Owner) -> Result<bool, StoreError> {
        let connection = self.reader.lock();
        let mut statement =
            connection.prepare_cached("SELECT 1 FROM presence WHERE owner = ? LIMIT 1")?;
        Ok(statement.exists([owner.key()])?)
    }
}

fn totals(connection: &Connection) -> rusqlite::Result<Totals> {
    let mut totals = Totals::default();
    let mut statement =
        connection.prepare("SELECT camera, line, direction, crossings FROM line_totals")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let of = LineDirection {
            camera: row.get(0)?,
            line: row.get(1)?,
            direction: row.get(2)?,
        };
        totals.crossings.insert(of, row.get(3)?);
    }
    let mut statement =
        connection.prepare("SELECT camera, zone, entries, person_ms FROM zone_totals")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let of = ZoneOf {
            camera: row.get(0)?,
            zone: row.get(1)?,
        };
        let total = ZoneTotal {
            entries: row.get(2)?,
            person_ms: row.get(3)?,
        };
        totals.zones.insert(of, total);
    }
    Ok(totals)
}

fn scenes(connection: &Connection) -> rusqlite::Result<Vec<SceneState>> {
    let mut scenes = Vec::new();
    let mut statement = connection.prepare("SELECT owner, state FROM scenes")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let state: Vec<u8> = row.get(1)?;
        let state = match state.split_first() {
            Some((&STATE_VERSION, state)) => postcard::from_bytes(state).ok(),
            _ => None,
        };
        if let Some(state) = state {
            scenes.push(state);
        } else {
            let owner: String = row.get(0)?;
            tracing::warn!("the tracks of {owner} begin again: another version stored them");
        }
    }
    Ok(scenes)
}

fn calibrations(connection: &Connection) -> rusqlite::Result<StoredCalibrations> {
    let mut statement = connection.prepare("SELECT id, revision, content FROM calibrations")?;
    let rows = statement.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    rows.collect()
}

fn messages(connection: &Connection) -> rusqlite::Result<Vec<Message>> {
    let mut statement = connection
        .prepare("SELECT id, webhook, body, created_s FROM deliveries ORDER BY created_s, id")?;
    let rows = statement.query_map([], |row| {
        Ok(Message {
            id: row.get(0)?,
            webhook: row.get(1)?,
            body: row.get(2)?,
            created_s: row.get(3)?,
        })
    })?;
    rows.collect()
}

fn held(connection: &Connection) -> rusqlite::Result<Vec<HeldCondition>> {
    let mut statement = connection.prepare("SELECT webhook, camera FROM conditions")?;
    let rows = statement.query_map([], |row| {
        Ok(HeldCondition {
            webhook: row.get(0)?,
            camera: row.get(1)?,
        })
    })?;
    rows.collect()
}

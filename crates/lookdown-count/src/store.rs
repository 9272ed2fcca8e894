//! The embedded store: sums per minute, the state of the trackers and the ID of the last report.
//!
//! All of it changes in one transaction, so that the sums contain every report up to that ID and
//! none after it, however the process ends.

mod read;
pub(crate) mod write;

use std::{
    fmt::Display,
    fs::{File, OpenOptions, TryLockError},
    os::unix::fs::OpenOptionsExt,
    path::Path,
    sync::Arc,
    thread::sleep,
    time::{Duration, Instant},
};

use lookdown_common::StoredFile;
use parking_lot::Mutex;
use rusqlite::Connection;

pub(crate) use read::{HOUR_MINUTES, ReferenceHour, Span, Step, StoredCalibrations};

/// First byte of the stored state of a scene.
const STATE_VERSION: u8 = StoredFile::Tracks.version();
/// The version of a file without tables.
const NEW: i64 = 0;
/// Longest wait for the other connection.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest wait for an earlier user of the store, and the interval of the attempts.
const LOCK_TIMEOUT: Duration = Duration::from_secs(5);
const LOCK_PAUSE: Duration = Duration::from_millis(50);

/// A store that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct StoreError(String);

impl StoreError {
    fn unusable(path: &Path, problem: impl Display) -> Self {
        Self(format!(
            "counts.path: {} cannot be used: {problem}: give a writable path of a store of lookdown count",
            path.display()
        ))
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(problem: rusqlite::Error) -> Self {
        Self(format!("the store cannot be read or written: {problem}"))
    }
}

impl From<postcard::Error> for StoreError {
    fn from(problem: postcard::Error) -> Self {
        Self(format!(
            "the state of a tracker cannot be stored: {problem}"
        ))
    }
}

/// The store. One connection writes, one reads.
#[derive(Clone)]
pub(crate) struct Store {
    writer: Arc<Mutex<Connection>>,
    reader: Arc<Mutex<Connection>>,
    /// Locked while the store is open.
    _lock: Arc<File>,
}

impl Store {
    /// Opens or creates the store. Blocks.
    pub(crate) fn open(path: &Path) -> Result<Self, StoreError> {
        let lock = lock(path)?;
        let unusable = |problem: rusqlite::Error| StoreError::unusable(path, problem);
        // The files of SQLite beside it get its mode.
        open_private(path).map_err(|problem| StoreError::unusable(path, problem))?;
        let writer = connect(path).map_err(unusable)?;
        if has_code(&writer).map_err(unusable)? {
            let problem = "it has views, triggers or virtual tables of another program";
            return Err(StoreError::unusable(path, problem));
        }
        let version = schema_version(&writer).map_err(unusable)?;
        if version != NEW {
            let checked = StoredFile::Counts.check(&version.to_string());
            checked.map_err(|problem| {
                StoreError(format!("counts.path: {} {problem}", path.display()))
            })?;
        }
        create_schema(&writer).map_err(unusable)?;
        let reader = connect(path).map_err(unusable)?;
        reader
            .pragma_update(None, "query_only", true)
            .map_err(unusable)?;
        Ok(Self {
            writer: Arc::new(Mutex::new(writer)),
            reader: Arc::new(Mutex::new(reader)),
            _lock: Arc::new(lock),
        })
    }
}

fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let connection = Connection::open(path)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.pragma_update(None, "trusted_schema", false)?;
    connection.pragma_update(None, "journal_mode", "wal")?;
    // A transaction survives the end of the process at once. A power failure may lose the last ones
    // as a whole: the server sends their reports again.
    connection.pragma_update(None, "synchronous", "normal")?;
    Ok(connection)
}

/// Opens or creates a file that only its owner may read.
fn open_private(path: &Path) -> std::io::Result<File> {
    // The opening of a pipe would wait for a reader.
    if std::fs::metadata(path).is_ok_and(|about| !about.is_file()) {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(path)
}

/// Locks the file beside the store. Waits for a process that ends, and for requests that end with
/// earlier settings.
fn lock(path: &Path) -> Result<File, StoreError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let unusable = |problem| StoreError::unusable(path, problem);
    let file = open_private(Path::new(&name)).map_err(unusable)?;
    let started = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::WouldBlock) if started.elapsed() < LOCK_TIMEOUT => sleep(LOCK_PAUSE),
            Err(TryLockError::WouldBlock) => {
                return Err(StoreError(format!(
                    "counts.path: {} is in use by another process: stop it, or give another path",
                    path.display()
                )));
            }
            Err(TryLockError::Error(problem)) => return Err(unusable(problem)),
        }
    }
}

/// Owners are `camera:NAME` or `site:NAME`. Minutes and days are counted from the Unix epoch.
const TABLES: &str = "
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS progress (only INTEGER PRIMARY KEY CHECK (only = 1), last_event INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS scenes (owner TEXT PRIMARY KEY, state BLOB NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS calibrations (
  id TEXT PRIMARY KEY, revision TEXT NOT NULL, content BLOB) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS presence (
  owner TEXT, minute INTEGER, known_ms INTEGER NOT NULL, person_ms INTEGER NOT NULL, most INTEGER NOT NULL,
  PRIMARY KEY (owner, minute)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS bars (
  owner TEXT, minute INTEGER, known_ms INTEGER NOT NULL, low_ms INTEGER NOT NULL, high_ms INTEGER NOT NULL,
  PRIMARY KEY (owner, minute)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS slow (
  camera TEXT, minute INTEGER, slow_ms INTEGER NOT NULL, PRIMARY KEY (camera, minute)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS crossings (
  camera TEXT, line TEXT, direction TEXT, minute INTEGER, crossings INTEGER NOT NULL,
  PRIMARY KEY (camera, minute, line, direction)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS reference_crossings (
  camera TEXT, line TEXT, direction TEXT, minute INTEGER, crossings INTEGER NOT NULL,
  PRIMARY KEY (camera, minute, line, direction)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS zones (
  camera TEXT, zone TEXT, minute INTEGER, entries INTEGER NOT NULL, visits INTEGER NOT NULL,
  visit_ms INTEGER NOT NULL, person_ms INTEGER NOT NULL, most INTEGER NOT NULL,
  PRIMARY KEY (camera, minute, zone)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS cells (
  owner TEXT, day INTEGER, cell_column INTEGER, cell_row INTEGER, milliseconds INTEGER NOT NULL,
  PRIMARY KEY (owner, day, cell_column, cell_row)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS line_totals (
  camera TEXT, line TEXT, direction TEXT, crossings INTEGER NOT NULL,
  PRIMARY KEY (camera, line, direction)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS zone_totals (
  camera TEXT, zone TEXT, entries INTEGER NOT NULL, person_ms INTEGER NOT NULL,
  PRIMARY KEY (camera, zone)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS deliveries (
  id TEXT PRIMARY KEY, webhook TEXT NOT NULL, body TEXT NOT NULL, created_s INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS conditions (
  webhook TEXT, camera TEXT, PRIMARY KEY (webhook, camera)) WITHOUT ROWID;
";

/// Returns the version of the tables of a store, `NEW` for a file without tables.
fn schema_version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

/// Returns true for a file whose schema runs code that no store has.
fn has_code(connection: &Connection) -> rusqlite::Result<bool> {
    let query = "SELECT EXISTS (SELECT 1 FROM sqlite_schema
        WHERE type NOT IN ('table', 'index') OR sql LIKE 'create%virtual%')";
    connection.query_row(query, [], |row| row.get(0))
}

/// Creates the tables that are missing.
fn create_schema(connection: &Connection) -> rusqlite::Result<()> {
    // An earlier table held the URLs of webhooks with their secrets.
    connection.execute_batch("PRAGMA secure_delete = ON; DROP TABLE IF EXISTS outbox;")?;
    let version = StoredFile::Counts.version();
    connection.execute_batch(&format!("{TABLES}PRAGMA user_version = {version}; COMMIT;"))
}

#[cfg(test)]
mod tests;

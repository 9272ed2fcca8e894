//! The tables.

use lookdown_common::StoredFile;
use rusqlite::Connection;

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
CREATE TABLE IF NOT EXISTS slow (
  camera TEXT, minute INTEGER, slow_ms INTEGER NOT NULL, PRIMARY KEY (camera, minute)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS crossings (
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
pub(super) fn version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

/// Returns true for a file whose schema runs code that no store has.
pub(super) fn has_code(connection: &Connection) -> rusqlite::Result<bool> {
    let query = "SELECT EXISTS (SELECT 1 FROM sqlite_schema
        WHERE type NOT IN ('table', 'index') OR sql LIKE 'create%virtual%')";
    connection.query_row(query, [], |row| row.get(0))
}

/// Creates the tables that are missing.
pub(super) fn create(connection: &Connection) -> rusqlite::Result<()> {
    // An earlier table held the URLs of webhooks with their secrets.
    connection.execute_batch("PRAGMA secure_delete = ON; DROP TABLE IF EXISTS outbox;")?;
    let version = StoredFile::Counts.version();
    connection.execute_batch(&format!("{TABLES}PRAGMA user_version = {version}; COMMIT;"))
}

//! Messages of a bag in SQLite, the default storage of ROS 2 before Iron. A damaged or hostile file
//! ends in an error.

use std::path::Path;

use rusqlite::config::DbConfig;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, OpenFlags};

/// The tables of a bag. A view in place of one could compute without end.
const TABLES: &str =
    "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('messages', 'topics')";
/// The messages in the order in which they were recorded.
const MESSAGES: &str = "SELECT topics.type, topics.name, messages.timestamp, messages.data \
    FROM messages JOIN topics ON topics.id = messages.topic_id ORDER BY messages.id";

/// A message of a file.
pub(super) struct StoredMessage<'a> {
    pub(super) kind: &'a str,
    pub(super) topic: &'a str,
    pub(super) log_ns: u64,
    pub(super) data: &'a [u8],
}

/// Reason why a file cannot be read.
pub(super) struct SqliteFault(pub(super) String);

impl From<Error> for SqliteFault {
    fn from(error: Error) -> Self {
        Self(format!("SQLite: {error}"))
    }
}

/// Passes every message of a file to `take`.
pub(super) fn read<E: From<SqliteFault>>(
    path: &Path,
    take: &mut impl FnMut(StoredMessage<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let wrong = SqliteFault::from;
    if path.starts_with("/proc") {
        let problem = "a bag in SQLite cannot be a stream; give its file".to_owned();
        return Err(SqliteFault(problem).into());
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let database = Connection::open_with_flags(path, flags).map_err(wrong)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true).map_err(wrong)?;
    database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false).map_err(wrong)?;
    let tables: i64 = database.query_row(TABLES, [], |row| row.get(0)).map_err(wrong)?;
    if tables != 2 {
        return Err(SqliteFault("it has no tables `messages` and `topics`".to_owned()).into());
    }
    let mut statement = database.prepare(MESSAGES).map_err(wrong)?;
    let mut rows = statement.query([]).map_err(wrong)?;
    while let Some(row) = rows.next().map_err(wrong)? {
        let text = |column| row.get_ref(column)?.as_str().map_err(Error::from);
        let (kind, topic) = (text(0).map_err(wrong)?, text(1).map_err(wrong)?);
        let log_ns: i64 = row.get(2).map_err(wrong)?;
        // An empty message may be stored as NULL.
        let data = match row.get_ref(3).map_err(wrong)? {
            ValueRef::Blob(data) => data,
            _ => &[],
        };
        take(StoredMessage { kind, topic, log_ns: log_ns.try_into().unwrap_or_default(), data })?;
    }
    Ok(())
}

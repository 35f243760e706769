//! Reading and writing that every format shares: TOML whose errors name file, line and remedy; hashes; outputs that
//! appear under their final names only when whole.

mod atomic;
mod disk;
mod document;
mod error;
mod hash;
mod hidden;
mod holder;
mod inside;
mod lock;
mod lock_file;
mod provenance;
mod staged;
mod write_toml;

pub use atomic::{parent_of, write_atomic};
pub use disk::free_bytes;
pub use document::Document;
pub use error::FileError;
pub use hash::{sha256_hex, sha256_of_file};
pub use holder::Holder;
pub use inside::inside_folder;
pub use lock::{Lock, LockError};
pub use provenance::{Input, Provenance, ProvenanceTable};
pub use staged::{OutputKind, StagedFolder};
pub use write_toml::{DateTimeError, datetime_from_timestamp, timestamp_from_datetime, write_toml};

/// The schema number that this version writes and reads, for every format.
pub const SCHEMA: i64 = 1;

/// What a written file says of the program that wrote it.
pub const PROGRAM: &str = concat!("weavelight ", env!("CARGO_PKG_VERSION"));

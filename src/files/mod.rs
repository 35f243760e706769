//! Reading and writing that every format shares: TOML whose errors name file, line and remedy; hashes; outputs that
//! appear under their final names only when whole.

mod atomic;
mod disk;
mod document;
mod error;
mod hash;
mod inside;
mod provenance;
mod staged;
mod write_toml;

pub use atomic::write_atomic;
pub use disk::free_bytes;
pub use document::Document;
pub use error::FileError;
pub use hash::{sha256_hex, sha256_of_file};
pub use inside::inside_folder;
pub use provenance::{Input, Provenance, ProvenanceTable};
pub use staged::{OutputKind, StagedFolder};
pub use write_toml::{DateTimeError, datetime_from_timestamp, timestamp_from_datetime, write_toml};

/// The schema number that this version writes and reads, for every format.
pub const SCHEMA: i64 = 1;

/// What a written file says of the program that wrote it.
pub const PROGRAM: &str = concat!("weavelight ", env!("CARGO_PKG_VERSION"));

//! Reading and writing that every format shares: TOML whose errors name file, line and remedy; hashes; outputs that
//! appear under their final names only when whole.

mod atomic;
mod disk;
mod document;
mod error;
mod exchange;
mod file_list;
mod hash;
mod hidden;
mod holder;
mod input;
mod inside;
mod leftovers;
mod lock;
mod lock_file;
mod owned;
mod provenance;
mod setting;
mod shown;
mod signals;
mod staged;
mod survey;
mod text;
mod write_toml;

pub use atomic::{check_output_folder, clean_temporary, parent_of, write_atomic};
pub use disk::free_bytes;
pub use document::Document;
pub use error::FileError;
pub use exchange::exchange;
pub use file_list::LIST_FILE;
pub use hash::{sha256_hex, sha256_of_file};
pub use holder::Holder;
pub(crate) use input::size;
pub use input::{InputKind, check_input, copy_input, open_input, read_input, read_input_text};
pub use inside::inside_folder;
pub use leftovers::UNFINISHED;
pub use lock::{Lock, LockError};
pub use owned::{
    Owned, begin_owned, check_owned, note_files, remove_noted, remove_owned, update_owned_toml,
    write_owned, write_owned_toml,
};
pub use provenance::{Input, Provenance, ProvenanceTable};
pub use setting::{Setting, name_settings, plain_words};
pub use shown::{WORK_FOLDER, shown};
pub use signals::survive_size_limits;
pub use staged::{OutputKind, StagedFolder};
pub use text::{
    harmless, harmless_json, one_line, path_text, serialize_maybe_path, serialize_path,
};
pub use write_toml::{
    DateTimeError, datetime_from_timestamp, timestamp_from_datetime, toml_bytes, write_toml,
};

/// What a written file says of the program that wrote it.
pub const PROGRAM: &str = concat!("weavelight ", env!("CARGO_PKG_VERSION"));

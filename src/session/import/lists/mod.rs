//! Lists as text: encodings, line ends, separators, quotes.

pub(super) mod table;
pub(super) mod text;

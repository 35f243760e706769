//! What a capture needs of the world outside: the light board.

pub mod board;

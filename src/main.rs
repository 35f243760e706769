//! The `weavelight` command.

fn main() {}

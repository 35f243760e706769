//! Long tables of one kind: a share of them in every run, all with `WEAVELIGHT_THOROUGH=1` (`make thorough`).

/// Whether case `k` of a table runs. Of every `of` cases in a row one does; `turn` says which, so that tables that belong
/// together (one a cloth) cover every case between them.
pub fn runs(k: usize, of: usize, turn: usize) -> bool {
    std::env::var_os("WEAVELIGHT_THOROUGH").is_some() || (k + turn).is_multiple_of(of)
}

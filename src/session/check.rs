//! What a manifest may say beyond its types: each problem as (key, what is wrong and what to do).

use super::{Board, FrameEntry, Patch, Session};
use crate::files::inside_folder;
use std::collections::HashMap;
use std::path::Path;

type Problem = (String, String);

/// Everything that a manifest must satisfy whatever command reads it.
pub(super) fn check_manifest(session: &Session) -> Result<(), Problem> {
    if let Some(mask) = &session.mask {
        check_path("mask", mask)?;
    }
    if let Some(target) = &session.target {
        if let Some(reflectance) = target.reflectance {
            check_reflectance("target.reflectance", reflectance)?;
        }
        if let Some(board) = target.board {
            check_board(board)?;
        }
        for (k, patch) in target.patches.iter().enumerate() {
            check_patch(&format!("target.patches.{k}"), patch)?;
        }
    }
    let mut first_use = HashMap::new();
    for (k, frame) in session.frames.iter().enumerate() {
        let key = format!("frames.{k}");
        check_frame(&key, frame)?;
        if let Some(earlier) = first_use.insert(&frame.file, k) {
            let what = format!(
                "is {}, as in frames[{earlier}]; list every frame once",
                frame.file.display()
            );
            return problem(&format!("{key}.file"), what);
        }
    }
    Ok(())
}

fn check_frame(key: &str, frame: &FrameEntry) -> Result<(), Problem> {
    check_path(&format!("{key}.file"), &frame.file)?;
    check_positive(
        &format!("{key}.exposure_s"),
        frame.exposure_s,
        "exposure times are positive seconds",
    )?;
    check_positive(&format!("{key}.iso"), frame.iso, "sensitivities are positive, as in 100")?;
    match &frame.sha256 {
        Some(hash) if hash.len() != 64 || !hash.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            problem(
                &format!("{key}.sha256"),
                "is no SHA-256; write its 64 hexadecimal digits or remove the key".into(),
            )
        }
        _ => Ok(()),
    }
}

fn check_board(board: Board) -> Result<(), Problem> {
    let counts = [("columns", board.columns), ("rows", board.rows)];
    for (name, count) in counts {
        if !(2..=1000).contains(&count) {
            let what = format!("is {count}; count the inner corners, 2 at least");
            return problem(&format!("target.board.{name}"), what);
        }
    }
    check_positive(
        "target.board.square_mm",
        board.square_mm,
        "the side of a square is positive millimetres",
    )
}

fn check_patch(key: &str, patch: &Patch) -> Result<(), Problem> {
    let [u0, v0, u1, v1] = patch.rect_px;
    if !(u0 >= 0.0 && v0 >= 0.0 && u0 < u1 && v0 < v1) {
        let what =
            format!("is [{u0}, {v0}, {u1}, {v1}]; write u0, v0, u1, v1 with u0 < u1 and v0 < v1");
        return problem(&format!("{key}.rect_px"), what);
    }
    check_reflectance(&format!("{key}.reflectance"), patch.reflectance)
}

fn check_reflectance(key: &str, value: f64) -> Result<(), Problem> {
    // Fluorescent paper may send back a little more than it gets in one channel.
    if value > 0.0 && value <= 1.5 {
        return Ok(());
    }
    problem(key, format!("is {value}; reflectances are above 0 and about 1 at most, 0.99 for 99 %"))
}

/// No exposure, sensitivity or length is farther from 1 than this; beyond, products leave the range of float32.
const RANGE: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

fn check_positive(key: &str, value: f64, rule: &str) -> Result<(), Problem> {
    if RANGE.contains(&value) { Ok(()) } else { problem(key, format!("is {value}; {rule}")) }
}

fn check_path(key: &str, path: &Path) -> Result<(), Problem> {
    inside_folder(&path.to_string_lossy()).map(drop).map_err(|what| (key.to_owned(), what))
}

fn problem(key: &str, what: String) -> Result<(), Problem> {
    Err((key.to_owned(), what))
}

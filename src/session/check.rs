//! What a manifest may say beyond its types: the first problem.

use super::{Board, FrameEntry, Patch, Session};
use crate::files::inside_folder;
use crate::quantity::{
    EXPOSURE_S, ISO, LAB_AB, LAB_L, PATCH_PX, Problem, REFLECTANCE, SQUARE_MM, SURFACE_MM,
    check_corners,
};
use std::collections::HashMap;
use std::path::Path;
use weavelight_calibration::description::Plane;

/// Everything that a manifest must satisfy whatever command reads it.
pub(super) fn check_manifest(session: &Session) -> Result<(), Problem> {
    if let Some(mask) = &session.mask {
        check_path("mask", mask)?;
    }
    session.plane.as_ref().map_or(Ok(()), check_plane)?;
    if let Some(target) = &session.target {
        if let Some(reflectance) = target.reflectance {
            REFLECTANCE.at("target.reflectance", reflectance)?;
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
            return Err(Problem::new(format!("{key}.file"), what));
        }
    }
    Ok(())
}

fn check_frame(key: &str, frame: &FrameEntry) -> Result<(), Problem> {
    check_path(&format!("{key}.file"), &frame.file)?;
    EXPOSURE_S.at(&format!("{key}.exposure_s"), frame.exposure_s)?;
    ISO.at(&format!("{key}.iso"), frame.iso)?;
    match &frame.sha256 {
        Some(hash) if hash.len() != 64 || !hash.bytes().all(|byte| byte.is_ascii_hexdigit()) => {
            let what = "is no SHA-256; write its 64 hexadecimal digits or remove the key";
            Err(Problem::new(format!("{key}.sha256"), what))
        }
        _ => Ok(()),
    }
}

fn check_board(board: Board) -> Result<(), Problem> {
    check_corners("target.board.columns", board.columns)?;
    check_corners("target.board.rows", board.rows)?;
    SQUARE_MM.at("target.board.square_mm", board.square_mm)
}

fn check_patch(key: &str, patch: &Patch) -> Result<(), Problem> {
    let [u0, v0, u1, v1] = patch.rect_px;
    PATCH_PX.all_at(&format!("{key}.rect_px"), &patch.rect_px)?;
    if !(u0 < u1 && v0 < v1) {
        let what =
            format!("is [{u0}, {v0}, {u1}, {v1}]; write u0, v0, u1, v1 with u0 < u1 and v0 < v1");
        return Err(Problem::new(format!("{key}.rect_px"), what));
    }
    if let Some([l, a, b]) = patch.lab_d50 {
        let key = format!("{key}.lab_d50");
        LAB_L.at(&format!("{key}.0"), l)?;
        LAB_AB.at(&format!("{key}.1"), a)?;
        LAB_AB.at(&format!("{key}.2"), b)?;
    }
    REFLECTANCE.at(&format!("{key}.reflectance"), patch.reflectance)
}

fn check_plane(plane: &Plane) -> Result<(), Problem> {
    SURFACE_MM.all_at("plane.point_mm", plane.point_mm.coords.as_slice())
}

fn check_path(key: &str, path: &Path) -> Result<(), Problem> {
    inside_folder(&path.to_string_lossy()).map(drop).map_err(|what| Problem::new(key, what))
}

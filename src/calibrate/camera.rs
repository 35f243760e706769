//! `calibrate camera`: intrinsics, distortion and the table's pose from pictures of a chessboard.

use super::boards::{self, Corners, shape_of};
use super::frames::{check_size, grey_picture};
use super::inputs::{check_out, fingerprint, load_all};
use super::plausible::check_camera;
use super::{CalibrateError, Inputs, Progress};
use crate::files::{Provenance, begin_owned, check_output_folder};
use crate::instrument::{CAMERA_FILE, MeasuredCamera, Optics, Rig, write_camera};
use crate::session::{Board, FrameEntry, Kind, Session};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use weavelight_calibration::board::{BoardShape, BoardView, NoBoard, camera_on_table, coverage};
use weavelight_calibration::description::{Camera, Plane};

/// What to calibrate from.
#[derive(Clone, Debug)]
pub struct CameraOptions {
    /// `rig.toml`.
    pub rig: PathBuf,
    /// Board capture sessions.
    pub sessions: Vec<PathBuf>,
    /// The calibration folder to add to.
    pub out: PathBuf,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct CameraReport {
    /// fx, fy, cx, cy in pixels.
    pub intrinsics_px: [f64; 4],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// One sigma of the four and of the five.
    pub sigma: [f64; 9],
    /// One sigma of the camera's pose over the table: rotation about its x, y, z in degrees, and place in millimetres.
    pub pose_sigma: [f64; 6],
    /// Root mean square reprojection error over the boards kept.
    pub rms_reprojection_px: f64,
    /// Every picture of the board.
    pub boards: Vec<BoardReport>,
    /// Corners in each field of a grid over the picture, row by row.
    pub coverage: Vec<usize>,
    /// Fields across and down.
    pub coverage_grid: [usize; 2],
    /// Camera above the table, millimetres.
    pub height_mm: f64,
    /// Sentences.
    pub warnings: Vec<String>,
}

/// One picture of the board.
#[derive(Clone, Debug, Serialize)]
pub struct BoardReport {
    /// Its file, below the capture session.
    pub file: String,
    /// Reprojection error, where it was found.
    pub rms_px: Option<f64>,
    /// Why it was left out.
    pub dropped: Option<String>,
}

pub(super) const COVERAGE_GRID: [usize; 2] = [8, 6];

/// One picture to look for the board in.
struct Picture<'a> {
    session: &'a Session,
    entry: &'a FrameEntry,
}

impl Picture<'_> {
    fn path(&self) -> PathBuf {
        self.session.frame_path(self.entry)
    }

    fn name(&self) -> String {
        format!("{}/{}", self.session.name, self.entry.file.display())
    }
}

/// Calibrates the camera and writes `camera.toml`.
///
/// # Errors
/// Where a frame or the board cannot be read, the boards do not carry a camera, or the file cannot be written.
pub fn camera(
    options: &CameraOptions,
    progress: &Progress,
) -> Result<CameraReport, CalibrateError> {
    check_output_folder(&options.out)?;
    let rig = Rig::load(&options.rig)?;
    check_out(&options.out)?;
    let sessions = load_all(&options.sessions, Kind::Board)?;
    let _lock = begin_owned(&options.out, "calibrate camera", &[CAMERA_FILE])?;
    let board = common_board(&sessions)?;
    let shape = shape_of(&board);
    let pictures: Vec<Picture> = sessions
        .iter()
        .flat_map(|session| session.frames.iter().map(move |entry| Picture { session, entry }))
        .collect();
    let size = [rig.camera.width_px, rig.camera.height_px];
    progress(0.0, "looking for the board");
    let looked = find_all(&pictures, &shape, &options.rig, size, progress)?;
    let found = without_copies(&pictures, &looked);
    if found.iter().all(Result::is_err) {
        return Err(none_found(&pictures, &looked, &shape));
    }
    let table = table_picture(&pictures);
    let used: Vec<usize> = (0..pictures.len()).filter(|k| found[*k].is_ok()).collect();
    let optics = one_optics(&pictures, &looked)?;
    let views: Vec<Corners> = found.iter().flatten().cloned().collect();
    progress(0.8, "fitting the camera");
    let (fit, kept, dropped) = boards::fit(&views, &shape, size)?;
    check_camera(&sessions[0].manifest_path(), &fit, size)?;
    let pictures_kept: Vec<usize> = kept.iter().map(|view| used[*view]).collect();
    let Some(table_view) = pictures_kept.iter().position(|k| *k == table) else {
        let what =
            "the board on the table was not found, or not read well enough to fix the rig frame";
        let remedy =
            "photograph it again: flat on the table, centred, whole and sharp in the picture";
        return Err(CalibrateError::target(pictures[table].path(), what, remedy));
    };
    let plane = pictures[table].session.plane.clone().unwrap_or_else(Plane::table);
    let camera = camera_on_table(&fit, table_view, &plane, size);
    let mut boards: Vec<BoardReport> =
        pictures.iter().zip(&found).map(|(picture, found)| not_found(picture, found)).collect();
    for (view, rms) in kept.iter().zip(&fit.view_rms_px) {
        boards[used[*view]] =
            BoardReport { file: pictures[used[*view]].name(), rms_px: Some(*rms), dropped: None };
    }
    for outlier in &dropped {
        boards[used[outlier.view]] =
            outlier_report(&pictures[used[outlier.view]], outlier.rms_px, outlier.typical_px);
    }
    let kept_views: Vec<BoardView> = kept.iter().map(|view| views[*view].refined.clone()).collect();
    let mut report = CameraReport {
        intrinsics_px: fit.intrinsics,
        distortion: fit.distortion,
        sigma: fit.sigma,
        pose_sigma: pose_sigma(fit.pose_sigma.get(table_view)),
        rms_reprojection_px: fit.rms_px,
        boards,
        coverage: coverage(&kept_views, size, COVERAGE_GRID),
        coverage_grid: COVERAGE_GRID,
        height_mm: centre_height(&camera),
        warnings: Vec::new(),
    };
    report.warnings = warnings(&report, &rig, size);
    let provenance = Provenance::of_this_program(
        Some(jiff::Timestamp::now()),
        Inputs::of(&options.rig, &sessions)?,
        quality(&report),
    );
    let measured = MeasuredCamera { camera, rms_reprojection_px: Some(fit.rms_px), optics };
    write_camera(&options.out, &measured, &provenance)?;
    progress(1.0, "done");
    Ok(report)
}

/// All capture sessions must show the same board.
fn common_board(sessions: &[Session]) -> Result<Board, CalibrateError> {
    let mut common = None;
    for session in sessions {
        let place = session.manifest_path();
        let Some(board) = session.target.as_ref().and_then(|target| target.board) else {
            let remedy =
                "add board = { columns = ..., rows = ..., square_mm = ... } (inner corners)";
            return Err(CalibrateError::target(place, "[target] names no board", remedy));
        };
        if common.is_some_and(|common| common != board) {
            let remedy = "calibrate from pictures of one board";
            return Err(CalibrateError::target(
                place,
                "this board differs from the other sessions'",
                remedy,
            ));
        }
        common = Some(board);
    }
    common.ok_or_else(|| {
        CalibrateError::target(
            "",
            "no capture session was given",
            "name at least one board capture session",
        )
    })
}

/// What was seen in one picture.
struct Looked {
    board: Result<Corners, NoBoard>,
    optics: Optics,
    fingerprint: u64,
}

fn find_all(
    pictures: &[Picture],
    shape: &BoardShape,
    rig: &Path,
    size: [usize; 2],
    progress: &Progress,
) -> Result<Vec<Looked>, CalibrateError> {
    let done = std::sync::atomic::AtomicUsize::new(0);
    let tell = |done: usize| {
        progress(0.8 * done as f64 / pictures.len() as f64, "looking for the board");
    };
    pictures
        .par_iter()
        .with_max_len(1)
        .map(|picture| {
            let frame = picture.session.frame(picture.entry)?;
            check_size(&picture.path(), &frame, rig, size)?;
            let tick = || tell(done.load(std::sync::atomic::Ordering::Relaxed));
            let board = boards::detect(&grey_picture(&frame), shape, &tick)?;
            tell(1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
            let optics = Optics::of(&frame.metadata);
            Ok(Looked { board, optics, fingerprint: fingerprint(&frame) })
        })
        .collect()
}

/// The corners in every picture, or why there are none. A copy of an earlier picture does not count a second time.
fn without_copies(pictures: &[Picture], looked: &[Looked]) -> Vec<Result<Corners, String>> {
    let of_picture = |(k, one): (usize, &Looked)| {
        let earlier = looked[..k].iter().position(|other| other.fingerprint == one.fingerprint);
        let board = one.board.clone().map_err(|cause| cause.to_string())?;
        match earlier {
            Some(earlier) => Err(format!("it is the same picture as {}", pictures[earlier].name())),
            None => Ok(board),
        }
    };
    looked.iter().enumerate().map(of_picture).collect()
}

/// The camera and lens of all pictures, which must be one and the same.
fn one_optics(pictures: &[Picture], looked: &[Looked]) -> Result<Optics, CalibrateError> {
    let Some(first) = looked.first() else { return Ok(Optics::default()) };
    for (picture, other) in pictures.iter().zip(looked) {
        if let Some(what) = first.optics.differences(&other.optics).first() {
            let what = format!("{what} ({})", pictures[0].name());
            let remedy = "photograph all boards with one camera and lens at one focal length";
            return Err(CalibrateError::target(picture.path(), what, remedy));
        }
    }
    Ok(first.optics.clone())
}

/// Radians to degrees; not known where the fit does not say.
fn pose_sigma(of_table: Option<&[f64; 6]>) -> [f64; 6] {
    let sigma = of_table.copied().unwrap_or([f64::NAN; 6]);
    std::array::from_fn(|k| if k < 3 { sigma[k].to_degrees() } else { sigma[k] })
}

/// Says what the first picture shows, and whether the board has another size than stated.
fn none_found(pictures: &[Picture], looked: &[Looked], shape: &BoardShape) -> CalibrateError {
    let (columns, rows) = (shape.columns, shape.rows);
    let Some(first) = pictures.first() else {
        let remedy = "photograph the board";
        return CalibrateError::target(".", "no picture was given", remedy);
    };
    let place = first.session.manifest_path();
    let what = format!("no picture shows a complete board of {columns} x {rows} inner corners");
    if let Some((k, [columns, rows])) = other_size(looked) {
        let remedy = format!(
            "{} shows one of {columns} x {rows}: correct columns and rows",
            pictures[k].name()
        );
        return CalibrateError::target(place, what, remedy);
    }
    let causes = pictures.iter().zip(looked);
    let cause =
        causes.filter_map(|(picture, looked)| Some((picture, looked.board.as_ref().err()?)));
    let cause = cause.map(|(picture, cause)| format!(" ({}: {cause})", picture.name())).next();
    let cause = cause.unwrap_or_default();
    let remedy = "check columns and rows (inner corners, one less than squares), and photograph the whole board, sharp and evenly lit";
    CalibrateError::target(place, what + &cause, remedy)
}

/// The first picture that shows a larger board, else the first of several that show one and the same smaller one whole.
fn other_size(looked: &[Looked]) -> Option<(usize, [usize; 2])> {
    let causes = || looked.iter().map(|looked| looked.board.as_ref().err()).enumerate();
    let larger = causes().find_map(|(k, cause)| match cause? {
        NoBoard::Larger(size) => Some((k, *size)),
        _ => None,
    });
    let whole: Vec<(usize, [usize; 2])> = causes()
        .filter_map(|(k, cause)| match cause? {
            NoBoard::Covered(size) | NoBoard::Glare(size) => Some((k, *size)),
            _ => None,
        })
        .collect();
    let alike = whole.len() >= 2 && whole.iter().all(|(_, size)| *size == whole[0].1);
    larger.or_else(|| whole.first().copied().filter(|_| alike))
}

/// The frame with `pose = "table"`, else the first one listed.
fn table_picture(pictures: &[Picture]) -> usize {
    pictures.iter().position(|p| p.entry.pose.as_deref() == Some("table")).unwrap_or(0)
}

fn not_found(picture: &Picture, found: &Result<Corners, String>) -> BoardReport {
    BoardReport { file: picture.name(), rms_px: None, dropped: found.as_ref().err().cloned() }
}

fn outlier_report(picture: &Picture, rms_px: f64, typical_px: f64) -> BoardReport {
    let why = format!(
        "its corners are off by {rms_px:.2} px where {typical_px:.2} px is usual: moved, blurred, bent or misread"
    );
    BoardReport { file: picture.name(), rms_px: Some(rms_px), dropped: Some(why) }
}

fn centre_height(camera: &Camera) -> f64 {
    camera.camera_from_rig.inverse_transform_point(&nalgebra::Point3::origin()).z
}

/// Departure of height or focal length from the rig's that deserves a word.
const RULER_TOLERANCE: f64 = 0.1;

fn warnings(report: &CameraReport, rig: &Rig, size: [usize; 2]) -> Vec<String> {
    let mut out: Vec<String> = report
        .boards
        .iter()
        .filter_map(|board| {
            board.dropped.as_ref().map(|why| format!("{} was left out: {why}", board.file))
        })
        .collect();
    let empty = report.coverage.iter().filter(|count| **count == 0).count();
    if empty * 4 > report.coverage.len() {
        out.push(format!(
            "no corner lies in {empty} of {} fields of the picture; photograph the board near the edges and corners too",
            report.coverage.len()
        ));
    }
    let [fx, fy, ..] = report.intrinsics_px;
    if report.sigma[0] > 1e-3 * fx || report.sigma[1] > 1e-3 * fy {
        out.push("the focal length is uncertain by more than 0.1 %; add boards tilted by 30 to 40 degrees".to_owned());
    }
    if let Some(height) =
        rig.camera.height_mm.filter(|h| (report.height_mm / h - 1.0).abs() > RULER_TOLERANCE)
    {
        out.push(format!(
            "the camera stands {:.0} mm over the table, the rig file says {height:.0}; check square_mm and the ruler",
            report.height_mm
        ));
    }
    if let (Some(focal), Some(pitch)) = (rig.camera.focal_length_mm, rig.camera.pixel_pitch_um) {
        let expected = focal / pitch * 1000.0;
        if (fx / expected - 1.0).abs() > RULER_TOLERANCE {
            out.push(format!(
                "the focal length is {fx:.0} px, the rig file's lens gives {expected:.0} at {} x {}; is this the lens of the rig?",
                size[0], size[1]
            ));
        }
    }
    out
}

fn quality(report: &CameraReport) -> toml::Table {
    let kept = report.boards.iter().filter(|board| board.dropped.is_none()).count();
    let mut table = toml::Table::new();
    table.insert("boards_kept".into(), toml::Value::Integer(kept as i64));
    table
        .insert("boards_dropped".into(), toml::Value::Integer((report.boards.len() - kept) as i64));
    let names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    for (name, sigma) in names.iter().zip(report.sigma) {
        table.insert(format!("{name}_sigma"), toml::Value::Float(sigma));
    }
    let names = ["rotation_x", "rotation_y", "rotation_z", "x", "y", "z"];
    for (k, (name, sigma)) in names.iter().zip(report.pose_sigma).enumerate() {
        let unit = if k < 3 { "deg" } else { "mm" };
        if sigma.is_finite() {
            table.insert(format!("{name}_sigma_{unit}"), toml::Value::Float(sigma));
        }
    }
    let counts = report.coverage.iter().map(|count| toml::Value::Integer(*count as i64)).collect();
    table.insert("coverage_8x6".into(), toml::Value::Array(counts));
    table
}

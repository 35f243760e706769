//! `camera.toml`: the keys of the format, to and from [`Camera`].

use super::Optics;
use crate::files::{Document, FileError, Provenance, ProvenanceTable, write_owned_toml};
use crate::quantity::{
    CAMERA_HEIGHT_MM, DISTORTION, FOCAL_LENGTH_MM, FOCAL_LENGTH_PX, PLACE_MM, PRINCIPAL_POINT_PX,
    Problem, REPROJECTION_PX, check_side,
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use weavelight_calibration::description::Camera;

/// The schema of `camera.toml` that this version reads and writes.
const SCHEMA: i64 = 1;

/// The file's name in a calibration folder.
pub const CAMERA_FILE: &str = "camera.toml";

/// How far a rotation's rows may be from unit length and right angles: digits rounded off by hand, not a mistake.
const ROTATION_SLACK: f64 = 1e-3;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    schema: i64,
    width_px: usize,
    height_px: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    distortion: [f64; 5],
    /// Rows; camera from rig.
    rotation: [[f64; 3]; 3],
    translation_mm: [f64; 3],
    rms_reprojection_px: Option<f64>,
    camera_model: Option<String>,
    lens: Option<String>,
    focal_length_mm: Option<f64>,
    #[serde(default)]
    provenance: ProvenanceTable,
}

/// A camera and what is known of its measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredCamera {
    /// The camera.
    pub camera: Camera,
    /// Root mean square distance of the board's corners from where the model puts them.
    pub rms_reprojection_px: Option<f64>,
    /// The camera and lens that took the boards.
    pub optics: Optics,
}

impl MeasuredCamera {
    /// A camera of which nothing else is known.
    pub fn new(camera: Camera) -> Self {
        Self { camera, rms_reprojection_px: None, optics: Optics::default() }
    }
}

/// What the file holds.
pub(super) struct Read {
    pub(super) measured: MeasuredCamera,
    pub(super) provenance: Provenance,
}

/// The folder's camera, or `None` where there is no such file.
pub(super) fn read(folder: &Path) -> Result<Option<Read>, FileError> {
    let path = folder.join(CAMERA_FILE);
    if !path.exists() {
        return Ok(None);
    }
    let document = Document::read(&path)?;
    let file: CameraFile = document.parse(SCHEMA)?;
    let camera = camera_from_file(&document, &file)?;
    let optics = Optics {
        camera_model: file.camera_model,
        lens: file.lens,
        focal_length_mm: file.focal_length_mm,
    };
    let measured = MeasuredCamera { camera, rms_reprojection_px: file.rms_reprojection_px, optics };
    Ok(Some(Read { measured, provenance: file.provenance.into() }))
}

/// Writes `camera.toml` into a calibration folder, which is made where absent.
///
/// # Errors
/// Where it cannot be written, would not be read back, or a `camera.toml` stands there that is not as the program wrote it.
pub fn write_camera(
    folder: &Path,
    measured: &MeasuredCamera,
    provenance: &Provenance,
) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::write(folder, source))?;
    let MeasuredCamera { camera, rms_reprojection_px, optics } = measured;
    let pose = &camera.camera_from_rig;
    let file = CameraFile {
        schema: SCHEMA,
        width_px: camera.width_px,
        height_px: camera.height_px,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        distortion: camera.distortion,
        // nalgebra stores columns; the file has rows.
        rotation: pose.rotation.matrix().transpose().into(),
        translation_mm: pose.translation.vector.into(),
        rms_reprojection_px: *rms_reprojection_px,
        camera_model: optics.camera_model.clone(),
        lens: optics.lens.clone(),
        focal_length_mm: optics.focal_length_mm,
        provenance: provenance.into(),
    };
    let path = folder.join(CAMERA_FILE);
    check_numbers(&file).map_err(|problem| FileError::unwritable(&path, &problem))?;
    write_owned_toml(&path, &file)
}

/// What readers and writers of the format ask of its numbers.
fn check_numbers(file: &CameraFile) -> Result<(), Problem> {
    check_side("width_px", file.width_px)?;
    check_side("height_px", file.height_px)?;
    FOCAL_LENGTH_PX.at("fx", file.fx)?;
    FOCAL_LENGTH_PX.at("fy", file.fy)?;
    PRINCIPAL_POINT_PX.at("cx", file.cx)?;
    PRINCIPAL_POINT_PX.at("cy", file.cy)?;
    DISTORTION.all_at("distortion", &file.distortion)?;
    check_rotation(&file.rotation)?;
    PLACE_MM.all_at("translation_mm", &file.translation_mm)?;
    let ahead_mm = file.translation_mm[2];
    if ahead_mm <= 0.0 {
        let what = "puts the scan area behind the camera; its z must be positive";
        return Err(Problem::new("translation_mm", what));
    }
    CAMERA_HEIGHT_MM.at("translation_mm.2", ahead_mm)?;
    REPROJECTION_PX.maybe_at("rms_reprojection_px", file.rms_reprojection_px)?;
    FOCAL_LENGTH_MM.maybe_at("focal_length_mm", file.focal_length_mm)
}

fn camera_from_file(document: &Document, file: &CameraFile) -> Result<Camera, FileError> {
    check_numbers(file).map_err(|problem| document.problem(&problem))?;
    let rotation = rotation_from_rows(document, &file.rotation)?;
    let translation = Translation3::from(Vector3::from(file.translation_mm));
    Ok(Camera {
        width_px: file.width_px,
        height_px: file.height_px,
        fx: file.fx,
        fy: file.fy,
        cx: file.cx,
        cy: file.cy,
        distortion: file.distortion,
        camera_from_rig: IsometryMatrix3::from_parts(translation, rotation),
    })
}

fn rotation_from_rows(
    document: &Document,
    rows: &[[f64; 3]; 3],
) -> Result<Rotation3<f64>, FileError> {
    let stated = Matrix3::from(*rows).transpose();
    let off = off_rotation(&stated);
    // Written with enough digits it is a rotation already and stays the same to the last bit.
    if off < 1e-14 {
        return Ok(Rotation3::from_matrix_unchecked(stated));
    }
    let svd = stated.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => Ok(Rotation3::from_matrix_unchecked(u * v_t)),
        _ => Err(document.invalid("rotation", NO_ROTATION)),
    }
}

const NO_ROTATION: &str =
    "is no rotation; its rows must be unit vectors at right angles, right-handed";

fn check_rotation(rows: &[[f64; 3]; 3]) -> Result<(), Problem> {
    let stated = Matrix3::from(*rows).transpose();
    // Written so that NaN, of numbers whose squares overflow, is no rotation.
    if off_rotation(&stated) <= ROTATION_SLACK && stated.determinant() > 0.0 {
        return Ok(());
    }
    Err(Problem::new("rotation", NO_ROTATION))
}

/// How far a matrix is from a rotation.
fn off_rotation(stated: &Matrix3<f64>) -> f64 {
    (stated * stated.transpose() - Matrix3::identity()).abs().max()
}

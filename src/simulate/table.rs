//! What lies on the simulated table: the swatch, or a calibration target in one of the poses in which a technician lays it.

use super::targets;
use super::{Instrument, Scene, SimulateError};
use crate::files::{Document, FileError};
use crate::instrument::Rig;
use crate::session::Target;
use nalgebra::IsometryMatrix3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use weavelight_calibration::description::Plane;
use weavelight_sim::render::Subject;
use weavelight_sim::target::{Art, Chart, Panel, board_poses, sheet_pose};

/// What lies on the table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Lying {
    /// The fabric.
    #[default]
    Swatch,
    /// The chessboard, in the poses that `simulate` photographs: 0 flat and centred, the others held this way and that.
    Board {
        /// Which.
        pose: usize,
    },
    /// The grey and colour chart, flat.
    Grey,
    /// The white sheet.
    White {
        /// Its middle over the table, millimetres.
        height_mm: f64,
        /// Its tilt, degrees.
        tilt_deg: f64,
        /// Where it then faces, degrees: 0 is the picture's right, 90 its top.
        towards_deg: f64,
    },
}

/// What a technician knows of what lies there: what the capture session will say.
#[derive(Clone, Debug, PartialEq)]
pub struct Laid {
    /// `[target]`; `None` for a swatch.
    pub target: Option<Target>,
    /// `[plane]`; `None` for the table itself, and for a board that is held in the air.
    pub plane: Option<Plane>,
}

/// `[table]`
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableTable {
    lies: String,
    pose: Option<usize>,
    height_mm: Option<f64>,
    tilt_deg: Option<f64>,
    towards_deg: Option<f64>,
}

/// Heights of a white sheet that can be simulated, millimetres.
const HEIGHTS_MM: [f64; 2] = [0.0, 300.0];
/// And tilts, degrees.
const TILTS_DEG: [f64; 2] = [0.0, 45.0];

/// Lays something on the table of the simulated rig whose file is `rig`: `scene.toml` beside it says so from now on. What
/// comes back is what the technician then knows.
///
/// # Errors
/// Where the rig or its scene cannot be read or written, or the target cannot be seen whole.
pub fn lay(rig: &Path, lying: Lying) -> Result<Laid, SimulateError> {
    let mut scene = Scene::beside(rig)?;
    scene.table = lying;
    let instrument = scene.instrument(&Rig::load(rig)?)?;
    let laid = scene.laid(&instrument)?;
    scene.save(rig.parent().unwrap_or(Path::new(".")))?;
    Ok(laid)
}

impl Scene {
    /// What the camera sees.
    ///
    /// # Errors
    /// Where the target cannot be seen whole.
    pub fn subject(
        &self,
        instrument: &Instrument,
    ) -> Result<Box<dyn Subject + Send>, SimulateError> {
        Ok(match self.panel(instrument)? {
            Some(panel) => Box::new(panel),
            None => Box::new(self.fabric()),
        })
    }

    /// The calibration target, if one lies there.
    fn panel(&self, instrument: &Instrument) -> Result<Option<Panel>, SimulateError> {
        let (options, view) = (self.options(), &instrument.stage.view);
        let (rig_from_panel, art) = match self.table {
            Lying::Swatch => return Ok(None),
            Lying::Board { pose } => {
                let board = targets::board(&options, view);
                let thickness_mm = options.targets.board_thickness_mm;
                let count = options.targets.boards;
                let poses = board_poses(&board, view, thickness_mm, count, self.seed);
                if !board.fits(view, &poses[0]) {
                    return Err(SimulateError::NoBoard { part: "board".to_owned() });
                }
                (poses[pose.min(poses.len() - 1)], Art::Board(board))
            }
            Lying::Grey => (IsometryMatrix3::identity(), Art::Chart(Chart::filling(view))),
            Lying::White { height_mm, tilt_deg, towards_deg } => {
                let pose = sheet_pose(height_mm, tilt_deg, towards_deg);
                (pose, Art::Sheet(targets::sheet(&options, view, 0)?))
            }
        };
        Ok(Some(Panel { rig_from_panel, art }))
    }

    fn laid(&self, instrument: &Instrument) -> Result<Laid, SimulateError> {
        let Some(panel) = self.panel(instrument)? else {
            return Ok(Laid { target: None, plane: None });
        };
        let target = match &panel.art {
            Art::Board(board) => {
                Target { board: Some(targets::stated(board)), ..Target::default() }
            }
            Art::Chart(chart) => Target {
                patches: targets::stated_patches(chart, &instrument.stage.view),
                ..Target::default()
            },
            Art::Sheet(sheet) => Target {
                reflectance: Some(sheet.reflectance),
                board: sheet.strip.map(|(board, _)| targets::stated(&board)),
                ..Target::default()
            },
        };
        let on_table = panel.rig_from_panel == IsometryMatrix3::identity();
        let measured = matches!(self.table, Lying::White { .. }) && !on_table;
        Ok(Laid { target: Some(target), plane: measured.then(|| panel.plane()) })
    }
}

pub(super) fn lying_from_table(
    document: &Document,
    table: Option<&TableTable>,
) -> Result<Lying, FileError> {
    let Some(table) = table else { return Ok(Lying::Swatch) };
    let within = |key: &str, value: Option<f64>, [least, most]: [f64; 2]| {
        let value = value.unwrap_or(0.0);
        let what = || format!("is {value}; give a number from {least} to {most}");
        if value >= least && value <= most {
            return Ok(value);
        }
        Err(document.invalid(&format!("table.{key}"), &what()))
    };
    Ok(match table.lies.as_str() {
        "swatch" => Lying::Swatch,
        "board" => {
            let (pose, count) = (table.pose.unwrap_or(0), super::Targets::default().boards);
            if pose >= count {
                let what = format!("is {pose}; the board has poses 0 to {}", count - 1);
                return Err(document.invalid("table.pose", &what));
            }
            Lying::Board { pose }
        }
        "grey" => Lying::Grey,
        "white" => Lying::White {
            height_mm: within("height_mm", table.height_mm, HEIGHTS_MM)?,
            tilt_deg: within("tilt_deg", table.tilt_deg, TILTS_DEG)?,
            towards_deg: within("towards_deg", table.towards_deg, [-360.0, 360.0])?,
        },
        other => {
            let what = format!("is \"{other}\"; swatch, board, grey or white can lie there");
            return Err(document.invalid("table.lies", &what));
        }
    })
}

pub(super) fn table_from_lying(lying: Lying) -> Option<TableTable> {
    let lies = |name: &str| TableTable {
        lies: name.to_owned(),
        pose: None,
        height_mm: None,
        tilt_deg: None,
        towards_deg: None,
    };
    match lying {
        Lying::Swatch => None,
        Lying::Board { pose } => Some(TableTable { pose: Some(pose), ..lies("board") }),
        Lying::Grey => Some(lies("grey")),
        Lying::White { height_mm, tilt_deg, towards_deg } => Some(TableTable {
            height_mm: Some(height_mm),
            tilt_deg: Some(tilt_deg),
            towards_deg: Some(towards_deg),
            ..lies("white")
        }),
    }
}

//! What is photographed, and with which exposures.

use super::targets::{self, sheet_poses};
use super::write::{Picture, Pictures, write_session};
use super::{Instrument, Options, Part, SimulateError, truth};
use crate::session::{Kind, Session, Target};
use nalgebra::{IsometryMatrix3, Point3, Vector3};
use std::path::Path;
use weavelight_calibration::description::Plane;
use weavelight_sim::render::{
    Frames, Shot, Stage, Subject, auto_exposure, shoot, shoot_with_truth,
};
use weavelight_sim::target::{Art, Chart, Panel, board_poses};

/// Options, instrument and where to write.
pub(super) struct Studio<'a> {
    pub(super) options: &'a Options,
    pub(super) instrument: &'a Instrument,
    pub(super) folder: &'a Path,
}

/// One capture session to make.
pub(super) struct PartPlan {
    pub(super) part: Part,
    /// Its folder's name.
    pub(super) name: String,
    /// Which of the parts it is: keeps their noise apart.
    index: usize,
    /// For white sheets: which pose.
    pose: usize,
}

/// What came of a part.
pub(super) struct Written {
    pub(super) frames: usize,
    pub(super) exposure_s: f64,
}

/// Share of the range that the brightest light's brightest photosites reach: on cloth, which is rough, and on targets.
const SWATCH_LEVEL: f64 = 0.5;
const TARGET_LEVEL: f64 = 0.6;
const SWATCH_QUANTILE: f64 = 0.995;
const TARGET_QUANTILE: f64 = 0.999;
/// Exposures of the light that is taken at several, relative to the common one.
const LINEARITY_STEPS: [f64; 6] = [0.03125, 0.0625, 0.125, 0.25, 0.5, 1.5];
/// The room's light on a chessboard, per channel.
const ROOM_LIGHT: [f64; 3] = [0.6, 1.0, 0.55];
/// Room between the shots' numbers of two parts.
const SHOTS_PER_PART: u64 = 10_000;

impl Studio<'_> {
    /// The capture sessions that were asked for.
    pub(super) fn parts(&self) -> Vec<PartPlan> {
        let one = |part: Part| (part, part.name().to_owned(), 0);
        let sheets = sheet_poses(self.options).into_iter().enumerate().map(|(pose, (name, _))| {
            let part = match pose {
                0 => Part::WhiteFlat,
                1 => Part::WhiteRaised,
                _ => Part::WhiteTilt,
            };
            (part, name, pose)
        });
        [one(Part::Board), one(Part::Grey)]
            .into_iter()
            .chain(sheets)
            .chain([one(Part::Swatch)])
            .enumerate()
            .map(|(index, (part, name, pose))| PartPlan { part, name, index, pose })
            .filter(|plan| self.options.wants(plan.part))
            .collect()
    }

    /// Makes one capture session.
    pub(super) fn photograph(
        &self,
        plan: &PartPlan,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Written, SimulateError> {
        match plan.part {
            Part::Board => self.board(plan, progress),
            Part::Grey => self.grey(plan, progress),
            Part::WhiteFlat | Part::WhiteRaised | Part::WhiteTilt => self.white(plan, progress),
            Part::Swatch => self.swatch(plan, progress),
        }
    }

    fn session(&self, plan: &PartPlan, kind: Kind) -> Session {
        let name = match plan.part {
            Part::Swatch => self.options.material.preset.name().to_owned(),
            _ => plan.name.clone(),
        };
        Session::new(self.folder.join(&plan.name), kind, name)
    }

    fn board(
        &self,
        plan: &PartPlan,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Written, SimulateError> {
        let stage =
            Stage { lights: Vec::new(), ambient: ROOM_LIGHT, ..self.instrument.stage.clone() };
        let (targets, view) = (&self.options.targets, &stage.view);
        let board = targets::board(self.options, view);
        let poses = board_poses(
            &board,
            view,
            targets.board_thickness_mm,
            targets.boards,
            self.options.seed,
        );
        if !board.fits(view, &poses[0]) {
            return Err(SimulateError::NoBoard { part: plan.name.clone() });
        }
        let panel =
            |pose: &IsometryMatrix3<f64>| Panel { rig_from_panel: *pose, art: Art::Board(board) };
        let exposure = self.meter(plan, &panel(&poses[0]), &stage, &[])?;
        let mut frames = Frames::new();
        for (k, pose) in poses.iter().enumerate() {
            let shot = self.shot(plan, k, None, exposure);
            let share = |s: f64| progress((k as f64 + s) / poses.len() as f64);
            frames.extend(shoot(&panel(pose), &stage, &self.instrument.sensor, &[shot], &share));
        }
        let mut session = self.session(plan, Kind::Board);
        session.target = Some(Target { board: Some(targets::stated(&board)), ..Target::default() });
        session.plane = level_plane(targets.board_thickness_mm);
        let pictures = (0..poses.len()).map(|k| Picture {
            pose: (k == 0).then(|| "table".to_owned()),
            ..Picture::new(format!("board-{k:02}"), None, exposure)
        });
        self.write(session, plan, frames, pictures.collect(), exposure)
    }

    fn grey(
        &self,
        plan: &PartPlan,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Written, SimulateError> {
        let stage = &self.instrument.stage;
        let chart = Chart::filling(&stage.view);
        let patches = targets::stated_patches(&chart, &stage.view);
        let panel = Panel { rig_from_panel: IsometryMatrix3::identity(), art: Art::Chart(chart) };
        let exposure = self.meter(plan, &panel, stage, &self.all_lights())?;
        let mut pictures = self.one_of_each(exposure);
        pictures.extend(LINEARITY_STEPS.iter().enumerate().map(|(k, step)| {
            let exposure = (exposure * step * 1e6).round() / 1e6;
            Picture::new(format!("light-00-exposure-{k}"), Some(0), exposure)
        }));
        let frames = self.shoot(plan, &panel, &pictures, progress);
        let mut session = self.session(plan, Kind::Grey);
        session.target = Some(Target { patches, ..Target::default() });
        self.write(session, plan, frames, pictures, exposure)
    }

    fn white(
        &self,
        plan: &PartPlan,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Written, SimulateError> {
        let stage = &self.instrument.stage;
        let sheet = targets::sheet(self.options, &stage.view, plan.pose)?;
        let (_, pose) = sheet_poses(self.options).swap_remove(plan.pose);
        let strip = sheet.strip.map(|(board, _)| targets::stated(&board));
        let panel = Panel { rig_from_panel: pose, art: Art::Sheet(sheet) };
        let exposure = self.meter(plan, &panel, stage, &self.all_lights())?;
        let pictures = self.one_of_each(exposure);
        let frames = self.shoot(plan, &panel, &pictures, progress);
        let mut session = self.session(plan, Kind::White);
        session.target =
            Some(Target { reflectance: Some(targets::WHITE), board: strip, ..Target::default() });
        let on_table = plan.part == Part::WhiteFlat;
        session.plane = (self.options.targets.state_planes && !on_table).then(|| panel.plane());
        self.write(session, plan, frames, pictures, exposure)
    }

    fn swatch(
        &self,
        plan: &PartPlan,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Written, SimulateError> {
        let stage = &self.instrument.stage;
        let fabric = self.options.fabric();
        let exposure = self.meter(plan, &fabric, stage, &self.all_lights())?;
        let pictures = self.one_of_each(exposure);
        let shots = self.shots(plan, &pictures);
        let (frames, seen) =
            shoot_with_truth(&fabric, stage, &self.instrument.sensor, &shots, progress);
        truth::write(&self.folder.join("truth"), self.instrument.size_px(), seen)?;
        let mut session = self.session(plan, Kind::Swatch);
        session.plane = level_plane(fabric.thickness_mm);
        self.write(session, plan, frames, pictures, exposure)
    }

    /// The exposure that the program would advise, times what the options ask for.
    fn meter(
        &self,
        plan: &PartPlan,
        subject: &dyn Subject,
        stage: &Stage,
        lights: &[usize],
    ) -> Result<f64, SimulateError> {
        let (quantile, level) = match plan.part {
            Part::Swatch => (SWATCH_QUANTILE, SWATCH_LEVEL),
            _ => (TARGET_QUANTILE, TARGET_LEVEL),
        };
        auto_exposure(subject, stage, lights, quantile, level)
            .map(|exposure| exposure * self.options.flaws.exposure_factor)
            .ok_or_else(|| SimulateError::Dark { part: plan.name.clone() })
    }

    fn all_lights(&self) -> Vec<usize> {
        (0..self.instrument.stage.lights.len()).collect()
    }

    /// Every light, the ambient light, and the first light again.
    fn one_of_each(&self, exposure_s: f64) -> Vec<Picture> {
        let lights = self.all_lights().into_iter();
        let mut pictures: Vec<Picture> = lights
            .map(|light| Picture::new(format!("light-{light:02}"), Some(light), exposure_s))
            .collect();
        pictures.push(Picture::new("ambient".to_owned(), None, exposure_s));
        pictures.push(Picture {
            drift_check: true,
            ..Picture::new("drift-check".to_owned(), Some(0), exposure_s)
        });
        pictures
    }

    fn shots(&self, plan: &PartPlan, pictures: &[Picture]) -> Vec<Shot> {
        let last = pictures.len().max(2) - 1;
        let shot = |(k, picture): (usize, &Picture)| {
            let strength = 1.0 + self.options.flaws.drift * k as f64 / last as f64;
            Shot { strength, ..self.shot(plan, k, picture.light, picture.exposure_s) }
        };
        pictures.iter().enumerate().map(shot).collect()
    }

    /// What really happens when a light is asked for.
    fn shot(&self, plan: &PartPlan, k: usize, light: Option<usize>, exposure: f64) -> Shot {
        Shot {
            light: light.and_then(|light| self.options.flaws.light_that_shines(light)),
            exposure,
            strength: 1.0,
            number: plan.index as u64 * SHOTS_PER_PART + k as u64,
        }
    }

    fn shoot(
        &self,
        plan: &PartPlan,
        subject: &dyn Subject,
        pictures: &[Picture],
        progress: &(dyn Fn(f64) + Sync),
    ) -> Frames {
        let shots = self.shots(plan, pictures);
        shoot(subject, &self.instrument.stage, &self.instrument.sensor, &shots, progress)
    }

    fn write(
        &self,
        session: Session,
        plan: &PartPlan,
        frames: Frames,
        pictures: Vec<Picture>,
        exposure_s: f64,
    ) -> Result<Written, SimulateError> {
        let count = frames.len();
        let pictures = Pictures { pictures, frames, part: plan.index };
        write_session(session, pictures, self.instrument)?;
        Ok(Written { frames: count, exposure_s })
    }
}

/// A level plane over the table, `None` for the table itself.
fn level_plane(height_mm: f64) -> Option<Plane> {
    (height_mm != 0.0)
        .then(|| Plane { point_mm: Point3::new(0.0, 0.0, height_mm), normal: Vector3::z_axis() })
}

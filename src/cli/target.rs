//! What `weavelight scan` photographs: a swatch, or a calibration target.

use super::output::Failure;
use crate::device::scan::{Pose, Sheet, Subject};
use crate::quantity::{REFLECTANCE, SQUARE_MM, SURFACE_MM, check_corners};
use crate::session::{Board, Target};
use clap::ValueEnum;
use nalgebra::{Point3, UnitVector3, Vector3};
use std::path::PathBuf;
use weavelight_calibration::description::Plane;

#[derive(Debug, clap::Args)]
pub(super) struct TargetArgs {
    /// What is photographed: a swatch, or a target for `weavelight calibrate`
    #[arg(long, value_enum, default_value_t = Kind::Swatch)]
    kind: Kind,
    /// The target as a [target] table describes it: a file of its own, or another session.toml
    #[arg(long, value_name = "FILE.toml")]
    target: Option<PathBuf>,
    /// Inner corners and squares of the chessboard, or of the strip beside a white sheet, as in 9x6x25
    #[arg(long, value_name = "CxRxMM", value_parser = board)]
    board: Option<Board>,
    /// Reflectance of the white sheet [default: 0.99]
    #[arg(long, value_name = "R", value_parser = |text: &str| REFLECTANCE.parse(text))]
    reflectance: Option<f64>,
    /// A point on the white sheet where that is tilted, rig frame
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    plane_point: Option<Vector3<f64>>,
    /// The direction that the white sheet faces, rig frame
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    plane_normal: Option<Vector3<f64>>,
    /// How the chessboard lies: flat and centred on the table, or anyhow [default: table for the first picture, then free]
    #[arg(long, value_enum, value_name = "POSE")]
    pose: Option<PoseName>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// A fabric
    Swatch,
    /// A white sheet under every light
    White,
    /// A grey or colour chart under every light, and under one at several exposures
    Grey,
    /// One picture of a chessboard, added to those in the capture session
    Board,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PoseName {
    Table,
    Free,
}

fn vector(text: &str) -> Result<Vector3<f64>, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|part| SURFACE_MM.parse(part).ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("write three numbers from -5000 to 5000, as in 0,0,60".to_owned()),
    }
}

fn board(text: &str) -> Result<Board, String> {
    let board = || {
        let mut parts = text.split('x');
        let columns = parts.next()?.parse().ok()?;
        let rows = parts.next()?.parse().ok()?;
        let square_mm: f64 = parts.next()?.parse().ok()?;
        let sensible = parts.next().is_none()
            && check_corners("columns", columns).is_ok()
            && check_corners("rows", rows).is_ok()
            && SQUARE_MM.check(square_mm).is_ok();
        sensible.then_some(Board { columns, rows, square_mm })
    };
    board().ok_or_else(|| {
        "write inner corners across, down, and the squares' side in mm, as in 9x6x25".to_owned()
    })
}

impl TargetArgs {
    /// Whether pictures are added to a capture session that is there.
    pub(super) fn adds(&self) -> bool {
        self.kind == Kind::Board
    }

    /// What is photographed. `light`: the light of a board's pictures; `first`: whether there is no picture of it yet.
    pub(super) fn subject(&self, light: usize, first: bool) -> Result<Subject, Failure> {
        self.check()?;
        let target = self.target.as_deref().map(Target::load).transpose().map_err(Failure::work)?;
        let target = target.unwrap_or_default();
        let board = self.board.or(target.board);
        Ok(match self.kind {
            Kind::Swatch => Subject::Swatch,
            Kind::White => Subject::White(Sheet {
                reflectance: self.reflectance.or(target.reflectance),
                plane: self.plane()?,
                strip: board,
            }),
            Kind::Grey if target.patches.is_empty() => {
                return Err(Failure::call(
                    "--kind grey: the patches are not described; name them with --target FILE.toml, a [target] table with [[target.patches]]",
                ));
            }
            Kind::Grey => Subject::Grey { patches: target.patches },
            Kind::Board => {
                let pose = match self.pose {
                    Some(PoseName::Table) => Pose::Table,
                    Some(PoseName::Free) => Pose::Free,
                    None if first => Pose::Table,
                    None => Pose::Free,
                };
                let board = board.ok_or_else(|| {
                    Failure::call("--kind board: the board is not described; give --board 9x6x25 (inner corners across and down, mm) or --target FILE.toml")
                })?;
                Subject::Board { board, pose, light }
            }
        })
    }

    /// An option that says nothing about what is photographed is a mistake.
    fn check(&self) -> Result<(), Failure> {
        let (white, board) = (self.kind == Kind::White, self.kind == Kind::Board);
        let given = [
            ("--target", self.target.is_some(), self.kind != Kind::Swatch, "a target"),
            ("--board", self.board.is_some(), white || board, "--kind board or white"),
            ("--reflectance", self.reflectance.is_some(), white, "--kind white"),
            ("--plane-point", self.plane_point.is_some(), white, "--kind white"),
            ("--plane-normal", self.plane_normal.is_some(), white, "--kind white"),
            ("--pose", self.pose.is_some(), board, "--kind board"),
        ];
        match given.into_iter().find(|(_, given, fits, _)| *given && !fits) {
            Some((option, .., what)) => Err(Failure::call(format!(
                "{option} goes with {what}; leave it out, or give the --kind that you mean"
            ))),
            None => Ok(()),
        }
    }

    fn plane(&self) -> Result<Option<Plane>, Failure> {
        let (point, normal) = match (self.plane_point, self.plane_normal) {
            (None, None) => return Ok(None),
            (point, normal) => (point.unwrap_or_default(), normal.unwrap_or_else(Vector3::z)),
        };
        let normal = UnitVector3::try_new(normal, 1e-9).filter(|normal| normal.z > 0.0);
        let normal = normal.ok_or_else(|| {
            Failure::call("--plane-normal does not point to the camera; its z must be positive")
        })?;
        Ok(Some(Plane { point_mm: Point3::from(point), normal }))
    }
}

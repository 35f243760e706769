//! Jobs of the Look room: opens solutions, and solves single photosites again.

pub mod act;
pub mod capture;
pub mod drafts;
pub mod frames;
pub mod opened;

use crate::jobs::look::capture::Sources;
use crate::jobs::look::opened::Opened;
use crate::model::settings::SolveSettings;
use crate::viewer::pyramid::Pyramid;
use crate::viewer::slopes::Distribution;
use std::path::PathBuf;
use std::sync::Arc;
use weavelight::photometry::Photosite;
use weavelight_calibration::description::Image;

/// Requests of the Look room.
#[derive(Debug)]
pub enum Command {
    /// Look at the solution in this folder.
    Open(PathBuf),
    /// Compare with the solution in this folder; the surface is the one that is looked at.
    Compare(PathBuf, Arc<Pyramid>),
    /// What the frames of a light show.
    Picture(Sources, usize),
    /// What a light measures over what the solution predicts.
    Residual(Sources, usize),
    /// Solve one photosite again: which lights does it rest on?
    Photosite(Sources, [usize; 2]),
    /// Save the mask of a capture session.
    Mask(Sources, EditedMask),
    /// The strokes in a file that were not saved.
    Draft(PathBuf),
    /// Solve the capture session in this folder, which has no solution yet, and look at that.
    SolveScan(PathBuf, SolveSettings),
    /// Solve again, into the solution's folder, and open it.
    Solve(Sources, PathBuf, SolveSettings),
}

/// A mask as it is when it is saved.
#[derive(Debug)]
pub struct EditedMask {
    /// What is inside.
    pub mask: Image<bool>,
    /// Of which picture.
    pub key: String,
    /// Which of its changes was the last one.
    pub version: u64,
}

/// Updates for the Look room.
#[derive(Debug)]
pub enum Event {
    /// A solution is there.
    Opened(Box<Opened>),
    /// Another solution to compare with.
    Other {
        /// Its name.
        name: String,
        /// Its normals.
        surface: Arc<Pyramid>,
        /// The angles between both.
        angles: Option<Distribution>,
    },
    /// A light's frames.
    Picture {
        /// The light.
        light: usize,
        /// Linear RGB, as albedo times the light vector.
        picture: Arc<Pyramid>,
    },
    /// A light's residual.
    Residual {
        /// The light.
        light: usize,
        /// Units of albedo.
        picture: Arc<Pyramid>,
    },
    /// A photosite, solved again.
    Photosite {
        /// Which.
        at: [usize; 2],
        /// `None` where that failed.
        found: Option<Box<Photosite>>,
    },
    /// The mask is on the disk: of this picture, with this last change.
    MaskSaved(String, u64),
    /// The strokes in a file, if there are some.
    Draft(PathBuf, Option<Box<Image<bool>>>),
    /// The solution of the last scan stands.
    Newest(PathBuf),
    /// A capture session that has no solution.
    Unsolved(PathBuf),
}

use crate::description::Plane;
use nalgebra::{Point3, UnitVector3};

/// What one white sheet, at one pose, showed under every light.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Name for messages.
    pub name: String,
    /// Where it lay, as well as known.
    pub plane: Plane,
    /// How well.
    pub pose_sigma: PoseSigma,
    /// Mean reflectance of the sheet.
    pub reflectance: f64,
    /// Columns and rows of the grid that the cells were cut from.
    pub grid: [usize; 2],
    /// The cells that show the sheet.
    pub cells: Vec<Cell>,
    /// `cells * lights` samples, cell by cell.
    pub samples: Vec<Sample>,
}

/// One sigma of a sheet's pose. Zero: known exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseSigma {
    /// About each axis in the sheet, radians.
    pub tilt_rad: f64,
    /// Along the normal, millimetres.
    pub offset_mm: f64,
}

/// A patch of a sheet over which the signal was averaged.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Column and row in the grid.
    pub place: [usize; 2],
    /// Centre, pixels of the frame.
    pub pixel: [f64; 2],
    /// Where the centre lies on the sheet, rig frame.
    pub point_mm: Point3<f64>,
    /// From the camera to that point, rig frame.
    pub view: UnitVector3<f64>,
}

/// Mean signal of a cell under one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// R, G, B: per second at ISO 100, black and ambient removed, fraction of the range from black to saturation. NaN where
    /// it cannot be used.
    pub signal: [f64; 3],
    /// One sigma of each, relative.
    pub relative_sigma: [f64; 3],
}

impl Sample {
    /// A sample that says nothing.
    pub const UNUSABLE: Sample = Sample { signal: [f64::NAN; 3], relative_sigma: [f64::NAN; 3] };

    /// Whether every channel carries a positive signal.
    pub fn is_usable(&self) -> bool {
        let good = |(signal, sigma): (&f64, &f64)| {
            signal.is_finite() && *signal > 0.0 && sigma.is_finite()
        };
        self.signal.iter().zip(&self.relative_sigma).all(good)
    }
}

impl Sheet {
    /// The samples of cell `cell`, one a light.
    pub fn samples_of(&self, cell: usize) -> &[Sample] {
        let lights = self.samples.len() / self.cells.len().max(1);
        &self.samples[cell * lights..(cell + 1) * lights]
    }
}

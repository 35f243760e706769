//! What the kernels share with the solve that calls them: one row in, one row out.

use nalgebra::Vector3;
use thiserror::Error;

use super::light_set::LightSet;
use super::method::MAX_LIGHTS;

/// One row of photosites, as every kernel reads it.
///
/// Symbols: y_i = rho (l_i . n) + noise, with l_i the light vector of light i (unit direction times falloff, rig frame, in
/// units of the light's own intensity), n the unit normal and rho the albedo under this photosite's colour filter.
pub struct RowInput<'a> {
    /// Per light: y, one value a photosite. Linear signal divided by exposure, ISO, the light's intensity in the
    /// photosite's channel and its gain map, ambient light removed. NaN where the sample cannot be used (saturated,
    /// dead photosite, not finite in the file, outside the mask).
    pub signal: &'a [&'a [f32]],
    /// Light vectors along this row.
    pub field: FieldRow<'a>,
    /// Per light: the variance of y at even and at odd columns (the two colour filters of the row).
    pub variance: &'a [[VarianceModel; 2]],
    /// Per photosite: what all lights' gain maps together do to the noise (1 / mean gain); `None` means 1 everywhere.
    /// The shot-noise term scales with it, the floor with its square.
    pub noise_scale: Option<&'a [f32]>,
}

/// Light vectors at equally spaced nodes of one row, linear in between. float64 because the pseudo-inverses are
/// computed here.
#[derive(Clone, Copy)]
pub struct FieldRow<'a> {
    /// Columns between nodes; node k stands at column `k * step`, the last one at or beyond the last column.
    pub step: usize,
    /// `nodes * lights` vectors, node-major.
    pub vectors: &'a [[f64; 3]],
    /// Lights, 3 to [`MAX_LIGHTS`].
    pub lights: usize,
}

impl FieldRow<'_> {
    /// Vector of one light at a column, linear between the nodes, constant beyond the last.
    pub fn at(&self, column: usize, light: usize) -> Vector3<f64> {
        let (node, t) = self.place(column);
        let (a, b) = (self.node(node, light), self.node(node + 1, light));
        a + (b - a) * t
    }

    /// Vectors of all lights at a column, times `factor`.
    pub(crate) fn copy_at(&self, column: usize, factor: f64, to: &mut Vec<[f64; 3]>) {
        let (node, t) = self.place(column);
        let last = self.nodes().saturating_sub(1);
        let of_node = |node: usize| &self.vectors[node.min(last) * self.lights..][..self.lights];
        let (a, b) = (of_node(node), of_node(node + 1));
        to.clear();
        if t == 0.0 {
            to.extend(a.iter().map(|a| a.map(|component| component * factor)));
            return;
        }
        to.extend(
            a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|c| (a[c] + (b[c] - a[c]) * t) * factor)),
        );
    }

    /// Nodes of the row.
    pub fn nodes(&self) -> usize {
        self.vectors.len() / self.lights.max(1)
    }

    /// The node left of a column and how far on it stands towards the next, 0 to 1.
    fn place(&self, column: usize) -> (usize, f64) {
        let step = self.step.max(1);
        (column / step, (column % step) as f64 / step as f64)
    }

    fn node(&self, node: usize, light: usize) -> Vector3<f64> {
        let last = self.nodes().saturating_sub(1);
        Vector3::from(self.vectors[node.min(last) * self.lights + light])
    }
}

/// var(y) = shot * y + floor + (kappa y)^2, in units of y squared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VarianceModel {
    /// Shot noise per unit of y.
    pub shot: f32,
    /// Read noise and quantisation, of the ambient frame too.
    pub floor: f32,
    /// What the light model leaves over, relative to the signal.
    pub kappa: f32,
}

/// What the solve says of one row. All slices are as long as the row.
pub struct RowOutput<'a> {
    /// Unit normals, rig frame; zero where unsolved.
    pub normal: &'a mut [[f32; 3]],
    /// Albedo under the photosite's own filter; zero where unsolved.
    pub albedo: &'a mut [f32],
    /// Expected RMS of the total angular error of the normal, degrees; zero where unsolved.
    pub expected_error_deg: &'a mut [f32],
    /// Root of the residual's mean square over the lights used, in units of y; zero where unsolved.
    pub residual: &'a mut [f32],
    /// What became of each photosite.
    pub outcome: &'a mut [Outcome],
    /// Where asked for: which samples took part in the fit; none where unsolved. (Colour pictures find the albedo of each
    /// channel from the samples that the normal rests on.)
    pub support: Option<&'a mut [Support]>,
}

/// Which samples a fit rests on. A usable sample in neither set was set aside before any test: the
/// fit has the surface turned away from its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Support {
    /// Samples that took part.
    pub kept: LightSet,
    /// Samples that the subset test dropped, because they contradict the rest.
    pub dropped: LightSet,
}

impl RowOutput<'_> {
    /// Marks a photosite as unsolved.
    pub(crate) fn clear(&mut self, column: usize, outcome: Outcome) {
        self.normal[column] = [0.0; 3];
        self.albedo[column] = 0.0;
        self.expected_error_deg[column] = 0.0;
        self.residual[column] = 0.0;
        self.outcome[column] = outcome;
        self.note(column, Support::default());
    }

    /// Notes which samples a fit rests on.
    pub(crate) fn note(&mut self, column: usize, of_fit: Support) {
        if let Some(support) = &mut self.support {
            support[column] = of_fit;
        }
    }
}

/// What became of a photosite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Outcome {
    /// Every usable sample kept.
    Fitted,
    /// The subset test dropped samples that were too dark for the rest.
    Shadow,
    /// The subset test dropped samples that were too bright for the rest.
    Highlight,
    /// The subset test dropped samples of both kinds, or kept all although the residual was large.
    Other,
    /// Fewer than three usable samples.
    TooFewLights,
    /// The usable lights lie in a plane through the photosite.
    CoplanarLights,
    /// No light comes back, or the fitted normal points away from the camera.
    NoSurface,
    /// Outside the mask. The kernels never say so (they see only NaN, hence `TooFewLights`); the solve does.
    Masked,
    /// The calibration lists the photosite as hot or dead; told apart by the solve as `Masked` is.
    Defective,
}

/// A row whose parts do not belong together.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RowError {
    /// Fewer than 3 or more than [`MAX_LIGHTS`] lights.
    #[error("a row has {lights} lights; the kernels take 3 to {MAX_LIGHTS}")]
    Lights {
        /// Lights of the field.
        lights: usize,
    },
    /// A slice of the wrong length.
    #[error("a row's {part} has {found} entries where {expected} are needed")]
    Length {
        /// Which slice.
        part: &'static str,
        /// Its length.
        found: usize,
        /// What the field and the outcome slice ask for.
        expected: usize,
    },
}

/// Checks that input and output describe one and the same row.
pub(crate) fn check_shapes(input: &RowInput, output: &RowOutput) -> Result<(), RowError> {
    let (lights, width) = (input.field.lights, output.outcome.len());
    if !(3..=MAX_LIGHTS).contains(&lights) {
        return Err(RowError::Lights { lights });
    }
    let same = |part, found, expected| {
        if found == expected { Ok(()) } else { Err(RowError::Length { part, found, expected }) }
    };
    same("list of signals", input.signal.len(), lights)?;
    same("list of variances", input.variance.len(), lights)?;
    for signal in input.signal {
        same("signal", signal.len(), width)?;
    }
    if let Some(scale) = input.noise_scale {
        same("noise scale", scale.len(), width)?;
    }
    same("normal", output.normal.len(), width)?;
    same("albedo", output.albedo.len(), width)?;
    same("expected error", output.expected_error_deg.len(), width)?;
    same("residual", output.residual.len(), width)?;
    if let Some(support) = &output.support {
        same("kept lights", support.len(), width)?;
    }
    let nodes = if width == 0 { 0 } else { (width - 1).div_ceil(input.field.step.max(1)) + 1 };
    same("light field", input.field.vectors.len(), nodes.max(input.field.nodes()) * lights)
}

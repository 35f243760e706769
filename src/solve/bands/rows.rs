//! The rows of a scene as the kernels see them, for estimators that are not the program's own: what these are compared
//! through.

use crate::linear::SignalRows;
use crate::photometry::{Method, Outcome, RowInput, RowOutput};
use crate::solve::SolveError;
use crate::solve::bands::Run;
use crate::solve::light_field::FieldRows;
use crate::solve::scene::Scene;
use rayon::prelude::*;
use weavelight_calibration::description::Image;

/// A scene whose rows can be handed to any kernel.
pub struct Rows<'a>(pub(crate) Run<'a>);

/// What a thread keeps from row to row.
struct Buffers {
    rows: SignalRows,
    albedo: Vec<f32>,
    expected_error_deg: Vec<f32>,
    residual: Vec<f32>,
    outcome: Vec<Outcome>,
}

impl Rows<'_> {
    /// Hands the rows of a scene to `work`; light field and noise are the same as in [`CheckedScene::solve`](crate::solve::CheckedScene::solve).
    ///
    /// # Errors
    /// As [`Scene::check`].
    pub fn with<T>(scene: &Scene, work: impl FnOnce(&Rows) -> T) -> Result<T, SolveError> {
        Self::with_method(scene, Method::LeastSquares, work)
    }

    /// The same for rows that are solved by the program's own `method` ([`Rows::photosite`], [`Rows::residual_of`]).
    ///
    /// # Errors
    /// As [`Scene::check`].
    pub fn with_method<T>(
        scene: &Scene,
        method: Method,
        work: impl FnOnce(&Rows) -> T,
    ) -> Result<T, SolveError> {
        let checked = scene.check()?;
        Ok(work(&Rows(Run::of(&checked, method))))
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        self.0.scene
    }

    /// Normals of rows 0, `step`, 2 `step`, ... by `kernel`, on the current thread pool; zero elsewhere. Photosites
    /// outside the mask come to the kernel as NaN.
    pub fn solve(
        &self,
        step: usize,
        kernel: &(dyn Fn(&RowInput, &mut RowOutput) + Sync),
    ) -> Image<[f32; 3]> {
        let (width, height) = (self.0.scene.width, self.0.scene.height);
        let mut normal = Image::filled(width, height, [0.0_f32; 3]);
        let rows = normal.data.par_chunks_mut(width).enumerate();
        rows.filter(|(y, _)| y.is_multiple_of(step)).for_each_init(
            || Buffers::new(width),
            |buffers, (y, normal)| self.solve_row(y, buffers, normal, kernel),
        );
        normal
    }

    fn solve_row(
        &self,
        y: usize,
        buffers: &mut Buffers,
        normal: &mut [[f32; 3]],
        kernel: &(dyn Fn(&RowInput, &mut RowOutput) + Sync),
    ) {
        let Buffers { rows, albedo, expected_error_deg, residual, outcome } = buffers;
        self.0.normalizer.row(y, 0..normal.len(), rows);
        if let Some(mask) = &self.0.scene.mask {
            rows.blank(mask.row(y));
        }
        let signal: Vec<&[f32]> = rows.signals().iter().map(Vec::as_slice).collect();
        let mut field = FieldRows::new(self.0.field);
        let input = RowInput {
            signal: &signal,
            field: field.row(y, 0),
            variance: &self.0.variance[y & 1],
            noise_scale: rows.noise_scale(),
        };
        let mut output =
            RowOutput { normal, albedo, expected_error_deg, residual, outcome, support: None };
        kernel(&input, &mut output);
    }
}

impl Buffers {
    fn new(width: usize) -> Self {
        Self {
            rows: SignalRows::default(),
            albedo: vec![0.0; width],
            expected_error_deg: vec![0.0; width],
            residual: vec![0.0; width],
            outcome: vec![Outcome::Masked; width],
        }
    }
}

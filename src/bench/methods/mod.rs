//! Who takes part: the program's own methods, and estimators from the literature for comparison. The latter are never used
//! by a solve.
//!
//! A contender is a name and a closure over a scene's rows; another way of solving takes part by one more entry in
//! [`all`].

mod cauchy;
mod l1;
mod photosite;
mod sparse_bayesian;
mod svd;
#[cfg(test)]
mod tests;

use crate::gpu::Device;
use crate::gpu::Gpu;
use crate::photometry::{Method, reference_row};
use crate::solve::{Rows, SolveError};
use photosite::{Estimator, solve_row};
use std::sync::Arc;
use weavelight_calibration::description::Image;

/// A way to solve a scene.
pub struct Contender {
    /// As tables and pictures call it.
    pub name: &'static str,
    /// In a few words.
    pub about: &'static str,
    /// Whole frames, or rows only.
    pub pace: Pace,
    /// The graphics processor that takes part. The processor's time says nothing then: time on the wall counts.
    pub adapter: Option<String>,
    /// From rows and step to what came out; a contender at the pace of frames ignores the step.
    pub solve: Solve,
}

/// What a contender does.
pub type Solve = Box<dyn Fn(&Rows, usize) -> Result<Answer, SolveError> + Sync>;

/// How fast a contender is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Fast: always solves whole frames.
    Frames,
    /// Slow: solves one row in `step`, and its time counts `step` times.
    Rows,
}

/// What a contender finds.
pub struct Answer {
    /// Unit normals, rig frame; zero where unsolved (and in rows left out).
    pub normal: Image<[f32; 3]>,
    /// Share of the solved photosites that the subset test changed, where there is such a test.
    pub robust_share: Option<f64>,
}

/// Everybody, in the order of the tables; with a graphics processor, where there is one.
pub fn all(gpu: Option<Gpu>) -> Vec<Contender> {
    let mut all = vec![
        of_literature(
            "svd-x4",
            "SVD per photosite, four solves: the published way",
            svd::four_solves,
        ),
        normal_equations(),
        own(Method::LeastSquares, "the program's plain method"),
        own(Method::Weighted, "weighted by the noise"),
        own(Method::Auto, "weighted, subset test where the residual asks for it"),
        own(Method::Robust, "weighted, subset test everywhere"),
    ];
    all.extend(gpu.map(on_gpu));
    all.extend([
        of_literature("l1", "least sum of absolute residuals", l1::least_absolute),
        of_literature("cauchy", "Cauchy's weights, ten times", cauchy::cauchy),
        of_literature(
            "shadow-test-cauchy",
            "samples below 0.3 x the median dropped, then Cauchy's weights",
            cauchy::shadow_test_then_cauchy,
        ),
        of_literature(
            "sparse-bayesian",
            "sparse errors, 60 iterations",
            sparse_bayesian::sparse_bayesian,
        ),
    ]);
    all
}

fn own(method: Method, about: &'static str) -> Contender {
    own_on(Device::Cpu, method, about)
}

/// The automatic way, complete neighbours on a graphics processor.
fn on_gpu(gpu: Gpu) -> Contender {
    let adapter = Some(gpu.adapter().name.clone());
    let device = Device::Opened(Arc::new(gpu));
    let about = "auto, complete neighbours on the graphics processor, transfers included";
    Contender { name: "gpu", adapter, ..own_on(device, Method::Auto, about) }
}

fn own_on(device: Device, method: Method, about: &'static str) -> Contender {
    let solve = move |rows: &Rows, _: usize| -> Result<Answer, SolveError> {
        let maps = rows.scene().check()?.solve(method, &device, None, &|_| {})?.maps;
        let share = maps.counts.robust() as f64 / maps.counts.solved().max(1) as f64;
        let robust_share = matches!(method, Method::Auto | Method::Robust).then_some(share);
        Ok(Answer { normal: maps.normal, robust_share })
    };
    Contender {
        name: method.name(),
        about,
        pace: Pace::Frames,
        adapter: None,
        solve: Box::new(solve),
    }
}

fn normal_equations() -> Contender {
    let solve = |rows: &Rows, step: usize| {
        let normal = rows.solve(step, &|input, output| {
            reference_row(input, output, Method::LeastSquares);
        });
        Ok(Answer { normal, robust_share: None })
    };
    Contender {
        name: "normal-equations",
        about: "per photosite in float64",
        pace: Pace::Rows,
        adapter: None,
        solve: Box::new(solve),
    }
}

fn of_literature(name: &'static str, about: &'static str, estimator: Estimator) -> Contender {
    let solve = move |rows: &Rows, step: usize| {
        let normal = rows.solve(step, &|input, output| solve_row(estimator, input, output));
        Ok(Answer { normal, robust_share: None })
    };
    Contender { name, about, pace: Pace::Rows, adapter: None, solve: Box::new(solve) }
}

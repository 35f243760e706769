//! Time over megapixels and over lights, on generated bands.

use super::Effort;
use super::band::{Band, Output, WIDTH, solve, touch};
use super::clock::{Spent, timed};
use crate::photometry::Method;

use serde::Serialize;

const MEGAPIXELS: [f64; 5] = [1.0, 4.0, 16.0, 50.0, 100.0];
const LIGHTS: [usize; 10] = [3, 4, 6, 10, 14, 16, 24, 32, 48, 64];
const METHODS: [Method; 3] = [Method::LeastSquares, Method::Weighted, Method::Auto];
/// Lights of the curve over megapixels.
const USUAL_LIGHTS: usize = 10;
/// Share of photosites with one spoilt sample.
const FAILING: f64 = 0.01;

/// One method's time as something grows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// What grows: "megapixels" or "lights".
    pub over: &'static str,
    /// The method; "touch" for touching the bytes once.
    pub method: &'static str,
    /// By ascending size.
    pub points: Vec<CurvePoint>,
}

/// One size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Millions of photosites.
    pub megapixels: f64,
    /// Lights.
    pub lights: usize,
    /// Median time.
    pub milliseconds: f64,
    /// Median processor time, all threads together.
    pub processor_milliseconds: f64,
    /// The latter over that of touching the bytes once.
    pub times_touch: f64,
}

/// How a size is measured.
#[derive(Clone, Copy)]
struct Plan {
    band_rows: usize,
    bands: usize,
    rounds: usize,
    lights: usize,
}

/// Both families of curves. Memory stays that of one band, which is solved again and again.
pub(super) fn measure(effort: Effort) -> Vec<Curve> {
    let (band_rows, rounds) = match effort {
        Effort::Quick => (8, 1),
        Effort::Full => (128, 5),
    };
    let bands =
        |megapixels: f64| ((1e6 * megapixels / (band_rows * WIDTH) as f64).round() as usize).max(1);
    let most = match effort {
        Effort::Quick => 1.0,
        Effort::Full => f64::INFINITY,
    };
    let megapixels = MEGAPIXELS.into_iter().filter(|size| *size <= most);
    let sizes = megapixels.map(|megapixels| {
        // A hundred megapixels average by themselves.
        let rounds = if megapixels > 20.0 { rounds.min(3) } else { rounds };
        Plan { band_rows, bands: bands(megapixels), rounds, lights: USUAL_LIGHTS }
    });
    let lights = LIGHTS.map(|lights| Plan { band_rows, bands: bands(1.0), rounds, lights });
    [curves("megapixels", sizes), curves("lights", lights.into_iter())].concat()
}

fn curves(over: &'static str, plans: impl Iterator<Item = Plan>) -> Vec<Curve> {
    let names = std::iter::once("touch").chain(METHODS.map(Method::name));
    let mut curves: Vec<Curve> =
        names.map(|method| Curve { over, method, points: Vec::new() }).collect();
    for plan in plans {
        let points = measure_plan(plan);
        curves.iter_mut().zip(points).for_each(|(curve, point)| curve.points.push(point));
    }
    curves
}

/// Touching, then every method, in turns.
fn measure_plan(plan: Plan) -> Vec<CurvePoint> {
    let band = Band::new(plan.lights, plan.band_rows, FAILING);
    let mut output = Output::new(plan.band_rows);
    let mut spent = vec![Vec::new(); 1 + METHODS.len()];
    // One band without counting: everything in place.
    touch(&band, &mut output);
    for _ in 0..plan.rounds {
        for (k, spent) in spent.iter_mut().enumerate() {
            let work = |_| match k.checked_sub(1) {
                None => touch(&band, &mut output),
                Some(method) => solve(&band, &mut output, METHODS[method]),
            };
            spent.push(timed(|| (0..plan.bands).for_each(work)).0);
        }
    }
    let touched = Spent::median(&spent[0]);
    let megapixels = (plan.bands * plan.band_rows * WIDTH) as f64 / 1e6;
    let point = |spent: &Vec<Spent>| {
        let median = Spent::median(spent);
        CurvePoint {
            megapixels,
            lights: plan.lights,
            milliseconds: 1e3 * median.wall_s,
            processor_milliseconds: 1e3 * median.processor_s,
            times_touch: median.processor_s / touched.processor_s,
        }
    };
    spent.iter().map(point).collect()
}

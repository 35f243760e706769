//! The figures, and the short test that keeps them.

use crate::errors::{KINDS, Kind};
use crate::rig::{LAYOUTS, Layout, Rig, Sheets};
use std::sync::atomic::{AtomicUsize, Ordering};
use weavelight_calibration::lights::{Place, Settings, fit};

/// Of one bench: the worst over its lights, and what the fit claimed.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    /// Distance.
    position_mm: f64,
    /// RMS over lights of the distance.
    rms_mm: f64,
    axis_deg: f64,
    exponent: f64,
    /// RMS over lights of error over stated sigma, per axis.
    over_sigma: f64,
    /// Largest error of a claimed position, per axis (RMS).
    claimed_mm: f64,
    claimed: usize,
    kappa: f64,
    iterations: usize,
}

fn errors(rig: &Rig, sheets: Sheets) -> Result<Errors, String> {
    let fitted = fit(&rig.sheets(sheets), &rig.priors(), &Settings::default())
        .map_err(|error| error.to_string())?;
    let mut out =
        Errors { kappa: fitted.slow_error_rms, iterations: fitted.iterations, ..Errors::default() };
    let (mut square, mut ratio) = (0.0, 0.0);
    for (light, led) in fitted.lights.iter().zip(&rig.leds) {
        let Place::Near { position_mm, axis, exponent } = &light.emitter.place else {
            return Err("a near light came back as a far one".into());
        };
        let off = (position_mm - led.position).norm();
        let per_axis = off / 3f64.sqrt();
        square += off * off;
        ratio += (per_axis / light.position_sigma_mm.unwrap()).powi(2);
        out.position_mm = out.position_mm.max(off);
        out.axis_deg = out.axis_deg.max(axis.angle(&led.axis).to_degrees());
        out.exponent = out.exponent.max((exponent - led.exponent).abs());
        if light.position_claimed {
            out.claimed += 1;
            out.claimed_mm = out.claimed_mm.max(per_axis);
        }
    }
    let count = rig.leds.len() as f64;
    out.rms_mm = (square / count).sqrt();
    out.over_sigma = (ratio / count).sqrt();
    Ok(out)
}

/// All of them on both cores.
fn all(rigs: &[(Layout, Kind, u64)], slow: f64, sheets: Sheets) -> Vec<Result<Errors, String>> {
    let next = AtomicUsize::new(0);
    let results: Vec<std::sync::Mutex<Option<Result<Errors, String>>>> =
        rigs.iter().map(|_| std::sync::Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some((layout, kind, seed)) =
                    rigs.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let k = rigs.iter().position(|r| r == &(*layout, *kind, *seed)).unwrap();
                    let found = errors(&Rig::new(*layout, *kind, slow, *seed), sheets);
                    *results[k].lock().unwrap() = Some(found);
                }
            });
        }
    });
    results.into_iter().map(|result| result.into_inner().unwrap().unwrap()).collect()
}

fn median_and_worst(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    (values[values.len() / 2], *values.last().unwrap())
}

fn row(name: &str, results: &[Result<Errors, String>]) {
    let good: Vec<Errors> = results.iter().filter_map(|r| r.as_ref().ok().copied()).collect();
    let failed = results.len() - good.len();
    if good.is_empty() {
        println!("{name:28} all {failed} failed: {:?}", results[0]);
        return;
    }
    let of = |value: &dyn Fn(&Errors) -> f64| median_and_worst(good.iter().map(value));
    let (rms, rms_worst) = of(&|e| e.rms_mm);
    let (position, position_worst) = of(&|e| e.position_mm);
    let (axis, axis_worst) = of(&|e| e.axis_deg);
    let (exponent, exponent_worst) = of(&|e| e.exponent);
    let (sigmas, sigmas_worst) = of(&|e| e.over_sigma);
    let (kappa, _) = of(&|e| 100.0 * e.kappa);
    let (_, claimed_worst) = of(&|e| e.claimed_mm);
    let claimed: usize = good.iter().map(|e| e.claimed).sum();
    let most = good.iter().map(|e| e.iterations).max().unwrap_or(0);
    println!(
        "{name:28} rms {rms:5.2} {rms_worst:5.2} | light {position:5.2} {position_worst:5.2} mm | axis {axis:4.2} {axis_worst:4.2} deg | exp {exponent:.3} {exponent_worst:.3} | err/sigma {sigmas:4.2} {sigmas_worst:4.2} | kappa {kappa:.3} | claimed {claimed} worst {claimed_worst:.2} | {most} it | {failed} failed"
    );
    if let Some(error) = results.iter().find_map(|r| r.as_ref().err()) {
        println!("    {error}");
    }
}

fn table(sheets: Sheets, slow: f64, seeds: std::ops::Range<u64>) {
    println!("{sheets:?}, slow errors {:.2} %: median and worst over benches", 100.0 * slow);
    let rigs: Vec<(Layout, Kind, u64)> = LAYOUTS
        .iter()
        .flat_map(|layout| {
            let seeds = seeds.clone();
            KINDS.iter().flat_map(move |kind| seeds.clone().map(move |seed| (*layout, *kind, seed)))
        })
        .collect();
    let results = all(&rigs, slow, sheets);
    let pick = |keep: &dyn Fn(&(Layout, Kind, u64)) -> bool| -> Vec<Result<Errors, String>> {
        rigs.iter().zip(&results).filter(|(rig, _)| keep(rig)).map(|(_, r)| r.clone()).collect()
    };
    for kind in KINDS {
        row(&format!("{kind:?}"), &pick(&|rig| rig.1 == kind));
    }
    for layout in LAYOUTS {
        row(&format!("{layout:?}"), &pick(&|rig| rig.0 == layout));
    }
    row("all", &results);
}

/// The worst over a few benches, and that sigma tells of it.
fn check(rigs: &[(Layout, Kind, u64)], sheets: Sheets, most: [f64; 3], most_over_sigma: f64) {
    for (rig, found) in rigs.iter().zip(all(rigs, 1e-3, sheets)) {
        let e = found.unwrap_or_else(|error| panic!("{rig:?}: {error}"));
        let worst = [e.position_mm, e.axis_deg, e.exponent];
        assert!(worst.iter().zip(&most).all(|(found, most)| found <= most), "{rig:?}: {e:?}");
        assert!(e.over_sigma <= most_over_sigma, "{rig:?}: {e:?}");
    }
}

#[test]
fn six_sheets_hold_their_limits_under_the_worst_kinds() {
    use Layout::{Irregular12, Reference, Rings};
    let rigs =
        [(Reference, Kind::Drift, 1), (Rings, Kind::Mixed, 0), (Irregular12, Kind::Fixed, 1)];
    check(&rigs, Sheets::Six, [5.0, 1.2, 0.1], 2.5);
}

#[test]
fn one_flat_sheet_always_has_a_solution_and_claims_nothing_wrong() {
    let rigs: Vec<_> = LAYOUTS
        .iter()
        .flat_map(|layout| [Kind::Cubic, Kind::Stray].map(|kind| (*layout, kind, 1)))
        .collect();
    for (rig, found) in rigs.iter().zip(all(&rigs, 1e-3, Sheets::Flat)) {
        let found = found.unwrap_or_else(|error| panic!("{rig:?}: {error}"));
        assert!(found.claimed_mm <= 7.5, "{rig:?}: {found:?}");
        assert!(found.over_sigma <= 2.0, "{rig:?}: {found:?}");
    }
}

fn seeds() -> u64 {
    std::env::var("SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(4)
}

#[test]
#[ignore = "minutes"]
fn six_sheets() {
    table(Sheets::Six, 1e-3, 0..seeds());
}

#[test]
#[ignore = "minutes"]
fn four_sheets() {
    table(Sheets::FlatRaisedTwoTilts, 1e-3, 0..seeds());
}

#[test]
#[ignore = "minutes"]
fn two_sheets() {
    table(Sheets::FlatAndTilt, 1e-3, 0..seeds());
}

#[test]
#[ignore = "minutes"]
fn one_flat_sheet() {
    table(Sheets::Flat, 1e-3, 0..seeds());
}

//! The noise model where the calibration has none: from the residuals of plain least squares.
//!
//! A residual is sensor noise, or light that the model does not describe (gloss, shadow, bounce, errors of the light
//! field). Noise is independent from photosite to photosite; what the model leaves over is shared by neighbours. So shot
//! noise and floor come from second differences of the residual between photosites of the same colour, and kappa from
//! what the residual itself has beyond them. Medians and lower quartiles make both blind to the places where the model
//! fails badly, which are for the subset test.

use nalgebra::{Matrix3, Vector3};

use super::method::MAX_LIGHTS;
use super::reference::inverse_if_conditioned;
use super::row::{RowInput, VarianceModel};

/// A light field and a surface that differ from the model by more than this differ in a way that is no noise: the subset
/// test is to see it. (On the DiLiGenT objects, where residuals of 5 to 10 % are usual, weights and subset test do best
/// with about this value.)
const MOST_KAPPA: f64 = 0.02;

/// Photosites are grouped by brightness, so that shot noise and floor can be told apart.
const GROUPS: usize = 12;

/// Fewest photosites from which noise is estimated.
const FEWEST_PHOTOSITES: usize = 20 * GROUPS;

/// Distance of the next photosite of the same colour.
const SAME_COLOR: usize = 2;

/// What one photosite says: squared residuals, and what each unit of noise would contribute to their sum.
#[derive(Clone, Copy, Debug)]
struct Evidence {
    brightness: f64,
    /// Sum over lights of the squared second difference of the residual, divided by 6: its variance is that of one residual.
    difference: f64,
    /// Sum over lights of the squared residual.
    total: f64,
    /// Expected sum of squares per unit of shot, floor and kappa^2.
    unit: [f64; 3],
}

/// Estimates the noise from rows of at least four lights. `variance` of each row must hold what *one unit* of each term is
/// in the row's normalised signal (for frames alike in exposure and light: 1, 1, 1); what comes back are the numbers of
/// units: shot, floor, kappa.
///
/// `None` where the rows do not tell: three lights (no residual), or too few photosites with three usable neighbours of
/// their colour.
pub fn estimate_noise(rows: &[RowInput]) -> Option<VarianceModel> {
    let mut evidence: Vec<Evidence> = rows.iter().flat_map(evidence_of_row).collect();
    if evidence.len() < FEWEST_PHOTOSITES {
        return None;
    }
    evidence.sort_by(|a, b| a.brightness.total_cmp(&b.brightness));
    let freedom = (rows.first()?.field.lights - 3) as f64;
    let groups: Vec<Group> =
        evidence.chunks(evidence.len().div_ceil(GROUPS)).map(|g| Group::new(g, freedom)).collect();
    let [shot, floor] = non_negative_fit(&groups);
    let kappa = kappa(&groups, shot, floor);
    Some(VarianceModel { shot: shot as f32, floor: floor as f32, kappa: kappa as f32 })
}

/// A group of about equal brightness.
struct Group {
    unit: [f64; 3],
    difference: f64,
    total: f64,
}

impl Group {
    fn new(evidence: &[Evidence], freedom: f64) -> Self {
        let mean =
            |i: usize| evidence.iter().map(|e| e.unit[i]).sum::<f64>() / evidence.len() as f64;
        let quantile = |share: f64, value: fn(&Evidence) -> f64| {
            let mut values: Vec<f64> = evidence.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            let expected = chi_square_quantile_over_mean(share, freedom);
            values[(share * (values.len() - 1) as f64) as usize] / expected
        };
        Self {
            unit: [mean(0), mean(1), mean(2)],
            difference: quantile(0.5, |e| e.difference),
            total: quantile(0.25, |e| e.total),
        }
    }
}

/// Quantile of chi-square over its degrees of freedom, by Wilson and Hilferty's cube root, for the two quantiles in use.
fn chi_square_quantile_over_mean(share: f64, freedom: f64) -> f64 {
    let deviate = if share < 0.4 { -0.674_49 } else { 0.0 };
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + deviate * spread.sqrt()).powi(3)
}

/// Shot and floor, neither negative, that explain the differences with least relative error.
fn non_negative_fit(groups: &[Group]) -> [f64; 2] {
    let (mut aa, mut ab, mut bb, mut a, mut b) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for group in groups.iter().filter(|g| g.difference > 0.0) {
        let (shot, floor) = (group.unit[0] / group.difference, group.unit[1] / group.difference);
        aa += shot * shot;
        ab += shot * floor;
        bb += floor * floor;
        a += shot;
        b += floor;
    }
    let alone = |sum: f64, squares: f64| if squares > 0.0 { sum / squares } else { 0.0 };
    let determinant = aa * bb - ab * ab;
    let (shot, floor) = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant);
    if determinant > 1e-9 * aa * bb && shot >= 0.0 && floor >= 0.0 {
        return [shot, floor];
    }
    // The better of the two single terms: what it leaves is the number of groups minus sum^2 / squares.
    if a * a * bb >= b * b * aa { [alone(a, aa), 0.0] } else { [0.0, alone(b, bb)] }
}

/// The median over the groups of what the residual has beyond shot noise and floor.
fn kappa(groups: &[Group], shot: f64, floor: f64) -> f64 {
    let excess = |g: &Group| (g.total - shot * g.unit[0] - floor * g.unit[1]) / g.unit[2];
    let mut squares: Vec<f64> = groups.iter().map(excess).filter(|e| e.is_finite()).collect();
    squares.sort_by(f64::total_cmp);
    let middle = squares.get(squares.len() / 2).copied().unwrap_or(0.0);
    middle.max(0.0).sqrt().min(MOST_KAPPA)
}

/// Plain residuals of a photosite.
struct Residuals {
    residual: [f64; MAX_LIGHTS],
    predicted: [f64; MAX_LIGHTS],
    /// 1 - h_ii: the share of a sample's variance that its residual shows.
    shown: [f64; MAX_LIGHTS],
}

fn evidence_of_row(row: &RowInput) -> Vec<Evidence> {
    let lights = row.field.lights;
    let width = row.signal.first().map_or(0, |signal| signal.len());
    if !(4..=MAX_LIGHTS).contains(&lights)
        || row.signal.len() != lights
        || row.variance.len() != lights
    {
        return Vec::new();
    }
    let residuals: Vec<Option<Residuals>> =
        (0..width).map(|column| residuals(row, column)).collect();
    let inner = SAME_COLOR..width.saturating_sub(SAME_COLOR);
    inner.filter_map(|column| evidence(row, &residuals, column)).collect()
}

fn residuals(row: &RowInput, column: usize) -> Option<Residuals> {
    let lights = row.field.lights;
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for i in 0..lights {
        let (l, y) = (row.field.at(column, i), f64::from(*row.signal[i].get(column)?));
        if !y.is_finite() || l.iter().any(|c| !c.is_finite()) {
            return None;
        }
        matrix += l * l.transpose();
        right += y * l;
    }
    let inverse = inverse_if_conditioned(&matrix)?;
    let g = inverse * right;
    let mut found = Residuals {
        residual: [0.0; MAX_LIGHTS],
        predicted: [0.0; MAX_LIGHTS],
        shown: [0.0; MAX_LIGHTS],
    };
    for i in 0..lights {
        let l = row.field.at(column, i);
        found.predicted[i] = g.dot(&l);
        found.residual[i] = f64::from(row.signal[i][column]) - found.predicted[i];
        found.shown[i] = 1.0 - l.dot(&(inverse * l));
    }
    (g.norm() > 0.0).then_some(found)
}

fn evidence(row: &RowInput, residuals: &[Option<Residuals>], column: usize) -> Option<Evidence> {
    let before = residuals[column - SAME_COLOR].as_ref()?;
    let here = residuals[column].as_ref()?;
    let after = residuals[column + SAME_COLOR].as_ref()?;
    let scale = row.noise_scale.map_or(1.0, |scale| f64::from(scale[column]));
    let mut evidence = Evidence { brightness: 0.0, difference: 0.0, total: 0.0, unit: [0.0; 3] };
    for i in 0..row.field.lights {
        let predicted = here.predicted[i].max(0.0);
        let model = row.variance[i][column & 1];
        let second = 2.0 * here.residual[i] - before.residual[i] - after.residual[i];
        evidence.brightness += predicted;
        evidence.difference += second * second / 6.0;
        evidence.total += here.residual[i].powi(2);
        evidence.unit[0] += here.shown[i] * f64::from(model.shot) * scale * predicted;
        evidence.unit[1] += here.shown[i] * f64::from(model.floor) * scale * scale;
        evidence.unit[2] += here.shown[i] * (f64::from(model.kappa) * predicted).powi(2);
    }
    let finite = evidence.unit.iter().all(|u| u.is_finite()) && evidence.total.is_finite();
    (finite && evidence.brightness > 0.0).then_some(evidence)
}

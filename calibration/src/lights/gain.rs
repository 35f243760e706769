//! What the fitted model leaves over: intensity per channel, vignetting, and a smooth gain map per light.

use super::basis::{degrees, legendre_products};
use super::emission::Emitter;
use super::fit::Fit;
use super::joint::{median, place};
use super::observation::Sheet;
use crate::description::Image;
use nalgebra::{Cholesky, DMatrix, DVector, Rotation3, Vector3};

/// Degree of the smooth surfaces that describe a sheet at one pose: the flat sheet must read exactly.
const ONE_POSE_DEGREE: usize = 7;
/// Degree of what is left per light over several poses, and of vignetting beyond its radial part.
const SMOOTH_DEGREE: usize = 4;
/// Degree of the sheet's own unevenness: enough for waves of half the sheet's length. What a stiffer surface cannot follow
/// would be taken for paper and vignetting in the directions that the poses hardly tell apart, several times enlarged.
const SHEET_DEGREE: usize = 12;
/// Spread of the coefficients (natural logarithm) before the pictures: a sheet's unevenness (of degree 1; falling with the
/// degree), and vignetting that is not radial. They tell the two apart where the poses do not.
const UNEVEN_SIGMA: f64 = 0.01;
const OFF_RADIAL_SIGMA: f64 = 0.002;
/// Beside the cells a gain goes on by this factor's logarithm at most: a sheet that covers half of the frame must not make a
/// gain of 1e30 in its corner.
const BEYOND: f64 = 0.25;
/// Cells farther from the smooth gain than this many robust sigmas show no sheet.
const OUTLIER_SIGMAS: f64 = 5.0;

/// What the lights give per channel and where in the frame it departs from the model.
#[derive(Clone, Debug)]
pub struct Gains {
    /// Per light: R, G, B, as [`crate::description::PointLight::intensity`].
    pub intensity: Vec<[f64; 3]>,
    /// Per light: multiplies the model's irradiance, R, G, B; texel k of n stands at pixel (k + 1/2) length / n - 1/2.
    pub maps: Vec<Image<[f32; 3]>>,
    /// Peak-to-peak of the sheet's own unevenness, green, as a fraction; `None` where one pose cannot tell it from
    /// vignetting.
    pub sheet_unevenness: Option<f64>,
    /// RMS over cells and lights of what the maps leave over, green, relative.
    pub residual_rms: f64,
}

/// Intensities and gain maps of `fit`'s lights.
///
/// Every cell's own gain is vignetting times the sheet: vignetting stays in pixel coordinates from pose to pose, the
/// sheet's unevenness in the sheet's. With one pose everything is taken up by the maps, so that this sheet reads exactly.
/// `frame_px`: width and height; `texels`: size of the maps.
pub fn gains(sheets: &[Sheet], fit: &Fit, frame_px: [usize; 2], texels: [usize; 2]) -> Gains {
    let channels: Vec<Channel> = (0..3).map(|k| Channel::fit(sheets, fit, frame_px, k)).collect();
    let lights = fit.lights.len();
    let map = |i: usize| {
        let texel = |t: usize| {
            let at = |k: usize, index: usize| (index as f64 + 0.5) / texels[k] as f64 * 2.0 - 1.0;
            let place = [at(0, t % texels[0]), at(1, t / texels[0])];
            std::array::from_fn(|k| channels[k].gain(i, place, frame_px) as f32)
        };
        let [width, height] = texels;
        Image { width, height, data: (0..width * height).map(texel).collect() }
    };
    Gains {
        intensity: (0..lights)
            .map(|i| std::array::from_fn(|k| channels[k].log_intensity[i].exp()))
            .collect(),
        maps: (0..lights).map(map).collect(),
        sheet_unevenness: channels[1].unevenness,
        residual_rms: channels[1].residual_rms,
    }
}

/// One colour channel.
struct Channel {
    log_intensity: Vec<f64>,
    vignetting: Surface,
    per_light: Vec<DVector<f64>>,
    per_light_degree: usize,
    unevenness: Option<f64>,
    residual_rms: f64,
    /// Least and largest logarithm of a gain where cells are; beside them polynomials know nothing.
    seen: [f64; 2],
}

/// ln vignetting: coefficients of [`vignetting_basis`], zero at the frame's centre.
struct Surface {
    coefficients: DVector<f64>,
    degree: usize,
}

/// ln(signal / model) of one channel and how far each is to be trusted, in the order of the sheets' samples.
struct Logs {
    value: Vec<Vec<f64>>,
    trust: Vec<Vec<f64>>,
}

impl Channel {
    fn fit(sheets: &[Sheet], fit: &Fit, frame_px: [usize; 2], channel: usize) -> Self {
        let lights = fit.lights.len();
        let logs = logs(sheets, fit, channel);
        let (relative, gains) = two_way(&logs, lights);
        let several = has_several_poses(sheets);
        let (vignetting, sheet) = separate(sheets, &gains, frame_px, several);
        let places: Vec<Vec<[f64; 2]>> =
            sheets.iter().map(|sheet| places(sheet, frame_px)).collect();
        let per_light_degree = if several { SMOOTH_DEGREE } else { ONE_POSE_DEGREE };
        let left_over = |s: usize, c: usize, i: usize| {
            let k = c * lights + i;
            (logs.value[s][k] - relative[i] - gains[s][c], logs.trust[s][k])
        };
        let per_light: Vec<DVector<f64>> = (0..lights)
            .map(|i| common_surface(&places, per_light_degree, &|s, c| left_over(s, c, i)))
            .collect();
        let residual_rms = residual_rms(&places, per_light_degree, &per_light, &left_over);
        let centre = vignetting.at_centre();
        let log_intensity = relative.iter().map(|a| a + centre).collect();
        let unevenness = several.then(|| sheet.peak_to_peak(&sheets[0]));
        let seen = [0.0; 2];
        let mut channel = Self {
            log_intensity,
            vignetting,
            per_light,
            per_light_degree,
            unevenness,
            residual_rms,
            seen,
        };
        for place in places.iter().flatten() {
            for i in 0..lights {
                let log = channel.log_gain(i, *place, frame_px);
                channel.seen = [channel.seen[0].min(log), channel.seen[1].max(log)];
            }
        }
        channel
    }

    /// Gain of light `i` at a place of the frame in [-1, 1]^2.
    fn gain(&self, i: usize, place: [f64; 2], frame_px: [usize; 2]) -> f64 {
        let [low, high] = self.seen;
        self.log_gain(i, place, frame_px).clamp(low - BEYOND, high + BEYOND).exp()
    }

    fn log_gain(&self, i: usize, place: [f64; 2], frame_px: [usize; 2]) -> f64 {
        let own = dot(&self.per_light[i], &legendre_products(place, 0, self.per_light_degree));
        self.vignetting.at(place, frame_px) - self.vignetting.at_centre() + own
    }
}

impl Surface {
    fn at(&self, place: [f64; 2], frame_px: [usize; 2]) -> f64 {
        dot(&self.coefficients, &vignetting_basis(place, frame_px, self.degree))
    }

    fn at_centre(&self) -> f64 {
        self.at([0.0, 0.0], [1, 1])
    }
}

fn dot(coefficients: &DVector<f64>, basis: &[f64]) -> f64 {
    coefficients.iter().zip(basis).map(|(c, b)| c * b).sum()
}

/// A constant, three even powers of the distance from the centre (1 in the corner), and smooth departures.
fn vignetting_basis(place: [f64; 2], frame_px: [usize; 2], degree: usize) -> Vec<f64> {
    let [w, h] = frame_px.map(|length| length as f64);
    let r2 = ((place[0] * w).powi(2) + (place[1] * h).powi(2)) / (w * w + h * h);
    let mut basis = vec![1.0, r2, r2 * r2, r2.powi(3)];
    basis.extend(legendre_products(place, 1, degree));
    basis
}

fn places(sheet: &Sheet, frame_px: [usize; 2]) -> Vec<[f64; 2]> {
    let place = |pixel: &[f64; 2]| {
        std::array::from_fn(|k| (pixel[k] + 0.5) / frame_px[k] as f64 * 2.0 - 1.0)
    };
    sheet.cells.iter().map(|cell| place(&cell.pixel)).collect()
}

/// Whether any two sheets differ by more than 2 degrees or 5 mm.
pub fn has_several_poses(sheets: &[Sheet]) -> bool {
    sheets.iter().any(|sheet| {
        let first = &sheets[0].plane;
        let tilt = first.normal.angle(&sheet.plane.normal).to_degrees();
        let lift = first.normal.dot(&(sheet.plane.point_mm - first.point_mm)).abs();
        tilt > 2.0 || lift > 5.0
    })
}

fn logs(sheets: &[Sheet], fit: &Fit, channel: usize) -> Logs {
    let emitters: Vec<Emitter> = fit
        .lights
        .iter()
        .map(|light| Emitter { log_intensity: 0.0, ..light.emitter.clone() })
        .collect();
    let mut logs = Logs { value: Vec::new(), trust: Vec::new() };
    for (s, sheet) in sheets.iter().enumerate() {
        let mut value = Vec::with_capacity(sheet.samples.len());
        for (c, cell) in sheet.cells.iter().enumerate() {
            let placed = place(sheet, cell, &fit.pose_corrections[s]);
            for (emitter, sample) in emitters.iter().zip(sheet.samples_of(c)) {
                let model =
                    emitter.log_irradiance(&placed.point, &placed.normal).unwrap_or(f64::NAN);
                value.push((sample.signal[channel] / sheet.reflectance).ln() - model);
            }
        }
        let trusted = |(value, trust): (&f64, &f64)| if value.is_finite() { *trust } else { 0.0 };
        logs.trust.push(value.iter().zip(&fit.trust[s]).map(trusted).collect());
        logs.value.push(value);
    }
    logs
}

/// Splits logs into one part per light (mean zero) and one per cell, by alternating weighted means.
fn two_way(logs: &Logs, lights: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mut relative = vec![0.0; lights];
    let mut gains = Vec::new();
    for _ in 0..20 {
        gains =
            logs.value.iter().zip(&logs.trust).map(|(v, t)| cell_gains(v, t, &relative)).collect();
        let mut sums = vec![(0.0, 0.0); lights];
        for ((value, trust), gain) in logs.value.iter().zip(&logs.trust).zip(&gains) {
            for (k, (v, t)) in value.iter().zip(trust).enumerate().filter(|(_, (_, t))| **t > 0.0) {
                sums[k % lights].0 += t * (v - gain[k / lights]);
                sums[k % lights].1 += t;
            }
        }
        relative = sums.iter().map(|(sum, weight)| sum / weight.max(f64::MIN_POSITIVE)).collect();
        let mean = relative.iter().sum::<f64>() / lights as f64;
        relative.iter_mut().for_each(|a| *a -= mean);
    }
    (relative, gains)
}

fn cell_gains(value: &[f64], trust: &[f64], relative: &[f64]) -> Vec<f64> {
    let lights = relative.len();
    let gain = |(v, t): (&[f64], &[f64])| {
        let used = || v.iter().zip(t).zip(relative).filter(|((_, t), _)| **t > 0.0);
        let total: f64 = used().map(|((_, t), _)| t).sum();
        used().map(|((v, t), a)| t * (v - a)).sum::<f64>() / total
    };
    value.chunks(lights).zip(trust.chunks(lights)).map(gain).collect()
}

/// ln gain of all cells = vignetting (pixel) + sheet (its own coordinates); the sheet's mean is zero. With one pose the
/// first takes everything.
fn separate(
    sheets: &[Sheet],
    gains: &[Vec<f64>],
    frame_px: [usize; 2],
    several: bool,
) -> (Surface, Unevenness) {
    let degree = if several { SMOOTH_DEGREE } else { ONE_POSE_DEGREE };
    let off_radial = degrees(1, degree).count();
    let area = SheetArea::seen(sheets);
    let sigma = if several { OFF_RADIAL_SIGMA } else { 1.0 };
    let mut precision = vec![1e-6, 1e-2, 1e-2, 1e-2];
    precision.extend(vec![sigma.powi(-2); off_radial]);
    if several {
        let sigma = |(a, b): (usize, usize)| UNEVEN_SIGMA / (a + b) as f64;
        precision.extend(degrees(1, SHEET_DEGREE).map(|pair| sigma(pair).powi(-2)));
    }
    let mut rows = Vec::new();
    for (sheet, gains) in sheets.iter().zip(gains) {
        for ((cell, place), gain) in sheet.cells.iter().zip(places(sheet, frame_px)).zip(gains) {
            let mut row = vignetting_basis(place, frame_px, degree);
            if several {
                row.extend(area.basis(sheet, &cell.point_mm.coords));
            }
            if gain.is_finite() {
                rows.push((row, *gain));
            }
        }
    }
    let all = robust_ridge(&rows, &precision);
    let split = 4 + off_radial;
    let mut vignetting = Surface { coefficients: all.rows(0, split).into_owned(), degree };
    let coefficients = all.rows(split, all.len() - split).into_owned();
    // What the sheet has on average belongs to its stated reflectance.
    let mean = rows.iter().map(|(row, _)| dot(&coefficients, &row[split..])).sum::<f64>()
        / rows.len().max(1) as f64;
    vignetting.coefficients[0] += mean;
    (vignetting, Unevenness { coefficients, area })
}

/// The part of the sheet that any pose shows, in its own coordinates, millimetres.
struct SheetArea {
    middle: [f64; 2],
    half: [f64; 2],
}

impl SheetArea {
    fn seen(sheets: &[Sheet]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for sheet in sheets {
            for cell in &sheet.cells {
                let at = in_sheet(sheet, &cell.point_mm.coords);
                low = std::array::from_fn(|k| low[k].min(at[k]));
                high = std::array::from_fn(|k| high[k].max(at[k]));
            }
        }
        Self {
            middle: std::array::from_fn(|k| 0.5 * (low[k] + high[k])),
            half: std::array::from_fn(|k| (0.5 * (high[k] - low[k])).max(f64::MIN_POSITIVE)),
        }
    }

    fn basis(&self, sheet: &Sheet, point: &Vector3<f64>) -> Vec<f64> {
        let at = in_sheet(sheet, point);
        let place = std::array::from_fn(|k| (at[k] - self.middle[k]) / self.half[k]);
        legendre_products(place, 1, SHEET_DEGREE)
    }
}

/// ln of the sheet's own reflectance over its area.
struct Unevenness {
    coefficients: DVector<f64>,
    area: SheetArea,
}

impl Unevenness {
    /// Of what one sheet shows.
    fn peak_to_peak(&self, sheet: &Sheet) -> f64 {
        let at = |point: &Vector3<f64>| dot(&self.coefficients, &self.area.basis(sheet, point));
        let values = sheet.cells.iter().map(|cell| at(&cell.point_mm.coords));
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high.exp() - low.exp()
    }
}

/// Coordinates in the sheet, millimetres: as if it had been tilted out of the table about its stated point.
fn in_sheet(sheet: &Sheet, point: &Vector3<f64>) -> [f64; 2] {
    let tilt = Rotation3::rotation_between(&Vector3::z(), &sheet.plane.normal)
        .unwrap_or_else(Rotation3::identity);
    let flat = tilt.inverse() * (point - sheet.plane.point_mm.coords);
    [flat.x, flat.y]
}

/// The surface in pixel coordinates that all sheets share: each sheet's own is fitted, and every coefficient of their mean
/// is shrunk by how little the sheets agree on it (one sheet: taken as it is).
fn common_surface(
    places: &[Vec<[f64; 2]>],
    degree: usize,
    value: &dyn Fn(usize, usize) -> (f64, f64),
) -> DVector<f64> {
    let of_sheet = |s: usize| {
        let row = |c: usize| {
            let (log, trust) = value(s, c);
            (trust > 0.25 && log.is_finite())
                .then(|| (legendre_products(places[s][c], 0, degree), log))
        };
        let rows: Vec<_> = (0..places[s].len()).filter_map(row).collect();
        ridge(&rows, &vec![1e-3; degrees(0, degree).count()], None)
    };
    let each: Vec<DVector<f64>> = (0..places.len()).map(of_sheet).collect();
    let count = each.len() as f64;
    let mean = each.iter().fold(DVector::zeros(each[0].len()), |sum, one| sum + one) / count;
    if each.len() < 3 {
        return mean;
    }
    DVector::from_fn(mean.len(), |k, _| {
        let scatter = each.iter().map(|one| (one[k] - mean[k]).powi(2)).sum::<f64>()
            / (count * (count - 1.0));
        let agreed = 1.0 - scatter / (mean[k] * mean[k]).max(f64::MIN_POSITIVE);
        mean[k] * agreed.max(0.0)
    })
}

fn residual_rms(
    places: &[Vec<[f64; 2]>],
    degree: usize,
    per_light: &[DVector<f64>],
    value: &dyn Fn(usize, usize, usize) -> (f64, f64),
) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for (s, places) in places.iter().enumerate() {
        for (c, place) in places.iter().enumerate() {
            let basis = legendre_products(*place, 0, degree);
            for (i, surface) in per_light.iter().enumerate() {
                let (log, trust) = value(s, c, i);
                if trust > 0.25 && log.is_finite() {
                    square += (log - dot(surface, &basis)).powi(2);
                    count += 1.0;
                }
            }
        }
    }
    f64::sqrt(square / f64::max(count, 1.0))
}

/// Ridge regression that leaves outliers out.
fn robust_ridge(rows: &[(Vec<f64>, f64)], precision: &[f64]) -> DVector<f64> {
    let mut keep = vec![true; rows.len()];
    let mut solution = DVector::zeros(precision.len());
    for _ in 0..4 {
        solution = ridge(rows, precision, Some(&keep));
        let off: Vec<f64> = rows.iter().map(|(row, y)| (y - dot(&solution, row)).abs()).collect();
        let limit = OUTLIER_SIGMAS * 1.4826 * median(&mut off.clone()).max(1e-5);
        keep = off.iter().map(|off| *off <= limit).collect();
    }
    solution
}

/// Relative noise of a cell that the ridges assume.
const ROW_SIGMA: f64 = 1e-3;

/// Least squares with prior N(0, 1 / precision) on each coefficient; zero where there is nothing to fit.
fn ridge(rows: &[(Vec<f64>, f64)], precision: &[f64], keep: Option<&[bool]>) -> DVector<f64> {
    let n = precision.len();
    let (mut hessian, mut right) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n));
    for (k, (row, y)) in rows.iter().enumerate() {
        if keep.is_none_or(|keep| keep[k]) {
            let row = DVector::from_column_slice(row);
            hessian.syger(1.0, &row, &row, 1.0);
            right.axpy(*y, &row, 1.0);
        }
    }
    for (k, precision) in precision.iter().enumerate() {
        hessian[(k, k)] += precision * ROW_SIGMA * ROW_SIGMA;
    }
    Cholesky::new(hessian).map_or_else(|| DVector::zeros(n), |factor| factor.solve(&right))
}

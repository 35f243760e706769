use super::{BoardShape, Chart, Sheet};
use crate::color::channel_rows;
use crate::lamp::arrival;
use crate::reflectance::dot;
use crate::render::{Kernel, Signals, Stage, Subject, TABLE_ALBEDO, Tile};
use nalgebra::{IsometryMatrix3, Point3, Vector3};
use weavelight_calibration::description::Plane;

/// A flat, matt target: its own frame has x to the right of what is on it, y up, z out of it, millimetres.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Where it is.
    pub rig_from_panel: IsometryMatrix3<f64>,
    /// What is on it.
    pub art: Art,
}

/// What is on a panel.
#[derive(Clone, Debug)]
pub enum Art {
    /// A chessboard on a white card.
    Board(BoardShape),
    /// Patches of known colour on a grey card.
    Chart(Chart),
    /// A white sheet.
    Sheet(Sheet),
}

impl Art {
    /// Reflectance (linear sRGB) at a place of the panel, constant between edges; `None` beyond the panel.
    fn ink(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        match self {
            Art::Board(board) => board.ink(x, y),
            Art::Chart(chart) => chart.ink(x, y),
            Art::Sheet(sheet) => sheet.ink(x, y),
        }
    }

    /// What changes smoothly over the panel: a factor for light `light` (`None`: ambient).
    fn factor(&self, light: Option<usize>, x: f64, y: f64) -> f64 {
        match self {
            Art::Sheet(sheet) => sheet.factor(light, x, y),
            _ => 1.0,
        }
    }
}

/// Samples along a photosite's side where an edge passes through it.
const EDGE_SAMPLES: usize = 6;

/// A pixel's corner on the panel.
type Corner = Option<[f64; 2]>;

impl Subject for Panel {
    fn expose(&self, stage: &Stage, tile: Tile, signals: &mut Signals) {
        let plane = self.plane();
        let kernel = Kernel::new(stage.view.psf_px, 1);
        let margin = kernel.margin();
        let corners = self.corners(stage, &plane, tile, margin);
        let (wide, high) = (tile.width + 2 * margin, tile.height + 2 * margin);
        let quad = |column: usize, row: usize| {
            let line = row * (wide + 1) + column;
            let below = line + wide + 1;
            [corners[line], corners[line + 1], corners[below], corners[below + 1]]
        };
        let inks: Vec<Ink> =
            (0..wide * high).map(|k| self.mean_ink(&quad(k % wide, k / wide))).collect();
        let channels = channel_rows();
        for at in 0..tile.pixels() {
            let (column, row) = (at % tile.width, at / tile.width);
            let (x, y) = (tile.x + column, tile.y + row);
            let ink = blurred(&inks, wide, [column, row], &kernel);
            match place(&quad(column + margin, row + margin)) {
                Some(middle) => {
                    let ink = ink.in_channel(channels[stage.cfa.channel(x, y) as usize]);
                    self.light_up(stage, (x, y), middle, ink, at, signals);
                }
                None => light_table(stage, (x, y), at, signals),
            }
        }
    }
}

/// Reflectance of a pixel's footprint, linear sRGB: a sum over samples.
#[derive(Clone, Copy)]
struct Ink {
    sum: [f32; 3],
    samples: f32,
}

impl Ink {
    fn even(ink: [f32; 3]) -> Self {
        Self { sum: ink, samples: 1.0 }
    }

    fn in_channel(&self, channel: [f32; 3]) -> f32 {
        dot(channel, self.sum) / self.samples
    }
}

/// The ink of a pixel of the tile as lens and filter blur it.
fn blurred(inks: &[Ink], wide: usize, [column, row]: [usize; 2], kernel: &Kernel) -> Ink {
    let mut sum = [0.0f32; 3];
    for (j, down) in kernel.weights().iter().enumerate() {
        for (i, across) in kernel.weights().iter().enumerate() {
            let ink = &inks[(row + j) * wide + column + i];
            if kernel.margin() == 0 {
                return *ink;
            }
            let weight = down * across / ink.samples;
            (0..3).for_each(|c| sum[c] += weight * ink.sum[c]);
        }
    }
    Ink::even(sum)
}

impl Panel {
    /// The panel's plane, rig frame.
    pub fn plane(&self) -> Plane {
        let normal = self.rig_from_panel.rotation.transform_vector(&Vector3::z());
        Plane {
            point_mm: self.rig_from_panel.transform_point(&Point3::origin()),
            normal: nalgebra::UnitVector3::new_normalize(normal),
        }
    }

    /// Where the corners of the pixels of a tile and of `margin` pixels around it lie on the panel, row by row.
    fn corners(&self, stage: &Stage, plane: &Plane, tile: Tile, margin: usize) -> Vec<Corner> {
        let panel_from_rig = self.rig_from_panel.inverse();
        let (width, height) = (tile.width + 2 * margin, tile.height + 2 * margin);
        let mut corners = Vec::with_capacity((width + 1) * (height + 1));
        let first = margin as f64 + 0.5;
        for row in 0..=height {
            corners.extend((0..=width).map(|column| {
                let (u, v) = ((tile.x + column) as f64 - first, (tile.y + row) as f64 - first);
                let point = stage.view.ray(u, v).meet(plane)?;
                let p = panel_from_rig.transform_point(&point);
                Some([p.x, p.y])
            }));
        }
        corners
    }

    /// Mean reflectance of a pixel's footprint.
    fn mean_ink(&self, quad: &[Corner; 4]) -> Ink {
        let ink = |p: [f64; 2]| self.art.ink(p[0], p[1]).unwrap_or([TABLE_ALBEDO; 3]);
        let [Some(a), Some(b), Some(c), Some(d)] = *quad else {
            return Ink::even([TABLE_ALBEDO; 3]);
        };
        let first = ink(a);
        if [b, c, d, between(a, b, c, d, 0.5, 0.5)].into_iter().all(|p| ink(p) == first) {
            return Ink::even(first);
        }
        let offset = |i: usize| (i as f64 + 0.5) / EDGE_SAMPLES as f64;
        let mut sum = [0.0f32; 3];
        for k in 0..EDGE_SAMPLES * EDGE_SAMPLES {
            let sample =
                ink(between(a, b, c, d, offset(k % EDGE_SAMPLES), offset(k / EDGE_SAMPLES)));
            (0..3).for_each(|c| sum[c] += sample[c]);
        }
        Ink { sum, samples: (EDGE_SAMPLES * EDGE_SAMPLES) as f32 }
    }

    fn light_up(
        &self,
        stage: &Stage,
        (x, y): (usize, usize),
        [a, b]: [f64; 2],
        ink: f32,
        at: usize,
        signals: &mut Signals,
    ) {
        let point = self.rig_from_panel.transform_point(&Point3::new(a, b, 0.0));
        let normal = self.rig_from_panel.rotation.transform_vector(&Vector3::z());
        let channel = stage.cfa.channel(x, y) as usize;
        let passed = stage.view.transmission(x as f64, y as f64) * f64::from(ink);
        for (i, (light, out)) in stage.lights.iter().zip(&mut signals.lights).enumerate() {
            let arrival = arrival(light, &point);
            let facing = arrival.towards.dot(&normal).max(0.0);
            let signal = arrival.strength * facing * light.intensity()[channel] * passed;
            out[at] = (signal * self.art.factor(Some(i), a, b)) as f32;
        }
        signals.ambient[at] =
            (stage.ambient[channel] * passed * self.art.factor(None, a, b)) as f32;
        if let Some(truth) = &mut signals.truth {
            truth.normal[at] = [normal.x as f32, normal.y as f32, normal.z as f32];
            truth.albedo[at] = self.art.ink(a, b).unwrap_or([TABLE_ALBEDO; 3]);
        }
    }
}

/// The middle of a pixel on the panel.
fn place(quad: &[Corner; 4]) -> Option<[f64; 2]> {
    Some(between(quad[0]?, quad[1]?, quad[2]?, quad[3]?, 0.5, 0.5))
}

fn between(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2], s: f64, t: f64) -> [f64; 2] {
    std::array::from_fn(|k| {
        let top = a[k] + (b[k] - a[k]) * s;
        let bottom = c[k] + (d[k] - c[k]) * s;
        top + (bottom - top) * t
    })
}

/// A pixel that does not see the panel's plane at all: the dark room.
fn light_table(stage: &Stage, (x, y): (usize, usize), at: usize, signals: &mut Signals) {
    let channel = stage.cfa.channel(x, y) as usize;
    signals.ambient[at] = stage.ambient[channel] as f32 * TABLE_ALBEDO;
}

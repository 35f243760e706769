use super::blur::{Kernel, expose_blurred};
use super::bounce::gather;
use super::relief::HeightGrid;
use super::{Signals, Stage, Subject, Tile};
use crate::cloth::{Cloth, Surface};
use crate::color::channel_rows;
use crate::lamp::arrival;
use crate::reflectance::{Directions, dot};
use crate::view::Ray;
use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::{Light, Plane};

/// A cloth on the table, as a subject.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// The cloth.
    pub cloth: Cloth,
    /// Height of the cloth's plane over the table, millimetres: the thickness of the swatch.
    pub thickness_mm: f64,
    /// Where the cloth ends; beyond is the dark table. `None`: it fills the picture.
    pub extent: Option<Extent>,
    /// Light that one yarn throws onto the next.
    pub bounce: Bounce,
    /// Samples along each side of a photosite; `None` chooses by the size of the yarns.
    pub samples: Option<usize>,
}

/// A rectangle around the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Along x, millimetres.
    pub width_mm: f64,
    /// Along y, millimetres.
    pub height_mm: f64,
}

/// Whether light that bounced once is added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounce {
    /// Direct light only.
    None,
    /// One bounce.
    Once,
}

/// Reflectance of the table.
pub(crate) const TABLE_ALBEDO: f32 = 0.04;
/// Most samples along a photosite's side.
const MOST_SAMPLES: usize = 4;
/// Lights lower than this above the plane are taken to be this high when the reach of shadows is bounded.
const LOWEST_LIGHT_SLOPE: f64 = 0.08;

/// One sample of the surface within a photosite's footprint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    pub(super) x_mm: f64,
    pub(super) y_mm: f64,
    pub(super) height_mm: f32,
    pub(super) normal: [f32; 3],
    /// Linear sRGB.
    pub(super) reflectance: [f32; 3],
    /// The same in camera RGB.
    pub(super) albedo: [f32; 3],
    /// Cloth may shine; the table is matt.
    pub(super) is_cloth: bool,
}

/// A light as seen from one photosite.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beam {
    pub(super) towards: [f32; 3],
    /// Signal of a white diffuser that faces the light.
    pub(super) strength: f32,
}

impl Subject for Fabric {
    fn expose(&self, stage: &Stage, tile: Tile, signals: &mut Signals) {
        let kernel = Kernel::new(stage.view.psf_px, self.samples_per_side(stage.view.mm_per_px()));
        let scene = TileScene::new(self, stage, tile, kernel.margin());
        if kernel.margin() > 0 {
            return expose_blurred(&scene, &kernel, tile, signals);
        }
        let (mut hits, mut beams) = (Vec::new(), Vec::new());
        for at in 0..tile.pixels() {
            scene.expose(
                tile.x + at % tile.width,
                tile.y + at / tile.width,
                at,
                &mut hits,
                &mut beams,
                signals,
            );
        }
    }
}

impl Fabric {
    /// The surface at a place, heights over the cloth's plane.
    pub(super) fn surface(&self, x: f64, y: f64) -> Surface {
        if self.covers(x, y) {
            return self.cloth.surface(x, y);
        }
        Surface { height_mm: self.table_mm(), slope: [0.0; 2], albedo: [TABLE_ALBEDO; 3] }
    }

    fn height_mm(&self, x: f64, y: f64) -> f64 {
        if self.covers(x, y) { self.cloth.height_mm(x, y) } else { self.table_mm() }
    }

    /// Height of the table over the cloth's plane: the cloth lies on it.
    fn table_mm(&self) -> f64 {
        (-self.thickness_mm).min(self.cloth.range_mm()[0])
    }

    fn covers(&self, x: f64, y: f64) -> bool {
        self.extent.is_none_or(|extent| {
            2.0 * x.abs() <= extent.width_mm && 2.0 * y.abs() <= extent.height_mm
        })
    }

    fn range_mm(&self) -> [f64; 2] {
        let [low, high] = self.cloth.range_mm();
        if self.extent.is_some() { [low.min(self.table_mm()), high] } else { [low, high] }
    }

    fn occludes(&self) -> bool {
        self.cloth.relief.occludes() || self.cloth.wave_slope() > 0.4
    }

    /// Samples along a photosite's side: enough for a quarter of a yarn's half width.
    fn samples_per_side(&self, mm_per_px: f64) -> usize {
        let wanted = (mm_per_px / (0.6 * self.cloth.relief.detail_mm())).ceil() as usize;
        self.samples.unwrap_or(wanted.clamp(2, MOST_SAMPLES)).max(1)
    }

    /// Distance of the nodes of the height grid: finer than both photosites and yarns, but no finer than a frame of few
    /// pixels can show, nor than a yarn's form needs: shadows are as long under a microscope, and the grid must hold them.
    fn grid_step_mm(&self, mm_per_px: f64) -> f64 {
        let fine = (0.5 * mm_per_px).min(self.cloth.relief.detail_mm() / 6.0);
        fine.max(mm_per_px / 12.0).max(self.cloth.relief.detail_mm() / 25.0)
    }
}

/// All that the photosites of a tile share.
pub(super) struct TileScene<'a> {
    pub(super) fabric: &'a Fabric,
    pub(super) stage: &'a Stage,
    plane: Plane,
    center: Point3<f64>,
    pub(super) grid: Option<HeightGrid>,
    pub(super) samples: usize,
    pub(super) channels: [[f32; 3]; 3],
}

/// The surface that a photosite sees.
pub(super) struct Seen {
    /// Its middle, rig frame.
    pub(super) middle: Point3<f64>,
    /// Sums over the samples.
    normal: [f32; 3],
    albedo: [f32; 3],
    height_mm: f64,
}

impl<'a> TileScene<'a> {
    /// The scene of a tile and of `margin` photosites around it.
    fn new(fabric: &'a Fabric, stage: &'a Stage, tile: Tile, margin: usize) -> Self {
        let plane = Plane {
            point_mm: Point3::new(0.0, 0.0, fabric.thickness_mm),
            normal: Vector3::z_axis(),
        };
        let mm_per_px = stage.view.mm_per_px();
        Self {
            fabric,
            stage,
            center: stage.view.center(),
            grid: fabric.occludes().then(|| tabulate(fabric, stage, tile, margin)),
            plane,
            samples: fabric.samples_per_side(mm_per_px),
            channels: channel_rows(),
        }
    }

    /// One photosite: its samples of the surface, every light on them, and the truth.
    fn expose(
        &self,
        x: usize,
        y: usize,
        at: usize,
        hits: &mut Vec<Hit>,
        beams: &mut Vec<Beam>,
        out: &mut Signals,
    ) {
        let channel = self.stage.cfa.channel(x, y) as usize;
        let Some(seen) = self.find_hits([x as f64, y as f64], hits) else { return };
        let middle = seen.middle;
        if let Some(truth) = &mut out.truth {
            let norm = dot(seen.normal, seen.normal).sqrt().max(1e-12);
            truth.normal[at] = seen.normal.map(|c| c / norm);
            truth.albedo[at] = seen.albedo.map(|c| c / hits.len() as f32);
            truth.height_mm[at] = seen.height_mm as f32;
        }
        let transmission = self.stage.view.transmission(x as f64, y as f64);
        self.find_beams(&middle, channel, transmission, beams);
        let view = self.towards_camera(&middle);
        let share = 1.0 / hits.len() as f32;
        for (beam, light) in beams.iter().zip(&mut out.lights) {
            let sum: f32 = hits.iter().map(|hit| self.direct(hit, beam, view, channel)).sum();
            light[at] = beam.strength * share * sum;
        }
        if let (Bounce::Once, Some(grid)) = (self.fabric.bounce, &self.grid) {
            let channels = (&self.channels, [channel]);
            gather(self.fabric, grid, channels, hits, beams, |i, [more]| out.lights[i][at] += more);
        }
        let sky: f32 = hits.iter().map(|hit| hit.albedo[channel] * sky_over(hit)).sum();
        out.ambient[at] = (self.stage.ambient[channel] * transmission) as f32 * share * sky;
    }

    /// Unit vector to the camera.
    pub(super) fn towards_camera(&self, place: &Point3<f64>) -> [f32; 3] {
        let view = (self.center - place).normalize();
        [view.x as f32, view.y as f32, view.z as f32]
    }

    #[inline]
    fn direct(&self, hit: &Hit, beam: &Beam, view: [f32; 3], channel: usize) -> f32 {
        let facing = self.facing(hit, beam);
        if facing <= 0.0 { 0.0 } else { facing * self.reflected(hit, beam, view, channel) }
    }

    /// Cosine between surface and light; 0 where the light does not reach it.
    #[inline]
    pub(super) fn facing(&self, hit: &Hit, beam: &Beam) -> f32 {
        let facing = dot(hit.normal, beam.towards);
        if facing <= 0.0 {
            return 0.0;
        }
        match &self.grid {
            Some(grid) if !grid.is_open(hit.x_mm, hit.y_mm, hit.height_mm, beam.towards) => 0.0,
            _ => facing,
        }
    }

    /// Share of the light that goes towards the camera, times pi.
    #[inline]
    pub(super) fn reflected(&self, hit: &Hit, beam: &Beam, view: [f32; 3], channel: usize) -> f32 {
        if !hit.is_cloth {
            return hit.albedo[channel];
        }
        let directions = Directions { normal: hit.normal, light: beam.towards, view };
        hit.albedo[channel] + self.fabric.cloth.reflectance.gloss(&directions, channel)
    }

    /// Samples a photosite's footprint.
    pub(super) fn find_hits(&self, [x, y]: [f64; 2], hits: &mut Vec<Hit>) -> Option<Seen> {
        hits.clear();
        let per_side = self.samples;
        let (mut normal, mut albedo, mut middle) = ([0.0f32; 3], [0.0f32; 3], Vector3::zeros());
        for k in 0..per_side * per_side {
            let offset = |i: usize| (i as f64 + 0.5) / per_side as f64 - 0.5;
            let ray = self.stage.view.ray(x + offset(k % per_side), y + offset(k / per_side));
            let [px, py] = self.meet(&ray)?;
            let surface = self.fabric.surface(px, py);
            let n = unit_normal(surface.slope);
            for c in 0..3 {
                normal[c] += n[c];
                albedo[c] += surface.albedo[c];
            }
            middle += Vector3::new(px, py, surface.height_mm);
            hits.push(Hit {
                x_mm: px,
                y_mm: py,
                height_mm: surface.height_mm as f32,
                normal: n,
                reflectance: surface.albedo,
                albedo: self.channels.map(|row| dot(row, surface.albedo)),
                is_cloth: self.fabric.covers(px, py),
            });
        }
        middle /= hits.len() as f64;
        Some(Seen {
            middle: Point3::new(middle.x, middle.y, middle.z + self.fabric.thickness_mm),
            normal,
            albedo,
            height_mm: middle.z,
        })
    }

    /// Where a ray of sight meets the cloth.
    fn meet(&self, ray: &Ray) -> Option<[f64; 2]> {
        let on_plane = ray.meet(&self.plane)?;
        if ray.direction.z >= -1e-3 {
            return None;
        }
        let fall = [-ray.direction.x / ray.direction.z, -ray.direction.y / ray.direction.z];
        if let Some(grid) = &self.grid {
            return Some(grid.sight([on_plane.x, on_plane.y, 0.0], fall));
        }
        let mut at = [on_plane.x, on_plane.y];
        if self.fabric.cloth.wrinkles.is_some() {
            // Shallow waves: the fixed point of "look where the surface of the last guess lies".
            for _ in 0..8 {
                let down = -self.fabric.height_mm(at[0], at[1]);
                at = [on_plane.x + fall[0] * down, on_plane.y + fall[1] * down];
            }
        }
        Some(at)
    }

    pub(super) fn find_beams(
        &self,
        middle: &Point3<f64>,
        channel: usize,
        transmission: f64,
        beams: &mut Vec<Beam>,
    ) {
        beams.clear();
        beams.extend(self.stage.lights.iter().map(|light| {
            let arrival = arrival(light, middle);
            let strength = arrival.strength * light.intensity()[channel] * transmission;
            let towards =
                [arrival.towards.x as f32, arrival.towards.y as f32, arrival.towards.z as f32];
            Beam { towards, strength: strength as f32 }
        }));
    }
}

/// Share of an even sky that a surface sees.
#[inline]
pub(super) fn sky_over(hit: &Hit) -> f32 {
    0.5 + 0.5 * hit.normal[2]
}

#[inline]
pub(super) fn unit_normal([sx, sy]: [f64; 2]) -> [f32; 3] {
    let scale = 1.0 / (sx * sx + sy * sy + 1.0).sqrt();
    [(-sx * scale) as f32, (-sy * scale) as f32, scale as f32]
}

/// The relief under a tile and around it, as far as shadows and sight reach.
fn tabulate(fabric: &Fabric, stage: &Stage, tile: Tile, around: usize) -> HeightGrid {
    let [low, high] = fabric.range_mm();
    let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (u, v) in border(tile, around as f64) {
        let ray = stage.view.ray(u, v);
        for height in [low, high] {
            let plane = Plane {
                point_mm: Point3::new(0.0, 0.0, fabric.thickness_mm + height),
                normal: Vector3::z_axis(),
            };
            let Some(point) = ray.meet(&plane) else { continue };
            for (k, c) in [point.x, point.y].into_iter().enumerate() {
                least[k] = least[k].min(c);
                most[k] = most[k].max(c);
            }
        }
    }
    if least[0] > most[0] {
        (least, most) = ([0.0; 2], [0.0; 2]);
    }
    let middle =
        Point3::new(0.5 * (least[0] + most[0]), 0.5 * (least[1] + most[1]), fabric.thickness_mm);
    let reach = shadow_reach_mm(fabric, stage, &middle);
    let step = fabric.grid_step_mm(stage.view.mm_per_px());
    let margin = reach + 2.0 * step + stage.view.mm_per_px();
    // On one lattice for the whole table: shadows reach as far as the lights of this stage cast them, but where the nodes
    // lie must not depend on which lights are lit, or frames of single lights would see different yarns.
    let origin = least.map(|c| ((c - margin) / step).floor() * step);
    HeightGrid::tabulate(origin, most.map(|c| c + margin), step, |x, y| fabric.height_mm(x, y))
}

/// Points `around` photosites beyond a tile at which its outline is followed; the half pixels around it are within the
/// grid's margin.
fn border(tile: Tile, around: f64) -> Vec<(f64, f64)> {
    const POINTS: usize = 4;
    let along = |from: usize, length: usize, k: usize| {
        from as f64 - around + (length as f64 - 1.0 + 2.0 * around) * k as f64 / POINTS as f64
    };
    (0..=POINTS)
        .flat_map(|k| {
            let (u, v) = (along(tile.x, tile.width, k), along(tile.y, tile.height, k));
            let [left, right] = [0, POINTS].map(|k| along(tile.x, tile.width, k));
            let [top, bottom] = [0, POINTS].map(|k| along(tile.y, tile.height, k));
            [(u, top), (u, bottom), (left, v), (right, v)]
        })
        .collect()
}

/// The longest shadow that the relief can cast near a place. Waves are gentle: only the relief on them counts, seen
/// against their slope.
fn shadow_reach_mm(fabric: &Fabric, stage: &Stage, middle: &Point3<f64>) -> f64 {
    let waves = fabric.cloth.wrinkles.as_ref().map_or(0.0, |_| fabric.cloth.wave_slope());
    let [low, high] = if waves < 0.4 && fabric.extent.is_none() {
        fabric.cloth.relief.range_mm()
    } else {
        fabric.range_mm()
    };
    let slope = |light: &Light| {
        let towards = arrival(light, middle).towards;
        towards.z / towards.x.hypot(towards.y).max(1e-9)
    };
    let lowest = stage.lights.iter().map(slope).filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    (high - low) / (lowest - waves).max(LOWEST_LIGHT_SLOPE)
}

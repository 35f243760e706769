use super::{Point, Top};
use crate::random::{Key, line_noise, split};

/// What all yarns of one family (warp, weft, a knit's only yarn) have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct Yarn {
    /// Distance between neighbouring yarns, millimetres.
    pub spacing_mm: f64,
    /// Half the width of a yarn seen from above, millimetres.
    pub half_width_mm: f64,
    /// Height of the yarn's top over its edges, millimetres: a yarn in cloth is flattened to a lens.
    pub rise_mm: f64,
    /// How far a yarn wanders sideways, millimetres.
    pub wander_mm: f64,
    /// Relative change of the width along the yarn: linen's slubs.
    pub slub: f64,
    /// Length over which a yarn wanders and swells, millimetres.
    pub wander_length_mm: f64,
    /// Height of the ridges that the twisted plies leave, millimetres.
    pub twist_mm: f64,
    /// Length of one turn of the twist, millimetres.
    pub twist_pitch_mm: f64,
    /// Diffuse reflectance of a crown, linear sRGB.
    pub color: [f32; 3],
    /// Diffuse reflectance between crowns, linear sRGB (dye that wore off the crowns, as denim's).
    pub color_low: [f32; 3],
    /// Relative difference in shade from yarn to yarn and along a yarn.
    pub shade_spread: f64,
}

/// Ridges seen across a yarn: how much of a turn lies between its edge and its middle.
const TWIST_SLANT: f64 = 0.8;

/// The place on a yarn's lens-shaped top, in the yarn's own coordinates.
pub(crate) struct Lens {
    /// From the middle, in half widths: -1..1.
    pub(crate) u: f64,
    /// du across the yarn, per mm.
    pub(crate) u_across: f64,
    /// du along the yarn, per mm.
    pub(crate) u_along: f64,
    /// Height of the yarn's edges, mm, and its slope along the yarn.
    pub(crate) edge: (f64, f64),
    /// Along the yarn, mm.
    pub(crate) along_mm: f64,
}

/// Height and slope (across, along) on a yarn's top.
pub(crate) struct Crown {
    pub(crate) height_mm: f64,
    pub(crate) across: f64,
    pub(crate) along: f64,
}

impl Yarn {
    /// Sideways displacement (mm, slope) and relative width (1 = nominal, slope per mm) of one yarn.
    #[inline]
    pub(crate) fn course(&self, key: Key, along_mm: f64) -> [(f64, f64); 2] {
        let per_mm = 1.0 / self.wander_length_mm;
        let [side, swell] = line_noise(key, along_mm * per_mm);
        [
            (self.wander_mm * side.0, self.wander_mm * side.1 * per_mm),
            (1.0 + self.slub * swell.0, self.slub * swell.1 * per_mm),
        ]
    }

    /// The lens z = edge + rise (1 - u^2), with the ridges of the twist on it.
    #[inline]
    pub(crate) fn crown(&self, lens: &Lens) -> Crown {
        let (u, dome) = (lens.u, 1.0 - lens.u * lens.u);
        let (wave, wave_slope) = round_wave(lens.along_mm / self.twist_pitch_mm + TWIST_SLANT * u);
        let height_mm = lens.edge.0 + (self.rise_mm + self.twist_mm * wave) * dome;
        let by_u = -2.0 * u * (self.rise_mm + self.twist_mm * wave)
            + self.twist_mm * TWIST_SLANT * wave_slope * dome;
        let by_along = self.twist_mm * wave_slope / self.twist_pitch_mm * dome;
        Crown {
            height_mm,
            across: by_u * lens.u_across,
            along: lens.edge.1 + by_along + by_u * lens.u_along,
        }
    }

    /// Highest surface over the yarn's edges, millimetres.
    pub(crate) fn top_mm(&self) -> f64 {
        self.rise_mm + self.twist_mm
    }

    /// Colour of a place: `crown` 0 (lowest) .. 1 (highest).
    pub(crate) fn shade(&self, key: Key, along_mm: f64, crown: f64) -> [f32; 3] {
        let yarn = key.with(1).signed_unit();
        let [along, _] = line_noise(key.with(2), along_mm / self.wander_length_mm);
        let shade = (1.0 + self.shade_spread * (0.6 * yarn + 0.4 * along.0)) as f32;
        let mix = crown.clamp(0.0, 1.0) as f32;
        std::array::from_fn(|c| {
            ((self.color_low[c] + (self.color[c] - self.color_low[c]) * mix) * shade).min(1.0)
        })
    }
}

/// A wave of period 1 and height 1 made of parabolas, like a sine with a continuous slope; with its derivative.
#[inline]
fn round_wave(t: f64) -> (f64, f64) {
    let (_, t) = split(t);
    let (half, sign) = if t < 0.5 { (t, 1.0) } else { (t - 0.5, -1.0) };
    (sign * 16.0 * half * (0.5 - half), sign * (8.0 - 32.0 * half))
}

/// The place between yarns, `depth` below the plane.
pub(crate) fn ground(height_mm: f64) -> Point {
    Point { height_mm, slope: [0.0; 2], top: Top::Ground }
}

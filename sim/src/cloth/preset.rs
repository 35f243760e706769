use super::{Cloth, Facets, Knit, Pattern, Pile, Relief, Woven, Yarn};
use crate::reflectance::Reflectance;

/// A cloth by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Natural flax, plain weave with slubs.
    Linen,
    /// Indigo warp over undyed weft, 3/1 twill.
    Denim,
    /// Eight-shaft satin, glossy.
    Satin,
    /// A pile that shines at its edges.
    Velvet,
    /// Stockinette of wool.
    Knit,
    /// Planar facets of known tilt, matt grey.
    Facets,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Preset; 6] =
        [Preset::Linen, Preset::Denim, Preset::Satin, Preset::Velvet, Preset::Knit, Preset::Facets];

    /// As the command line says it.
    pub fn name(self) -> &'static str {
        match self {
            Preset::Linen => "linen",
            Preset::Denim => "denim",
            Preset::Satin => "satin",
            Preset::Velvet => "velvet",
            Preset::Knit => "knit",
            Preset::Facets => "facets",
        }
    }

    /// Reads [`Preset::name`].
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// The cloth; the seed makes one piece differ from another.
    pub fn cloth(self, seed: u64) -> Cloth {
        let relief = match self {
            Preset::Linen => Structure::Plain.relief(None, None, seed),
            Preset::Denim => denim(seed),
            Preset::Satin => Structure::Satin.relief(None, None, seed),
            Preset::Velvet => Relief::Pile(Pile {
                tuft_mm: 0.45,
                tuft_height_mm: 0.05,
                nap_mm: 14.0,
                nap_height_mm: 0.6,
                color: [0.24, 0.035, 0.055],
                seed,
            }),
            Preset::Knit => Structure::Knit.relief(None, None, seed),
            Preset::Facets => Structure::Facets.relief(None, None, seed),
        };
        Cloth { relief, wrinkles: None, print: None, reflectance: self.reflectance() }
    }

    fn reflectance(self) -> Reflectance {
        match self {
            Preset::Satin => Reflectance::Satin { f0: 0.05, alpha: 0.28 },
            Preset::Velvet => Reflectance::Velvet { sheen: [0.12, 0.05, 0.06], alpha: 0.35 },
            _ => Reflectance::Lambert,
        }
    }
}

/// How a cloth is made, at any thread count and yarn radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Structure {
    /// A plane.
    Flat,
    /// Planar facets.
    Facets,
    /// Plain weave.
    Plain,
    /// 3/1 twill.
    Twill,
    /// Eight-shaft satin.
    Satin,
    /// Weft rib.
    Rib,
    /// Stockinette.
    Knit,
}

impl Structure {
    /// Every structure.
    pub const ALL: [Structure; 7] = [
        Structure::Flat,
        Structure::Facets,
        Structure::Plain,
        Structure::Twill,
        Structure::Satin,
        Structure::Rib,
        Structure::Knit,
    ];

    /// As the command line says it.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Flat => "flat",
            Structure::Facets => "facets",
            Structure::Plain => "plain",
            Structure::Twill => "twill",
            Structure::Satin => "satin",
            Structure::Rib => "rib",
            Structure::Knit => "knit",
        }
    }

    /// Reads [`Structure::name`].
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|structure| structure.name() == name)
    }

    /// The relief at `threads_per_cm` (warp; a knit's wales) with yarns of `radius_mm` (half width seen from above).
    /// What is `None` is the structure's usual figure; flat and facets have neither.
    pub fn relief(self, threads_per_cm: Option<f64>, radius_mm: Option<f64>, seed: u64) -> Relief {
        match self {
            Structure::Flat => Relief::Flat([0.5; 3]),
            Structure::Facets => Relief::Facets(Facets { patch_mm: 10.0, albedo: [0.5; 3] }),
            Structure::Knit => knit(threads_per_cm, radius_mm, seed),
            Structure::Plain => {
                woven(Pattern::Plain, [17.0, 16.0], FLAX, threads_per_cm, radius_mm, seed)
            }
            Structure::Twill => {
                woven(Pattern::Twill, [26.0, 18.0], COTTON, threads_per_cm, radius_mm, seed)
            }
            Structure::Satin => {
                woven(Pattern::Satin, [38.0, 24.0], SILK, threads_per_cm, radius_mm, seed)
            }
            Structure::Rib => {
                woven(Pattern::Rib, [24.0, 14.0], COTTON, threads_per_cm, radius_mm, seed)
            }
        }
    }
}

/// What a fibre is like, apart from how densely it is woven.
#[derive(Clone, Copy)]
struct Fibre {
    /// Width of a yarn over the distance of the yarns.
    cover: f64,
    /// Height of a yarn's dome over its half width.
    roundness: f64,
    wander: f64,
    slub: f64,
    twist: f64,
    color: [f32; 3],
    spread: f64,
}

const FLAX: Fibre = Fibre {
    cover: 0.9,
    roundness: 0.72,
    wander: 0.07,
    slub: 0.17,
    twist: 0.035,
    color: [0.56, 0.46, 0.33],
    spread: 0.14,
};
const COTTON: Fibre = Fibre {
    cover: 1.04,
    roundness: 0.7,
    wander: 0.03,
    slub: 0.06,
    twist: 0.04,
    color: [0.62, 0.59, 0.53],
    spread: 0.08,
};
const SILK: Fibre = Fibre {
    cover: 1.06,
    roundness: 0.42,
    wander: 0.02,
    slub: 0.02,
    twist: 0.01,
    color: [0.50, 0.34, 0.36],
    spread: 0.04,
};
const WOOL: Fibre = Fibre {
    cover: 0.48,
    roundness: 0.75,
    wander: 0.02,
    slub: 0.06,
    twist: 0.07,
    color: [0.30, 0.38, 0.34],
    spread: 0.07,
};

fn yarn(fibre: Fibre, threads_per_cm: f64, radius_mm: Option<f64>) -> Yarn {
    let spacing_mm = 10.0 / threads_per_cm;
    let half_width_mm = radius_mm.unwrap_or(0.5 * fibre.cover * spacing_mm);
    Yarn {
        spacing_mm,
        half_width_mm,
        rise_mm: fibre.roundness * half_width_mm,
        wander_mm: fibre.wander * spacing_mm,
        slub: fibre.slub,
        wander_length_mm: 9.0 * spacing_mm,
        twist_mm: fibre.twist * half_width_mm,
        twist_pitch_mm: 1.6 * half_width_mm,
        color: fibre.color,
        color_low: fibre.color.map(|c| 0.92 * c),
        shade_spread: fibre.spread,
    }
}

fn woven(
    pattern: Pattern,
    usual: [f64; 2],
    fibre: Fibre,
    threads_per_cm: Option<f64>,
    radius_mm: Option<f64>,
    seed: u64,
) -> Relief {
    let warp_count = threads_per_cm.unwrap_or(usual[0]);
    let weft_count = warp_count * usual[1] / usual[0];
    let (warp, weft) = (yarn(fibre, warp_count, radius_mm), yarn(fibre, weft_count, radius_mm));
    // The two families touch where they cross: their middles are half the sum of their heights apart.
    let crimp_mm = 0.25 * (warp.rise_mm + weft.rise_mm) * 1.3;
    Relief::Woven(Woven { warp, weft, pattern, crimp_mm, seed })
}

fn denim(seed: u64) -> Relief {
    let mut relief = Structure::Twill.relief(None, None, seed);
    if let Relief::Woven(woven) = &mut relief {
        // Indigo rings the yarn and wears off its crowns.
        woven.warp.color = [0.085, 0.135, 0.26];
        woven.warp.color_low = [0.018, 0.032, 0.085];
        woven.warp.shade_spread = 0.28;
    }
    relief
}

fn knit(threads_per_cm: Option<f64>, radius_mm: Option<f64>, seed: u64) -> Relief {
    let yarn = yarn(WOOL, threads_per_cm.unwrap_or(6.5), radius_mm);
    let course_mm = 0.78 * yarn.spacing_mm;
    let loop_mm = 0.55 * yarn.rise_mm;
    Relief::Knit(Knit { yarn, course_mm, loop_mm, seed })
}

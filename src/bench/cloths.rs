//! Cloths whose colours are hard to find: every preset, prints, and what overfitted methods fail on.

use crate::simulate::Material;
use weavelight_sim::cloth::{Preset, Structure};

/// A cloth of the colour tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorCloth {
    /// As tables call it.
    pub name: &'static str,
    preset: Preset,
    structure: Option<Structure>,
    /// Warp and weft.
    dyes: Option<[[f64; 3]; 2]>,
    /// From yarn to yarn of the warp; the weft lies 6 % wider.
    pitch_px: Option<f64>,
    wear: Option<f64>,
    print: bool,
}

const PLAIN: ColorCloth = ColorCloth {
    name: "",
    preset: Preset::Linen,
    structure: None,
    dyes: None,
    pitch_px: None,
    wear: None,
    print: false,
};

const NEUTRAL: [f64; 3] = [0.5; 3];
const FLAX: [f64; 3] = [0.56, 0.46, 0.33];
const RED: [f64; 3] = [0.5, 0.12, 0.1];
const GREEN: [f64; 3] = [0.12, 0.4, 0.15];
const TAN: [f64; 3] = [0.45, 0.3, 0.15];
const BLUE: [f64; 3] = [0.12, 0.3, 0.45];
const CLOSE: [[f64; 3]; 2] = [[0.30, 0.25, 0.20], [0.38, 0.36, 0.33]];

const fn preset(preset: Preset, name: &'static str) -> ColorCloth {
    ColorCloth { name, preset, ..PLAIN }
}

const fn dyed(name: &'static str, pitch_px: f64, dyes: [[f64; 3]; 2]) -> ColorCloth {
    ColorCloth { name, dyes: Some(dyes), pitch_px: Some(pitch_px), ..PLAIN }
}

const fn flat(name: &'static str, print: bool) -> ColorCloth {
    ColorCloth { name, preset: Preset::Facets, structure: Some(Structure::Flat), print, ..PLAIN }
}

impl ColorCloth {
    /// Every one.
    pub const ALL: [Self; 21] = [
        preset(Preset::Linen, "linen"),
        preset(Preset::Denim, "denim"),
        preset(Preset::Knit, "knit"),
        preset(Preset::Satin, "satin"),
        preset(Preset::Velvet, "velvet"),
        preset(Preset::Facets, "facets"),
        ColorCloth { name: "print on linen", print: true, ..PLAIN },
        flat("print on flat", true),
        flat("flat grey", false),
        dyed("neutral, 2.6 px", 2.6, [NEUTRAL; 2]),
        dyed("neutral, 5.3 px", 5.3, [NEUTRAL; 2]),
        dyed("one dye, 1.97 px", 1.97, [FLAX; 2]),
        dyed("one dye, 2.00 px", 2.0, [FLAX; 2]),
        dyed("one dye, 7 px", 7.0, [FLAX; 2]),
        dyed("red and green, 2.6 px", 2.6, [RED, GREEN]),
        dyed("red and green, 4.1 px", 4.1, [RED, GREEN]),
        dyed("tan and blue, 2.6 px", 2.6, [TAN, BLUE]),
        dyed("tan and blue, 4.1 px", 4.1, [TAN, BLUE]),
        dyed("close dyes, 3 px", 3.0, CLOSE),
        ColorCloth { wear: Some(0.4), ..dyed("crowns worn 40 %, 4 px", 4.0, [FLAX; 2]) },
        dyed("one dye, 4.00 px", 4.0, [FLAX; 2]),
    ];

    /// By name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cloth| cloth.name == name)
    }

    /// As a camera sees it whose photosites are this far apart on the table.
    pub(super) fn material(&self, mm_per_px: f64) -> Material {
        Material {
            preset: self.preset,
            structure: self.structure,
            threads_per_cm: self.pitch_px.map(|pitch| 10.0 / (pitch * mm_per_px)),
            warp_color: self.dyes.map(|[warp, _]| warp),
            weft_color: self.dyes.map(|[_, weft]| weft),
            wear: self.wear,
            print: self.print,
            ..Material::default()
        }
    }
}

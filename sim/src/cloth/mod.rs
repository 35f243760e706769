//! Cloth as a height field with ground truth: the height of the yarns over the swatch's plane, its slope, and the
//! colour of what is on top, at any place and for any extent (nothing repeats: yarns wander, swell and vary in
//! shade by noise keyed with the yarn's number).
//!
//! Coordinates are x and y of the rig frame in millimetres; heights count from the swatch's plane.

mod facets;
mod knit;
mod pile;
mod preset;
mod print;
mod thread;
mod weave;
mod wrinkles;

pub use facets::{FACET_TILTS_DEG, Facets};
pub use knit::Knit;
pub use pile::Pile;
pub use preset::{Preset, Structure};
pub use print::Print;
pub use thread::Yarn;
pub use weave::{Pattern, Woven};
pub use wrinkles::Wrinkles;

use crate::reflectance::Reflectance;

/// A fabric lying on a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Cloth {
    /// How it is made.
    pub relief: Relief,
    /// Large-scale waves, if any.
    pub wrinkles: Option<Wrinkles>,
    /// What is printed on it, if anything.
    pub print: Option<Print>,
    /// How its fibres reflect.
    pub reflectance: Reflectance,
}

/// The small-scale height field.
#[derive(Clone, Debug, PartialEq)]
pub enum Relief {
    /// A plane of one colour (linear sRGB reflectance).
    Flat([f32; 3]),
    /// Planar facets at known tilts.
    Facets(Facets),
    /// Warp and weft.
    Woven(Woven),
    /// Loops.
    Knit(Knit),
    /// A dense pile such as velvet's.
    Pile(Pile),
}

/// The surface at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Above the swatch's plane, millimetres.
    pub height_mm: f64,
    /// dz/dx and dz/dy.
    pub slope: [f64; 2],
    /// Diffuse reflectance, linear sRGB, 1 = perfect white.
    pub albedo: [f32; 3],
}

/// What one relief says of one place: height, slope, and which material is on top.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) height_mm: f64,
    pub(crate) slope: [f64; 2],
    pub(crate) top: Top,
}

/// The material on top.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Top {
    /// A yarn of family 0 (warp) or 1 (weft), its number, the place along it in mm and the height of the place over the
    /// lowest and below the highest yarn surface, 0..1.
    Yarn { family: u8, index: i64, along_mm: f64, crown: f64 },
    /// Between yarns, or no yarns at all.
    Ground,
}

impl Cloth {
    /// The surface at (x, y).
    pub fn surface(&self, x_mm: f64, y_mm: f64) -> Surface {
        let point = self.relief.point(x_mm, y_mm);
        let (wave, wave_slope) = self.wave(x_mm, y_mm);
        let mut albedo = self.relief.albedo(point.top, x_mm, y_mm);
        if let Some(print) = &self.print {
            albedo = print.over(albedo, x_mm, y_mm);
        }
        let slope = [point.slope[0] + wave_slope[0], point.slope[1] + wave_slope[1]];
        Surface { height_mm: point.height_mm + wave, slope, albedo }
    }

    /// The height at (x, y) alone, millimetres.
    pub fn height_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        self.relief.point(x_mm, y_mm).height_mm + self.wave(x_mm, y_mm).0
    }

    /// Lowest and highest height anywhere, millimetres.
    pub fn range_mm(&self) -> [f64; 2] {
        let [low, high] = self.relief.range_mm();
        let wave = self.wrinkles.as_ref().map_or(0.0, Wrinkles::amplitude_mm);
        [low - wave, high + wave]
    }

    /// The steepest slope of the large-scale waves.
    pub fn wave_slope(&self) -> f64 {
        self.wrinkles.as_ref().map_or(0.0, Wrinkles::steepest)
    }

    fn wave(&self, x_mm: f64, y_mm: f64) -> (f64, [f64; 2]) {
        self.wrinkles.as_ref().map_or((0.0, [0.0; 2]), |wrinkles| wrinkles.at(x_mm, y_mm))
    }
}

impl Relief {
    pub(crate) fn point(&self, x: f64, y: f64) -> Point {
        match self {
            Relief::Flat(_) => Point { height_mm: 0.0, slope: [0.0; 2], top: Top::Ground },
            Relief::Facets(facets) => facets.point(x, y),
            Relief::Woven(woven) => woven.point(x, y),
            Relief::Knit(knit) => knit.point(x, y),
            Relief::Pile(pile) => pile.point(x, y),
        }
    }

    fn albedo(&self, top: Top, x: f64, y: f64) -> [f32; 3] {
        match self {
            Relief::Flat(albedo) => *albedo,
            Relief::Facets(facets) => facets.albedo,
            Relief::Woven(woven) => woven.albedo(top),
            Relief::Knit(knit) => knit.albedo(top),
            Relief::Pile(pile) => pile.albedo(x, y),
        }
    }

    /// Lowest and highest height, millimetres.
    pub fn range_mm(&self) -> [f64; 2] {
        match self {
            Relief::Flat(_) => [0.0; 2],
            Relief::Facets(_) => [-facets::HALF_RISE_MM, facets::HALF_RISE_MM],
            Relief::Woven(woven) => woven.range_mm(),
            Relief::Knit(knit) => knit.range_mm(),
            Relief::Pile(pile) => pile.range_mm(),
        }
    }

    /// Whether parts of it can stand in each other's light or view. Flat and faceted reliefs cannot, by construction.
    pub fn occludes(&self) -> bool {
        !matches!(self, Relief::Flat(_) | Relief::Facets(_))
    }

    /// The size of the smallest thing to see, millimetres; infinite where nothing is small.
    pub fn detail_mm(&self) -> f64 {
        match self {
            Relief::Flat(_) | Relief::Facets(_) => f64::INFINITY,
            Relief::Woven(woven) => woven.detail_mm(),
            Relief::Knit(knit) => knit.yarn.half_width_mm,
            Relief::Pile(pile) => pile.tuft_mm / 2.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_slopes(cloth: &Cloth, name: &str) {
        let (step, mut compared) = (1e-6, 0);
        let [low, high] = cloth.range_mm();
        for i in 0..4000 {
            let (x, y) = (-80.0 + 0.040_713 * f64::from(i), 57.0 - 0.029_171 * f64::from(i));
            let here = cloth.surface(x, y);
            assert!(
                here.height_mm >= low && here.height_mm <= high,
                "{name}: {} at {x}, {y}",
                here.height_mm
            );
            let slope = |dx: f64, dy: f64| {
                let forward = (cloth.height_mm(x + dx, y + dy) - here.height_mm) / step;
                let backward = (here.height_mm - cloth.height_mm(x - dx, y - dy)) / step;
                // Where two yarns meet or one ends the surface has an edge, and no slope to compare with.
                ((forward - backward).abs() < 1e-2).then_some((forward + backward) / 2.0)
            };
            for (numeric, analytic) in
                [(slope(step, 0.0), here.slope[0]), (slope(0.0, step), here.slope[1])]
            {
                if let Some(numeric) = numeric {
                    assert!(
                        (numeric - analytic).abs() < 1e-3,
                        "{name} at {x}, {y}: {numeric} against {analytic}"
                    );
                    compared += 1;
                }
            }
        }
        assert!(compared > 7800, "{name}: only {compared} of 8000 slopes could be compared");
    }

    #[test]
    fn slopes_are_the_finite_differences_of_the_height() {
        for structure in Structure::ALL {
            let mut cloth = Preset::Linen.cloth(5);
            cloth.relief = structure.relief(None, None, 5);
            check_slopes(&cloth, structure.name());
            cloth.wrinkles = Some(Wrinkles::new(1.5, 5));
            check_slopes(&cloth, structure.name());
        }
        for preset in Preset::ALL {
            check_slopes(&preset.cloth(11), preset.name());
        }
    }

    #[test]
    fn nothing_repeats() {
        let cloth = Preset::Linen.cloth(1);
        let Relief::Woven(woven) = &cloth.relief else { panic!("linen is woven") };
        let period = [2.0 * woven.warp.spacing_mm, 2.0 * woven.weft.spacing_mm];
        let moved = (0..500)
            .map(|i| (0.37 * f64::from(i), 0.21 * f64::from(i)))
            .filter(|&(x, y)| {
                (cloth.height_mm(x, y) - cloth.height_mm(x + period[0], y + period[1])).abs() > 1e-4
            })
            .count();
        assert!(moved > 400, "{moved} of 500 places differ from their neighbours one repeat away");
    }

    #[test]
    fn albedos_are_reflectances() {
        for preset in Preset::ALL {
            for print in [None, Some(Print::new(2))] {
                let mut cloth = preset.cloth(2);
                cloth.print = print;
                for i in 0..3000 {
                    let albedo =
                        cloth.surface(0.113 * f64::from(i) - 150.0, 0.071 * f64::from(i)).albedo;
                    assert!(
                        albedo.iter().all(|a| (0.0..=1.0).contains(a)),
                        "{} {albedo:?}",
                        preset.name()
                    );
                }
            }
        }
    }
}

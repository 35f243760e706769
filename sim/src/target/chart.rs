use crate::color::{lab_d50, linear_from_srgb8, luminance};
use crate::view::View;
use nalgebra::Point3;

/// The 24 colours of a usual chart, 8-bit sRGB as they are commonly published.
pub const COLOR_PATCHES: [[u8; 3]; 24] = [
    [115, 82, 68],
    [194, 150, 130],
    [98, 122, 157],
    [87, 108, 67],
    [133, 128, 177],
    [103, 189, 170],
    [214, 126, 44],
    [80, 91, 166],
    [193, 90, 99],
    [94, 60, 108],
    [157, 188, 64],
    [224, 163, 46],
    [56, 61, 150],
    [70, 148, 73],
    [175, 54, 60],
    [231, 199, 31],
    [187, 86, 149],
    [8, 133, 161],
    [243, 243, 242],
    [200, 200, 200],
    [160, 160, 160],
    [122, 122, 121],
    [85, 85, 85],
    [52, 52, 52],
];

/// Reflectances of the grey row.
const GREYS: [f64; 6] = [0.90, 0.59, 0.36, 0.20, 0.09, 0.035];
const COLUMNS: usize = 6;
/// Grey row, then four rows of colours.
const ROWS: usize = 5;
/// The card's own grey.
const CARD: [f32; 3] = [0.12; 3];
/// Card between patches, as a share of the patches' distance.
const GAP: f64 = 0.14;
/// How far a stated rectangle stays within its patch, as a share of the patch.
const INSET: f64 = 0.12;

/// A card with a row of greys and 24 colours; the panel's origin is its middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Distance of the patches, millimetres.
    pub pitch_mm: f64,
    /// Reflectance of each patch, linear sRGB, row by row from the top left.
    inks: Vec<[f64; 3]>,
}

/// What is known of one patch.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartPatch {
    /// u0, v0, u1, v1: a rectangle in the picture that lies within the patch.
    pub rect_px: [f64; 4],
    /// Reflectance (relative luminance).
    pub reflectance: f64,
    /// CIE L*a*b* under D50; `None` for the grey row.
    pub lab_d50: Option<[f64; 3]>,
}

impl Chart {
    /// A chart that fills most of a picture's height.
    pub fn filling(view: &View) -> Self {
        let mm = |pixels: usize| view.mm_per_px() * pixels as f64;
        let pitch_mm = (0.86 * mm(view.camera.height_px) / ROWS as f64)
            .min(0.86 * mm(view.camera.width_px) / COLUMNS as f64);
        let greys = GREYS.iter().map(|&y| [y; 3]);
        let colors = COLOR_PATCHES.iter().map(|&srgb| linear_from_srgb8(srgb));
        Self { pitch_mm, inks: greys.chain(colors).collect() }
    }

    /// Half the card's size, millimetres.
    fn half_mm(&self) -> [f64; 2] {
        [0.5 * COLUMNS as f64 * self.pitch_mm, 0.5 * ROWS as f64 * self.pitch_mm]
    }

    pub(crate) fn ink(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        let [half_x, half_y] = self.half_mm();
        let margin = GAP * self.pitch_mm;
        if x.abs() > half_x + margin || y.abs() > half_y + margin {
            return None;
        }
        if x.abs() >= half_x || y.abs() >= half_y {
            return Some(CARD);
        }
        let (column, row) = ((x + half_x) / self.pitch_mm, (half_y - y) / self.pitch_mm);
        let in_gap = |c: f64| (c - c.floor() - 0.5).abs() > 0.5 * (1.0 - GAP);
        if in_gap(column) || in_gap(row) {
            return Some(CARD);
        }
        Some(self.inks[row as usize * COLUMNS + column as usize].map(|c| c as f32))
    }

    /// The patches of a chart that lies on the table, as they appear in a picture.
    pub fn patches(&self, view: &View, height_mm: f64) -> Vec<ChartPatch> {
        let [half_x, half_y] = self.half_mm();
        let reach = 0.5 * (1.0 - GAP) * (1.0 - 2.0 * INSET) * self.pitch_mm;
        let patch = |k: usize, ink: &[f64; 3]| {
            let x = ((k % COLUMNS) as f64 + 0.5) * self.pitch_mm - half_x;
            let y = half_y - ((k / COLUMNS) as f64 + 0.5) * self.pitch_mm;
            let corners: Vec<[f64; 2]> = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
                .iter()
                .filter_map(|(a, b)| {
                    view.project(&Point3::new(x + a * reach, y + b * reach, height_mm))
                })
                .collect();
            let most = |c: usize, low: bool| {
                // The inner two of four: a rectangle within the quadrilateral.
                let mut values: Vec<f64> = corners.iter().map(|p| p[c]).collect();
                values.sort_unstable_by(f64::total_cmp);
                values.get(if low { 1 } else { 2 }).map_or(0.0, |v| v.round())
            };
            ChartPatch {
                rect_px: [most(0, true), most(1, true), most(0, false), most(1, false)],
                reflectance: luminance(*ink),
                lab_d50: (k >= COLUMNS).then(|| lab_d50(*ink)),
            }
        };
        self.inks.iter().enumerate().map(|(k, ink)| patch(k, ink)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::camera_from_linear_srgb;
    use crate::rig::reference_camera;
    use weavelight_calibration::description::Plane;

    #[test]
    fn stated_rectangles_lie_within_their_patches() {
        for size in [[1232, 816], [308, 204]] {
            let view = View {
                camera: reference_camera(size[0], size[1], 3),
                vignetting: 0.0,
                psf_px: 0.0,
            };
            let chart = Chart::filling(&view);
            for (k, patch) in chart.patches(&view, 0.0).iter().enumerate() {
                let [u0, v0, u1, v1] = patch.rect_px;
                assert!(u1 - u0 >= 6.0 && v1 - v0 >= 6.0, "{:?}", patch.rect_px);
                for (u, v) in [(u0, v0), (u1, v0), (u0, v1), (u1, v1)] {
                    let p = view.ray(u, v).meet(&Plane::table()).unwrap();
                    let expected = chart.inks[k].map(|c| c as f32);
                    assert_eq!(chart.ink(p.x, p.y), Some(expected), "patch {k} at {u}, {v}");
                }
            }
        }
    }

    #[test]
    fn the_camera_can_see_every_patch() {
        for srgb in COLOR_PATCHES {
            let camera =
                camera_from_linear_srgb() * nalgebra::Vector3::from(linear_from_srgb8(srgb));
            assert!(camera.min() > 0.0, "{srgb:?} gives {camera:?}");
        }
    }
}

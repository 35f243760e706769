use super::thread::{Lens, Yarn, ground};
use super::{Point, Top};
use crate::random::{Key, smooth_step};

/// Stockinette: columns (wales) of loops; each loop shows two legs that open upwards like a V, rise out of the loop
/// below and dive under the loop above.
#[derive(Clone, Debug, PartialEq)]
pub struct Knit {
    /// The yarn; its spacing is the distance of the wales.
    pub yarn: Yarn,
    /// Height of a row of loops (course), millimetres.
    pub course_mm: f64,
    /// Half the height between the ends and the middle of a leg, millimetres.
    pub loop_mm: f64,
    /// Makes this piece of cloth differ from another.
    pub seed: u64,
}

/// Length of a leg in courses: its upper part lies under the next loop.
const LEG: f64 = 1.7;
/// Distance of a leg's lower and upper end from the middle of the wale, in wales.
const FOOT: f64 = 0.10;
const HEAD: f64 = 0.34;

impl Knit {
    pub(crate) fn point(&self, x: f64, y: f64) -> Point {
        let mut best = ground(self.range_mm()[0]);
        let wale = (x / self.yarn.spacing_mm).floor() as i64;
        let course = (y / self.course_mm).floor() as i64;
        for (column, row) in [(wale - 1, course), (wale, course), (wale + 1, course)]
            .into_iter()
            .flat_map(|(column, row)| [(column, row), (column, row - 1)])
        {
            for side in [-1.0, 1.0] {
                if let Some(point) =
                    self.leg(column, row, side, x, y).filter(|p| p.height_mm > best.height_mm)
                {
                    best = point;
                }
            }
        }
        best
    }

    fn leg(&self, column: i64, row: i64, side: f64, x: f64, y: f64) -> Option<Point> {
        let yarn = &self.yarn;
        let along = y - row as f64 * self.course_mm;
        let length = LEG * self.course_mm;
        let q = along / length;
        if !(0.0..1.0).contains(&q) {
            return None;
        }
        let leg = Key::new(self.seed).with_signed(2 * column + i64::from(side > 0.0));
        let [wander, width] = yarn.course(leg, y);
        let (s, ds) = smooth_step(q);
        let foot = side * FOOT * yarn.spacing_mm;
        let spread = side * (HEAD - FOOT) * yarn.spacing_mm;
        let middle = (column as f64 + 0.5) * yarn.spacing_mm + foot + spread * s + wander.0;
        let half_width = yarn.half_width_mm * width.0;
        let u = (x - middle) / half_width;
        if u.abs() >= 1.0 {
            return None;
        }
        let u_along = -(spread * ds / length + wander.1) / half_width - u * width.1 / width.0;
        let arch = 4.0 * q * (1.0 - q);
        let edge =
            (self.loop_mm * (2.0 * arch - 1.0), self.loop_mm * 8.0 * (1.0 - 2.0 * q) / length);
        let crown = yarn.crown(&Lens {
            u,
            u_across: 1.0 / half_width,
            u_along,
            edge,
            along_mm: side * along,
        });
        // The lens runs the other way on the other leg, so that the twist mirrors; only its slope along y turns back.
        Some(Point {
            height_mm: crown.height_mm,
            slope: [crown.across, self.unmirror(side, &crown, &edge, u_along, half_width)],
            top: Top::Yarn {
                family: 0,
                index: row,
                along_mm: x,
                crown: crown.height_mm / self.range_mm()[1],
            },
        })
    }

    /// Slope along y of a leg whose twist was evaluated at `side * along`.
    fn unmirror(
        &self,
        side: f64,
        crown: &super::thread::Crown,
        edge: &(f64, f64),
        u_along: f64,
        half_width: f64,
    ) -> f64 {
        let by_u = crown.across * half_width * u_along;
        let by_twist = crown.along - edge.1 - by_u;
        edge.1 + by_u + side * by_twist
    }

    pub(crate) fn albedo(&self, top: Top) -> [f32; 3] {
        match top {
            Top::Yarn { index, along_mm, crown, .. } => {
                self.yarn.shade(Key::new(self.seed).with(3).with_signed(index), along_mm, crown)
            }
            Top::Ground => self.yarn.color_low.map(|c| 0.5 * c),
        }
    }

    /// Lowest and highest surface, millimetres.
    pub(crate) fn range_mm(&self) -> [f64; 2] {
        [-self.loop_mm - 0.3 * self.yarn.rise_mm, self.loop_mm + self.yarn.top_mm()]
    }
}

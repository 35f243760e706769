use super::thread::{Crown, Lens, Yarn, ground};
use super::{Point, Top};
use crate::random::{Key, smooth_step, split};

/// Warp (along y) and weft (along x), each over or under the other by a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct Woven {
    /// The yarns along y.
    pub warp: Yarn,
    /// The yarns along x.
    pub weft: Yarn,
    /// Who lies on top where.
    pub pattern: Pattern,
    /// Half the height between a yarn's crossings over and under, millimetres.
    pub crimp_mm: f64,
    /// Makes this piece of cloth differ from another.
    pub seed: u64,
}

/// Who lies on top at the crossing of warp i and weft j.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// 1/1.
    Plain,
    /// 3/1 right-hand twill, warp-faced.
    Twill,
    /// Eight-shaft satin, step 3, warp-faced.
    Satin,
    /// Weft in pairs.
    Rib,
}

impl Pattern {
    /// Whether warp yarn `i` lies on top of weft yarn `j`.
    pub fn warp_on_top(self, i: i64, j: i64) -> bool {
        match self {
            Pattern::Plain => (i + j).rem_euclid(2) == 0,
            Pattern::Twill => (i - j).rem_euclid(4) != 0,
            Pattern::Satin => (i - 3 * j).rem_euclid(8) != 0,
            Pattern::Rib => (i + j.div_euclid(2)).rem_euclid(2) == 0,
        }
    }
}

const WARP: u8 = 0;
const WEFT: u8 = 1;

impl Woven {
    pub(crate) fn point(&self, x: f64, y: f64) -> Point {
        let low = self.range_mm()[0];
        let mut best = ground(low);
        for (family, across, along) in [(WARP, x, y), (WEFT, y, x)] {
            let yarn = self.yarn(family);
            let (nearest, share) = split(across / yarn.spacing_mm);
            let neighbour = if share < 0.5 { -1 } else { 1 };
            for index in [nearest, nearest + neighbour] {
                let Some(crown) = self.crown(family, index, across, along) else { continue };
                if crown.height_mm > best.height_mm {
                    best = Point {
                        height_mm: crown.height_mm,
                        slope: if family == WARP {
                            [crown.across, crown.along]
                        } else {
                            [crown.along, crown.across]
                        },
                        top: Top::Yarn {
                            family,
                            index,
                            along_mm: along,
                            crown: self.crown_share(crown.height_mm),
                        },
                    };
                }
            }
        }
        best
    }

    /// The top of one yarn, `None` where it does not pass.
    #[inline]
    fn crown(&self, family: u8, index: i64, across: f64, along: f64) -> Option<Crown> {
        let yarn = self.yarn(family);
        let off_middle = across - (index as f64 + 0.5) * yarn.spacing_mm;
        if off_middle.abs() >= yarn.half_width_mm * (1.0 + yarn.slub) + yarn.wander_mm {
            return None; // however it wanders and swells
        }
        let [side, width] = yarn.course(self.key(family, index), along);
        let half_width = yarn.half_width_mm * width.0;
        let u = (off_middle - side.0) / half_width;
        if u.abs() >= 1.0 {
            return None;
        }
        let u_along = -side.1 / half_width - u * width.1 / width.0;
        let edge = self.edge(family, index, along);
        Some(yarn.crown(&Lens { u, u_across: 1.0 / half_width, u_along, edge, along_mm: along }))
    }

    /// Height of a yarn's edges and its slope: up where it passes over, down where it passes under.
    #[inline]
    fn edge(&self, family: u8, index: i64, along: f64) -> (f64, f64) {
        let pitch = self.yarn(1 - family).spacing_mm;
        let (crossing, share) = split(along / pitch - 0.5);
        let level = |other: i64| {
            let warp_up = match family {
                WARP => self.pattern.warp_on_top(index, other),
                _ => !self.pattern.warp_on_top(other, index),
            };
            if warp_up { self.crimp_mm } else { -self.crimp_mm }
        };
        let (here, next) = (level(crossing), level(crossing + 1));
        let (s, ds) = smooth_step(share);
        (here + (next - here) * s, (next - here) * ds / pitch)
    }

    pub(crate) fn albedo(&self, top: Top) -> [f32; 3] {
        match top {
            Top::Yarn { family, index, along_mm, crown } => {
                self.yarn(family).shade(self.key(family, index), along_mm, crown)
            }
            // One sees yarns further down, in their own shade.
            Top::Ground => self.weft.color_low.map(|c| 0.5 * c),
        }
    }

    /// Lowest (between yarns) and highest surface, millimetres.
    pub(crate) fn range_mm(&self) -> [f64; 2] {
        let top = self.warp.top_mm().max(self.weft.top_mm());
        [-self.crimp_mm - 0.5 * self.warp.rise_mm.min(self.weft.rise_mm), self.crimp_mm + top]
    }

    pub(crate) fn detail_mm(&self) -> f64 {
        self.warp.half_width_mm.min(self.weft.half_width_mm)
    }

    fn crown_share(&self, height_mm: f64) -> f64 {
        let top = self.range_mm()[1];
        (height_mm / top).max(0.0)
    }

    fn yarn(&self, family: u8) -> &Yarn {
        if family == WARP { &self.warp } else { &self.weft }
    }

    fn key(&self, family: u8, index: i64) -> Key {
        Key::new(self.seed).with(u64::from(family)).with_signed(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::{Preset, Relief};

    fn check(pattern: Pattern, rows: [&str; 4]) {
        for (j, row) in rows.iter().enumerate() {
            let drawn: String =
                (0..8).map(|i| if pattern.warp_on_top(i, j as i64) { '#' } else { '.' }).collect();
            assert_eq!(&drawn, row, "{pattern:?}, weft {j}");
        }
    }

    #[test]
    fn patterns_are_the_weaves_they_are_named_after() {
        check(Pattern::Plain, ["#.#.#.#.", ".#.#.#.#", "#.#.#.#.", ".#.#.#.#"]);
        check(Pattern::Twill, [".###.###", "#.###.##", "##.###.#", "###.###."]);
        check(Pattern::Satin, [".#######", "###.####", "######.#", "#.######"]);
        check(Pattern::Rib, ["#.#.#.#.", "#.#.#.#.", ".#.#.#.#", ".#.#.#.#"]);
    }

    #[test]
    fn the_yarn_on_top_is_the_patterns() {
        let Relief::Woven(woven) = Preset::Denim.cloth(3).relief else { panic!("denim is woven") };
        for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (i, j))) {
            let at = |index: i64, yarn: &Yarn| (index as f64 + 0.5) * yarn.spacing_mm;
            let point = woven.point(at(i, &woven.warp), at(j, &woven.weft));
            let Top::Yarn { family, .. } = point.top else {
                panic!("no yarn at crossing {i}, {j}")
            };
            assert_eq!(family == WARP, woven.pattern.warp_on_top(i, j), "crossing {i}, {j}");
        }
    }
}

//! The relief of a tile on a fine grid: what rays are marched through.

/// Heights at the nodes of a square grid; f32 in units that keep a tile small.
pub(super) struct HeightGrid {
    /// Node (0, 0), millimetres.
    origin: [f64; 2],
    nodes_per_mm: f32,
    columns: usize,
    rows: usize,
    heights_mm: Vec<f32>,
    lowest_mm: f32,
    highest_mm: f32,
}

/// Rays start this far over the surface, in grid steps: more than what the grid's chords stand over a yarn's ridges.
const LIFT_STEPS: f32 = 0.08;
/// A line of the grid nearer to the start than this, in grid steps, says nothing about what lies ahead.
const NEAREST_STEPS: f32 = 0.15;

impl HeightGrid {
    /// Tabulates `height_mm(x, y)` over the box `low..high`, nodes `step_mm` apart.
    pub(super) fn tabulate(
        low: [f64; 2],
        high: [f64; 2],
        step_mm: f64,
        height_mm: impl Fn(f64, f64) -> f64,
    ) -> Self {
        let nodes = |k: usize| ((high[k] - low[k]) / step_mm).ceil() as usize + 2;
        let (columns, rows) = (nodes(0), nodes(1));
        let mut heights_mm = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            let y = low[1] + j as f64 * step_mm;
            heights_mm
                .extend((0..columns).map(|i| height_mm(low[0] + i as f64 * step_mm, y) as f32));
        }
        let lowest_mm = heights_mm.iter().copied().fold(f32::INFINITY, f32::min);
        let highest_mm = heights_mm.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let nodes_per_mm = (1.0 / step_mm) as f32;
        Self { origin: low, nodes_per_mm, columns, rows, heights_mm, lowest_mm, highest_mm }
    }

    #[inline]
    fn place(&self, x_mm: f64, y_mm: f64) -> [f32; 2] {
        [
            (x_mm - self.origin[0]) as f32 * self.nodes_per_mm,
            (y_mm - self.origin[1]) as f32 * self.nodes_per_mm,
        ]
    }

    /// Height at a place in nodes, bilinear; the border's outside it.
    #[inline]
    fn height(&self, [a, b]: [f32; 2]) -> f32 {
        let a = a.clamp(0.0, (self.columns - 2) as f32);
        let b = b.clamp(0.0, (self.rows - 2) as f32);
        let (i, j) = (a as usize, b as usize);
        let (s, t) = (a - i as f32, b - j as f32);
        let at = j * self.columns + i;
        let top = self.heights_mm[at] + (self.heights_mm[at + 1] - self.heights_mm[at]) * s;
        let next = at + self.columns;
        let bottom =
            self.heights_mm[next] + (self.heights_mm[next + 1] - self.heights_mm[next]) * s;
        top + (bottom - top) * t
    }

    /// Where a ray of sight meets the surface: `from` is a point of the ray as (x, y, height), `fall` its change of x and
    /// y per mm downwards.
    pub(super) fn sight(&self, from: [f64; 3], fall: [f64; 2]) -> [f64; 2] {
        let drop_to_top = from[2] - f64::from(self.highest_mm);
        let start = [from[0] + fall[0] * drop_to_top, from[1] + fall[1] * drop_to_top];
        let depth = self.highest_mm - self.lowest_mm;
        let run = depth * self.nodes_per_mm * (fall[0].hypot(fall[1]) as f32);
        let steps = run.ceil().max(1.0);
        let step_down = depth / steps;
        let first = self.place(start[0], start[1]);
        let per_step = [
            fall[0] as f32 * step_down * self.nodes_per_mm,
            fall[1] as f32 * step_down * self.nodes_per_mm,
        ];
        let mut over = self.highest_mm - self.height(first);
        let mut k = 0.0;
        while k < steps {
            let next = k + 1.0;
            let place = [first[0] + per_step[0] * next, first[1] + per_step[1] * next];
            let gap = self.highest_mm - step_down * next - self.height(place);
            if gap <= 0.0 {
                let share = if over > gap { over / (over - gap) } else { 1.0 };
                let down = f64::from(step_down * (k + share));
                return [start[0] + fall[0] * down, start[1] + fall[1] * down];
            }
            (over, k) = (gap, next);
        }
        [start[0] + fall[0] * f64::from(depth), start[1] + fall[1] * f64::from(depth)]
    }

    /// Whether a ray from the surface at (x, y) with the given height meets nothing in direction `towards`.
    #[inline]
    pub(super) fn is_open(&self, x_mm: f64, y_mm: f64, height_mm: f32, towards: [f32; 3]) -> bool {
        towards[2] > 0.0 && self.first_hit(x_mm, y_mm, height_mm, towards).is_none()
    }

    /// The place where a ray from the surface meets the surface again. The ray visits every line of the grid across its
    /// main direction.
    #[inline]
    pub(super) fn first_hit(
        &self,
        x_mm: f64,
        y_mm: f64,
        height_mm: f32,
        towards: [f32; 3],
    ) -> Option<[f64; 2]> {
        let steep = towards[0].abs().max(towards[1].abs());
        if steep < 1e-6 {
            return None;
        }
        let main = usize::from(towards[1].abs() > towards[0].abs());
        let start = self.place(x_mm, y_mm);
        let step = [towards[0] / steep, towards[1] / steep];
        let rise = towards[2] / (steep * self.nodes_per_mm);
        // The first line ahead, but none so near that it is the start itself.
        let ahead =
            if step[main] > 0.0 { start[main].floor() + 1.0 } else { start[main].ceil() - 1.0 };
        let mut t = (ahead - start[main]).abs();
        if t < NEAREST_STEPS {
            t += 1.0;
        }
        let base = height_mm + LIFT_STEPS / self.nodes_per_mm;
        let limit = [(self.columns - 2) as f32, (self.rows - 2) as f32];
        loop {
            let z = base + rise * t;
            if z >= self.highest_mm && rise >= 0.0 {
                return None;
            }
            let place = [start[0] + step[0] * t, start[1] + step[1] * t];
            if place[0] < 0.0 || place[1] < 0.0 || place[0] >= limit[0] || place[1] >= limit[1] {
                return None;
            }
            if self.on_line(place, main) > z {
                let per_mm = 1.0 / f64::from(self.nodes_per_mm);
                return Some([
                    self.origin[0] + f64::from(place[0]) * per_mm,
                    self.origin[1] + f64::from(place[1]) * per_mm,
                ]);
            }
            t += 1.0;
        }
    }

    /// Height at a place that lies on a line of the grid across `main`: linear between two nodes.
    #[inline]
    fn on_line(&self, place: [f32; 2], main: usize) -> f32 {
        let line = (place[main] + 0.5) as usize;
        let other = place[1 - main];
        let node = other as usize;
        let share = other - node as f32;
        let (at, next) = if main == 0 {
            (node * self.columns + line, self.columns)
        } else {
            (line * self.columns + node, 1)
        };
        let (a, b) = (self.heights_mm[at], self.heights_mm[at + next]);
        a + (b - a) * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::{Cloth, Preset};
    use crate::random::Key;

    /// Marches in tiny steps through the analytic height, the plain way.
    fn open_by_brute_force(cloth: &Cloth, x: f64, y: f64, towards: [f64; 3]) -> bool {
        let top = cloth.range_mm()[1];
        let start = cloth.height_mm(x, y) + 1e-4;
        let step = 0.001;
        (1..).map(|k| step * f64::from(k)).take_while(|t| start + t * towards[2] < top).all(|t| {
            cloth.height_mm(x + t * towards[0], y + t * towards[1]) <= start + t * towards[2]
        })
    }

    #[test]
    fn shadows_are_those_of_brute_force() {
        for preset in [Preset::Linen, Preset::Denim, Preset::Knit] {
            let cloth = preset.cloth(4);
            let grid =
                HeightGrid::tabulate([-4.0, -4.0], [4.0, 4.0], 0.03, |x, y| cloth.height_mm(x, y));
            let (mut asked, mut differ, mut shaded, mut shaded_plainly) = (0, 0, 0, 0);
            for k in 0..4000 {
                let key = Key::new(8).with(k);
                let (x, y) = (2.0 * key.with(1).signed_unit(), 2.0 * key.with(2).signed_unit());
                let towards = low_light(key);
                let surface = cloth.surface(x, y);
                if towards[2] - surface.slope[0] * towards[0] - surface.slope[1] * towards[1] <= 0.0
                {
                    continue; // turned away: never asked
                }
                let open = grid.is_open(x, y, surface.height_mm as f32, towards.map(|c| c as f32));
                let plainly = open_by_brute_force(&cloth, x, y, towards);
                asked += 1;
                differ += u32::from(open != plainly);
                shaded += u32::from(!open);
                shaded_plainly += u32::from(!plainly);
            }
            let name = preset.name();
            println!(
                "{name}: of {asked}, {shaded} in shadow, {shaded_plainly} by brute force, {differ} differ"
            );
            assert!(shaded_plainly > 40, "{name}: too few shadows to tell");
            // Within a grid step of where two yarns meet the grid's chord lies over the crease.
            assert!(differ * 50 < asked, "{name}: {differ} of {asked} differ");
            assert!(
                shaded.abs_diff(shaded_plainly) * 100 < asked,
                "{name}: {shaded} against {shaded_plainly}"
            );
        }
    }

    /// A direction 15 to 55 degrees over the plane.
    fn low_light(key: Key) -> [f64; 3] {
        let (sin, cos) = (std::f64::consts::TAU * key.with(3).unit()).sin_cos();
        let elevation = 0.26 + 0.7 * key.with(4).unit();
        [cos * elevation.cos(), sin * elevation.cos(), elevation.sin()]
    }

    #[test]
    fn sight_finds_the_surface_it_looks_at() {
        let cloth = Preset::Linen.cloth(4);
        let grid =
            HeightGrid::tabulate([-4.0, -4.0], [4.0, 4.0], 0.02, |x, y| cloth.height_mm(x, y));
        let mut misses = 0;
        for k in 0..2000 {
            let key = Key::new(2).with(k);
            let from = [2.0 * key.with(1).signed_unit(), 2.0 * key.with(2).signed_unit(), 0.0];
            let fall = [0.4 * key.with(3).signed_unit(), 0.4 * key.with(4).signed_unit()];
            let [x, y] = grid.sight(from, fall);
            // The point lies on the ray, and the ray is at the surface's height there.
            let down = if fall[0].abs() > fall[1].abs() {
                (x - from[0]) / fall[0]
            } else {
                (y - from[1]) / fall[1]
            };
            misses += u32::from((cloth.height_mm(x, y) + down).abs() > 0.02);
        }
        assert!(
            misses < 60,
            "{misses} of 2000 rays end off the surface (cliffs between yarns excepted)"
        );
    }
}

use crate::random::Key;

/// A coloured print: five-petalled blossoms of three inks on a loose lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Print {
    seed: u64,
}

/// Distance of the blossoms, millimetres.
const LATTICE_MM: f64 = 18.0;
/// Reflectance of the inks, linear sRGB, as on white cloth.
const INKS: [[f32; 3]; 3] = [[0.55, 0.05, 0.07], [0.04, 0.16, 0.45], [0.62, 0.42, 0.05]];
const HEART: [f32; 3] = [0.75, 0.62, 0.10];

impl Print {
    /// A print; the seed scatters the blossoms.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The cloth's albedo with ink over it: inks on fibres filter, so that reflectances multiply.
    pub(crate) fn over(&self, albedo: [f32; 3], x: f64, y: f64) -> [f32; 3] {
        let ink = self.ink(x, y);
        std::array::from_fn(|c| albedo[c] * ink[c])
    }

    fn ink(&self, x: f64, y: f64) -> [f32; 3] {
        let (column, row) = ((x / LATTICE_MM).floor() as i64, (y / LATTICE_MM).floor() as i64);
        let key = Key::new(self.seed).with(0x9f).with_signed(column).with_signed(row);
        let size = LATTICE_MM * (0.28 + 0.12 * key.with(1).unit());
        let margin = 0.5 * LATTICE_MM - size;
        let middle = |cell: i64, k: u64| {
            (cell as f64 + 0.5) * LATTICE_MM + margin * key.with(k).signed_unit()
        };
        let (dx, dy) = (x - middle(column, 2), y - middle(row, 3));
        let radius = dx.hypot(dy) / size;
        let petals = 0.72 + 0.28 * (5.0 * dy.atan2(dx) + 6.0 * key.with(4).unit()).cos();
        match radius {
            r if r < 0.22 => HEART,
            r if r < petals => INKS[(key.bits() % INKS.len() as u64) as usize],
            _ => [1.0; 3],
        }
    }
}

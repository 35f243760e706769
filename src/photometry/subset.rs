//! The exact search for samples to drop: all subsets of at most four, by rank-one downdates of residuals and hat matrix,
//! eight photosites side by side in float64 (a chi-square of 10 out of 10^6 is what matters, which float32 cannot see).
//!
//! Dropping sample i from a least-squares fit with residuals r and hat matrix H leaves
//!
//!   r_j + h_ij r_i / (1 - h_ii),   h_jk + h_ij h_ik / (1 - h_ii),   RSS - r_i^2 / (1 - h_ii),   det (1 - h_ii);
//!
//! Cook and Weisberg, "Residuals and Influence in Regression", 1982, chapter 2. The last of the four drops needs no more
//! than its own r^2 / (1 - h).

use multiversion::multiversion;

use super::block::{Block, LANES};
use super::method::{DROP_PENALTY, FEWEST_KEPT, LEAST_DETERMINANT, MOST_DROPPED};

/// Photosites that are searched together.
pub(crate) const WIDE: usize = 8;

/// One float64 a photosite.
pub(crate) type Wide = [f64; WIDE];

pub(crate) const WIDE_ZERO: Wide = [0.0; WIDE];

/// Samples and light vectors of eight photosites, multiplied by the root of their weights.
#[derive(Default)]
pub(crate) struct Whitened {
    pub(crate) y: Vec<Wide>,
    pub(crate) light: Vec<[Wide; 3]>,
    /// 1 where a sample has a weight.
    pub(crate) used: Vec<Wide>,
    pub(crate) count: Wide,
}

/// sum l l^T and sum l y, the former as xx, xy, xz, yy, yz, zz.
pub(crate) struct WideSums {
    pub(crate) matrix: [Wide; 6],
    pub(crate) right: [Wide; 3],
}

/// Residuals and hat matrix after some drops, of the lights not yet decided on.
#[derive(Default)]
struct State {
    residual: Vec<Wide>,
    /// h_ij at `i * n + j`, i <= j.
    hat: Vec<Wide>,
    /// Residual sum of squares.
    rss: Wide,
    /// det(sum w l l^T) over that of all lights.
    determinant: Wide,
}

/// Buffers of the search.
#[derive(Default)]
pub(crate) struct SubsetSearch {
    none: State,
    one: State,
    two: State,
}

/// The cheapest set so far.
struct Best {
    cost: Wide,
    dropped: [u64; WIDE],
    /// Cost of dropping as many samples as the index says: the penalty, or infinite where too few would remain.
    penalty: [Wide; MOST_DROPPED + 1],
}

impl Whitened {
    /// Takes lanes `first..first + 8` of a block at its present weights.
    pub(crate) fn take(&mut self, block: &Block, first: usize) {
        debug_assert!(first + WIDE <= LANES, "lanes {first} and on of {LANES}");
        let n = block.sample.len();
        self.y.resize(n, WIDE_ZERO);
        self.light.resize(n, [WIDE_ZERO; 3]);
        self.used.resize(n, WIDE_ZERO);
        self.count = WIDE_ZERO;
        for (i, sample) in block.sample.iter().enumerate() {
            for k in 0..WIDE {
                let lane = first + k;
                let root = f64::from(sample.weight[lane]).sqrt();
                self.y[i][k] = root * f64::from(sample.y[lane]);
                for axis in 0..3 {
                    self.light[i][axis][k] = root * f64::from(sample.light[axis][lane]);
                }
                self.used[i][k] = if root > 0.0 { 1.0 } else { 0.0 };
                self.count[k] += self.used[i][k];
            }
        }
    }

    /// Sums with each square multiplied by `trim`.
    #[inline(always)]
    pub(crate) fn sums(&self, trim: impl Fn(usize) -> Wide) -> WideSums {
        let mut sums = WideSums { matrix: [WIDE_ZERO; 6], right: [WIDE_ZERO; 3] };
        for (i, ([lx, ly, lz], y)) in self.light.iter().zip(&self.y).enumerate() {
            let w = trim(i);
            for k in 0..WIDE {
                let (wx, wy, wz) = (w[k] * lx[k], w[k] * ly[k], w[k] * lz[k]);
                sums.matrix[0][k] += wx * lx[k];
                sums.matrix[1][k] += wx * ly[k];
                sums.matrix[2][k] += wx * lz[k];
                sums.matrix[3][k] += wy * ly[k];
                sums.matrix[4][k] += wy * lz[k];
                sums.matrix[5][k] += wz * lz[k];
                sums.right[0][k] += wx * y[k];
                sums.right[1][k] += wy * y[k];
                sums.right[2][k] += wz * y[k];
            }
        }
        sums
    }

    /// y - l . g of light `i`.
    #[inline(always)]
    pub(crate) fn residual(&self, i: usize, g: &[Wide; 3]) -> Wide {
        let [lx, ly, lz] = &self.light[i];
        let mut residual = WIDE_ZERO;
        for k in 0..WIDE {
            residual[k] = self.y[i][k] - (lx[k] * g[0][k] + ly[k] * g[1][k] + lz[k] * g[2][k]);
        }
        residual
    }
}

impl WideSums {
    /// Inverse of the matrix by cofactors; not finite where it is singular.
    #[inline(always)]
    pub(crate) fn inverse(&self) -> [Wide; 6] {
        let [xx, xy, xz, yy, yz, zz] = &self.matrix;
        let mut inverse = [WIDE_ZERO; 6];
        for k in 0..WIDE {
            let c0 = yy[k] * zz[k] - yz[k] * yz[k];
            let c1 = xz[k] * yz[k] - xy[k] * zz[k];
            let c2 = xy[k] * yz[k] - xz[k] * yy[k];
            let d = 1.0 / (xx[k] * c0 + xy[k] * c1 + xz[k] * c2);
            inverse[0][k] = c0 * d;
            inverse[1][k] = c1 * d;
            inverse[2][k] = c2 * d;
            inverse[3][k] = (xx[k] * zz[k] - xz[k] * xz[k]) * d;
            inverse[4][k] = (xy[k] * xz[k] - xx[k] * yz[k]) * d;
            inverse[5][k] = (xx[k] * yy[k] - xy[k] * xy[k]) * d;
        }
        inverse
    }
}

/// Symmetric 3 x 3 times vector.
#[inline(always)]
pub(crate) fn wide_times(matrix: &[Wide; 6], [x, y, z]: &[Wide; 3]) -> [Wide; 3] {
    let [xx, xy, xz, yy, yz, zz] = matrix;
    let mut product = [WIDE_ZERO; 3];
    for k in 0..WIDE {
        product[0][k] = xx[k] * x[k] + xy[k] * y[k] + xz[k] * z[k];
        product[1][k] = xy[k] * x[k] + yy[k] * y[k] + yz[k] * z[k];
        product[2][k] = xz[k] * x[k] + yz[k] * y[k] + zz[k] * z[k];
    }
    product
}

/// Per photosite the set of lights (bit i for light i) whose drop minimises RSS + 12 |K|. Smaller sets come first: once all
/// photosites have a cost that the penalty of the next larger sets alone exceeds, these cannot be better.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
pub(crate) fn best_subset(search: &mut SubsetSearch, samples: &Whitened) -> [u64; WIDE] {
    let n = samples.y.len();
    search.none.fit(samples);
    let mut best = Best::new(&samples.count);
    best.consider(0, 0, &search.none.rss, &search.none.determinant);
    if best.is_settled(1) {
        return best.dropped;
    }
    for i in 0..n {
        search.none.consider_two(n, i, (1, 1 << i), &mut best);
    }
    if best.is_settled(3) {
        return best.dropped;
    }
    for i in 0..n {
        search.one.drop(&search.none, n, i);
        for j in i + 1..n {
            search.one.consider_two(n, j, (2, 1 << i | 1 << j), &mut best);
        }
    }
    if best.is_settled(4) {
        return best.dropped;
    }
    for i in 0..n {
        search.one.drop(&search.none, n, i);
        for j in i + 1..n {
            search.two.drop(&search.one, n, j);
            for k in j + 1..n {
                search.two.consider_two(n, k, (3, 1 << i | 1 << j | 1 << k), &mut best);
            }
        }
    }
    best.dropped
}

impl State {
    /// The fit with every sample.
    #[inline(always)]
    fn fit(&mut self, samples: &Whitened) {
        let n = samples.y.len();
        self.residual.resize(n, WIDE_ZERO);
        self.hat.resize(n * n, WIDE_ZERO);
        self.determinant = [1.0; WIDE];
        self.rss = WIDE_ZERO;
        let sums = samples.sums(|i| samples.used[i]);
        let inverse = sums.inverse();
        let g = wide_times(&inverse, &sums.right);
        for i in 0..n {
            self.residual[i] = samples.residual(i, &g);
            for k in 0..WIDE {
                self.rss[k] += self.residual[i][k] * self.residual[i][k];
            }
            let [px, py, pz] = &wide_times(&inverse, &samples.light[i]);
            for j in i..n {
                let [lx, ly, lz] = &samples.light[j];
                let hat = &mut self.hat[i * n + j];
                for k in 0..WIDE {
                    hat[k] = px[k] * lx[k] + py[k] * ly[k] + pz[k] * lz[k];
                }
            }
        }
    }

    /// This state becomes `before` without light `i`; entries of lights up to `i` are left stale.
    #[inline(always)]
    fn drop(&mut self, before: &State, n: usize, i: usize) {
        self.residual.resize(n, WIDE_ZERO);
        self.hat.resize(n * n, WIDE_ZERO);
        let (own, r) = (&before.hat[i * n + i], &before.residual[i]);
        let (mut inverse, mut step) = (WIDE_ZERO, WIDE_ZERO);
        for k in 0..WIDE {
            let left = 1.0 - own[k];
            inverse[k] = 1.0 / left;
            step[k] = r[k] * inverse[k];
            self.rss[k] = before.rss[k] - r[k] * step[k];
            self.determinant[k] = before.determinant[k] * left;
        }
        for j in i + 1..n {
            let across = &before.hat[i * n + j];
            let mut scaled = WIDE_ZERO;
            for k in 0..WIDE {
                self.residual[j][k] = before.residual[j][k] + across[k] * step[k];
                scaled[k] = across[k] * inverse[k];
            }
            for m in j..n {
                let (other, old) = (&before.hat[i * n + m], &before.hat[j * n + m]);
                let new = &mut self.hat[j * n + m];
                for k in 0..WIDE {
                    new[k] = old[k] + scaled[k] * other[k];
                }
            }
        }
    }

    /// Considers dropping `i`, which makes a set of `drops`, and then each one of the lights after it.
    #[inline(always)]
    fn consider_two(&self, n: usize, i: usize, (drops, set): (usize, u64), best: &mut Best) {
        let (own, r) = (&self.hat[i * n + i], &self.residual[i]);
        let (mut inverse, mut rss, mut determinant) = (WIDE_ZERO, WIDE_ZERO, WIDE_ZERO);
        for k in 0..WIDE {
            let left = 1.0 - own[k];
            inverse[k] = 1.0 / left;
            rss[k] = self.rss[k] - r[k] * r[k] * inverse[k];
            determinant[k] = self.determinant[k] * left;
        }
        best.consider(drops, set, &rss, &determinant);
        for j in i + 1..n {
            let (across, own, rj) = (&self.hat[i * n + j], &self.hat[j * n + j], &self.residual[j]);
            let (mut last_rss, mut last_determinant) = (WIDE_ZERO, WIDE_ZERO);
            for k in 0..WIDE {
                let scaled = across[k] * inverse[k];
                let residual = rj[k] + scaled * r[k];
                let left = 1.0 - (own[k] + scaled * across[k]);
                last_rss[k] = rss[k] - residual * residual / left;
                last_determinant[k] = determinant[k] * left;
            }
            best.consider(drops + 1, set | 1 << j, &last_rss, &last_determinant);
        }
    }
}

impl Best {
    #[inline(always)]
    fn new(count: &Wide) -> Self {
        let mut penalty = [WIDE_ZERO; MOST_DROPPED + 1];
        for (drops, penalty) in penalty.iter_mut().enumerate() {
            for k in 0..WIDE {
                let enough = drops == 0 || count[k] >= (FEWEST_KEPT + drops) as f64;
                penalty[k] = if enough { DROP_PENALTY * drops as f64 } else { f64::INFINITY };
            }
        }
        Self { cost: [f64::INFINITY; WIDE], dropped: [0; WIDE], penalty }
    }

    /// Whether no set of at least so many drops can be better for any photosite.
    #[inline(always)]
    fn is_settled(&self, drops: usize) -> bool {
        let mut settled = true;
        for k in 0..WIDE {
            settled &= self.cost[k] <= DROP_PENALTY * drops as f64;
        }
        settled
    }

    #[inline(always)]
    fn consider(&mut self, drops: usize, set: u64, rss: &Wide, determinant: &Wide) {
        for k in 0..WIDE {
            let cost = rss[k] + self.penalty[drops][k];
            let better = (cost < self.cost[k]) & (determinant[k] >= LEAST_DETERMINANT);
            self.cost[k] = if better { cost } else { self.cost[k] };
            self.dropped[k] = if better { set } else { self.dropped[k] };
        }
    }
}

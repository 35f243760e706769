//! Small vectors and symmetric matrices of as many photosites as the processor's vector registers hold. No closure stands
//! here or where these are used: one would be compiled for the least processor and called.

use pulp::Simd;

/// x, y, z.
pub(crate) type Vector<S> = [<S as Simd>::f32s; 3];

/// A symmetric 3 x 3 matrix: xx, xy, xz, yy, yz, zz.
pub(crate) type Matrix<S> = [<S as Simd>::f32s; 6];

/// Arithmetic on them. Products are added by fused instructions, so that every processor gives the same bits.
#[derive(Clone, Copy)]
pub(crate) struct Wide<S: Simd>(pub(crate) S);

impl<S: Simd> Wide<S> {
    /// One number in every lane.
    #[inline(always)]
    pub(crate) fn splat(self, value: f32) -> S::f32s {
        self.0.splat_f32s(value)
    }

    /// Vector number `chunk` of an array.
    #[inline(always)]
    pub(crate) fn load(self, values: &[f32], chunk: usize) -> S::f32s {
        S::as_simd_f32s(values).0[chunk]
    }

    #[inline(always)]
    pub(crate) fn store(self, values: &mut [f32], chunk: usize, value: S::f32s) {
        S::as_mut_simd_f32s(values).0[chunk] = value;
    }

    /// start + slope t.
    #[inline(always)]
    pub(crate) fn line(self, start: f32, slope: f32, t: S::f32s) -> S::f32s {
        self.0.mul_add_f32s(self.splat(slope), t, self.splat(start))
    }

    #[inline(always)]
    pub(crate) fn dot(self, a: &Vector<S>, b: &Vector<S>) -> S::f32s {
        let s = self.0;
        s.mul_add_f32s(a[2], b[2], s.mul_add_f32s(a[1], b[1], s.mul_f32s(a[0], b[0])))
    }

    #[inline(always)]
    pub(crate) fn times(self, [xx, xy, xz, yy, yz, zz]: &Matrix<S>, v: &Vector<S>) -> Vector<S> {
        [
            self.dot(&[*xx, *xy, *xz], v),
            self.dot(&[*xy, *yy, *yz], v),
            self.dot(&[*xz, *yz, *zz], v),
        ]
    }

    /// sum + l v.
    #[inline(always)]
    pub(crate) fn add_product(self, sum: &mut Vector<S>, l: &Vector<S>, v: S::f32s) {
        for axis in 0..3 {
            sum[axis] = self.0.mul_add_f32s(l[axis], v, sum[axis]);
        }
    }

    /// sum + w l l^T.
    #[inline(always)]
    pub(crate) fn add_square(self, sum: &mut Matrix<S>, l: &Vector<S>, w: S::f32s) {
        let s = self.0;
        let weighted = [s.mul_f32s(w, l[0]), s.mul_f32s(w, l[1]), s.mul_f32s(w, l[2])];
        for (entry, (a, b)) in PLACES.into_iter().enumerate() {
            sum[entry] = s.mul_add_f32s(weighted[a], l[b], sum[entry]);
        }
    }

    /// v^T m v.
    #[inline(always)]
    pub(crate) fn form(self, m: &Matrix<S>, v: &Vector<S>) -> S::f32s {
        self.dot(v, &self.times(m, v))
    }

    /// Inverse by L D L^T, and the square of the light vectors' condition number (an upper bound within a factor of nine);
    /// not a number, infinite or negative where the matrix is not positive.
    #[inline(always)]
    pub(crate) fn inverse(self, [xx, xy, xz, yy, yz, zz]: &Matrix<S>) -> (Matrix<S>, S::f32s) {
        let s = self.0;
        let one = self.splat(1.0);
        let r1 = s.div_f32s(one, *xx);
        let (l21, l31) = (s.mul_f32s(*xy, r1), s.mul_f32s(*xz, r1));
        let d2 = s.negate_mul_add_f32s(l21, *xy, *yy);
        let r2 = s.div_f32s(one, d2);
        let l32 = s.mul_f32s(s.negate_mul_add_f32s(l21, *xz, *yz), r2);
        let d3 = s.negate_mul_add_f32s(l31, *xz, *zz);
        let d3 = s.negate_mul_add_f32s(s.mul_f32s(l32, l32), d2, d3);
        let r3 = s.div_f32s(one, d3);
        let m31 = s.mul_add_f32s(l21, l32, s.neg_f32s(l31));
        let (l21r2, m31r3, l32r3) = (s.mul_f32s(l21, r2), s.mul_f32s(m31, r3), s.mul_f32s(l32, r3));
        let inverse_xx = s.mul_add_f32s(m31, m31r3, s.mul_add_f32s(l21, l21r2, r1));
        let inverse_yy = s.mul_add_f32s(l32, l32r3, r2);
        let inverse_xy = s.neg_f32s(s.mul_add_f32s(m31r3, l32, l21r2));
        let inverse = [inverse_xx, inverse_xy, m31r3, inverse_yy, s.neg_f32s(l32r3), r3];
        let trace = s.add_f32s(s.add_f32s(*xx, *yy), *zz);
        let condition = s.mul_f32s(trace, self.trace(&inverse));
        let positive = s.greater_than_f32s(s.min_f32s(d2, d3), self.splat(0.0));
        (inverse, s.select_f32s(positive, condition, self.splat(f32::INFINITY)))
    }

    #[inline(always)]
    pub(crate) fn trace(self, m: &Matrix<S>) -> S::f32s {
        self.0.add_f32s(self.0.add_f32s(m[0], m[3]), m[5])
    }

    #[inline(always)]
    pub(crate) fn add(self, a: &Vector<S>, b: &Vector<S>) -> Vector<S> {
        let s = self.0;
        [s.add_f32s(a[0], b[0]), s.add_f32s(a[1], b[1]), s.add_f32s(a[2], b[2])]
    }
}

/// Row and column of a symmetric matrix's entries.
const PLACES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

//! Who is worth a look.

/// Which points no other point beats: no other is at most as far in both coordinates and less far in one. Points that are
/// not finite are beaten.
pub fn pareto_front(points: &[[f64; 2]]) -> Vec<bool> {
    let finite = |p: &[f64; 2]| p.iter().all(|c| c.is_finite());
    let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    let on_front = |point: &[f64; 2]| {
        finite(point) && !points.iter().any(|other| finite(other) && beats(other, point))
    };
    points.iter().map(on_front).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_unbeaten_points_are_on_the_front() {
        let check = |points: &[[f64; 2]], expected: &[bool]| {
            assert_eq!(pareto_front(points), expected, "{points:?}");
        };
        check(&[], &[]);
        check(&[[1.0, 1.0]], &[true]);
        check(&[[1.0, 2.0], [2.0, 1.0]], &[true, true]);
        check(&[[1.0, 2.0], [2.0, 2.0], [2.0, 3.0]], &[true, false, false]);
        check(&[[1.0, 2.0], [1.0, 1.0]], &[false, true]);
        check(&[[1.0, 1.0], [1.0, 1.0]], &[true, true]);
        check(&[[f64::NAN, 0.0], [1.0, 1.0], [0.5, f64::INFINITY]], &[false, true, false]);
        check(&[[3.0, 1.0], [1.0, 3.0], [2.0, 2.0], [2.5, 2.5]], &[true, true, true, false]);
    }
}

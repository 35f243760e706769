/// The `share` quantile (0 to 1) of sorted values, linear between neighbours. `None` of nothing.
pub fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share.clamp(0.0, 1.0) * (sorted.len().checked_sub(1)?) as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    Some(below + (above - below) * place.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_small_sets() {
        let check = |sorted: &[f64], share: f64, expected: Option<f64>| {
            assert_eq!(percentile(sorted, share), expected);
        };
        check(&[], 0.5, None);
        check(&[3.0], 0.95, Some(3.0));
        check(&[1.0, 2.0, 4.0], 0.5, Some(2.0));
        check(&[1.0, 2.0, 4.0, 8.0], 0.5, Some(3.0));
        check(&[0.0, 10.0], 0.95, Some(9.5));
        check(&[0.0, 10.0], 1.0, Some(10.0));
        check(&[0.0, 10.0], 0.0, Some(0.0));
    }
}

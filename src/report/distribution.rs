use maud::{Markup, html};

/// How values spread: quantiles and a histogram, made to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Values counted.
    pub count: usize,
    /// Arithmetic mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Half of the values lie below.
    pub median: f64,
    /// 95 of 100 values lie below.
    pub p95: f64,
    /// The largest value.
    pub max: f64,
    /// Upper end of the histogram: the 99th percentile; what lies above counts in the last bin.
    pub top: f64,
    /// Equal bins from 0 to `top`.
    pub bins: Vec<usize>,
}

const BINS: usize = 60;

impl Distribution {
    /// Of non-negative values; those that are not finite are left out. `None` where nothing is left.
    pub fn of(values: impl Iterator<Item = f32>) -> Option<Self> {
        let mut values: Vec<f32> = values.filter(|v| v.is_finite()).collect();
        if values.is_empty() {
            return None;
        }
        let count = values.len();
        let (sum, squares) =
            values.iter().map(|&v| f64::from(v)).fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
        let mut quantile = |q: f64| {
            let place = ((count - 1) as f64 * q).round() as usize;
            f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1)
        };
        let (median, p95, top, max) =
            (quantile(0.5), quantile(0.95), quantile(0.99), quantile(1.0));
        let top = if top > 0.0 { top } else { 1.0 };
        let mut bins = vec![0; BINS];
        for &value in &values {
            let bin = (f64::from(value) / top * BINS as f64) as usize;
            bins[bin.min(BINS - 1)] += 1;
        }
        Some(Self {
            count,
            mean: sum / count as f64,
            rms: (squares / count as f64).sqrt(),
            median,
            p95,
            max,
            top,
            bins,
        })
    }

    /// The histogram as an inline SVG with its axis in `unit`.
    pub(super) fn histogram(&self, unit: &str) -> Markup {
        let (width, height) = (600.0, 160.0);
        let tallest = self.bins.iter().copied().max().unwrap_or(1).max(1) as f64;
        let step = width / self.bins.len() as f64;
        let place = |value: f64| (value / self.top * width).clamp(0.0, width);
        html! {
            svg class="histogram" viewBox="-8 -8 616 200" role="img" aria-label={"distribution in " (unit)} {
                @for (k, &count) in self.bins.iter().enumerate() {
                    @let bar = count as f64 / tallest * height;
                    rect class="bar" x=(format!("{:.1}", k as f64 * step)) y=(format!("{:.1}", height - bar))
                        width=(format!("{:.1}", step - 1.0)) height=(format!("{bar:.1}")) {}
                }
                @for (name, value) in [("median", self.median), ("95 %", self.p95)] {
                    @let x = format!("{:.1}", place(value));
                    line class="mark" x1=(x) x2=(x) y1="0" y2=(height) {}
                    text class="mark" x=(format!("{:.1}", place(value) + 4.0)) y="10" { (name) }
                }
                @for k in 0..=4 {
                    @let value = self.top * f64::from(k) / 4.0;
                    text class="axis" x=(format!("{:.1}", place(value))) y=(height + 18.0)
                        text-anchor=(if k == 0 { "start" } else if k == 4 { "end" } else { "middle" }) {
                        (number(value)) @if k == 4 { " " (unit) }
                    }
                }
            }
        }
    }
}

/// Three significant digits.
pub(super) fn number(value: f64) -> String {
    let digits =
        if value == 0.0 { 0 } else { (2 - value.abs().log10().floor() as i32).clamp(0, 6) };
    format!("{value:.*}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_ramp() {
        let ramp = Distribution::of((0..=100).rev().map(|k| k as f32)).unwrap();
        assert_eq!(
            (ramp.count, ramp.mean, ramp.median, ramp.p95, ramp.max),
            (101, 50.0, 50.0, 95.0, 100.0)
        );
        assert_eq!(ramp.bins.iter().sum::<usize>(), 101);
    }

    #[test]
    fn degenerate_input() {
        assert_eq!(Distribution::of(std::iter::empty()), None);
        assert_eq!(Distribution::of([f32::NAN, f32::INFINITY].into_iter()), None);
        let zeros = Distribution::of([0.0; 3].into_iter()).unwrap();
        assert_eq!((zeros.max, zeros.bins[0]), (0.0, 3));
        assert!(zeros.histogram("deg").into_string().contains("svg"));
    }

    #[test]
    fn numbers_have_three_digits() {
        let check = |value, text: &str| assert_eq!(number(value), text);
        check(0.0, "0");
        check(0.012_345, "0.0123");
        check(1.234_5, "1.23");
        check(123.45, "123");
        check(12_345.0, "12345");
    }
}

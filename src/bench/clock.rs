//! How long something takes.

use std::time::Instant;

/// What a piece of work took, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// By the clock on the wall.
    pub wall_s: f64,
    /// Processor time of all threads together: what other programs take at the same time does not count.
    pub processor_s: f64,
}

impl Spent {
    /// Both times `factor`.
    pub(super) fn times(self, factor: f64) -> Self {
        Self { wall_s: factor * self.wall_s, processor_s: factor * self.processor_s }
    }

    /// Medians of each.
    pub(super) fn median(all: &[Self]) -> Self {
        let of = |value: fn(&Self) -> f64| median(&all.iter().map(value).collect::<Vec<_>>());
        Self { wall_s: of(|spent| spent.wall_s), processor_s: of(|spent| spent.processor_s) }
    }
}

/// Does some work on threads that live on after it, and says what it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (Spent, T) {
    let (begun, before) = (Instant::now(), processor_seconds());
    let value = work();
    let wall_s = begun.elapsed().as_secs_f64();
    let processor_s = match (before, processor_seconds()) {
        (Some(before), Some(after)) if after > before => after - before,
        _ => wall_s,
    };
    (Spent { wall_s, processor_s }, value)
}

/// Processor time of all threads so far, where the system tells.
fn processor_seconds() -> Option<f64> {
    let of_thread = |task: std::fs::DirEntry| -> Option<f64> {
        let text = crate::files::read_input_text(&task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    Some(1e-9 * tasks.flatten().filter_map(of_thread).sum::<f64>())
}

/// The middle value, the mean of the middle two; NaN of nothing.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    crate::compare::percentile(&sorted, 0.5).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_taken_of_each_time() {
        let spent = |wall_s: f64, processor_s: f64| Spent { wall_s, processor_s };
        let all = [spent(3.0, 1.0), spent(1.0, 5.0), spent(2.0, 9.0)];
        assert_eq!(Spent::median(&all), spent(2.0, 5.0));
        assert!(Spent::median(&[]).wall_s.is_nan());
    }

    #[test]
    fn work_takes_time() {
        let (spent, sum) = timed(|| (0..3_000_000_u64).map(std::hint::black_box).sum::<u64>());
        assert_eq!(sum, 4_499_998_500_000);
        assert!(spent.wall_s > 0.0 && spent.processor_s > 0.0, "{spent:?}");
    }
}

//! The figures as text.

use super::curves::Curve;
use super::report::{MethodReport, Report, SetReport};
use std::fmt::Write;

/// One table a set; `*` marks methods that no other beats in both time and error.
pub fn sets_text(report: &Report) -> String {
    report.sets.iter().map(|set| set_text(set, report.threads)).collect::<Vec<_>>().join("\n")
}

fn set_text(set: &SetReport, threads: usize) -> String {
    let [width, height] = set.size_px;
    let mut text = format!(
        "{}: {}\n{width} x {height}, {} lights, {threads} thread{}; touching {:.1} MB once takes {:.2} ms; errors over {} photosites\n",
        set.name,
        set.about,
        set.lights,
        if threads == 1 { "" } else { "s" },
        set.touch.bytes as f64 / 1e6,
        set.touch.milliseconds,
        set.compared,
    );
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "  {:<20}{:>10}{:>11}{:>8}{:>8}{:>8}{:>8}{:>10}{:>9}",
        "method", "x touch", "ms", "mean", "median", "rms", "95 %", "unsolved", "robust"
    );
    set.methods.iter().for_each(|method| text.push_str(&method_text(method)));
    for (method, adapter) in set.methods.iter().filter_map(|m| Some((m, m.adapter.as_ref()?))) {
        let _ = writeln!(text, "  {}: on {adapter}, multiples of wall time", method.name);
    }
    text
}

fn method_text(method: &MethodReport) -> String {
    let robust = method
        .robust_share
        .map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    format!(
        "{} {:<20}{:>10.1}{:>11.1}{:>8.2}{:>8.2}{:>8.2}{:>8.2}{:>8.2} %{:>9}\n",
        if method.on_front { '*' } else { ' ' },
        method.name,
        method.times_touch,
        method.milliseconds,
        method.mean_deg,
        method.median_deg,
        method.rms_deg,
        method.p95_deg,
        100.0 * method.unsolved_share,
        robust,
    )
}

/// One line a curve and size; nothing where no curve was measured.
pub fn curves_text(curves: &[Curve]) -> String {
    let mut text = String::new();
    for curve in curves {
        let _ = writeln!(text, "{} over {}", curve.method, curve.over);
        for point in &curve.points {
            let photosites = 1e6 * point.megapixels;
            let _ = writeln!(
                text,
                "  {:>6.1} MP {:>3} lights {:>8.2} x touch {:>9.1} ms {:>7.2} ns of processor a photosite",
                point.megapixels,
                point.lights,
                point.times_touch,
                point.milliseconds,
                1e6 * point.processor_milliseconds / photosites,
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::Touch;

    fn method(name: &str, on_front: bool, robust_share: Option<f64>) -> MethodReport {
        MethodReport {
            name: name.to_owned(),
            about: String::new(),
            times_touch: 4.56,
            adapter: (name == "gpu").then(|| "card".to_owned()),
            milliseconds: 123.45,
            processor_milliseconds: 200.0,
            repeats: 3,
            mean_deg: 1.234,
            median_deg: 0.5,
            rms_deg: 2.0,
            p95_deg: 12.3,
            unsolved_share: 0.001,
            robust_share,
            on_front,
        }
    }

    #[test]
    fn a_table_has_one_aligned_line_a_method() {
        let set = SetReport {
            name: "linen".to_owned(),
            about: "plain weave".to_owned(),
            size_px: [640, 480],
            lights: 10,
            rows_step: 1,
            compared: 5,
            touch: Touch { bytes: 12_300_000, milliseconds: 1.5, processor_milliseconds: 3.0 },
            methods: vec![
                method("auto", true, Some(0.25)),
                method("gpu", true, Some(0.25)),
                method("l1", false, None),
            ],
            warnings: vec![],
        };
        let report = Report {
            schema: 1,
            program: String::new(),
            threads: 2,
            sets: vec![set],
            curves: vec![],
            colors: vec![],
        };
        let expected = "\
linen: plain weave
640 x 480, 10 lights, 2 threads; touching 12.3 MB once takes 1.50 ms; errors over 5 photosites
  method                 x touch         ms    mean  median     rms    95 %  unsolved   robust
* auto                       4.6      123.5    1.23    0.50    2.00   12.30    0.10 %   25.0 %
* gpu                        4.6      123.5    1.23    0.50    2.00   12.30    0.10 %   25.0 %
  l1                         4.6      123.5    1.23    0.50    2.00   12.30    0.10 %        -
  gpu: on card, multiples of wall time
";
        assert_eq!(sets_text(&report), expected);
        assert_eq!(curves_text(&[]), "");
    }

    #[test]
    fn times_of_curves_are_given_per_photosite_too() {
        let point = super::super::CurvePoint {
            megapixels: 2.0,
            lights: 10,
            milliseconds: 30.0,
            processor_milliseconds: 50.0,
            times_touch: 3.0,
        };
        let curve = Curve { over: "lights", method: "auto", points: vec![point] };
        let text = curves_text(&[curve]);
        assert_eq!(
            text,
            "auto over lights\n     2.0 MP  10 lights     3.00 x touch      30.0 ms   25.00 ns of processor a photosite\n"
        );
    }
}

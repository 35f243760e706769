//! The figures as a picture: one panel a set, time across and error up, and one a family of curves.

use super::chart::{Line, Mark, Panel, Shape, svg as svg_of_panels};
use super::curves::{Curve, CurvePoint};
use super::report::{MethodReport, Report, SetReport};
use crate::photometry::Method;

/// The program's own methods, others, the front (told apart by colour-blind people too).
const OWN: &str = "#0060a8";
const OTHER: &str = "#707070";
const FRONT: &str = "#e69f00";
/// Of curves.
const COLORS: [&str; 4] = ["#707070", "#0060a8", "#009e73", "#d55e00"];

/// A self-contained SVG file.
pub(super) fn svg(report: &Report) -> String {
    let sets = report.sets.iter().map(of_set);
    let families = ["megapixels", "lights"].map(|over| of_curves(over, &report.curves));
    let panels: Vec<Panel> = sets.chain(families.into_iter().flatten()).collect();
    svg_of_panels(&panels)
}

fn of_set(set: &SetReport) -> Panel {
    let mark = |method: &MethodReport| Mark {
        at: [method.times_touch, method.mean_deg],
        label: method.name.clone(),
        color: if is_own(&method.name) { OWN } else { OTHER },
        shape: if method.on_front { Shape::Disc } else { Shape::Ring },
    };
    Panel {
        title: set.name.clone(),
        axes: [
            "processor time, multiples of touching the bytes once".to_owned(),
            "mean error, degrees".to_owned(),
        ],
        marks: set.methods.iter().map(mark).collect(),
        lines: vec![Line { points: front(set), color: FRONT }],
    }
}

fn is_own(name: &str) -> bool {
    let own = [Method::LeastSquares, Method::Weighted, Method::Auto, Method::Robust];
    name == "gpu" || own.into_iter().any(|method| method.name() == name)
}

/// The front's points by ascending time.
fn front(set: &SetReport) -> Vec<[f64; 2]> {
    let on_front = set.methods.iter().filter(|method| method.on_front);
    let mut points: Vec<[f64; 2]> = on_front.map(|m| [m.times_touch, m.mean_deg]).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

/// Milliseconds over what grows: straight lines of slope one where the cost is linear.
fn of_curves(over: &str, curves: &[Curve]) -> Option<Panel> {
    let at = |point: &CurvePoint| {
        let across = if over == "lights" { point.lights as f64 } else { point.megapixels };
        [across, point.processor_milliseconds]
    };
    let mut panel = Panel {
        title: format!("generated bands: time over {over}"),
        axes: [over.to_owned(), "processor time, milliseconds".to_owned()],
        marks: vec![],
        lines: vec![],
    };
    let family = curves.iter().filter(|curve| curve.over == over);
    for (curve, color) in family.zip(COLORS) {
        let points: Vec<[f64; 2]> = curve.points.iter().map(at).collect();
        let Some(&last) = points.last() else { continue };
        panel.lines.push(Line { points, color });
        let label = curve.method.to_owned();
        panel.marks.push(Mark { at: last, label, color, shape: Shape::Disc });
    }
    (!panel.lines.is_empty()).then_some(panel)
}

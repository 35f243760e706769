//! What came of a fit, in a few words.

use crate::jobs::calibrate::Report;
use crate::texts::calibrate as texts;
use weavelight::calibrate::wizard::Step;

/// The step and its figures.
pub(super) fn text(report: &Report) -> (Step, String) {
    match report {
        Report::Camera(report) => {
            let kept = report.boards.iter().filter(|board| board.dropped.is_none()).count();
            let text = texts::camera_figures(kept, report.rms_reprojection_px, report.height_mm);
            (Step::Camera, text)
        }
        Report::Color(report) => {
            let count = report.patches_de2000.len().max(1) as f64;
            let mean = report.patches_de2000.iter().map(|[_, with]| with).sum::<f64>() / count;
            let colors = (!report.patches_de2000.is_empty()).then_some(mean);
            (Step::Color, texts::color_figures(report.nonlinearity, colors))
        }
        Report::Lights(report) => {
            let sigmas: Vec<f64> =
                report.lights.iter().filter_map(|light| light.position_sigma_mm).collect();
            let square = sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>();
            let sigma = (square / sigmas.len().max(1) as f64).sqrt();
            let moved = report.lights.iter().filter_map(|light| light.from_rig_mm);
            let text = texts::lights_figures(sigma, moved.fold(0.0, f64::max));
            (Step::Lights, text)
        }
        Report::Check(report) => {
            let worst = report.sheets.iter().map(|sheet| sheet.slope_rms_deg).fold(0.0, f64::max);
            (Step::Check, texts::check_figures(report.passed, worst, report.threshold_deg))
        }
    }
}

//! Colours of simulated cloth against the truth, in a crop of 512 x 512, sharp, with a seed that no constant of the method was
//! chosen on. Opposite dyes and dyes that are equal in green are not here: on them the method is not better than interpolation.

#![allow(clippy::unwrap_used, reason = "a test that cannot set its scene up has failed")]

use weavelight::bench::{ColorCloth, ColorOptions, ColorRow, measure_colors};

fn measure(cloth: &str, psf_px: f64) -> ColorRow {
    let options = ColorOptions {
        cloths: vec![ColorCloth::parse(cloth).unwrap()],
        sizes_px: vec![[1848, 1224]],
        middle_px: Some([512, 512]),
        psf_px: vec![psf_px],
        seeds: vec![2],
    };
    measure_colors(&options, &|_, _| {}).unwrap().remove(0)
}

/// Mean, 95 %, mean of 4 x 4 means and false colour at most; better than every published demosaicer.
fn check(cloth: &str, [mean, p95, blocks, false_color]: [f64; 4]) {
    let row = measure(cloth, 0.0);
    let found = &row.figures;
    assert!(found.mean_de2000 <= mean, "{cloth}: {found:?}");
    assert!(found.p95_de2000 <= p95, "{cloth}: {found:?}");
    assert!(found.mean_de2000_4x4.unwrap() <= blocks, "{cloth}: {found:?}");
    assert!(found.false_color <= false_color, "{cloth}: {found:?}");
    for (name, of) in &row.demosaicers {
        assert!(found.mean_de2000 < of.mean_de2000 + 0.02, "{cloth}: {name} has {of:?}");
    }
}

#[test]
fn linen_has_its_colour() {
    check("linen", [1.3, 3.5, 0.6, 0.7]);
}

#[test]
fn denim_has_its_two() {
    check("denim", [3.4, 7.5, 2.9, 3.5]);
}

#[test]
fn knit_has_its_colour() {
    check("knit", [1.6, 5.5, 0.8, 0.9]);
}

#[test]
fn satin_and_velvet_stay_right() {
    check("satin", [1.9, 3.3, 1.9, 0.8]);
    check("velvet", [0.42, 0.6, 0.42, 0.2]);
}

#[test]
fn ink_on_flat_cloth_is_no_shade() {
    check("print on flat", [1.5, 7.5, 1.1, 5.0]);
}

/// Two dyes of one lightness nearly: shading must not swallow them.
#[test]
fn close_dyes_are_told_apart() {
    check("close dyes, 3 px", [2.2, 5.0, 0.8, 1.8]);
}

/// Where the lens leaves less of the yarns than their shade needs, the solve says that its level is low, and one reading
/// gives it: what is left then is small.
#[test]
fn a_low_level_is_told() {
    let row = measure("linen", 0.7);
    assert!(row.figures.false_color < 0.4, "{:?}", row.figures);
    assert!(row.said.iter().any(|said| said.contains("% low")), "{:?}", row.said);
    assert!(row.said.iter().any(|said| said.starts_with("Yarns of 2.6 px")), "{:?}", row.said);
}

//! What is refused: which picture, why, what to photograph instead; and the old calibration stands as it was.

use super::bench::{Bench, Picture, edit};
use weavelight::calibrate::CalibrateError;
use weavelight::simulate::{Options, Part};

/// The message must hold these words in one or two lines, and no file of the old calibration may change.
pub fn refused<T>(
    bench: &Bench,
    work: impl Fn(&Bench) -> Result<T, CalibrateError>,
    words: &[&str],
) {
    bench.know_all();
    let before = bench.snapshot();
    assert!(before.len() >= 3);
    let Err(error) = work(bench) else { panic!("not refused; expected {words:?}") };
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "no {word:?} in {message:?}");
    }
    assert!(message.lines().count() <= 2, "{message}");
    assert!(bench.snapshot() == before, "the old calibration was touched: {message}");
}

fn check_sheets(
    sheets: &[&str],
    change: impl Fn(&mut Options),
    spoil: impl Fn(&Bench),
    words: &[&str],
) {
    let bench = Bench::new(&[Part::WhiteFlat], change);
    spoil(&bench);
    refused(&bench, |bench| bench.lights(sheets), words);
}

#[test]
fn flawed_sheets() {
    let flat = ["white-flat"];
    let (fine, as_is) = (|_: &mut Options| (), |_: &Bench| ());
    let swapped = |o: &mut Options| o.flaws.swapped = Some([2, 7]);
    check_sheets(&flat, swapped, as_is, &["light 2", "light 7", "wires"]);
    check_sheets(&flat, |o| o.flaws.dead = Some(5), as_is, &["light 5", "dark"]);
    let over = |o: &mut Options| o.flaws.exposure_factor = 4.0;
    check_sheets(&flat, over, as_is, &["overexposes", "exposure", "photograph this sheet again"]);
    check_sheets(&["white-flat", "white-flat"], fine, as_is, &["is given twice"]);
    let nine = |bench: &Bench| {
        edit(bench.rig("white-flat/session.toml"), |text| {
            text.replace("light = 9\n", "light = 8\n")
        });
    };
    check_sheets(&flat, fine, nine, &["light [9]", "photograph"]);
    let wrong_strip = |bench: &Bench| {
        edit(bench.rig("white-flat/session.toml"), |t| t.replace("columns = ", "columns = 1"));
    };
    check_sheets(&flat, fine, wrong_strip, &["strip", "not found"]);
    let knocked = |bench: &Bench| {
        bench.spoil("white-flat", "light-06", |picture| picture.shift(4, -2));
    };
    check_sheets(&flat, fine, knocked, &["moved", "light-06", "photograph this pose again"]);
}

#[test]
fn sheets_that_all_lie_alike() {
    // Two sheets, none raised, none tilted: no more than one.
    let bench = Bench::new(&[Part::WhiteFlat, Part::WhiteRaised], |o| o.targets.raised_mm = 0.0);
    let two = ["white-flat", "white-raised"];
    refused(&bench, |bench| bench.lights(&two), &["all 2", "same pose", "raised", "tilted"]);
}

/// Of six boards, the first on the table.
fn check_boards(change: impl Fn(&mut Options), spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = Bench::new(&[Part::Board], |o| {
        o.targets.boards = 6;
        change(o);
    });
    spoil(&bench);
    refused(&bench, Bench::camera, words);
}

#[test]
fn boards_that_say_nothing() {
    let fine = |_: &mut Options| ();
    let manifest = |bench: &Bench| bench.rig("board/session.toml");
    let other_size = |bench: &Bench| {
        edit(manifest(bench), |text| {
            text.replace("columns = 9", "columns = 8").replace("rows = 6", "rows = 7")
        });
    };
    check_boards(fine, other_size, &["8 x 7", "correct columns and rows"]);
    // The board on the table, pushed about: one angle.
    let one_angle = |bench: &Bench| {
        let first = std::fs::read(bench.rig("board/board-00.dng")).unwrap();
        for k in 1..6 {
            std::fs::write(bench.rig(&format!("board/board-0{k}.dng")), &first).unwrap();
            let by = 2 * k as isize;
            bench.spoil("board", &format!("board-0{k}"), |picture| picture.shift(by, 6 - by));
        }
    };
    check_boards(fine, one_angle, &["one angle", "tilted by 20 to 40 degrees"]);
    let spoil_all = |change: fn(&mut Picture)| {
        move |bench: &Bench| {
            bench.spoil("board", "board", change);
        }
    };
    let whole = ["complete", "whole board", "sharp"];
    // Small: each of these pictures is searched in every way.
    let few = |o: &mut Options| {
        o.targets.boards = 4;
        o.size_px = Some([308, 204]);
    };
    check_boards(few, spoil_all(|picture| picture.blur(10)), &whole);
    check_boards(few, spoil_all(|picture| picture.shift(200, 0)), &whole);
    // All but the table's: too few.
    let most = |bench: &Bench| {
        (1..5).for_each(|k| {
            bench.spoil("board", &format!("board-0{k}"), |picture| picture.blur(20));
        });
    };
    check_boards(fine, most, &["only 2 usable", "at least 4"]);
    // The table's own.
    let table = |bench: &Bench| {
        bench.spoil("board", "board-00", |picture| picture.shift(240, 0));
    };
    check_boards(fine, table, &["board-00", "table", "photograph it again"]);
}

#[test]
fn some_bad_boards_are_left_out_by_name() {
    let bench = Bench::new(&[Part::Board], |_| ());
    bench.spoil("board", "board-03", |picture| picture.blur(20));
    bench.spoil("board", "board-05", |picture| picture.shift(240, 60));
    let report = bench.camera().unwrap();
    for name in ["board-03", "board-05"] {
        let told = report.warnings.iter().any(|w| w.contains(name) && w.contains("left out"));
        assert!(told, "{name}: {:?}", report.warnings);
    }
    assert!(report.rms_reprojection_px < 0.06, "{}", report.rms_reprojection_px);
}

#[test]
fn squares_of_another_size_are_told() {
    let bench = Bench::new(&[Part::Board], |_| ());
    edit(bench.rig("board/session.toml"), |text| text.replace("square_mm = ", "square_mm = 1"));
    let report = bench.camera().unwrap();
    let told =
        report.warnings.iter().any(|w| w.contains("square_mm") && w.contains("over the table"));
    assert!(told, "{:?}", report.warnings);
}

fn check_chart(change: impl Fn(&mut Options), spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = Bench::new(&[Part::Grey], change);
    spoil(&bench);
    refused(&bench, Bench::color, words);
}

#[test]
fn charts_in_the_wrong_place() {
    let fine = |_: &mut Options| ();
    let moved = |right: isize, down: isize| {
        move |bench: &Bench| {
            bench.spoil("grey", "", |picture| picture.shift(right, down));
        }
    };
    let remedy = ["patch", "put it back", "rect_px"];
    // By one patch, by half of one, by a fifth: over the edges.
    for by in [70, 36, 16] {
        check_chart(fine, moved(by, 0), &remedy);
        check_chart(fine, moved(0, by), &remedy);
    }
    let upside_down = |bench: &Bench| {
        // Turned by half a turn the colours of the mosaic come to lie elsewhere; one row and column back they fit.
        bench.spoil("grey", "", |picture| {
            picture.samples.reverse();
            let width = picture.width;
            picture.samples.rotate_left(width + 1);
        });
    };
    check_chart(fine, upside_down, &remedy);
    let outside = |bench: &Bench| {
        edit(bench.rig("grey/session.toml"), |text| {
            let (before, rest) = text.split_once("rect_px = [").unwrap();
            let (_, after) = rest.split_once(']').unwrap();
            format!("{before}rect_px = [900, 44, 990, 90]{after}")
        });
    };
    check_chart(fine, outside, &["patch 0", "outside"]);
    check_chart(|o| o.flaws.dead = Some(4), |_| (), &["light 4", "photograph the chart again"]);
    let nine = |bench: &Bench| {
        edit(bench.rig("grey/session.toml"), |t| t.replace("light = 9\n", "light = 8\n"));
    };
    check_chart(fine, nine, &["light [9]", "every light"]);
}

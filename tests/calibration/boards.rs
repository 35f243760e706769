//! The search for the board: where something lies beside it, where there is none, and that it can be stopped.

use super::bench::{Bench, edit};
use std::panic::{AssertUnwindSafe, catch_unwind};
use weavelight::calibrate::find_board;
use weavelight::raw::{self, Frame, Hint, Layout, Metadata, Samples};
use weavelight::session::{Board, Session};
use weavelight::simulate::Part;

const BOARD: Board = Board { columns: 9, rows: 6, square_mm: 25.0 };

fn grey(width: usize, height: usize, value: impl FnMut(usize) -> f32) -> Frame {
    Frame {
        width,
        height,
        layout: Layout::Grey,
        samples: Samples::F32((0..width * height).map(value).collect()),
        black: [0.0; 4],
        saturation: [1.0; 4],
        metadata: Metadata::default(),
    }
}

/// Fine texture of several kinds: a plain weave, noise, a twill.
fn cloths() -> Vec<Frame> {
    let (width, height) = (1500, 1000);
    let mut seed = 5u64;
    let mut dice = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32
    };
    let at = |k: usize| (k % width, k / width);
    let weave = grey(width, height, |k| {
        let (x, y) = at(k);
        let over = (x / 8 + y / 8) % 2 == 0;
        let along = if over { x } else { y } % 8;
        0.2 + 0.5 * (along as f32 / 8.0 * std::f32::consts::PI).sin()
    });
    let noise = grey(width, height, |_| dice());
    let twill = grey(width, height, |k| {
        let (x, y) = at(k);
        if (x + y) % 12 < 6 { 0.25 } else { 0.6 + 0.01 * (x % 6) as f32 }
    });
    vec![weave, noise, twill]
}

#[test]
fn cloth_is_no_board() {
    for (k, cloth) in cloths().iter().enumerate() {
        let seen = find_board(cloth, &BOARD, &|| ()).unwrap();
        assert_eq!(seen, None, "cloth {k}");
    }
}

#[test]
fn the_search_can_be_stopped_and_gives_up_on_what_cannot_be() {
    let cloth = &cloths()[0];
    let ticks = std::cell::Cell::new(0);
    let stop = || {
        ticks.set(ticks.get() + 1);
        if ticks.get() == 2 {
            std::panic::resume_unwind(Box::new("stopped"));
        }
    };
    let ended = catch_unwind(AssertUnwindSafe(|| find_board(cloth, &BOARD, &stop)));
    assert!(ended.is_err() && ticks.get() == 2);

    let never = || panic!("a picture of nothing was searched");
    for value in [0.0, 0.5, 1.0] {
        assert_eq!(find_board(&grey(1500, 1000, |_| value), &BOARD, &never).unwrap(), None);
    }
    let million = Board { columns: 1000, rows: 1000, square_mm: 1.0 };
    assert_eq!(find_board(cloth, &million, &never).unwrap(), None);
    let tiny = grey(3, 2, |k| k as f32);
    assert_eq!(find_board(&tiny, &BOARD, &never).unwrap(), None);
}

/// A disc that clips, its edge just beside an inner corner of `file`, and where that corner is.
fn glare(bench: &Bench, file: &str, corner: usize) -> [f64; 2] {
    let session = Session::load(&bench.rig("board")).unwrap();
    let entry = session.frames.iter().find(|e| e.file.to_string_lossy().starts_with(file)).unwrap();
    let frame = raw::decode(&session.read_frame(entry).unwrap(), &Hint::default()).unwrap();
    let board = session.target.as_ref().unwrap().board.unwrap();
    let seen = find_board(&frame, &board, &|| ()).unwrap().unwrap();
    let (here, next) = (seen.corners_px()[corner], seen.corners_px()[corner + 1]);
    let along = [next[0] - here[0], next[1] - here[1]];
    let square = along[0].hypot(along[1]);
    let centre = [here[0] + 0.42 * along[0] - 0.1 * along[1], here[1] + 0.42 * along[1]];
    let radius = 0.36 * square;
    bench.spoil("board", file, |picture| {
        let width = picture.width;
        for (k, sample) in picture.samples.iter_mut().enumerate() {
            let far = ((k % width) as f64 - centre[0]).hypot((k / width) as f64 - centre[1]);
            let share = ((radius - far) / 1.5).clamp(0.0, 1.0);
            *sample = (f64::from(*sample) + share * 16_000.0).min(16_383.0) as u16;
        }
    });
    here
}

#[test]
fn glare_beside_a_corner_costs_that_corner_and_not_the_board() {
    let bench = Bench::new(&[Part::Board], |_| ());
    for (file, corner) in [("board-02", 12), ("board-04", 0), ("board-06", 40)] {
        glare(&bench, file, corner);
    }
    let report = bench.camera().unwrap();
    let of = |name: &str| report.boards.iter().find(|b| b.file.contains(name)).unwrap();
    for name in ["board-02", "board-04", "board-06"] {
        assert_eq!(of(name).dropped, None, "{name}");
        assert!(of(name).rms_px.unwrap() < 0.15, "{name}: {:?}", of(name).rms_px);
    }
    assert!(report.rms_reprojection_px < 0.06, "{}", report.rms_reprojection_px);
}

/// What is said of one spoiled board among good ones.
fn check_cause(spoil: impl Fn(&Bench), words: &[&str]) {
    let bench = Bench::new(&[Part::Board], |o| o.targets.boards = 8);
    spoil(&bench);
    let report = bench.camera().unwrap();
    let spoiled = report.boards.iter().find(|board| board.file.contains("board-03")).unwrap();
    let why = spoiled.dropped.clone().unwrap_or_default();
    assert!(words.iter().any(|word| why.contains(word)), "{words:?}: {why}");
    assert!(report.warnings.iter().any(|w| w.contains("board-03") && w.contains(&why)));
}

#[test]
fn the_true_cause_is_told() {
    check_cause(
        |b| {
            b.spoil("board", "board-03", |p| p.blur(20));
        },
        &["blurred"],
    );
    check_cause(
        |b| {
            b.spoil("board", "board-03", |p| p.samples.fill(600));
        },
        &["no contrast"],
    );
    check_cause(
        |b| {
            b.spoil("board", "board-03", |p| p.shift(240, 60));
        },
        &["cut off"],
    );
    let copied = |bench: &Bench| {
        std::fs::copy(bench.rig("board/board-02.dng"), bench.rig("board/board-03.dng")).unwrap();
        edit(bench.rig("board/session.toml"), |text| {
            let lines = text.lines().filter(|line| !line.starts_with("sha256"));
            lines.collect::<Vec<_>>().join("\n") + "\n"
        });
    };
    check_cause(copied, &["the same picture as", "board-02"]);
    let noise = |bench: &Bench| {
        bench.spoil("board", "board-03", |picture| {
            let mut seed = 9u64;
            for sample in &mut picture.samples {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                *sample = 700 + (seed >> 52) as u16;
            }
        });
    };
    check_cause(noise, &["no board in it"]);
}

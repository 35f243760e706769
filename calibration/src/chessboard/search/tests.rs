use super::*;

const SHAPE: BoardShape = BoardShape { columns: 9, rows: 6, square_mm: 25.0 };

fn picture(size: [usize; 2], mut value: impl FnMut(usize, usize) -> f32) -> Image<f32> {
    let [width, height] = size;
    let data = (0..width * height).map(|k| value(k % width, k / width)).collect();
    Image { width, height, data }
}

/// White noise in [-0.5, 0.5).
fn dice() -> impl FnMut() -> f32 {
    let mut seed = 5u64;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / (1u64 << 24) as f32 - 0.5
    }
}

/// A board of squares of 36 px, a little blurred by noise, in a light margin.
fn board() -> Image<f32> {
    let mut noise = dice();
    picture([640, 480], |x, y| {
        let (column, row) = ((x as i32 - 140).div_euclid(36), (y as i32 - 110).div_euclid(36));
        let inside = (0..10).contains(&column) && (0..7).contains(&row);
        let dark = inside && (column + row) % 2 == 0;
        let level = if dark { 0.1 } else { 0.8 };
        level + 0.02 * noise()
    })
}

/// Dark squares apart from each other: `count` across and half as many down.
fn squares(count: usize) -> Image<f32> {
    let pitch = 1200 / count;
    picture([1200, 600], |x, y| {
        let dark = [x, y].iter().all(|at| (1..3).contains(&(at % pitch * 4 / pitch)));
        if dark { 0.2 } else { 0.7 }
    })
}

/// Seconds of processor time of this thread.
fn seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split_whitespace().next().unwrap().parse::<f64>().unwrap() * 1e-9
}

#[test]
fn a_search_on_cloth_is_bounded() {
    opencv::core::set_num_threads(0).unwrap();
    let mut noise = dice();
    let twill =
        |x: usize, y: usize| if (x + y) % 12 < 6 { 0.25 } else { 0.6 + 0.01 * (x % 6) as f32 };
    let weave = |x: usize, y: usize| {
        let along = if (x / 6 + y / 6).is_multiple_of(2) { x % 6 } else { y % 6 };
        0.2 + 0.5 * (along as f32 / 6.0 * std::f32::consts::PI).sin()
    };
    // Fine twill becomes noise when it is reduced, and every grain of noise a quadrangle. `classic`: its calls at most.
    for (name, cloth, classic) in [
        ("twill", picture([1500, 1000], twill), 4),
        ("noisy weave", picture([800, 600], |x, y| weave(x, y) + 0.3 * noise()), 3),
        ("squares", squares(48), 0),
    ] {
        let (mut effort, started) = (Effort::default(), seconds());
        let found = find(&cloth, &SHAPE, &|| (), &mut effort).unwrap();
        let took = seconds() - started;
        assert!(found.is_err(), "{name}");
        assert!(effort.classic <= classic && effort.sector_based <= 5, "{name}: {effort:?}");
        assert!(effort.pixels <= 6 * cloth.data.len(), "{name}: {effort:?}");
        // Unbounded, one call of the classic detector takes 20 s on the twill, and minutes on others.
        assert!(took < 30.0, "{name}: {took} s");
    }
}

#[test]
fn the_classic_detector_is_asked_about_boards() {
    let searched = Searched::of(&board());
    for version in [Version::Whole, Version::Half, Version::Even] {
        let attempt = Attempt { detector: Detector::Classic, version, flags: CLASSIC };
        let mut effort = Effort::default();
        let corners = corners_of(&searched, &SHAPE, attempt, &mut effort).unwrap();
        assert_eq!(effort.classic, 1);
        assert_eq!(corners.unwrap().len(), 54);
    }
}

#[test]
fn the_limit_lies_between_a_room_and_cloth() {
    for (count, few) in [(20, true), (24, true), (30, false), (60, false)] {
        let (width, bytes) = Searched::of(&squares(count)).bytes(1);
        let row = Mat::from_slice(&bytes).unwrap();
        let mut mat = Mat::default();
        row.reshape(1, (bytes.len() / width) as i32).unwrap().copy_to(&mut mat).unwrap();
        let flags = quads::bounded(&mat, &SHAPE, CLASSIC).unwrap();
        assert_eq!(flags, few.then_some(CLASSIC), "{count} across");
    }
}

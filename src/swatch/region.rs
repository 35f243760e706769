//! Regions of a grid: growing, closing, filling. Grids have one place for hundreds of photosites, so plain loops do.

use weavelight_calibration::description::Image;

/// The places that a path of true places joins to one of `seeds`, seeds that are true included. Steps go along rows and
/// columns.
pub(crate) fn flood(passable: &Image<bool>, seeds: &[usize]) -> Image<bool> {
    let mut reached = Image::filled(passable.width, passable.height, false);
    let mut open: Vec<usize> = seeds.iter().copied().filter(|&at| passable.data[at]).collect();
    open.iter().for_each(|&at| reached.data[at] = true);
    while let Some(at) = open.pop() {
        for next in neighbours(passable, at) {
            if passable.data[next] && !reached.data[next] {
                reached.data[next] = true;
                open.push(next);
            }
        }
    }
    reached
}

fn neighbours(grid: &Image<bool>, at: usize) -> impl Iterator<Item = usize> {
    let (x, y, width, height) = (at % grid.width, at / grid.width, grid.width, grid.height);
    let steps = [
        (x > 0).then(|| at - 1),
        (x + 1 < width).then(|| at + 1),
        (y > 0).then(|| at - width),
        (y + 1 < height).then(|| at + width),
    ];
    steps.into_iter().flatten()
}

/// Every place within `radius` rows and columns of a true one.
pub(crate) fn dilated(region: &Image<bool>, radius: usize) -> Image<bool> {
    let mut out = Image::filled(region.width, region.height, false);
    for at in (0..region.data.len()).filter(|&at| region.data[at]) {
        let (x, y) = (at % region.width, at / region.width);
        let columns = x.saturating_sub(radius)..(x + radius + 1).min(region.width);
        for row in y.saturating_sub(radius)..(y + radius + 1).min(region.height) {
            out.data[row * region.width..][columns.clone()].fill(true);
        }
    }
    out
}

/// Grown by `radius` and shrunk again: gaps of up to twice that are bridged. Never smaller than it was.
pub(crate) fn closed(region: &Image<bool>, radius: usize) -> Image<bool> {
    inverted(&dilated(&inverted(&dilated(region, radius)), radius))
}

fn inverted(region: &Image<bool>) -> Image<bool> {
    let data = region.data.iter().map(|value| !value).collect();
    Image { width: region.width, height: region.height, data }
}

/// With everything that it surrounds: what is outside can be reached from the border of the grid.
pub(crate) fn with_holes_filled(region: &Image<bool>) -> Image<bool> {
    let (width, height) = (region.width, region.height);
    let on_border = |at: &usize| {
        let (x, y) = (at % width, at / width);
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    };
    let border: Vec<usize> = (0..region.data.len()).filter(on_border).collect();
    inverted(&flood(&inverted(region), &border))
}

/// Without its connected parts of fewer than `least` places.
pub(crate) fn without_specks(region: &Image<bool>, least: usize) -> Image<bool> {
    let mut out = region.clone();
    let mut seen = Image::filled(region.width, region.height, false);
    for at in 0..region.data.len() {
        if !region.data[at] || seen.data[at] {
            continue;
        }
        let part = part_of(region, at, &mut seen);
        if part.len() < least {
            part.into_iter().for_each(|at| out.data[at] = false);
        }
    }
    out
}

/// The connected part that a place belongs to.
fn part_of(region: &Image<bool>, at: usize, seen: &mut Image<bool>) -> Vec<usize> {
    let mut part = vec![at];
    seen.data[at] = true;
    let mut next = 0;
    while let Some(&at) = part.get(next) {
        next += 1;
        for neighbour in neighbours(region, at) {
            if region.data[neighbour] && !seen.data[neighbour] {
                seen.data[neighbour] = true;
                part.push(neighbour);
            }
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(rows: &[&str]) -> Image<bool> {
        let data = rows.iter().flat_map(|row| row.chars().map(|c| c == '#')).collect();
        Image { width: rows[0].len(), height: rows.len(), data }
    }

    fn check(found: &Image<bool>, expected: &[&str]) {
        assert_eq!(*found, grid(expected));
    }

    #[test]
    fn floods_go_round_corners_but_not_across_them() {
        check(&flood(&grid(&["##.", "..#", "###"]), &[0, 3]), &["##.", "...", "..."]);
        check(&flood(&grid(&["##.", ".##", "..#"]), &[8]), &["##.", ".##", "..#"]);
        check(&flood(&grid(&["#"]), &[]), &["."]);
    }

    #[test]
    fn growing_stops_at_the_border() {
        check(&dilated(&grid(&["#...", "....", "...."]), 1), &["##..", "##..", "...."]);
        check(&dilated(&grid(&["....", "...#"]), 9), &["####", "####"]);
    }

    #[test]
    fn closing_bridges_gaps_and_loses_nothing() {
        let (empty, gap, bridged) = ("......", "#..#..", "####..");
        check(
            &closed(&grid(&[empty, empty, gap, empty, empty]), 1),
            &[empty, empty, bridged, empty, empty],
        );
        check(&closed(&grid(&["#....#"]), 1), &["#....#"]);
    }

    #[test]
    fn holes_are_filled_and_bays_are_not() {
        check(
            &with_holes_filled(&grid(&["#####", "#.#.#", "###.#"])),
            &["#####", "###.#", "###.#"],
        );
    }

    #[test]
    fn specks_are_dust() {
        check(
            &without_specks(&grid(&["#..##", "...#.", "#...."]), 3),
            &["...##", "...#.", "....."],
        );
    }
}

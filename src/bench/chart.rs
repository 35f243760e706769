//! Panels with two logarithmic axes, as SVG.

use maud::{Markup, html};

/// Size of a panel, and what its axes leave for labels.
const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 42.0;
const BOTTOM: f64 = 46.0;
/// What an axis shows beyond the outermost values, as a factor.
const MARGIN: f64 = 1.25;
/// Panels side by side.
const COLUMNS: usize = 2;
/// Height of a label and width of one of its letters, about.
const LETTER: [f64; 2] = [6.2, 12.0];

/// One diagram.
pub(super) struct Panel {
    pub(super) title: String,
    /// Along x and along y.
    pub(super) axes: [String; 2],
    pub(super) marks: Vec<Mark>,
    pub(super) lines: Vec<Line>,
}

/// A point with a name.
pub(super) struct Mark {
    pub(super) at: [f64; 2],
    pub(super) label: String,
    pub(super) color: &'static str,
    pub(super) shape: Shape,
}

/// How a point is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    Disc,
    Ring,
}

/// Points joined by straight lines.
pub(super) struct Line {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) color: &'static str,
}

/// All panels as one picture.
pub(super) fn svg(panels: &[Panel]) -> String {
    let columns = panels.len().clamp(1, COLUMNS);
    let rows = panels.len().div_ceil(columns).max(1);
    let (width, height) = (columns as f64 * WIDTH, rows as f64 * HEIGHT);
    let corner = |k: usize| ((k % columns) as f64 * WIDTH, (k / columns) as f64 * HEIGHT);
    let picture = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox={ "0 0 " (width) " " (height) }
            width=(width) height=(height) font-family="sans-serif" font-size="11" {
            rect width="100%" height="100%" fill="white" {}
            @for (k, panel) in panels.iter().enumerate() {
                @let (x, y) = corner(k);
                g transform={ "translate(" (x) " " (y) ")" } { (panel.draw()) }
            }
        }
    };
    picture.into_string() + "\n"
}

/// A coordinate, as short as a pixel asks for.
fn px(value: f64) -> String {
    format!("{value:.1}")
}

impl Panel {
    fn draw(&self) -> Markup {
        let scales = self.scales();
        let place = |p: &[f64; 2]| [scales[0].place(p[0]), scales[1].place(p[1])];
        let points = |line: &Line| {
            let points = line.points.iter().map(place);
            points.map(|[x, y]| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
        };
        html! {
            text x=(LEFT) y="22" font-size="13" font-weight="bold" { (self.title) }
            (self.axes(&scales))
            @for line in &self.lines {
                polyline points=(points(line)) fill="none" stroke=(line.color) stroke-width="1.5" {}
            }
            (self.draw_marks(&place))
        }
    }

    /// Horizontal and vertical, wide enough for everything.
    fn scales(&self) -> [Scale; 2] {
        let all = |axis: usize| {
            let marks = self.marks.iter().map(move |mark| mark.at[axis]);
            marks.chain(self.lines.iter().flat_map(move |l| l.points.iter().map(move |p| p[axis])))
        };
        [
            Scale::around(all(0), [LEFT, WIDTH - RIGHT]),
            Scale::around(all(1), [HEIGHT - BOTTOM, TOP]),
        ]
    }

    fn axes(&self, [across, up]: &[Scale; 2]) -> Markup {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let (middle, height) = (0.5 * (LEFT + right), 0.5 * (TOP + bottom));
        html! {
            @for value in across.ticks() {
                @let x = px(across.place(value));
                path d={ "M" (x) " " (TOP) "V" (bottom) } stroke="#e4e4e4" {}
                text x=(x) y=(bottom + 15.0) text-anchor="middle" { (value) }
            }
            @for value in up.ticks() {
                @let y = up.place(value);
                path d={ "M" (LEFT) " " (px(y)) "H" (right) } stroke="#e4e4e4" {}
                text x=(LEFT - 6.0) y=(px(y + 4.0)) text-anchor="end" { (value) }
            }
            path d={ "M" (LEFT) " " (TOP) "V" (bottom) "H" (right) } fill="none" stroke="#444" {}
            text x=(middle) y=(HEIGHT - 12.0) text-anchor="middle" { (self.axes[0]) }
            text transform={ "translate(14 " (height) ") rotate(-90)" } text-anchor="middle" {
                (self.axes[1])
            }
        }
    }

    /// Points, each with its name at a place that nothing else takes.
    fn draw_marks(&self, place: &dyn Fn(&[f64; 2]) -> [f64; 2]) -> Markup {
        let mut taken: Vec<Area> =
            self.marks.iter().map(|mark| Area::around(place(&mark.at), [5.0, 5.0])).collect();
        let mut label_of = |mark: &Mark| {
            let half = [0.5 * LETTER[0] * mark.label.chars().count() as f64, 0.5 * LETTER[1]];
            let area = free_place(place(&mark.at), half, &taken);
            taken.push(area);
            area.middle
        };
        html! {
            @for mark in &self.marks {
                @let [x, y] = place(&mark.at);
                @let [label_x, label_y] = label_of(mark);
                @let fill = if mark.shape == Shape::Disc { mark.color } else { "white" };
                circle cx=(px(x)) cy=(px(y)) r="4" fill=(fill) stroke=(mark.color) stroke-width="1.5" {}
                text x=(px(label_x)) y=(px(label_y + 4.0)) text-anchor="middle" fill=(mark.color)
                    stroke="white" stroke-width="3" paint-order="stroke" { (mark.label) }
            }
        }
    }
}

/// A rectangle that something takes.
#[derive(Clone, Copy)]
struct Area {
    middle: [f64; 2],
    half: [f64; 2],
}

impl Area {
    fn around(middle: [f64; 2], half: [f64; 2]) -> Self {
        Self { middle, half }
    }

    fn meets(&self, other: &Area) -> bool {
        (0..2).all(|c| (self.middle[c] - other.middle[c]).abs() < self.half[c] + other.half[c])
    }

    fn is_inside(&self) -> bool {
        let [x, y] = self.middle;
        x - self.half[0] >= LEFT
            && x + self.half[0] <= WIDTH
            && (TOP..=HEIGHT - BOTTOM).contains(&y)
    }
}

/// The nearest place for a label of that size beside a point; right of it where none is free.
fn free_place([x, y]: [f64; 2], half: [f64; 2], taken: &[Area]) -> Area {
    let beside = 8.0 + half[0];
    let right = Area::around([x + beside, y], half);
    let candidates = (0..9).flat_map(|distance| {
        let away = 14.0 * f64::from(distance);
        [
            [beside, -away],
            [beside, away],
            [-beside, -away],
            [-beside, away],
            [0.0, -away],
            [0.0, away],
        ]
    });
    let places = candidates.map(|[dx, dy]| Area::around([x + dx, y + dy], half));
    let is_free = |place: &Area| place.is_inside() && !taken.iter().any(|other| place.meets(other));
    places.into_iter().find(is_free).unwrap_or(right)
}

/// A logarithmic axis.
#[derive(Clone, Copy, Debug)]
struct Scale {
    /// Least and greatest value.
    values: [f64; 2],
    /// Where these are, pixels.
    pixels: [f64; 2],
}

impl Scale {
    /// Wide enough for all values that a logarithm has.
    fn around(values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|value| *value > 0.0 && value.is_finite()) {
            (least, most) = (least.min(value), most.max(value));
        }
        if least > most {
            (least, most) = (1.0, 1.0);
        }
        Self { values: [least / MARGIN, most * MARGIN], pixels }
    }

    fn place(&self, value: f64) -> f64 {
        let [least, most] = self.values;
        let share = (value.max(least) / least).ln() / (most / least).ln();
        self.pixels[0] + share.min(1.0) * (self.pixels[1] - self.pixels[0])
    }

    /// Round numbers inside, as many as the range takes.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.values.map(|value| value.log10().floor() as i32);
        let digits: &[f64] = match self.values[1] / self.values[0] {
            ..10.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
            10.0..300.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let all = (decades[0]..=decades[1])
            .flat_map(|decade| digits.iter().map(move |digit| digit_of(*digit, decade)));
        all.filter(|value| (self.values[0]..=self.values[1]).contains(value)).collect()
    }
}

/// 5 and -1 give 0.5, not its neighbour.
fn digit_of(digit: f64, decade: i32) -> f64 {
    let power = 10_f64.powi(decade.abs());
    if decade < 0 { digit / power } else { digit * power }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside() {
        let check = |values: &[f64], expected: &[f64]| {
            let scale = Scale::around(values.iter().copied(), [0.0, 100.0]);
            assert_eq!(scale.ticks(), expected, "{values:?}");
        };
        check(&[0.55, 2.0], &[0.5, 0.7, 1.0, 1.5, 2.0]);
        check(&[0.5, 30.0], &[0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
        check(&[1.0, 20_000.0], &[1.0, 10.0, 100.0, 1000.0, 10_000.0]);
        check(&[], &[1.0]);
        check(&[f64::NAN, -1.0, 0.0, 1.0], &[1.0]);
    }

    #[test]
    fn places_are_logarithmic_and_stay_on_the_axis() {
        let scale = Scale { values: [1.0, 100.0], pixels: [50.0, 250.0] };
        for (value, expected) in
            [(1.0, 50.0), (10.0, 150.0), (100.0, 250.0), (0.0, 50.0), (1e9, 250.0)]
        {
            let found = scale.place(value);
            assert!((found - expected).abs() < 1e-9, "{value}: {found}");
        }
    }

    #[test]
    fn labels_of_points_at_one_place_do_not_meet() {
        let middle = [0.5 * (LEFT + WIDTH), 0.5 * HEIGHT];
        let mut taken = vec![];
        for _ in 0..10 {
            let place = free_place(middle, [30.0, 6.0], &taken);
            assert!(!taken.iter().any(|other| place.meets(other)), "{} labels", taken.len());
            taken.push(place);
        }
    }
}

use super::distribution::{Distribution, number};
use super::page::{figure, page};
use super::picture::Thumbnail;
use maud::{Markup, html};

/// Everything the page of a solution shows. Pictures are small already (see [`super::picture::shrink`]).
pub struct SolutionPage {
    /// The capture session's name.
    pub title: String,
    /// One line below it: where, when, which method.
    pub subtitle: String,
    /// Key figures, first to last.
    pub verdicts: Vec<Verdict>,
    /// Sentences of the solve.
    pub warnings: Vec<String>,
    /// Normal, albedo, confidence, error.
    pub maps: Vec<Figure>,
    /// Expected error of the normals, degrees.
    pub expected_error: Option<Distribution>,
    /// Error against the truth, where the truth is known.
    pub truth: Option<TruthErrors>,
    /// Stage and its seconds, in order.
    pub seconds: Vec<(String, f64)>,
    /// The frames as captured.
    pub frames: Vec<Figure>,
}

/// A key figure: "0.41 deg", "median error against the truth".
pub struct Verdict {
    /// The number with its unit.
    pub value: String,
    /// What it is.
    pub label: String,
}

/// A picture and its caption.
pub struct Figure {
    /// The picture.
    pub picture: Thumbnail,
    /// What it shows, scale included.
    pub caption: String,
}

/// How far the maps are from the truth.
pub struct TruthErrors {
    /// Angle between normal and true normal, degrees.
    pub normal: Option<Distribution>,
    /// Rows of further figures: name, value.
    pub figures: Vec<(String, String)>,
}

impl SolutionPage {
    /// The page as one self-contained HTML file.
    pub fn html(&self) -> String {
        let body = html! {
            (cards(&self.verdicts))
            (warnings(&self.warnings))
            h2 { "Maps" }
            div class="maps" { @for map in &self.maps { (figure(&map.picture, &map.caption)) } }
            @if let Some(truth) = &self.truth { (against_truth(truth)) }
            @if let Some(expected) = &self.expected_error {
                h2 { "Expected error of the normals" }
                div class="columns" { (expected.histogram("deg")) (quantiles(expected, "deg")) }
            }
            (timings(&self.seconds))
            @if !self.frames.is_empty() {
                h2 { "Frames" }
                div class="frames" { @for frame in &self.frames { (figure(&frame.picture, &frame.caption)) } }
            }
        };
        page(&self.title, &self.subtitle, &body)
    }
}

fn cards(verdicts: &[Verdict]) -> Markup {
    html! {
        div class="cards" {
            @for verdict in verdicts { div class="card" { b { (verdict.value) } span { (verdict.label) } } }
        }
    }
}

fn warnings(sentences: &[String]) -> Markup {
    html! {
        @if !sentences.is_empty() { ul class="warnings" { @for sentence in sentences { li { (sentence) } } } }
    }
}

fn against_truth(truth: &TruthErrors) -> Markup {
    html! {
        h2 { "Error against the truth" }
        div class="columns" {
            @if let Some(normal) = &truth.normal { (normal.histogram("deg")) (quantiles(normal, "deg")) }
            table { @for (name, value) in &truth.figures { tr { th { (name) } td class="number" { (value) } } } }
        }
    }
}

fn quantiles(distribution: &Distribution, unit: &str) -> Markup {
    let rows = [
        ("mean", distribution.mean),
        ("median", distribution.median),
        ("root mean square", distribution.rms),
        ("95 of 100 below", distribution.p95),
        ("largest", distribution.max),
    ];
    html! {
        table {
            @for (name, value) in rows { tr { th { (name) } td class="number" { (number(value)) " " (unit) } } }
            tr { th { "pixels" } td class="number" { (distribution.count) } }
        }
    }
}

fn timings(seconds: &[(String, f64)]) -> Markup {
    let longest = seconds.iter().map(|(_, s)| *s).fold(f64::MIN_POSITIVE, f64::max);
    html! {
        @if !seconds.is_empty() {
            h2 { "Time" }
            table {
                @for (stage, s) in seconds {
                    tr {
                        th { (stage) }
                        td class="number" { (format!("{s:.3} s")) }
                        td { span class="meter" style={"width:" (format!("{:.0}px", 240.0 * s / longest))} {} }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> SolutionPage {
        let picture = Thumbnail { width: 2, height: 1, rgb: vec![[9, 9, 9]; 2] };
        SolutionPage {
            title: "linen <4021>".into(),
            subtitle: "auto".into(),
            verdicts: vec![Verdict { value: "0.4 deg".into(), label: "median".into() }],
            warnings: vec!["light 4 has no frame".into()],
            maps: vec![Figure { picture: picture.clone(), caption: "normal".into() }],
            expected_error: Distribution::of([0.1, 0.2].into_iter()),
            truth: None,
            seconds: vec![("decode".into(), 0.25)],
            frames: vec![Figure { picture, caption: "light 0".into() }],
        }
    }

    #[test]
    fn the_page_stands_alone_and_escapes_names() {
        let html = example().html();
        assert!(html.contains("linen &lt;4021&gt;"), "names are escaped");
        assert!(html.contains("light 4 has no frame") && html.contains("0.250 s"));
        for outside in ["http://", "https://", "<script", "src=\"/", "@import"] {
            assert!(!html.contains(outside), "the page refers to {outside}");
        }
    }

    #[test]
    fn what_is_unknown_is_not_shown() {
        let html = example().html();
        assert!(!html.contains("against the truth"));
    }
}

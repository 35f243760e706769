//! Picking from the lists that a camera offers, by their labels.

/// Furthest that an exposure may be from what was asked, in stops: next to the ends of the list.
const NEAREST_STOPS: f64 = 1.0 / 3.0;
/// White balances that suit LEDs best come first; any fixed one will do, as RAW does not depend on it.
const WHITE_BALANCES: [&str; 4] = ["Daylight", "Sunny", "Direct sunlight", "Flash"];

/// Seconds of an exposure as cameras label it: `0.5000s`, `1/60`, `1 1/3`, `30`; `None` for `Bulb` and the like.
pub(crate) fn seconds(label: &str) -> Option<f64> {
    let label = label.trim().trim_end_matches(['s', '"']).trim_end();
    let sum: Option<f64> = label.split_whitespace().map(fraction).sum();
    sum.filter(|seconds| seconds.is_finite() && *seconds > 0.0)
}

fn fraction(text: &str) -> Option<f64> {
    match text.split_once('/') {
        Some((above, below)) => Some(above.parse::<f64>().ok()? / below.parse::<f64>().ok()?),
        None => text.parse().ok(),
    }
}

/// The label nearest to `wanted` seconds.
pub(crate) fn exposure(labels: &[String], wanted: f64) -> Option<String> {
    let off = |label: &&String| seconds(label).map(|seconds| (seconds / wanted).log2().abs());
    let near = labels.iter().filter(|label| off(label).is_some_and(|off| off < NEAREST_STOPS));
    near.min_by(|a, b| off(a).unwrap_or(f64::MAX).total_cmp(&off(b).unwrap_or(f64::MAX))).cloned()
}

/// The label of a sensitivity.
pub(crate) fn iso(labels: &[String], wanted: f64) -> Option<String> {
    let is =
        |label: &&String| label.trim().parse::<f64>().is_ok_and(|iso| (iso - wanted).abs() < 0.5);
    labels.iter().find(is).cloned()
}

/// RAW alone: not with a JPEG beside it, not one of reduced size.
pub(crate) fn raw(labels: &[String]) -> Option<String> {
    let is = |label: &&String| {
        let label = label.to_ascii_lowercase();
        let raw = label.contains("nef") || label.contains("raw");
        raw && !["+", "jpeg", "sraw", "mraw", "craw", "small", "tiff"]
            .iter()
            .any(|other| label.contains(other))
    };
    labels.iter().filter(is).min_by_key(|label| label.len()).cloned()
}

/// `current` if it is fixed, else one that is.
pub(crate) fn white_balance(labels: &[String], current: &str) -> Option<String> {
    let fixed = |label: &&String| !label.to_ascii_lowercase().contains("auto");
    let known = labels.iter().filter(fixed);
    let stays = known.clone().find(|label| *label == current);
    let suits = WHITE_BALANCES.iter().find_map(|name| known.clone().find(|label| label == name));
    stays.or(suits).or_else(|| known.clone().next()).cloned()
}

/// The first of `names` that is offered.
pub(crate) fn any_of(labels: &[String], names: &[&str]) -> Option<String> {
    names.iter().find_map(|name| labels.iter().find(|label| label == name)).cloned()
}

/// Those nearest to `wanted` seconds, for a message.
pub(crate) fn near(labels: &[String], wanted: f64) -> Vec<String> {
    let mut timed: Vec<(f64, &String)> =
        labels.iter().filter_map(|label| Some((seconds(label)?, label))).collect();
    timed.sort_by(|a, b| (a.0 / wanted).log2().abs().total_cmp(&(b.0 / wanted).log2().abs()));
    timed.into_iter().take(3).map(|(_, label)| label.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(text: &str) -> Vec<String> {
        text.split(", ").map(str::to_owned).collect()
    }

    #[test]
    fn exposures_are_read_as_cameras_write_them() {
        let check =
            |label: &str, expected: Option<f64>| assert_eq!(seconds(label), expected, "{label}");
        check("0.5000s", Some(0.5));
        check("1/4", Some(0.25));
        check("1 1/2", Some(1.5));
        check("30", Some(30.0));
        check("2\"", Some(2.0));
        check("Bulb", None);
        check("", None);
        check("0", None);
        check("1/0", None);
        check("-2", None);
    }

    #[test]
    fn the_nearest_exposure_is_taken_or_none() {
        let list = labels("0.0166s, 0.4000s, 0.5000s, 0.6250s, 30.0000s, Bulb");
        let check = |wanted: f64, expected: Option<&str>| {
            assert_eq!(exposure(&list, wanted).as_deref(), expected, "{wanted}");
        };
        check(0.5, Some("0.5000s"));
        check(0.46, Some("0.5000s"));
        check(1.0 / 60.0, Some("0.0166s"));
        check(2.0, None);
        check(60.0, None);
        check(f64::NAN, None);
        check(-1.0, None);
    }

    #[test]
    fn labels_are_picked_for_what_they_mean() {
        let list = labels("JPEG Basic, JPEG Fine, NEF+Fine, NEF (Raw), NEF+Basic");
        assert_eq!(raw(&list).as_deref(), Some("NEF (Raw)"));
        assert_eq!(
            raw(&labels("Large Fine JPEG, RAW + Large Fine JPEG, RAW, mRAW")).as_deref(),
            Some("RAW")
        );
        assert_eq!(raw(&labels("JPEG Basic, JPEG Fine")), None);
        assert_eq!(iso(&labels("Auto, 100, 200"), 100.0).as_deref(), Some("100"));
        assert_eq!(iso(&labels("Auto, 200"), 100.0), None);
        let list = labels("Automatic, Shade, Daylight");
        assert_eq!(white_balance(&list, "Automatic").as_deref(), Some("Daylight"));
        assert_eq!(white_balance(&list, "Shade").as_deref(), Some("Shade"));
        assert_eq!(white_balance(&labels("Auto, AutoAmbience"), "Auto"), None);
    }
}

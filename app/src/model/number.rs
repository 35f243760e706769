//! Numbers as people write them: with a decimal point or comma, a unit, a fraction.

use std::ops::RangeInclusive;

/// What a number is a number of: the units that may stand behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A length, millimetres.
    Millimetres,
    /// A time, seconds; "1/60" is one, too.
    Seconds,
    /// An angle, degrees.
    Degrees,
    /// A share of one; "85 %" is one, too.
    Share,
    /// Stops of exposure.
    Stops,
    /// A length in a picture.
    Pixels,
    /// A time of calibrations.
    Days,
    /// Sensitivity.
    Iso,
    /// How many, or the number of something.
    Count,
}

impl Unit {
    /// What may stand behind a number, and what that makes of it. The first one is what is written.
    fn names(self) -> &'static [(&'static str, f64)] {
        match self {
            Unit::Millimetres => &[
                ("mm", 1.0),
                ("cm", 10.0),
                ("m", 1000.0),
                ("µm", 1e-3),
                ("μm", 1e-3),
                ("um", 1e-3),
                ("in", 25.4),
                ("inch", 25.4),
                ("″", 25.4),
                ("\"", 25.4),
                ("millimetres", 1.0),
                ("millimeters", 1.0),
            ],
            Unit::Seconds => &[
                ("s", 1.0),
                ("sec", 1.0),
                ("second", 1.0),
                ("seconds", 1.0),
                ("″", 1.0),
                ("\"", 1.0),
                ("ms", 1e-3),
                ("µs", 1e-6),
                ("μs", 1e-6),
                ("us", 1e-6),
            ],
            Unit::Degrees => {
                &[("°", 1.0), ("º", 1.0), ("deg", 1.0), ("degree", 1.0), ("degrees", 1.0)]
            }
            Unit::Share => &[("", 1.0), ("%", 0.01), ("percent", 0.01)],
            Unit::Stops => &[("ev", 1.0), ("stop", 1.0), ("stops", 1.0)],
            Unit::Pixels => &[("px", 1.0), ("pixel", 1.0), ("pixels", 1.0)],
            Unit::Days => &[("days", 1.0), ("day", 1.0), ("d", 1.0)],
            Unit::Iso => &[("iso", 1.0)],
            Unit::Count => &[],
        }
    }

    /// Behind the number in a field.
    pub fn suffix(self) -> &'static str {
        match self {
            Unit::Millimetres => " mm",
            Unit::Seconds => " s",
            Unit::Degrees => "°",
            Unit::Stops => " EV",
            Unit::Pixels => " px",
            Unit::Days => " days",
            Unit::Share | Unit::Iso | Unit::Count => "",
        }
    }

    /// Only whole numbers make sense.
    pub(crate) fn is_whole(self) -> bool {
        matches!(self, Unit::Days | Unit::Iso | Unit::Count)
    }
}

/// What a number was to be, and why it is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unreadable {
    /// No number stands there.
    NotANumber,
    /// A number that is out of range.
    OutOfRange,
    /// A part of something that cannot be divided.
    NotWhole,
}

/// The number that is meant, in the unit of `unit`.
///
/// # Errors
/// Where there is none, or it is out of range.
pub fn number(text: &str, unit: Unit, range: &RangeInclusive<f64>) -> Result<f64, Unreadable> {
    let text = plain(text);
    let (digits, factor) = without_unit(&text, unit);
    let value = factor * fraction(digits, unit.is_whole()).ok_or(Unreadable::NotANumber)?;
    // A percent of something has rounding errors in its last digits.
    let value = if unit.is_whole() { value } else { (value * 1e9).round() / 1e9 };
    if unit.is_whole() && value.fract() != 0.0 {
        return Err(Unreadable::NotWhole);
    }
    if range.contains(&value) { Ok(value) } else { Err(Unreadable::OutOfRange) }
}

/// Digits and signs of any keyboard as those of ours.
fn plain(text: &str) -> String {
    let plain = |c: char| match c {
        // Full width, as Japanese and Chinese keyboards write them.
        '！'..='～' => char::from_u32(u32::from(c) - 0xFEE0).unwrap_or(c),
        '、' => ',',
        '−' | '–' | '—' => '-',
        '⁄' | '∕' => '/',
        '٫' => ',',
        '٬' | '’' => '\'',
        _ => digit(c).unwrap_or(c),
    };
    text.trim().chars().map(plain).flat_map(char::to_lowercase).collect()
}

/// Arabic, Persian and Indian digits.
fn digit(c: char) -> Option<char> {
    const ZEROS: [char; 3] = ['٠', '۰', '०'];
    let value = ZEROS
        .iter()
        .find_map(|zero| u32::from(c).checked_sub(u32::from(*zero)).filter(|value| *value < 10))?;
    char::from_digit(value, 10)
}

/// What stands before the unit, and the unit's factor.
fn without_unit(text: &str, unit: Unit) -> (&str, f64) {
    // "ISO 100": it may stand before, too.
    let text = if unit == Unit::Iso { text.trim_start_matches("iso").trim_start() } else { text };
    let named = unit.names().iter().filter(|(name, _)| !name.is_empty());
    let found = named.filter_map(|(name, factor)| Some((text.strip_suffix(name)?, *name, *factor)));
    // The longest: "mm" before "m".
    let longest = found.max_by_key(|(_, name, _)| name.len());
    longest.map_or((text, 1.0), |(digits, _, factor)| (digits.trim_end(), factor))
}

/// A decimal, or one over another: "1/60", and "1 1/2".
fn fraction(text: &str, whole: bool) -> Option<f64> {
    let Some((above, below)) = text.split_once('/') else { return decimal(text, whole) };
    let (before, above) = match above.trim().rsplit_once(char::is_whitespace) {
        Some((before, above)) => (decimal(before, true)?, above),
        None => (0.0, above),
    };
    let (above, below) = (decimal(above, whole)?, decimal(below, whole)?);
    (above >= 0.0 && below > 0.0).then(|| before + above / below)
}

/// A decimal number. A single comma is a decimal comma, unless only whole numbers make sense and three digits follow.
fn decimal(text: &str, whole: bool) -> Option<f64> {
    let text = text.trim();
    let sign = if text.starts_with('-') { -1.0 } else { 1.0 };
    let text = text.strip_prefix(['-', '+']).unwrap_or(text);
    let (digits, exponent) = match text.split_once('e') {
        Some((digits, exponent)) => (digits, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let last = digits.rfind(['.', ',']);
    let groups = |mark: char| digits.matches(mark).count();
    let is_grouping = |at: usize| {
        let (mark, other) = if digits[at..].starts_with(',') { (',', '.') } else { ('.', ',') };
        let thousands = whole && mark == ',' && digits[at + 1..].len() == 3;
        groups(other) == 0 && (groups(mark) > 1 || thousands)
    };
    let point = last.filter(|at| !is_grouping(*at));
    let (before, after) = match point {
        Some(at) => (&digits[..at], &digits[at + 1..]),
        None => (digits, ""),
    };
    let before = without_groups(before)?;
    let clean = after.chars().all(|c| c.is_ascii_digit());
    if !clean || (before.is_empty() && after.is_empty()) {
        return None;
    }
    let value: f64 = format!("0{before}.{after}0e{exponent}").parse().ok()?;
    value.is_finite().then_some(sign * value)
}

/// "1 250", "1'250", "1,250" and "1.250" as digits alone; every group but the first has three.
fn without_groups(text: &str) -> Option<String> {
    let is_mark = |c: char| c.is_whitespace() || matches!(c, '\'' | ',' | '.' | '_');
    let mut groups = text.split(is_mark);
    let first = groups.next()?.to_owned();
    let mut digits = first.clone();
    for group in groups {
        if group.len() != 3 || first.is_empty() || first.len() > 3 {
            return None;
        }
        digits.push_str(group);
    }
    digits.chars().all(|c| c.is_ascii_digit()).then_some(digits)
}

#[cfg(test)]
mod tests {
    use super::Unreadable::{NotANumber, NotWhole, OutOfRange};
    use super::*;

    fn check(unit: Unit, text: &str, expected: Result<f64, Unreadable>) {
        let range = match unit {
            Unit::Millimetres => 0.0..=100.0,
            Unit::Seconds => 1e-4..=30.0,
            Unit::Stops => -4.0..=4.0,
            Unit::Share => 0.1..=1.0,
            Unit::Iso => 25.0..=25_600.0,
            _ => 0.0..=9999.0,
        };
        assert_eq!(number(text, unit, &range), expected, "{text:?}");
    }

    #[test]
    fn lengths() {
        let check = |text: &str, expected| check(Unit::Millimetres, text, expected);
        for text in [
            "1.25",
            "1,25",
            "1.25 mm",
            "1,25mm",
            " 1.250 MM ",
            "+1.25",
            "０.１２５ cm",
            "１，２５",
            "1250 µm",
            "1250um",
            "0.00125 m",
            "1 250 µm",
            "1'250 µm",
            "1.250,0 µm",
            "1,250.0 µm",
            "125e-2",
            "١٫٢٥",
            "5/4",
            "1 1/4 mm",
        ] {
            check(text, Ok(1.25));
        }
        check(".5", Ok(0.5));
        check(",5", Ok(0.5));
        check("5.", Ok(5.0));
        check("1,250", Ok(1.25));
        check("1\"", Ok(25.4));
        check("1 in", Ok(25.4));
        check("0", Ok(0.0));
        check("-1", Err(OutOfRange));
        check("−0,5 mm", Err(OutOfRange));
        check("101", Err(OutOfRange));
        check("1e400", Err(NotANumber));
        for text in [
            "", "thin", "mm", "1.2.3", "1,2,3", "1 2", "1..2", "nan", "inf", "infinity", "1/0",
            "1/", "/2", "1.25 kg", "--1", "1e", "0x10", ".", ",", "1,25,", "12 34.5", "e5", "½x",
        ] {
            check(text, Err(NotANumber));
        }
    }

    #[test]
    fn times() {
        let check = |text: &str, expected| check(Unit::Seconds, text, expected);
        for text in ["0.5", "1/2", "1/2 s", "0,5s", "500 ms", "500ms", "0.5\"", "0.5 sec", "1 / 2"]
        {
            check(text, Ok(0.5));
        }
        check("1/60", Ok(0.016_666_667));
        check("2 1/2 s", Ok(2.5));
        check("1/100000", Err(OutOfRange));
        check("60", Err(OutOfRange));
        check("-1/2", Err(NotANumber));
    }

    #[test]
    fn what_else_there_is() {
        check(Unit::Degrees, "12,5°", Ok(12.5));
        check(Unit::Degrees, "12.5 deg", Ok(12.5));
        check(Unit::Share, "85 %", Ok(0.85));
        check(Unit::Share, "0,85", Ok(0.85));
        check(Unit::Share, "85", Err(OutOfRange));
        check(Unit::Stops, "−1,5 EV", Ok(-1.5));
        check(Unit::Stops, "+2 stops", Ok(2.0));
        check(Unit::Pixels, "12 px", Ok(12.0));
        check(Unit::Days, "90 days", Ok(90.0));
        check(Unit::Days, "1 day", Ok(1.0));
        check(Unit::Iso, "ISO 400", Ok(400.0));
        check(Unit::Iso, "25,600", Ok(25_600.0));
        check(Unit::Iso, "25'600", Ok(25_600.0));
        check(Unit::Iso, "25 600 ISO", Ok(25_600.0));
        check(Unit::Iso, "25.6", Err(NotWhole));
        check(Unit::Iso, "1e6", Err(OutOfRange));
        check(Unit::Count, "7", Ok(7.0));
        check(Unit::Count, "7,5", Err(NotWhole));
        check(Unit::Count, "seven", Err(NotANumber));
    }
}

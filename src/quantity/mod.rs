//! What numbers can mean: for each unit the range in which an instrument, a picture or a cloth could be. Readers and writers
//! of every format, and options of the command line, ask here, so that what one writes the other accepts.
//!
//! The ranges are wide: a macro lens and a telescope, a phone's photosites and binned ones, lights 20 mm and 10 m away. What is
//! outside is a slip, most often of the unit, and the message says of which.

mod known;

pub use known::*;

use std::ops::RangeInclusive;

/// A kind of number: its range and its unit.
#[derive(Debug)]
pub struct Quantity {
    /// As in "pixels": what is within the range.
    what: &'static str,
    /// As in "micrometres"; empty for plain numbers.
    unit: &'static str,
    least: f64,
    most: f64,
    /// Units that are mistaken for this one: name, and how many of this unit one of them is.
    mistaken: &'static [(&'static str, f64)],
}

/// A number out of its range, or another fault of a file's content: where it is, and what is wrong and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// A dotted path with indices from 0: `frames.3.exposure_s`.
    pub key: String,
    /// Follows the key's name, as in "is 0; exposures are 0.000001 to 86400 seconds".
    pub what: String,
}

impl Problem {
    /// A problem with the value at `key`.
    pub fn new(key: impl Into<String>, what: impl Into<String>) -> Self {
        Self { key: key.into(), what: what.into() }
    }
}

impl Quantity {
    /// The range, in its unit.
    pub fn range(&self) -> RangeInclusive<f64> {
        self.least..=self.most
    }

    /// # Errors
    /// What is wrong with a value out of the range (NaN is) and what to do; follows the value's name.
    pub fn check(&self, value: f64) -> Result<(), String> {
        if self.range().contains(&value) {
            return Ok(());
        }
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let (least, most) = (plain(self.least), plain(self.most));
        let slip = self
            .mistaken
            .iter()
            .find(|(_, factor)| self.range().contains(&(value * factor)))
            .map_or_else(|| "; correct it".to_owned(), |(unit, _)| format!(": is this in {unit}?"));
        Err(format!("is {}; {} are {least} to {most}{unit}{slip}", plain(value), self.what))
    }

    /// # Errors
    /// As [`Quantity::check`], with the key.
    pub fn at(&self, key: &str, value: f64) -> Result<(), Problem> {
        self.check(value).map_err(|what| Problem::new(key, what))
    }

    /// # Errors
    /// As [`Quantity::at`], for the first of several values that is out of the range.
    pub fn all_at(&self, key: &str, values: &[f64]) -> Result<(), Problem> {
        let one = |(k, value): (usize, &f64)| self.at(&format!("{key}.{k}"), *value);
        values.iter().enumerate().try_for_each(one)
    }

    /// # Errors
    /// As [`Quantity::at`]; an absent value is in any range.
    pub fn maybe_at(&self, key: &str, value: Option<f64>) -> Result<(), Problem> {
        value.map_or(Ok(()), |value| self.at(key, value))
    }

    /// Reads an option of the command line.
    ///
    /// # Errors
    /// Not a number, or out of the range.
    pub fn parse(&self, text: &str) -> Result<f64, String> {
        let value: f64 = text.trim().parse().map_err(|_| "is not a number".to_owned())?;
        self.check(value).map(|()| value)
    }
}

/// A number as people write it: without an exponent where it is neither huge nor tiny.
pub fn plain(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-6..1e9).contains(&size) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

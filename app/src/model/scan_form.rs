//! What the technician enters for a scan.

use crate::model::names::ScanNames;
use serde::{Deserialize, Serialize};

/// Name of the first swatch.
const FIRST_NAME: &str = "linen 1";

/// What the technician writes for a scan; remembered, so that the next day begins where this one ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ScanForm {
    /// Of the swatch.
    pub name: String,
    /// Of the swatch, millimetres; 0: not measured.
    pub thickness_mm: f64,
    /// Whether test shots find the exposure.
    pub find_exposure: bool,
    /// Where they do not.
    pub exposure_s: f64,
    /// Sensitivity.
    pub iso: f64,
}

impl Default for ScanForm {
    fn default() -> Self {
        Self {
            name: FIRST_NAME.to_owned(),
            thickness_mm: 0.0,
            find_exposure: true,
            exposure_s: 0.1,
            iso: 100.0,
        }
    }
}

impl ScanForm {
    /// Counts the name on until no scan has it.
    pub(crate) fn next_free_name(&mut self, taken: &ScanNames) {
        while taken.has(self.name.trim()) {
            self.name = next_name(&self.name);
        }
    }
}

fn next_name(name: &str) -> String {
    let name = name.trim();
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    match name[stem.len()..].parse::<u64>() {
        Ok(number) => {
            let width = name.len() - stem.len();
            format!("{stem}{:0width$}", number.saturating_add(1))
        }
        Err(_) => format!("{name} 2"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_count_on() {
        let check = |name: &str, next: &str| assert_eq!(next_name(name), next);
        check("linen 4021", "linen 4022");
        check("linen", "linen 2");
        check("A-009", "A-010");
        check("99", "100");
        check("x 99999999999999999999999", "x 99999999999999999999999 2");
    }
}

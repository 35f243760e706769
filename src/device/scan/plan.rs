//! What is photographed, in which order.

use super::ScanError;
use crate::device::board::wire::LIGHTS_MAX;
use crate::instrument::Rig;

/// One frame to take.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Its file's name without ending.
    pub stem: String,
    /// The rig's light; `None`: every LED off.
    pub light: Option<usize>,
    /// The board's output of that light.
    pub output: Option<u8>,
    /// Exposure relative to the scan's.
    pub factor: f64,
    /// The first light again, to see drift.
    pub drift_check: bool,
}

/// The frames of a scan, in order: ambient light, each light (at each exposure of a bracket), the first light again.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// In the order in which they are taken.
    pub steps: Vec<Step>,
}

/// The widest bracket that makes sense: beyond, one of two exposures is black or white.
const FACTORS: std::ops::RangeInclusive<f64> = 1.0 / 1024.0..=1024.0;

impl Step {
    /// The outputs while its shutter is open: one bit, or none.
    pub fn pins(&self) -> u32 {
        self.output.map_or(0, |output| 1u32.checked_shl(output.into()).unwrap_or(0))
    }

    /// As in "light 4" or "the ambient frame".
    pub fn name(&self) -> String {
        match self.light {
            None => "the ambient frame".to_owned(),
            Some(light) if self.drift_check => format!("light {light} again"),
            Some(light) if self.factor != 1.0 => {
                format!("light {light} at {} times the exposure", self.factor)
            }
            Some(light) => format!("light {light}"),
        }
    }
}

impl Plan {
    /// A scan with `rig`; `bracket`: further exposures of each light, relative to the scan's own.
    ///
    /// # Errors
    /// Where a light hangs on an output that no board has, or the bracket makes no sense.
    pub fn new(rig: &Rig, bracket: &[f64]) -> Result<Self, ScanError> {
        check_bracket(bracket)?;
        let step = |stem: String, light| Step {
            stem,
            light,
            output: None,
            factor: 1.0,
            drift_check: false,
        };
        let mut steps = vec![step("ambient".to_owned(), None)];
        for light in 0..rig.lights.len() {
            steps.push(step(format!("light-{light:02}"), Some(light)));
            let further = bracket.iter().enumerate().map(|(k, &factor)| Step {
                factor,
                ..step(format!("light-{light:02}-exposure-{}", k + 1), Some(light))
            });
            steps.extend(further);
        }
        steps.push(Step { drift_check: true, ..step("drift-check".to_owned(), Some(0)) });
        for step in &mut steps {
            step.output = step.light.map(|light| output(rig, light)).transpose()?;
        }
        Ok(Self { steps })
    }
}

fn output(rig: &Rig, light: usize) -> Result<u8, ScanError> {
    let channel = rig.channel(light);
    u8::try_from(channel)
        .ok()
        .filter(|output| *output < LIGHTS_MAX)
        .ok_or(ScanError::Output { light, channel })
}

fn check_bracket(bracket: &[f64]) -> Result<(), ScanError> {
    let bad = |(k, factor): (usize, &f64)| {
        !FACTORS.contains(factor) || *factor == 1.0 || bracket[..k].contains(factor)
    };
    match bracket.iter().enumerate().find(|&(k, factor)| bad((k, factor))) {
        Some((_, &factor)) => Err(ScanError::Bracket { factor }),
        None => Ok(()),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::simulate::{Instrument, Options};

    pub(in crate::device::scan) fn reference_rig() -> Rig {
        let options = Options { size_px: Some([32, 32]), ..Options::default() };
        Instrument::from_options(&options).unwrap().rig
    }

    #[test]
    fn ambient_light_each_light_and_the_first_again() {
        let plan = Plan::new(&reference_rig(), &[]).unwrap();
        let stems: Vec<&str> = plan.steps.iter().map(|step| step.stem.as_str()).collect();
        assert_eq!(
            (stems[0], stems[1], stems[10], stems[11]),
            ("ambient", "light-00", "light-09", "drift-check")
        );
        let pins: Vec<u32> = plan.steps.iter().map(Step::pins).collect();
        assert_eq!(pins, [0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1]);
        assert!(
            plan.steps[11].drift_check && plan.steps[..11].iter().all(|step| !step.drift_check)
        );
    }

    #[test]
    fn outputs_are_those_of_the_rig() {
        let mut rig = reference_rig();
        rig.lights[2].channel = Some(13);
        assert_eq!(Plan::new(&rig, &[]).unwrap().steps[3].pins(), 1 << 13);
        rig.lights[2].channel = Some(16);
        let error = Plan::new(&rig, &[]).unwrap_err().to_string();
        assert!(error.contains("light 2 is on channel 16"), "{error}");
    }

    #[test]
    fn a_bracket_adds_exposures_of_each_light() {
        let plan = Plan::new(&reference_rig(), &[0.25, 4.0]).unwrap();
        assert_eq!(plan.steps.len(), 1 + 10 * 3 + 1);
        let names: Vec<String> = plan.steps[4..7].iter().map(Step::name).collect();
        assert_eq!(
            names,
            ["light 1", "light 1 at 0.25 times the exposure", "light 1 at 4 times the exposure"]
        );
        for bad in [&[1.0][..], &[0.0], &[-2.0], &[f64::NAN], &[4.0, 4.0], &[1e6]] {
            assert!(Plan::new(&reference_rig(), bad).is_err(), "{bad:?}");
        }
    }
}

//! Frames held against the plan and against each other: an LED that stays dark, two lights that are alike, clipping, focus.

use super::plan::{Plan, Step};
use super::sequencer::Judgement;
use crate::device::look::{Look, difference};
use crate::files::Setting;
use std::collections::BTreeSet;

/// A light that gives less than this share of what the others give has failed.
const DARK: f64 = 0.1;
/// Less than this share of the range over the ambient light is no light.
const NOTHING: f64 = 5e-4;
/// So many lights without light in their frames, and none with: something common to all is wrong.
const ALL_DARK: usize = 3;
/// Lights whose pictures differ by no more than twice what noise makes of one light are one light; the noise is known from the
/// drift check. Between these shares: less is no difference, and cloth under two lamps of a rig differs by more.
const ALIKE: [f64; 2] = [0.005, 0.03];
/// Above this share of clipped samples the exposure should be shorter.
const CLIPPED: f64 = 0.005;
/// Below this brightness, as a fraction of the range, the exposure should be longer.
const UNDEREXPOSED: f64 = 0.25;
/// Above this share of a light's brightness the room should be darker.
const ROOM_LIGHT: f64 = 0.2;
/// A frame with less than this share of its light's sharpness before is blurred.
const BLURRED: f64 = 0.7;

/// The frames of a scan as far as they were looked at.
#[derive(Debug)]
pub struct Assessor {
    steps: Vec<Step>,
    looks: Vec<Option<Look>>,
    /// Lights whose frames showed no light.
    dark: BTreeSet<usize>,
}

impl Assessor {
    /// Nothing looked at yet.
    pub fn new(plan: &Plan) -> Self {
        Self {
            steps: plan.steps.clone(),
            looks: vec![None; plan.steps.len()],
            dark: BTreeSet::new(),
        }
    }

    /// Takes a frame and says what it, and those before it that it throws light on, are worth.
    pub fn add(&mut self, step: usize, look: Look) -> Vec<(usize, Judgement)> {
        self.looks[step] = Some(look);
        let dark: Vec<(usize, Judgement)> = (0..self.steps.len())
            .filter_map(|k| self.why_dark(k).map(|why| (k, Judgement::Dark(why))))
            .collect();
        for (k, _) in &dark {
            self.looks[*k] = None;
            self.dark.extend(self.steps[*k].light);
        }
        if dark.iter().any(|(k, _)| *k == step) {
            return dark;
        }
        [vec![(step, Judgement::Good)], dark].concat()
    }

    /// What a light adds to the ambient light, as a fraction of the range, in its own frame.
    fn light(&self, step: usize) -> Option<f64> {
        let ambient = self.ambient().map_or(0.0, Look::mean) * self.steps[step].factor;
        self.looks[step].as_ref().map(|look| look.mean() - ambient)
    }

    fn ambient(&self) -> Option<&Look> {
        let step = self.steps.iter().position(|step| step.light.is_none())?;
        self.looks[step].as_ref()
    }

    fn why_dark(&self, step: usize) -> Option<String> {
        let light = self.steps[step].light?;
        let (own, factor) = (self.light(step)?, self.steps[step].factor);
        match self.usual_light(step).filter(|usual| *usual > NOTHING) {
            Some(usual) => (own < DARK * usual * factor).then(|| stays_dark(light)),
            // Nothing to compare with: the exposure may be to blame as well as the light. One that is meant to be short may
            // be dark, and still not empty.
            None => (own < NOTHING * factor.min(1.0))
                .then(|| format!("light {light}: the picture shows no light")),
        }
    }

    /// Why a step has no frame in the end, where its light is to blame: by then the others are known.
    pub fn why_left_out(&self, step: usize) -> Option<String> {
        self.steps[step].light.filter(|light| self.dark.contains(light)).map(stays_dark)
    }

    /// Whether several lights were tried and none showed: then it is not one LED that has failed.
    pub fn nothing_is_lit(&self) -> bool {
        let lit = |k: usize| self.steps[k].light.is_some() && self.looks[k].is_some();
        self.dark.len() >= ALL_DARK && !(0..self.steps.len()).any(lit)
    }

    /// Median of what the other lights give, per exposure; `None` where fewer than two are there.
    fn usual_light(&self, step: usize) -> Option<f64> {
        let others = (0..self.steps.len())
            .filter(|&k| k != step && self.steps[k].light.is_some())
            .filter_map(|k| self.light(k).map(|light| light / self.steps[k].factor));
        let mut others: Vec<f64> = others.collect();
        if others.len() < 2 {
            return None;
        }
        let middle = others.len() / 2;
        Some(*others.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// What the technician should know of the frames, as sentences.
    pub fn advice(&self) -> Vec<String> {
        [self.room_light(), self.exposure()]
            .into_iter()
            .flatten()
            .chain(self.alike())
            .chain(self.blurred())
            .collect()
    }

    fn base_frames(&self) -> impl Iterator<Item = (usize, &Step, &Look)> {
        let all = self.steps.iter().zip(&self.looks).enumerate();
        all.filter(|(_, (step, _))| step.factor == 1.0 && step.light.is_some())
            .filter_map(|(k, (step, look))| Some((k, step, look.as_ref()?)))
    }

    fn room_light(&self) -> Option<String> {
        let ambient = self.ambient()?.mean();
        let lights: Vec<f64> = self.base_frames().filter_map(|(k, ..)| self.light(k)).collect();
        let mean = lights.iter().sum::<f64>() / lights.len().max(1) as f64;
        (mean > 0.0 && ambient > ROOM_LIGHT * mean).then(|| {
            format!(
                "With every LED off the picture is {:.0} % as bright as under a light; darken the room.",
                100.0 * ambient / mean
            )
        })
    }

    fn exposure(&self) -> Option<String> {
        let most = |of: fn(&Look) -> f64| {
            let frames = self.base_frames().map(|(_, step, look)| (step.name(), of(look)));
            frames.max_by(|a, b| a.1.total_cmp(&b.1))
        };
        // One light at several exposures, as for a grey chart, is no bracket.
        let bracketed = self.steps.iter().any(|step| step.factor < 1.0 && step.light != Some(0));
        let ((clipping, clipped), (brightest, high)) = (most(Look::clipped)?, most(Look::high)?);
        if clipped > CLIPPED && !bracketed {
            Some(format!(
                "{:.1} % of the samples clip under {clipping}; use a shorter exposure (or {} 0.25 for glossy cloth).",
                100.0 * clipped,
                Setting("bracket")
            ))
        } else if high < UNDEREXPOSED {
            Some(format!(
                "The brightest light, {brightest}, reaches {:.0} % of full scale only; a longer exposure gives less noise.",
                100.0 * high
            ))
        } else {
            None
        }
    }

    fn alike(&self) -> Vec<String> {
        let sketches: Vec<(usize, Vec<f64>)> = self
            .base_frames()
            .filter(|(_, step, _)| !step.drift_check)
            .filter_map(|(k, step, _)| Some((step.light?, self.sketch(k)?)))
            .collect();
        let pairs = (0..sketches.len()).flat_map(|a| (0..a).map(move |b| (b, a)));
        let noise = self.repeated_difference().unwrap_or(0.0);
        let most = (2.0 * noise).clamp(ALIKE[0], ALIKE[1]);
        let alike = pairs.filter(|&(a, b)| difference(&sketches[a].1, &sketches[b].1) < most);
        alike
            .map(|(a, b)| {
                format!(
                    "Lights {} and {} give the same picture; look for stray light, a light that stays on, or two outputs at one LED.",
                    sketches[a].0, sketches[b].0
                )
            })
            .collect()
    }

    /// How much the light of the drift check differs from itself.
    fn repeated_difference(&self) -> Option<f64> {
        let again = self.steps.iter().position(|step| step.drift_check)?;
        let light = self.steps[again].light;
        let same = |step: &Step| step.light == light && step.factor == 1.0 && !step.drift_check;
        let first = self.steps.iter().position(same)?;
        Some(difference(&self.sketch(first)?, &self.sketch(again)?))
    }

    /// The sketch with the ambient light taken off.
    fn sketch(&self, step: usize) -> Option<Vec<f64>> {
        let own = &self.looks[step].as_ref()?.sketch;
        let factor = self.steps[step].factor;
        let ambient = self.ambient().map(|look| &look.sketch).filter(|a| a.len() == own.len());
        let off = |k: usize| ambient.map_or(0.0, |ambient| f64::from(ambient[k]) * factor);
        Some(own.iter().enumerate().map(|(k, value)| f64::from(*value) - off(k)).collect())
    }

    fn blurred(&self) -> Option<String> {
        let (_, again, later) = self.base_frames().find(|(_, step, _)| step.drift_check)?;
        let (_, _, first) = self
            .base_frames()
            .find(|(_, step, _)| step.light == again.light && !step.drift_check)?;
        (later.sharpness < BLURRED * first.sharpness).then(|| {
            "The last frame is blurred against the first; see that camera and swatch do not move, and focus by hand.".to_owned()
        })
    }
}

fn stays_dark(light: usize) -> String {
    format!(
        "light {light} stays dark although the board switched it on; look at its LED, driver and wiring"
    )
}

#[cfg(test)]
mod tests;

//! Frames without light: lamps that were off, a lens cap, a channel that is dead, and ambient frames that are none.

use crate::linear::{Exposure, PhotographedLight};
use crate::solve::error::SolveError;
use crate::solve::scene::Scene;
use crate::solve::screen::brightness::Brightness;
use crate::solve::screen::copies::name;
use crate::solve::words::few;
use weavelight_calibration::description::Light;

/// The fewest lights that can be solved.
const LEAST_LIGHTS: usize = 3;
/// A light must reach this share of the blocks.
const LIT_SHARE: f64 = 0.02;
/// A block is lit where the light's part is above the noise of one sample, and above this share of the ambient light, which
/// is steadier than that in no room.
const OF_AMBIENT: f64 = 0.02;
/// A frame is darker than the ambient one where it falls below it by this share, and by three deviations of a block's median.
const CLEARLY_DARKER: f64 = 0.05;
const DARKER_DEVIATIONS: f64 = 0.5;
/// It is so as a whole if it is at this share of the blocks.
const DARKER_SHARE: f64 = 0.25;
/// Frames are alike if they differ by less than this, and by noise ...
const ALIKE: f64 = 0.005;
/// ... at this share of the blocks. Near lights have falloff and directions of their own: no two agree so well.
const ALIKE_SHARE: f64 = 0.98;
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// Leaves out lights that show nothing above noise, and says which.
///
/// # Errors
/// Where fewer than three lights remain, an ambient frame is brighter than the lit ones, or no light changes the picture.
pub(crate) fn leave_out_dark_lights(scene: &mut Scene) -> Result<Vec<String>, SolveError> {
    let bright = Bright::new(scene);
    bright.check_ambient(scene)?;
    let lit: Vec<[f64; 3]> = (0..scene.lights.len()).map(|light| bright.lit(light)).collect();
    // Where nothing is known of a light, as between the blocks of a small mask, it is given the benefit of the doubt.
    let dark = |light: &usize| {
        let mut known = lit[*light].iter().filter(|share| !share.is_nan()).peekable();
        known.peek().is_some() && known.all(|share| *share < LIT_SHARE)
    };
    let dark: Vec<usize> = (0..scene.lights.len()).filter(dark).collect();
    let left = scene.lights.len() - dark.len();
    if left < LEAST_LIGHTS {
        return Err(SolveError::NoSignal {
            session: scene.origin.session.clone(),
            what: too_dark(scene, &dark, left),
        });
    }
    if dark.is_empty() && bright.all_alike(scene) {
        return Err(SolveError::NoSignal {
            session: scene.origin.session.clone(),
            what: "the frames of all lights show the same brightness everywhere, so no light changes the picture".into(),
        });
    }
    let mut warnings = dead_channels(scene, &bright, &lit, &dark);
    warnings.extend(sentence_of_dark(scene, &dark));
    let mut position = 0;
    scene.lights.retain(|_| {
        position += 1;
        !dark.contains(&(position - 1))
    });
    Ok(warnings)
}

fn indices(scene: &Scene, positions: &[usize]) -> String {
    few(positions.iter().map(|&k| scene.lights[k].index.to_string()).collect())
}

fn too_dark(scene: &Scene, dark: &[usize], left: usize) -> String {
    if left == 0 {
        return "no light shows a signal above noise in its frame".into();
    }
    let are = if dark.len() == 1 { "light {} shows" } else { "lights {} show" };
    let who = are.replace("{}", &indices(scene, dark));
    format!(
        "{who} no signal above noise, and {left} of the three lights that a solve needs are left"
    )
}

fn sentence_of_dark(scene: &Scene, dark: &[usize]) -> Option<String> {
    let who = indices(scene, dark);
    match dark {
        [] => None,
        [one] => {
            let file = scene.lights[*one].exposures.first().map(name).unwrap_or_default();
            Some(format!(
                "Light {who} shows no signal above noise in {file} and was left out; is its LED on, is its frame black?"
            ))
        }
        _ => Some(format!(
            "Lights {who} show no signal above noise and were left out; are their LEDs on, are their frames black?"
        )),
    }
}

/// A channel that adds less than this share of the brightest one's light is dead: no dye swallows so much.
const DEAD_SHARE: f64 = 0.005;

/// A channel in which a light shows nothing, although it does in others.
fn dead_channels(scene: &Scene, bright: &Bright, lit: &[[f64; 3]], dark: &[usize]) -> Vec<String> {
    let mut warnings = vec![];
    for (channel, color) in CHANNELS.iter().enumerate() {
        let of = |light: &usize| lit[*light][channel];
        let lights: Vec<usize> = (0..lit.len()).filter(|light| !dark.contains(light)).collect();
        // The noise is the whole frame's: a colour that the cloth hardly reflects may stay below it and still be there.
        let is_dead =
            |light: &usize| of(light) == 0.0 && bright.share(*light, channel) < DEAD_SHARE;
        let dead: Vec<usize> = lights.iter().copied().filter(is_dead).collect();
        // A layout without the channel has no share of it at all.
        if dead.is_empty() || lights.iter().any(|light| of(light).is_nan()) {
            continue;
        }
        warnings.push(match dead.len() == lights.len() {
            true => format!(
                "No frame shows any {color} light above noise: photosites of that colour cannot be solved. Check the LEDs, and cfa in session.toml."
            ),
            false => format!(
                "Frames of light{} {} show no {color} light above noise, those of the others do; check the LEDs, and whether the files are whole.",
                if dead.len() == 1 { "" } else { "s" },
                indices(scene, &dead)
            ),
        });
    }
    warnings
}

/// Every frame in blocks.
struct Bright {
    lights: Vec<Vec<Brightness>>,
    ambient: Vec<Brightness>,
}

impl Bright {
    fn new(scene: &Scene) -> Self {
        let of = |exposures: &[Exposure]| Brightness::of(scene, exposures);
        Self {
            lights: scene.lights.iter().map(|light| of(&light.exposures)).collect(),
            ambient: of(&scene.ambient),
        }
    }

    fn blocks(&self) -> usize {
        self.lights.first().and_then(|of| of.first()).map_or(0, |frame| frame.levels.len())
    }

    /// Ambient light of a block per second at ISO 100, all ambient frames together; infinite where one clips.
    fn ambient_rate(&self, block: usize, channel: usize) -> f64 {
        let seconds: f64 = self.ambient.iter().map(|frame| frame.seconds).sum();
        let light: f64 = self.ambient.iter().map(|frame| frame.levels[block][channel]).sum();
        if self.ambient.is_empty() { 0.0 } else { light / seconds }
    }

    /// Per channel, the share of the blocks that a light reaches above noise in any of its frames; NaN without the channel.
    fn lit(&self, light: usize) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let (mut lit, mut all) = (0.0, 0.0);
            for block in 0..self.blocks() {
                let known = |frame: &&Brightness| !frame.levels[block][channel].is_nan();
                let ambient = self.ambient_rate(block, channel);
                let reached = |frame: &Brightness| {
                    let background = ambient * frame.seconds;
                    let least = frame.noise.max(OF_AMBIENT * background);
                    let level = frame.levels[block][channel];
                    level.is_infinite() || level - background > least
                };
                all += f64::from(u8::from(self.lights[light].iter().any(|f| known(&f))));
                lit += f64::from(u8::from(self.lights[light].iter().filter(known).any(reached)));
            }
            lit / all
        })
    }

    /// What a light adds in one channel, as a share of what it adds in its brightest one.
    fn share(&self, light: usize, channel: usize) -> f64 {
        let added = |channel: usize| -> f64 {
            let of_block = |block: usize| {
                let frame = self.lights[light].first()?;
                let level = frame.levels[block][channel];
                let added = level - self.ambient_rate(block, channel) * frame.seconds;
                added.is_finite().then_some(added)
            };
            (0..self.blocks()).filter_map(of_block).sum()
        };
        let most = (0..3).map(added).fold(f64::MIN_POSITIVE, f64::max);
        added(channel) / most
    }

    /// The share of the blocks at which every frame of a light is clearly darker than the ambient light alone.
    fn darker_than_ambient(&self, light: usize) -> f64 {
        let darker = |block: usize| {
            (0..3).any(|channel| {
                let ambient = self.ambient_rate(block, channel);
                let below = |frame: &Brightness| {
                    let level = frame.levels[block][channel];
                    let background = ambient * frame.seconds;
                    let margin = CLEARLY_DARKER * background + DARKER_DEVIATIONS * frame.noise;
                    background.is_infinite() && level.is_finite() || level + margin < background
                };
                ambient > 0.0 && self.lights[light].iter().all(below)
            })
        };
        let blocks = self.blocks();
        (0..blocks).filter(|block| darker(*block)).count() as f64 / blocks.max(1) as f64
    }

    /// With light added, nothing becomes darker: ambient frames that half of the lights fall below are none.
    fn check_ambient(&self, scene: &Scene) -> Result<(), SolveError> {
        if self.ambient.is_empty() {
            return Ok(());
        }
        let below = |light: &usize| self.darker_than_ambient(*light) > DARKER_SHARE;
        let below: Vec<usize> = (0..scene.lights.len()).filter(below).collect();
        if 2 * below.len() < scene.lights.len() {
            return Ok(());
        }
        let brightest = (0..self.ambient.len()).max_by(|a, b| {
            self.mean_rate(&self.ambient[*a]).total_cmp(&self.mean_rate(&self.ambient[*b]))
        });
        let Some(brightest) = brightest else { return Ok(()) };
        let what = match below.len() == scene.lights.len() {
            true => "every frame".to_owned(),
            false => format!("the frames of lights {}", indices(scene, &below)),
        };
        Err(SolveError::BrightAmbient { path: scene.ambient[brightest].path.clone(), what })
    }

    fn mean_rate(&self, frame: &Brightness) -> f64 {
        let rates = (0..self.blocks()).flat_map(|block| {
            (0..3).map(move |channel| frame.rate(block, channel)).filter(|rate| !rate.is_nan())
        });
        rates.sum()
    }

    /// Whether the frames of all lights show one brightness at nearly every block, the ambient light not known. Far lights
    /// over a flat sheet may do so in earnest.
    fn all_alike(&self, scene: &Scene) -> bool {
        let near = |light: &PhotographedLight| matches!(light.calibrated.light, Light::Point(_));
        if self.blocks() < 9 || !self.ambient.is_empty() || !scene.lights.iter().all(near) {
            return false;
        }
        let frames: Vec<&Brightness> = self.lights.iter().filter_map(|of| of.first()).collect();
        let Some((first, others)) = frames.split_first() else { return false };
        let alike = |other: &Brightness, block: usize, channel: usize| {
            let (a, b) = (first.rate(block, channel), other.rate(block, channel));
            let noise = 0.5 * (first.noise / first.seconds + other.noise / other.seconds);
            a.is_nan() || (a.is_finite() && (a - b).abs() <= ALIKE * a.abs() + noise)
        };
        let blocks = self.blocks();
        others.iter().all(|other| {
            let same = (0..blocks).filter(|&block| (0..3).all(|c| alike(other, block, c)));
            same.count() as f64 >= ALIKE_SHARE * blocks as f64
        })
    }
}

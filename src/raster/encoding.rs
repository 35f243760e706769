//! What the numbers of a picture mean, as far as its file says so: the curve from stored numbers to light, and the primaries.

use super::srgb;

/// What a file says of its numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// From stored numbers to linear light.
    pub curve: SaidCurve,
    /// Who says so, as in "its sRGB chunk"; empty where nothing does.
    pub by: String,
    /// Linear Rec. 709 from the picture's linear RGB, three rows that sum to 1; `None` where the file does not say, or for
    /// grey.
    pub linear_srgb_from_rgb: Option<[[f64; 3]; 3]>,
}

/// A file's word about its curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum SaidCurve {
    /// None.
    #[default]
    Silent,
    /// One that can be applied.
    Known(Curve),
    /// One that cannot: why, as in "a lookup table".
    Unreadable(String),
}

impl Said {
    /// A curve with a name.
    pub(crate) fn known(curve: Curve, by: impl Into<String>) -> Self {
        Self { curve: SaidCurve::Known(curve), by: by.into(), linear_srgb_from_rgb: None }
    }

    /// A curve that cannot be applied, and why.
    pub(crate) fn unreadable(why: impl Into<String>, by: impl Into<String>) -> Self {
        Self { curve: SaidCurve::Unreadable(why.into()), by: by.into(), linear_srgb_from_rgb: None }
    }

    /// With primaries.
    pub(crate) fn with_primaries(self, linear_srgb_from_rgb: Option<[[f64; 3]; 3]>) -> Self {
        Self { linear_srgb_from_rgb, ..self }
    }
}

/// From stored numbers, as fractions of full scale, to linear light.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {
    /// Proportional.
    Linear,
    /// sRGB's.
    Srgb,
    /// Another, of red, green and blue.
    Tone(Box<[Tone; 3]>),
}

impl Curve {
    /// Named where it is one of the two that have a name.
    pub(crate) fn from_tones(tones: [Tone; 3]) -> Self {
        let is = |other: &dyn Fn(f64) -> f64, slack: f64| {
            tones.iter().all(|tone| {
                (0..=256)
                    .map(|i| f64::from(i) / 256.0)
                    .all(|x| (tone.linear(x) - other(x)).abs() <= slack)
            })
        };
        if is(&|x| x, LINEAR_SLACK) {
            Self::Linear
        } else if is(&|x| f64::from(srgb::decode(x as f32)), SRGB_SLACK) {
            Self::Srgb
        } else {
            Self::Tone(Box::new(tones))
        }
    }

    /// Linear light of a stored number, fractions of full scale, for channel 0, 1 or 2.
    pub fn linear(&self, channel: usize, stored: f64) -> f64 {
        match self {
            Self::Linear => stored,
            Self::Srgb => f64::from(srgb::decode(stored as f32)),
            Self::Tone(tones) => tones[channel.min(2)].linear(stored),
        }
    }

    /// For messages: "linear", "sRGB" or "gamma 2.20".
    pub fn name(&self) -> String {
        match self {
            Self::Linear => "linear".to_owned(),
            Self::Srgb => "sRGB".to_owned(),
            Self::Tone(tones) => match tones[1] {
                Tone::Gamma(gamma) => format!("gamma {gamma:.2}"),
                _ => "another curve".to_owned(),
            },
        }
    }
}

/// The sixteen bits of a profile's numbers.
const LINEAR_SLACK: f64 = 1e-4;
/// Tables of 1024 entries in the profiles that ship with most programs are this close to the formula; gamma 2.2 is not.
const SRGB_SLACK: f64 = 5e-4;

/// A tone curve: ICC.1:2022, sections 10.6 and 10.18.
#[derive(Clone, Debug, PartialEq)]
pub enum Tone {
    /// x^gamma.
    Gamma(f64),
    /// (a x + b)^g + e from d on, c x + f below: g, a, b, c, d, e, f.
    Parametric([f64; 7]),
    /// Equally spaced from 0 to 1, 65535 for 1, straight in between; two entries or more.
    Table(Vec<u16>),
}

impl Tone {
    /// Linear light of a stored number, fractions of full scale.
    pub fn linear(&self, x: f64) -> f64 {
        match self {
            Self::Gamma(gamma) => x.max(0.0).powf(*gamma),
            Self::Parametric([g, a, b, c, d, e, f]) => {
                if x >= *d {
                    (a * x + b).max(0.0).powf(*g) + e
                } else {
                    c * x + f
                }
            }
            Self::Table(table) => {
                let place = x.clamp(0.0, 1.0) * (table.len() - 1) as f64;
                let below = (place as usize).min(table.len() - 2);
                let [low, high] = [table[below], table[below + 1]].map(f64::from);
                (low + (place - below as f64) * (high - low)) / 65_535.0
            }
        }
    }

    /// Whether it goes from 0 to 1, and never down.
    pub(crate) fn is_sound(&self) -> bool {
        let values: Vec<f64> = (0..=64).map(|i| self.linear(f64::from(i) / 64.0)).collect();
        let [Some(first), Some(last)] = [values.first(), values.last()] else { return false };
        values.iter().all(|value| value.is_finite())
            && values.windows(2).all(|pair| pair[1] >= pair[0] - 1e-6)
            && first.abs() < 0.05
            && (last - 1.0).abs() < 0.05
    }

    /// ITU-R BT.709-6, 1.2, inverted.
    pub(crate) fn bt_709() -> Self {
        let [alpha, beta] = [1.099, 0.081];
        Self::Parametric([
            1.0 / 0.45,
            1.0 / alpha,
            (alpha - 1.0) / alpha,
            1.0 / 4.5,
            beta,
            0.0,
            0.0,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_named_by_what_they_do() {
        let three = |tone: Tone| Curve::from_tones([tone.clone(), tone.clone(), tone]);
        let srgb =
            Tone::Parametric([2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045, 0.0, 0.0]);
        assert_eq!(three(srgb), Curve::Srgb);
        let table = (0..1024)
            .map(|i| (65_535.0 * srgb::decode(i as f32 / 1023.0)).round() as u16)
            .collect();
        assert_eq!(three(Tone::Table(table)), Curve::Srgb);
        assert_eq!(three(Tone::Gamma(1.0)), Curve::Linear);
        assert_eq!(three(Tone::Table(vec![0, 65_535])), Curve::Linear);
        assert_eq!(three(Tone::Gamma(2.2)).name(), "gamma 2.20");
        // One channel that differs is enough.
        let mixed = Curve::from_tones([Tone::Gamma(1.0), Tone::Gamma(1.0), Tone::Gamma(1.8)]);
        assert!((mixed.linear(2, 0.5) - 0.5_f64.powf(1.8)).abs() < 1e-15);
        assert_eq!(mixed.linear(0, 0.5), 0.5);
    }

    #[test]
    fn tones_at_known_places() {
        let check = |tone: &Tone, x: f64, expected: f64| {
            assert!((tone.linear(x) - expected).abs() < 1e-6, "{tone:?} {x}: {}", tone.linear(x));
        };
        check(&Tone::Gamma(2.2), 0.5, 0.217_637_64);
        check(&Tone::Table(vec![0, 0, 65_535]), 0.75, 0.5);
        check(&Tone::Table(vec![0, 0, 65_535]), 2.0, 1.0);
        check(&Tone::bt_709(), 0.5, 0.259_589_4);
        check(&Tone::bt_709(), 0.045, 0.01);
        assert!(Tone::bt_709().is_sound() && !Tone::Table(vec![65_535, 0]).is_sound());
        assert!(!Tone::Gamma(f64::NAN).is_sound());
    }
}

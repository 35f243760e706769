//! ICC profiles: curve and primaries, where a profile is made of these (ICC.1:2022, sections 8.3 and 8.4). The `moxcms` crate reads
//! the tags.

use super::encoding::{Curve, Said, Tone};
use super::primaries::linear_srgb_from_colorants;
use moxcms::{ColorProfile, DataColorSpace, ProfileText, ToneReprCurve};

/// What a profile says of a picture's numbers.
pub(crate) fn said_by_icc(bytes: &[u8]) -> Said {
    let Ok(profile) = ColorProfile::new_from_slice(bytes) else {
        return Said::unreadable("it cannot be read", "its ICC profile");
    };
    let by = match profile.description.as_ref().map(text).filter(|name| !name.is_empty()) {
        Some(name) => format!("its ICC profile \"{name}\""),
        None => "its ICC profile".to_owned(),
    };
    let tones = match profile.color_space {
        DataColorSpace::Gray => [&profile.gray_trc; 3],
        DataColorSpace::Rgb => [&profile.red_trc, &profile.green_trc, &profile.blue_trc],
        other => return Said::unreadable(format!("it describes {other:?}"), by),
    };
    let [Some(red), Some(green), Some(blue)] = tones.map(|tone| tone.as_ref().and_then(tone_of))
    else {
        return Said::unreadable("it holds lookup tables instead of a curve", by);
    };
    let colorants = [profile.red_colorant, profile.green_colorant, profile.blue_colorant];
    let primaries = match profile.color_space {
        DataColorSpace::Rgb => linear_srgb_from_colorants(colorants.map(|c| [c.x, c.y, c.z])),
        _ => None,
    };
    Said::known(Curve::from_tones([red, green, blue]), by).with_primaries(primaries)
}

/// `None` for a curve that makes no sense.
fn tone_of(curve: &ToneReprCurve) -> Option<Tone> {
    let tone = match curve {
        ToneReprCurve::Lut(table) => match table.as_slice() {
            [] => Tone::Gamma(1.0),
            // u8Fixed8Number.
            [gamma] => Tone::Gamma(f64::from(*gamma) / 256.0),
            _ => Tone::Table(table.clone()),
        },
        ToneReprCurve::Parametric(numbers) => {
            let n: Vec<f64> = numbers.iter().map(|&number| f64::from(number)).collect();
            match n[..] {
                [g] => Tone::Gamma(g),
                [g, a, b] => Tone::Parametric([g, a, b, 0.0, -b / a, 0.0, 0.0]),
                [g, a, b, c] => Tone::Parametric([g, a, b, 0.0, -b / a, c, c]),
                [g, a, b, c, d] => Tone::Parametric([g, a, b, c, d, 0.0, 0.0]),
                [g, a, b, c, d, e, f] => Tone::Parametric([g, a, b, c, d, e, f]),
                _ => return None,
            }
        }
    };
    tone.is_sound().then_some(tone)
}

/// A name on one line, quotation marks left out.
fn text(text: &ProfileText) -> String {
    let found = match text {
        ProfileText::PlainString(text) => text.as_str(),
        ProfileText::Localizable(texts) => texts.first().map_or("", |text| text.value.as_str()),
        ProfileText::Description(text) if text.ascii_string.is_empty() => &text.unicode_string,
        ProfileText::Description(text) => &text.ascii_string,
    };
    let plain = found.chars().filter(|c| !c.is_control() && *c != '"');
    plain.take(60).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::encoding::SaidCurve;
    use super::*;

    fn said(profile: &ColorProfile) -> Said {
        said_by_icc(&profile.encode().unwrap())
    }

    #[test]
    fn known_profiles() {
        let srgb = said(&ColorProfile::new_srgb());
        assert_eq!(srgb.curve, SaidCurve::Known(Curve::Srgb));
        assert_eq!(
            srgb.linear_srgb_from_rgb,
            Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        );
        assert!(srgb.by.starts_with("its ICC profile \"sRGB"), "{}", srgb.by);
        let adobe = said(&ColorProfile::new_adobe_rgb());
        let SaidCurve::Known(curve) = &adobe.curve else { panic!("{adobe:?}") };
        assert!((curve.linear(1, 0.5) - 0.5_f64.powf(2.2)).abs() < 1e-3, "{curve:?}");
        // Published (Lindbloom): linear sRGB from linear Adobe RGB.
        let matrix = adobe.linear_srgb_from_rgb.unwrap();
        assert!(
            (matrix[0][0] - 1.398_3).abs() < 2e-3 && (matrix[0][1] + 0.398_3).abs() < 2e-3,
            "{matrix:?}"
        );
        let grey = said(&ColorProfile::new_gray_with_gamma(1.0));
        assert_eq!(
            (grey.curve, grey.linear_srgb_from_rgb),
            (SaidCurve::Known(Curve::Linear), None)
        );
    }

    #[test]
    fn what_cannot_be_applied_says_why() {
        let lab = said(&ColorProfile::new_lab());
        assert!(matches!(&lab.curve, SaidCurve::Unreadable(why) if why.contains("Lab")), "{lab:?}");
        let junk = said_by_icc(&[7; 300]);
        assert!(matches!(&junk.curve, SaidCurve::Unreadable(_)), "{junk:?}");
        let mut cut = ColorProfile::new_srgb().encode().unwrap();
        cut.truncate(cut.len() / 2);
        said_by_icc(&cut);
    }
}

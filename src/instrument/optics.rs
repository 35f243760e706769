use crate::raw::Metadata;

/// Which camera and lens took the pictures, as far as their files say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Optics {
    /// Maker and model, as in "Nikon D5100".
    pub camera_model: Option<String>,
    /// The lens, as in "AF-S Micro-NIKKOR 40mm 1:2.8G".
    pub lens: Option<String>,
    /// What the lens is set to.
    pub focal_length_mm: Option<f64>,
}

/// Files round focal lengths; a zoom that was turned is off by more.
const SAME_FOCAL_LENGTH: f64 = 0.005;

impl Optics {
    /// What a frame's file says.
    pub fn of(metadata: &Metadata) -> Self {
        Self {
            camera_model: metadata.camera.clone(),
            lens: metadata.lens.clone(),
            focal_length_mm: metadata.focal_length_mm,
        }
    }

    /// How another frame's camera and lens differ, as in `the lens is "A", calibrated was "B"`; nothing where either side
    /// does not say.
    pub fn differences(&self, other: &Optics) -> Vec<String> {
        let mut found = Vec::new();
        let texts = [
            ("camera", &self.camera_model, &other.camera_model),
            ("lens", &self.lens, &other.lens),
        ];
        for (what, calibrated, now) in texts {
            if let (Some(calibrated), Some(now)) = (calibrated, now)
                && !same_name(calibrated, now)
            {
                found.push(format!("the {what} is \"{now}\", calibrated was \"{calibrated}\""));
            }
        }
        if let (Some(calibrated), Some(now)) = (self.focal_length_mm, other.focal_length_mm)
            && (now / calibrated - 1.0).abs() > SAME_FOCAL_LENGTH
        {
            found.push(format!("the lens stands at {now} mm, calibrated was {calibrated} mm"));
        }
        found
    }
}

/// Programs write "NIKON D5100" and "Nikon D5100".
fn same_name(a: &str, b: &str) -> bool {
    a.trim().eq_ignore_ascii_case(b.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_named_where_both_sides_speak() {
        let optics = |camera: &str, lens: &str, focal_length_mm| Optics {
            camera_model: Some(camera.to_owned()).filter(|text| !text.is_empty()),
            lens: Some(lens.to_owned()).filter(|text| !text.is_empty()),
            focal_length_mm,
        };
        let calibrated = optics("NIKON D5100", "Micro 40mm", Some(40.0));
        let check = |now: Optics, expected: &[&str]| {
            let found = calibrated.differences(&now);
            assert_eq!(found.len(), expected.len(), "{found:?}");
            assert!(
                found.iter().zip(expected).all(|(text, word)| text.contains(word)),
                "{found:?}"
            );
        };
        check(optics("Nikon D5100 ", "Micro 40mm", Some(40.1)), &[]);
        check(Optics::default(), &[]);
        check(optics("Nikon D7000", "", None), &["camera is \"Nikon D7000\""]);
        check(optics("", "Kit 18-55", Some(35.0)), &["lens is \"Kit 18-55\"", "35 mm"]);
    }
}

//! Which channels of an OpenEXR file belong together, and which of them are meant.
//!
//! "Technical introduction to OpenEXR", Academy Software Foundation: a channel's layer is what stands before the last dot of its
//! name.

use super::PictureError;

/// What a group of channels holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// R, G, B.
    Rgb,
    /// X, Y, Z: a vector, or CIE XYZ.
    Xyz,
    /// Y alone (or V, as Blender names a value).
    Grey,
    /// Y with RY and BY.
    Chroma,
}

/// Channels that belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// What stands before their last letters, as in "ViewLayer.Normal"; empty for the file's main picture.
    pub layer: String,
    /// What they hold.
    pub role: Role,
    /// Places of the three channels, or three times that of the only one.
    pub channels: [usize; 3],
    /// Place of the layer's alpha.
    pub alpha: Option<usize>,
}

/// What a reader is after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// A picture: colours or grey.
    Colors,
    /// Vectors.
    Vectors,
    /// Either.
    Any,
}

/// Names of three channels, or of one.
const ROLES: [(&[&str], Role); 6] = [
    (&["R", "G", "B"], Role::Rgb),
    (&["X", "Y", "Z"], Role::Xyz),
    (&["NX", "NY", "NZ"], Role::Xyz),
    (&["Y", "RY", "BY"], Role::Chroma),
    (&["Y"], Role::Grey),
    (&["V"], Role::Grey),
];

/// The groups among channels of these names; of one layer the first that fits.
pub(crate) fn groups(names: &[&str]) -> Vec<Group> {
    let split = |name: &&str| match name.rsplit_once('.') {
        Some((layer, last)) => (layer.to_owned(), last.to_uppercase()),
        None => (String::new(), name.to_uppercase()),
    };
    let names: Vec<(String, String)> = names.iter().map(split).collect();
    let mut layers: Vec<&String> = names.iter().map(|(layer, _)| layer).collect();
    layers.sort();
    layers.dedup();
    let group = |layer: &String| {
        let place = |wanted: &str| names.iter().position(|(l, last)| l == layer && last == wanted);
        // One component of a vector is no picture.
        let vector = place("X").is_some() || place("U").is_some();
        ROLES.iter().filter(|(_, role)| *role != Role::Grey || !vector).find_map(
            |(wanted, role)| {
                let found: Vec<usize> = wanted.iter().map_while(|name| place(name)).collect();
                let channels = match found[..] {
                    [a, b, c] => [a, b, c],
                    [only] if wanted.len() == 1 => [only; 3],
                    _ => return None,
                };
                Some(Group { layer: layer.clone(), role: *role, channels, alpha: place("A") })
            },
        )
    };
    layers.into_iter().filter_map(group).collect()
}

/// The group that is meant.
///
/// # Errors
/// None, or several.
pub(crate) fn choose(names: &[&str], choice: Choice) -> Result<Group, PictureError> {
    let all = groups(names);
    let fits = |group: &&Group| match choice {
        Choice::Colors => matches!(group.role, Role::Rgb | Role::Grey),
        Choice::Vectors => matches!(group.role, Role::Rgb | Role::Xyz),
        Choice::Any => group.role != Role::Chroma,
    };
    let fitting: Vec<&Group> = all.iter().filter(fits).collect();
    let chosen = match fitting[..] {
        [] => None,
        [only] => Some(only),
        _ => main_group(&fitting, choice),
    };
    chosen.cloned().ok_or_else(|| match (fitting.len(), all.first()) {
        (0, Some(group)) => other_role(group.role, choice),
        (0, None) => {
            let what = format!("an OpenEXR picture with the channels {}", listed(names));
            PictureError::unsupported(what, "name its channels R, G, B or Y")
        }
        _ => {
            let layers: Vec<&str> = fitting.iter().map(|group| name_of(group)).collect();
            let what = format!("an OpenEXR picture of several layers ({})", listed(&layers));
            PictureError::unsupported(what, "save the one that is meant as a file of its own")
        }
    })
}

/// The one among several that is plainly meant.
fn main_group<'a>(fitting: &[&'a Group], choice: Choice) -> Option<&'a Group> {
    let is_vector = |group: &&&Group| {
        let name = group.layer.rsplit('.').next().unwrap_or_default().to_lowercase();
        group.role == Role::Xyz || name.contains("normal") || name == "n"
    };
    let vectors: Vec<&Group> = fitting.iter().filter(is_vector).copied().collect();
    let main = fitting.iter().copied().find(|group| group.layer.is_empty());
    match (choice, &vectors[..]) {
        (Choice::Vectors, [only]) => Some(only),
        (Choice::Vectors, _) | (Choice::Colors, _) => main,
        // A picture beside its normals: either may be meant.
        (Choice::Any, []) => main,
        (Choice::Any, _) => None,
    }
}

fn other_role(role: Role, choice: Choice) -> PictureError {
    match (role, choice) {
        (Role::Chroma, _) => PictureError::unsupported(
            "an OpenEXR picture of luminance and chroma (Y, RY, BY)",
            "save it as R, G, B",
        ),
        (Role::Xyz, _) => PictureError::unsupported(
            "an OpenEXR picture of X, Y, Z (a vector or CIE XYZ, not a photograph)",
            "give a picture of R, G, B or Y",
        ),
        _ => PictureError::unsupported(
            "an OpenEXR picture of one grey channel",
            "give three channels: X, Y, Z or R, G, B",
        ),
    }
}

fn name_of(group: &Group) -> &str {
    if group.layer.is_empty() { "the main one" } else { &group.layer }
}

/// The first of them, separated by commas.
fn listed(names: &[&str]) -> String {
    const MOST: usize = 8;
    let rest = if names.len() > MOST { ", ..." } else { "" };
    let short = |name: &&str| name.chars().filter(|c| !c.is_control()).take(40).collect::<String>();
    names.iter().take(MOST).map(short).collect::<Vec<_>>().join(", ") + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(names: &[&str], choice: Choice, expected: Result<(&str, Role), &str>) {
        match (choose(names, choice), expected) {
            (Ok(found), Ok(expected)) => {
                assert_eq!((found.layer.as_str(), found.role), expected, "{names:?}");
            }
            (Err(error), Err(expected)) => {
                assert!(error.to_string().contains(expected), "{names:?}: {error}");
            }
            (found, expected) => panic!("{names:?}: {found:?}, not {expected:?}"),
        }
    }

    #[test]
    fn the_only_layer_is_chosen() {
        use Choice::{Any, Colors, Vectors};
        check(&["B", "G", "R"], Colors, Ok(("", Role::Rgb)));
        check(&["A", "B", "G", "R", "Y", "Z"], Any, Ok(("", Role::Rgb)));
        check(&["X", "Y", "Z"], Vectors, Ok(("", Role::Xyz)));
        check(&["X", "Y", "Z"], Any, Ok(("", Role::Xyz)));
        check(&["X", "Y", "Z"], Colors, Err("vector or CIE XYZ"));
        check(&["L.Normal.X", "L.Normal.Y", "L.Normal.Z"], Vectors, Ok(("L.Normal", Role::Xyz)));
        check(
            &["V.Combined.A", "V.Combined.B", "V.Combined.G", "V.Combined.R"],
            Colors,
            Ok(("V.Combined", Role::Rgb)),
        );
        check(&["Y"], Colors, Ok(("", Role::Grey)));
        check(&["Y"], Vectors, Err("one grey channel"));
        check(&["BY", "RY", "Y"], Any, Err("luminance and chroma"));
        check(&["BY", "RY", "Y"], Colors, Err("luminance and chroma"));
        check(&["U", "V.Depth.Z"], Colors, Err("channels U, V.Depth.Z"));
        check(&["U", "V"], Colors, Err("channels U, V"));
        check(&["X", "Y"], Any, Err("channels X, Y"));
        check(&["b", "g", "r"], Colors, Ok(("", Role::Rgb)));
    }

    #[test]
    fn of_several_the_main_one_or_an_error_that_lists_them() {
        use Choice::{Any, Colors, Vectors};
        let render = ["B", "G", "R", "normal.X", "normal.Y", "normal.Z"];
        check(&render, Colors, Ok(("", Role::Rgb)));
        check(&render, Vectors, Ok(("normal", Role::Xyz)));
        check(&render, Any, Err("several layers (the main one, normal)"));
        let layers = ["a.B", "a.G", "a.R", "b.B", "b.G", "b.R"];
        check(&layers, Colors, Err("several layers (a, b)"));
        check(&["B", "G", "R", "spec.B", "spec.G", "spec.R"], Any, Ok(("", Role::Rgb)));
        let group = choose(&["A", "B", "G", "R"], Colors).unwrap();
        assert_eq!((group.channels, group.alpha), ([3, 2, 1], Some(0)));
    }
}

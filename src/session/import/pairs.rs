//! Which picture belongs to which light.

use super::lights::{LightList, Named};
use super::natural::natural_order;
use super::{ImportError, Options};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A picture and its light.
#[derive(Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) image: PathBuf,
    pub(super) light: usize,
}

/// Pairs in the order of the lights, and what the user should know.
pub(super) fn pair(
    list: &LightList,
    options: &Options,
) -> Result<(Vec<Pair>, Vec<String>), ImportError> {
    let images: Vec<&PathBuf> =
        options.images.iter().filter(|image| !is_mask(image, options)).collect();
    let (found, warnings) = match list.names() {
        Some(named) if images.is_empty() => (beside_the_list(named)?, Vec::new()),
        Some(named) => among(named, &images)?,
        None => (in_natural_order(&images), Vec::new()),
    };
    if found.len() != list.directions.len() {
        let what = format!("{} pictures were given", found.len());
        return Err(ImportError::Count {
            path: options.lights.clone(),
            lights: list.directions.len(),
            what,
        });
    }
    let pairs = found.into_iter().enumerate().map(|(light, image)| Pair { image, light }).collect();
    Ok((pairs, warnings))
}

/// A mask among the pictures, as a shell's `*.png` puts it there.
fn is_mask(image: &Path, options: &Options) -> bool {
    let same = |mask: &PathBuf| mask == image || same_file(mask, image);
    options.mask.as_ref().is_some_and(same)
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn beside_the_list(named: &Named) -> Result<Vec<PathBuf>, ImportError> {
    let folder = named.list.parent().unwrap_or(Path::new(""));
    let find = |name: &String| {
        // Lists travel: a path from another machine is worth no more than its last part.
        let candidates = [folder.join(name), folder.join(last_part(name))];
        candidates
            .into_iter()
            .find(|path| path.is_file())
            .ok_or_else(|| missing(named, name, "there beside it"))
    };
    named.names.iter().map(find).collect()
}

/// The named ones of the given pictures; the others are left out with a word.
fn among(named: &Named, images: &[&PathBuf]) -> Result<(Vec<PathBuf>, Vec<String>), ImportError> {
    let file_name =
        |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut given: HashMap<String, &PathBuf> =
        images.iter().map(|image| (file_name(image), *image)).collect();
    let mut take = |name: &String| {
        let image = given.remove(last_part(name)).cloned();
        image.ok_or_else(|| missing(named, name, "among the pictures given (or twice in the list)"))
    };
    let found = named.names.iter().map(&mut take).collect::<Result<Vec<_>, _>>()?;
    let mut left: Vec<String> = given.into_keys().collect();
    left.sort_by(|a, b| natural_order(a, b));
    let list = named.list.display();
    let warning = (!left.is_empty())
        .then(|| format!("left out, since {list} does not name them: {}", left.join(", ")));
    Ok((found, warning.into_iter().collect()))
}

fn in_natural_order(images: &[&PathBuf]) -> Vec<PathBuf> {
    let mut images: Vec<PathBuf> = images.iter().map(|image| (*image).clone()).collect();
    images.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    images
}

fn last_part(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

fn missing(named: &Named, name: &str, place: &str) -> ImportError {
    ImportError::NamedMissing {
        path: named.list.clone(),
        name: name.to_owned(),
        place: place.to_owned(),
    }
}

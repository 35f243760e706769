//! Which picture belongs to which light.

use super::lights::{LightList, Name, Named};
use super::names::{Fit, Pool, last_part};
use super::natural::natural_order;
use super::{ImportError, Options};
use crate::instrument::LIGHT_COUNT;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A picture and its light.
#[derive(Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) image: PathBuf,
    /// Its place in the list.
    pub(super) light: usize,
}

/// Pairs in the order of the lights, and what the user should know.
pub(super) fn pair(
    list: &LightList,
    options: &Options,
) -> Result<(Vec<Pair>, Vec<String>), ImportError> {
    let images: Vec<&PathBuf> =
        options.images.iter().filter(|image| !is_mask(image, options)).collect();
    let mut warnings = Vec::new();
    let pairs = match &list.named {
        Some(named) if images.is_empty() => beside_the_list(named, &mut warnings)?,
        Some(named) => among(named, &images, &mut warnings)?,
        None => in_natural_order(list, &images, options)?,
    };
    if LIGHT_COUNT.contains(&pairs.len()) {
        return Ok((pairs, warnings));
    }
    let what = match pairs.len() == list.directions.len() {
        true => format!("{} directions", pairs.len()),
        false => format!("{} of its {} lights are chosen", pairs.len(), list.directions.len()),
    };
    Err(ImportError::LightCount { path: options.lights.clone(), what })
}

/// A mask among the pictures, as a shell's `*.png` puts it there.
fn is_mask(image: &Path, options: &Options) -> bool {
    let same = |mask: &PathBuf| mask == image || same_file(mask, image);
    options.mask.as_ref().is_some_and(same)
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

fn beside_the_list(named: &Named, warnings: &mut Vec<String>) -> Result<Vec<Pair>, ImportError> {
    let folder = named.list.parent().unwrap_or(Path::new(""));
    let mut pools: HashMap<PathBuf, Pool> = HashMap::new();
    let mut finds = Finds::new(named);
    for (light, name) in named.names.iter().enumerate() {
        let as_written = name.candidates.iter().map(|text| folder.join(text.replace('\\', "/")));
        if let Some(image) = as_written.into_iter().find(|path| path.is_file()) {
            finds.add(name, light, &image, Fit::Path)?;
            continue;
        }
        let subfolder = folder_of(name).map(|inner| folder.join(inner));
        let place = subfolder.filter(|path| path.is_dir()).unwrap_or_else(|| folder.to_owned());
        // Lists travel: a path from another machine is worth no more than its last part.
        let pool = pools.entry(place.clone()).or_insert_with(|| Pool::of_folder(&place));
        match pool.find(named, name)? {
            Some((image, fit)) => finds.add(name, light, image, fit)?,
            None => return Err(missing(named, name, "there beside it")),
        }
    }
    warnings.extend(finds.warning());
    Ok(finds.pairs)
}

fn folder_of(name: &Name) -> Option<PathBuf> {
    let text = name.text().replace('\\', "/");
    Path::new(&text).parent().filter(|path| !path.as_os_str().is_empty()).map(Path::to_owned)
}

/// The named ones of the given pictures. Lights whose picture is not given are left out, as are pictures that the list does
/// not name; both at once is a mistake in a name.
fn among(
    named: &Named,
    images: &[&PathBuf],
    warnings: &mut Vec<String>,
) -> Result<Vec<Pair>, ImportError> {
    let mut once: Vec<PathBuf> = Vec::new();
    for image in images {
        if !once.contains(image) {
            once.push((*image).clone());
        }
    }
    if once.len() < images.len() {
        warnings.push("some pictures are given twice; each is used once".to_owned());
    }
    let pool = Pool::new(once.clone());
    let mut finds = Finds::new(named);
    let mut unseen: Vec<&Name> = Vec::new();
    for (light, name) in named.names.iter().enumerate() {
        match pool.find(named, name)? {
            Some((image, fit)) => finds.add(name, light, image, fit)?,
            None => unseen.push(name),
        }
    }
    let left: Vec<String> = once
        .iter()
        .filter(|image| finds.pairs.iter().all(|pair| pair.image != **image))
        .map(|image| image.file_name().unwrap_or_default().to_string_lossy().into_owned())
        .collect();
    let list = named.list.display();
    if let Some(first) = unseen.first() {
        if !left.is_empty() {
            return Err(missing(named, first, "among the pictures given"));
        }
        warnings.push(format!(
            "{list}: the pictures given choose {} of its {} lights; the calibration holds these",
            finds.pairs.len(),
            named.names.len()
        ));
    } else if !left.is_empty() {
        warnings.push(format!("left out, since {list} does not name them: {}", in_few(left)));
    }
    warnings.extend(finds.warning());
    Ok(finds.pairs)
}

/// Names in natural order, the first dozen of many.
fn in_few(mut names: Vec<String>) -> String {
    const SHOWN: usize = 12;
    names.sort_by(|a, b| natural_order(a, b));
    let more = names.len().saturating_sub(SHOWN);
    names.truncate(SHOWN);
    let shown = names.join(", ");
    if more == 0 { shown } else { format!("{shown} and {more} more") }
}

fn in_natural_order(
    list: &LightList,
    images: &[&PathBuf],
    options: &Options,
) -> Result<Vec<Pair>, ImportError> {
    let lights = list.directions.len();
    if LIGHT_COUNT.contains(&lights) && images.len() != lights {
        let what = format!("{} pictures were given", images.len());
        return Err(ImportError::Count { path: options.lights.clone(), lights, what });
    }
    let mut images: Vec<PathBuf> = images.iter().map(|image| (*image).clone()).collect();
    images.sort_by(|a, b| natural_order(&a.to_string_lossy(), &b.to_string_lossy()));
    // A list of an impossible length is refused by the caller, whatever was given.
    images.resize(lights, PathBuf::new());
    Ok(images.into_iter().enumerate().map(|(light, image)| Pair { image, light }).collect())
}

/// Pairs of a list with names, as they are found.
struct Finds<'a> {
    named: &'a Named,
    pairs: Vec<Pair>,
    /// Line by file.
    lines: HashMap<PathBuf, usize>,
    /// The first name whose file has another extension, with that file, and how many there are.
    renamed: Option<(String, String)>,
    renamed_count: usize,
}

impl<'a> Finds<'a> {
    fn new(named: &'a Named) -> Self {
        let (pairs, lines) = (Vec::new(), HashMap::new());
        Self { named, pairs, lines, renamed: None, renamed_count: 0 }
    }

    fn add(
        &mut self,
        name: &Name,
        light: usize,
        image: &Path,
        fit: Fit,
    ) -> Result<(), ImportError> {
        if let Some(line) = self.lines.insert(image.to_owned(), name.line) {
            let place = format!("the picture of line {line} already; give every light its own");
            return Err(ImportError::NamedTwice {
                path: self.named.list.clone(),
                line: name.line,
                name: name.text().to_owned(),
                place,
            });
        }
        if fit == Fit::Stem {
            let file = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
            self.renamed.get_or_insert_with(|| (last_part(name.text()).to_owned(), file));
            self.renamed_count += 1;
        }
        self.pairs.push(Pair { image: image.to_owned(), light });
        Ok(())
    }

    fn warning(&self) -> Option<String> {
        let (name, file) = self.renamed.as_ref()?;
        let list = self.named.list.display();
        let more = match self.renamed_count {
            1 => String::new(),
            count => format!(", and so for {} others", count - 1),
        };
        Some(format!("{list}: names {name}, which is not there; {file} was taken{more}"))
    }
}

fn missing(named: &Named, name: &Name, place: &str) -> ImportError {
    ImportError::NamedMissing {
        path: named.list.clone(),
        line: name.line,
        name: name.text().to_owned(),
        place: place.to_owned(),
    }
}

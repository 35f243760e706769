//! Two lights that are taken for each other: noticed on every cloth, whichever two they are, and never suspected where
//! nothing is wrong.

use crate::photograph::{Field, LIGHTS, Scan};
use crate::thorough;
use weavelight::simulate::Material;
use weavelight::solve::Scene;
use weavelight_sim::cloth::Preset;

fn swap(scene: &mut Scene, a: usize, b: usize) {
    let frames = std::mem::take(&mut scene.lights[a].exposures);
    let others = std::mem::replace(&mut scene.lights[b].exposures, frames);
    scene.lights[a].exposures = others;
}

/// Pairs that are not named, and lights that are suspected besides; of every four pairs the one whose turn it is.
fn missed(scene: &Scene, turn: usize) -> Vec<String> {
    let mut missed = vec![];
    let pairs = (0..LIGHTS).flat_map(|a| (a + 1..LIGHTS).map(move |b| (a, b)));
    for (_, (a, b)) in pairs.enumerate().filter(|(k, _)| thorough::runs(*k, 4, turn)) {
        let mut scene = scene.clone();
        swap(&mut scene, a, b);
        let warnings = scene.leave_out_what_adds_nothing().unwrap();
        let expected = format!("Lights {a} and {b} seem to be swapped");
        if !matches!(warnings.as_slice(), [only] if only.starts_with(&expected)) {
            missed.push(format!("{a}-{b}: {}", warnings.join(" ")));
        }
    }
    missed
}

#[test]
fn any_swapped_pair_is_named_on_every_cloth() {
    let mut all = vec![];
    for (cloth, preset) in Preset::ALL.into_iter().enumerate() {
        for (field, seed) in [(Field::Close, 1), (Field::Whole, 2)] {
            let material = Material { preset, ..Material::default() };
            let scan = Scan::new(field, [264, 176], material, |options| options.seed = seed);
            let (scene, warnings) = scan.load();
            let mut wrong = missed(&scene, cloth + seed as usize);
            println!("{} {field:?}: {} missed", preset.name(), wrong.len());
            wrong.extend(warnings.iter().map(|warning| format!("nothing swapped: {warning}")));
            all.extend(wrong.into_iter().map(|text| format!("{} {field:?} {text}", preset.name())));
        }
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn with_three_lights_it_cannot_be_told() {
    let material = Material { preset: Preset::Facets, ..Material::default() };
    let (mut scene, _) = Scan::new(Field::Close, [96, 64], material, |_| {}).load();
    scene.lights.truncate(3);
    swap(&mut scene, 0, 1);
    let warnings = scene.leave_out_what_adds_nothing().unwrap().join("\n");
    assert!(
        warnings.contains("nothing can tell whether one of them failed or two were swapped"),
        "{warnings}"
    );
}

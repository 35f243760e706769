//! A solve looked at closely says what the whole solve did.

use super::*;
use crate::photometry::{Part, Photosite, Sample, is_solved};

/// float32, summed in another order at most.
const SAME: f32 = 1e-6;

/// What grazing light may still send, share of the brightest sample: more of it and the solver asks for the subset test.
const GRAZING: f32 = 0.05;

/// Checks a scene; the samples that were set aside as turned away.
fn check(recipe: Recipe) -> usize {
    let mut scene = scene(recipe);
    let mask = (0..scene.width * scene.height).map(|k| k % scene.width > 6).collect();
    scene.mask = Some(Image { width: scene.width, height: scene.height, data: mask });
    let maps = solve(&scene, Method::Auto);
    let mut turned_away = 0;
    let looked = Rows::with_method(&scene, Method::Auto, |rows| {
        let residual = rows.residual_of(2);
        for (y, x) in
            (0..scene.height).step_by(7).flat_map(|y| (0..scene.width).map(move |x| (y, x)))
        {
            let alone = rows.photosite([x, y]).unwrap();
            let at = format!("{recipe:?} ({x}, {y})");
            assert_eq!(alone.outcome, *maps.outcome.at(x, y), "{at}");
            let whole = maps.normal.at(x, y);
            assert!((0..3).all(|c| (alone.normal[c] - whole[c]).abs() <= SAME), "{at}");
            turned_away += check_parts(&alone, &at);
            let sample = alone.samples[2];
            let expected = sample.measured.zip(sample.predicted).map(|(m, p)| m - p);
            let found = Some(*residual.at(x, y)).filter(|r| r.is_finite());
            let far = expected.zip(found).is_some_and(|(a, b)| (a - b).abs() > 1e-5);
            assert!(expected.is_some() == found.is_some() && !far, "{at}: {expected:?} {found:?}");
        }
        assert_eq!(rows.photosite([scene.width, 0]), None);
        rows.picture_of(2)
    });
    // The picture of a light is what the light measures.
    let picture = looked.unwrap();
    let bright = picture.data.iter().filter(|rgb| rgb.iter().all(|c| *c > 0.0)).count();
    assert!(bright > picture.data.len() / 2, "{recipe:?}: {bright} bright pixels");
    turned_away
}

/// Checks that every part agrees with the outcome; the samples that were set aside as turned away.
fn check_parts(photosite: &Photosite, at: &str) -> usize {
    let count = |part| photosite.samples.iter().filter(|sample| sample.part == part).count();
    let dropped = count(Part::TooDark) + count(Part::TooBright);
    match photosite.outcome {
        Outcome::Fitted => assert_eq!(dropped, 0, "{at}: {photosite:?}"),
        Outcome::Shadow | Outcome::Highlight => assert!(dropped > 0, "{at}: {photosite:?}"),
        Outcome::Masked => assert_eq!(count(Part::Unusable), photosite.samples.len(), "{at}"),
        _ => {}
    }
    if is_solved(photosite.outcome) {
        assert!(count(Part::Used) >= 3, "{at}");
    }
    let measured = |sample: &Sample| sample.measured.unwrap_or(0.0);
    let brightest = photosite.samples.iter().map(measured).fold(0.0, f32::max);
    for sample in photosite.samples.iter().filter(|sample| sample.part == Part::TurnedAway) {
        let most = GRAZING * brightest;
        let predicted = sample.predicted.unwrap_or(0.0);
        assert!(predicted <= most && measured(sample) <= most, "{at}: {photosite:?}");
    }
    count(Part::TurnedAway)
}

#[test]
fn a_photosite_alone_is_solved_as_in_the_whole_picture() {
    let mosaic = Recipe { gain_maps: true, ambient: true, ..Recipe::default() };
    let turned_away = check(mosaic)
        + check(Recipe { exposures: 2, ..mosaic })
        + check(Recipe { layout: Layout::Grey, directional: true, ..Recipe::default() })
        + check(Recipe { layout: Layout::Rgb, ..Recipe::default() });
    assert!(turned_away > 0, "nothing here turns away from any light");
}

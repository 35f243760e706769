use super::*;
use crate::device::look::Channel;
use crate::device::scan::plan::tests::reference_rig;

/// A frame of this brightness whose sketch leans towards `side`.
fn look(mean: f64, side: f64) -> Look {
    let channel = Channel { name: "G", mean, high: 1.5 * mean, ..Channel::default() };
    let sketch = (0..100).map(|k| (mean * (1.0 + side * f64::from(k) / 100.0)) as f32).collect();
    Look { size_px: [32, 32], channels: vec![channel], sharpness: 0.2, sketch }
}

/// A good scan: what each step shows.
fn good(step: &Step) -> Look {
    match step.light {
        None => look(0.01, 0.0),
        Some(light) => look(0.01 + 0.3 * step.factor, -0.3 + 0.07 * light as f64),
    }
}

/// Runs a whole scan of which some steps show something else; every judgement that is not good, and the advice.
fn scan(bracket: &[f64], change: impl Fn(&Step) -> Option<Look>) -> (Vec<String>, Vec<String>) {
    let plan = Plan::new(&reference_rig(), bracket).unwrap();
    let mut assessor = Assessor::new(&plan);
    let mut judged = Vec::new();
    for (k, step) in plan.steps.iter().enumerate() {
        for (k, judgement) in assessor.add(k, change(step).unwrap_or_else(|| good(step))) {
            if let Judgement::Dark(why) = judgement {
                judged.push(format!("{}: {why}", plan.steps[k].stem));
            }
        }
    }
    (judged, assessor.advice())
}

#[test]
fn a_good_scan_has_nothing_to_say() {
    assert_eq!(scan(&[], |_| None), (vec![], vec![]));
    assert_eq!(scan(&[0.1, 2.0], |_| None), (vec![], vec![]));
}

#[test]
fn a_light_that_stays_dark_is_found_wherever_it_is() {
    for light in [0, 1, 5, 9] {
        for mean in [0.01, 0.0101, 0.02] {
            let (judged, _) = scan(&[], |step| {
                (step.light == Some(light) && !step.drift_check).then(|| look(mean, 0.0))
            });
            assert_eq!(judged.len(), 1, "light {light} at {mean}: {judged:?}");
            // Before two others are known, the exposure may be to blame.
            let unknown = light < 2 && mean < 0.02;
            let why = if unknown { ": the picture shows no light" } else { " stays dark" };
            assert_eq!(judged[0].find(&format!("light-{light:02}: light {light}{why}")), Some(0));
        }
    }
    let (judged, _) =
        scan(&[0.1], |step| (step.light == Some(4)).then(|| look(0.01 * step.factor, 0.0)));
    assert_eq!(judged.len(), 2, "{judged:?}");
}

#[test]
fn a_weak_light_is_no_dark_one() {
    let weak = |step: &Step| (step.light == Some(3)).then(|| look(0.06, 0.1));
    assert_eq!(scan(&[], weak).0, Vec::<String>::new());
}

#[test]
fn advice() {
    let check = |change: &dyn Fn(&Step) -> Option<Look>, expected: &str| {
        let (_, advice) = scan(&[], change);
        assert_eq!(advice.len(), 1, "{expected}: {advice:?}");
        assert!(advice[0].contains(expected), "{advice:?}");
    };
    check(
        &|step| (step.light == Some(7)).then(|| good(&Step { light: Some(2), ..step.clone() })),
        "Lights 2 and 7 give the same picture",
    );
    check(&|step| step.light.is_none().then(|| look(0.12, 0.0)), "darken the room");
    check(
        &|step| {
            let mut look = good(step);
            look.channels[0].clipped = if step.light == Some(8) { 0.02 } else { 0.0 };
            Some(look)
        },
        "2.0 % of the samples clip under light 8",
    );
    check(
        &|step| Some(look(0.3 * good(step).mean(), -0.3 + 0.07 * step.light.unwrap_or(0) as f64)),
        "reaches 14 % of full scale only",
    );
    check(
        &|step| step.drift_check.then(|| Look { sharpness: 0.1, ..good(step) }),
        "The last frame is blurred",
    );
}

#[test]
fn where_nothing_is_lit_no_single_light_is_blamed() {
    let plan = Plan::new(&reference_rig(), &[]).unwrap();
    let mut assessor = Assessor::new(&plan);
    for k in 0..4 {
        assert!(!assessor.nothing_is_lit(), "after {k} frames");
        let judged = assessor.add(k, look(0.0101, 0.0));
        let blamed = |(_, judgement): &(usize, Judgement)| match judgement {
            Judgement::Dark(why) => why.contains("LED"),
            _ => false,
        };
        assert!(!judged.iter().any(blamed), "{judged:?}");
    }
    assert!(assessor.nothing_is_lit());
    // A weak light is light: then one that stays dark is at fault.
    let mut assessor = Assessor::new(&plan);
    for (k, step) in plan.steps.iter().enumerate() {
        let mean = if step.light == Some(2) { 0.01 } else { 0.0112 };
        assessor.add(k, step.light.map_or(look(0.01, 0.0), |_| look(mean, 0.0)));
    }
    assert!(!assessor.nothing_is_lit());
    assert!(assessor.why_dark(3).is_none(), "it was taken out");
}

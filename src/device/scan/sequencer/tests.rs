use super::*;
use crate::device::scan::plan::tests::reference_rig;
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

const SECOND: Duration = Duration::from_secs(1);

fn sequencer() -> Sequencer {
    Sequencer::new(&Plan::new(&reference_rig(), &[]).unwrap(), &[])
}

fn passing() -> Trouble {
    Trouble::Passing("it happened".to_owned())
}

/// Goes on with everything as it should be until `until` is due, and returns what was done.
fn go(sequencer: &mut Sequencer, until: &Action) -> Vec<Action> {
    let mut done = Vec::new();
    loop {
        let action = sequencer.next(Duration::ZERO);
        if action == *until || matches!(action, Action::End(_)) || done.len() > 1000 {
            done.push(action);
            return done;
        }
        sequencer.tell(well(sequencer, &action), Duration::ZERO);
        if let Action::Keep(step) = action {
            sequencer.tell(Input::Judged(step, Judgement::Good), Duration::ZERO);
        }
        done.push(action);
    }
}

/// What happens when all is well.
fn well(sequencer: &Sequencer, action: &Action) -> Input {
    match action {
        Action::Light(_) => Input::Lit,
        Action::Expose(step) => {
            let pins = Some(sequencer.tracks[*step].step.pins());
            Input::Exposed { open: pins, close: pins, interruptions: vec![] }
        }
        Action::Keep(_) => Input::Kept,
        Action::FindBoard => Input::BoardBack,
        Action::Rest => Input::Continue,
        other => panic!("{other:?}"),
    }
}

#[test]
fn light_then_shutter_then_disk_for_each_step() {
    let mut sequencer = sequencer();
    let done = go(&mut sequencer, &Action::FindBoard);
    let expected = (0..12)
        .flat_map(|k| [Action::Light(k), Action::Expose(k), Action::Keep(k)])
        .chain([Action::End(Ending::Complete)]);
    assert_eq!(done, expected.collect::<Vec<_>>());
    assert!((0..12).all(|step| sequencer.attempts(step) == 1));
}

/// At step 3, `input` in place of what should come at `at`: the reason noted, and the frame taken again.
fn check_again(at: &Action, input: Input, reason: &str) {
    let mut sequencer = sequencer();
    go(&mut sequencer, at);
    sequencer.tell(input, SECOND);
    if sequencer.next(SECOND) == Action::FindBoard {
        sequencer.tell(Input::BoardBack, SECOND);
    }
    assert_eq!(sequencer.next(SECOND), Action::Light(3), "{reason}");
    assert_eq!(sequencer.reasons(3), [reason]);
    let done = go(&mut sequencer, &Action::Rest);
    assert_eq!(done.last(), Some(&Action::End(Ending::Complete)));
    assert_eq!(sequencer.attempts(3), 2);
}

#[test]
fn what_makes_a_frame_void() {
    let exposed = |open, close, interruptions| Input::Exposed { open, close, interruptions };
    let (light, expose, keep) = (&Action::Light(3), &Action::Expose(3), &Action::Keep(3));
    let good = Some(4);
    check_again(
        expose,
        exposed(Some(8), good, vec![]),
        "at shutter open the outputs read 00008 instead of 00004",
    );
    check_again(
        expose,
        exposed(good, Some(0), vec![]),
        "at shutter close the outputs read 00000 instead of 00004",
    );
    check_again(
        expose,
        exposed(good, None, vec![]),
        "at shutter close the outputs read nothing instead of 00004",
    );
    let interruptions = [
        (Interruption::Booted { cause: "WATCHDOG".into() }, "the light board restarted (WATCHDOG)"),
        (
            Interruption::WentDark { reason: "SILENCE".into() },
            "the light board went dark (SILENCE)",
        ),
        (
            Interruption::LightsChanged { expected: 4, read: 0 },
            "the outputs changed from 00004 to 00000",
        ),
        (Interruption::Silent, "the light board did not answer"),
        (Interruption::Unplugged, "the light board was unplugged"),
    ];
    for (interruption, reason) in interruptions {
        check_again(expose, exposed(good, good, vec![interruption]), reason);
    }
    check_again(light, Input::NotLit(passing()), "it happened");
    check_again(light, Input::NotLit(Trouble::NoBoard("it was pulled".into())), "it was pulled");
    check_again(expose, Input::NotExposed(passing()), "it happened");
    check_again(keep, Input::NotKept(passing()), "it happened");
    let trigger_closed = exposed(Some(4 | 1 << 17), good, vec![]);
    let mut fine = sequencer();
    go(&mut fine, expose);
    fine.tell(trigger_closed, SECOND);
    assert_eq!(fine.next(SECOND), *keep);
}

#[test]
fn what_ends_a_scan() {
    let check = |inputs: &[(Action, Input)], ending: Ending| {
        let mut sequencer = sequencer();
        for (at, input) in inputs {
            go(&mut sequencer, at);
            sequencer.tell(input.clone(), SECOND);
        }
        assert_eq!(sequencer.next(SECOND), Action::End(ending));
    };
    let failed = || Ending::Failed(3);
    check(&[(Action::Expose(3), Input::NotExposed(Trouble::Lasting))], failed());
    check(&[(Action::Keep(3), Input::NotKept(Trouble::Lasting))], failed());
    check(&vec![(Action::Expose(3), Input::NotExposed(passing())); 5], failed());
    check(
        &[
            (Action::Light(3), Input::NotLit(Trouble::NoBoard("gone".into()))),
            (Action::FindBoard, Input::BoardLost),
        ],
        failed(),
    );
    check(&[(Action::Expose(3), Input::Abort)], Ending::Aborted);
}

#[test]
fn a_pause_comes_after_the_frame_under_way() {
    let mut sequencer = sequencer();
    go(&mut sequencer, &Action::Expose(3));
    sequencer.tell(Input::Pause, SECOND);
    let done = go(&mut sequencer, &Action::Rest);
    assert_eq!(done, [Action::Expose(3), Action::Keep(3), Action::Rest]);
    sequencer.tell(Input::Continue, SECOND);
    assert_eq!(sequencer.next(SECOND), Action::Light(4));
}

#[test]
fn a_dark_light_is_tried_again_and_then_left_out() {
    let mut sequencer = sequencer();
    let dark = || Input::Judged(3, Judgement::Dark("no light".into()));
    go(&mut sequencer, &Action::Light(6));
    sequencer.tell(dark(), SECOND);
    sequencer.tell(dark(), SECOND); // of the same frame: counts once
    assert_eq!(go(&mut sequencer, &Action::Light(3)).last(), Some(&Action::Light(3)));
    go(&mut sequencer, &Action::Keep(3));
    sequencer.tell(Input::Kept, SECOND);
    sequencer.tell(dark(), SECOND);
    assert_eq!(sequencer.next(SECOND), Action::Drop(3));
    let done = go(&mut sequencer, &Action::Rest);
    assert_eq!(done.last(), Some(&Action::End(Ending::Incomplete(vec![3]))));
    assert_eq!(sequencer.reasons(3), ["no light", "no light"]);
}

#[test]
fn the_end_waits_for_every_judgement() {
    let plan = Plan::new(&reference_rig(), &[]).unwrap();
    let finished: Vec<usize> = (0..12).collect();
    let mut sequencer = Sequencer::new(&plan, &finished);
    for step in 0..12 {
        assert_eq!(sequencer.next(SECOND), Action::AwaitJudgement);
        sequencer.tell(Input::Judged(step, Judgement::Good), SECOND);
    }
    assert_eq!(sequencer.next(SECOND), Action::End(Ending::Complete));
}

#[test]
fn what_is_finished_is_not_taken_again() {
    let plan = Plan::new(&reference_rig(), &[]).unwrap();
    let mut sequencer = Sequencer::new(&plan, &[0, 1, 2, 7]);
    for step in [0, 1, 2, 7] {
        sequencer.tell(Input::Judged(step, Judgement::Good), SECOND);
    }
    let lit: Vec<usize> = go(&mut sequencer, &Action::Rest)
        .into_iter()
        .filter_map(|action| if let Action::Light(step) = action { Some(step) } else { None })
        .collect();
    assert_eq!(lit, [3, 4, 5, 6, 8, 9, 10, 11]);
}

#[test]
fn time_left_is_what_frames_took_so_far() {
    let mut sequencer = sequencer();
    assert_eq!(sequencer.time_left(), None);
    for frame in 0..3u32 {
        for phase in 0..3u32 {
            let now = SECOND * (6 * frame + 2 * phase);
            let action = sequencer.next(now);
            sequencer.tell(well(&sequencer, &action), now);
        }
    }
    assert_eq!(sequencer.time_left(), Some(SECOND * 4 * 9));
}

/// Four hours of scans on their own clock, with every fault there is at random: each ends; only frames that were lit right at
/// both ends, without interruption, are kept; and every complete scan has each frame once.
#[test]
fn four_hours_of_scans() {
    let mut random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let (mut now, mut scans, mut complete, mut frames) = (Duration::ZERO, 0u32, 0u32, 0u32);
    while now < 4 * 3600 * SECOND {
        let mut sequencer = sequencer();
        let mut right = [false; 12];
        for turn in 0.. {
            assert!(turn < 10_000, "a scan without end");
            let action = sequencer.next(now);
            now += Duration::from_millis(u64::from(random.next_u32() % 700));
            let fault = random.next_u32() % 100;
            let mut judged = None;
            let input = match (&action, fault) {
                (Action::End(ending), _) => {
                    complete += u32::from(*ending == Ending::Complete);
                    if *ending == Ending::Complete {
                        assert_eq!(right, [true; 12]);
                    }
                    break;
                }
                (Action::Drop(step), _) => {
                    right[*step] = false;
                    continue;
                }
                (Action::AwaitJudgement, _) => panic!("everything is judged at once"),
                (Action::Light(_), 0) => Input::NotLit(passing()),
                (Action::Light(_), 1) => Input::NotLit(Trouble::NoBoard("gone".into())),
                (Action::FindBoard, 0) => Input::BoardLost,
                (Action::Expose(_), 0) => Input::NotExposed(passing()),
                (Action::Expose(step), 1..4) => {
                    let pins = sequencer.tracks[*step].step.pins();
                    let (open, close) = [(Some(pins), None), (Some(pins ^ 2), Some(pins))]
                        [(random.next_u32() % 2) as usize];
                    Input::Exposed { open, close, interruptions: vec![] }
                }
                (Action::Expose(step), 4) => {
                    let pins = Some(sequencer.tracks[*step].step.pins());
                    let interruptions = vec![Interruption::Silent];
                    Input::Exposed { open: pins, close: pins, interruptions }
                }
                (Action::Keep(_), 0) => Input::NotKept(passing()),
                (Action::Keep(step), 1) => {
                    judged = Some((*step, Judgement::Bad("damaged".into())));
                    Input::Kept
                }
                (Action::Keep(step), 2) => {
                    judged = Some((*step, Judgement::Dark("dark".into())));
                    Input::Kept
                }
                (Action::Keep(step), _) => {
                    judged = Some((*step, Judgement::Good));
                    right[*step] = true;
                    frames += 1;
                    Input::Kept
                }
                (action, _) => well(&sequencer, action),
            };
            let keeping = matches!(action, Action::Keep(_));
            sequencer.tell(input, now);
            if let Some((step, judgement)) = judged.filter(|_| keeping) {
                sequencer.tell(Input::Judged(step, judgement), now);
            }
        }
        scans += 1;
    }
    println!("{scans} scans, {complete} complete, {frames} frames in four hours");
    assert!(complete > scans / 2 && scans > 500, "{complete} of {scans}");
}

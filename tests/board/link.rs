//! The board at a port: the real serial port crate, a pseudo-terminal, and the real firmware behind it.

use crate::simboard::{BOOTLOADER, SimBoard};
use serialport::SerialPort;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use weavelight::device::board::wire::{LIGHTS_MAX, seal};
use weavelight::device::board::{Board, Interruption, PortChoice, SimulatedBoard, diagnose};

/// What the light must be after an interruption, in seconds of the board's clock: the limit.
const DARK_AFTER_US: u64 = 1_000_000;

fn open(sim: &SimBoard) -> Board {
    Board::open(PortChoice::Path(sim.port()), Some(10)).unwrap()
}

fn light(board: &Board, light: u8) {
    let shown = board.light(light, None).unwrap();
    assert_eq!(shown.outputs.lights(), 1 << light);
}

#[test]
fn ten_lights_and_the_rest() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let board = open(&sim);
    assert_eq!(board.identity().lights, Some(10));
    for number in 0..10 {
        light(&board, number);
        assert_eq!(sim.pins().1, 1 << number);
    }
    assert_eq!(board.back_light(None).unwrap().outputs.pins, 1 << 16);
    assert_eq!(board.light(3, Some(128)).unwrap().outputs.pins, 8);
    assert_eq!(board.off().unwrap().outputs.pins, 0);
    assert_eq!(board.trigger(200).unwrap().outputs.pins, 1 << 17);
    let refused = board.light(LIGHTS_MAX - 1, None).unwrap_err();
    assert!(refused.to_string().contains("does not have that output"), "{refused}");
    assert_eq!(board.take_interruptions(), []);
    light(&board, 7);
    drop(board);
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(sim.pins().1, 0, "dark when the program ends");
}

#[test]
fn a_light_stays_on_while_the_caller_is_busy() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let board = open(&sim);
    light(&board, 5);
    sim.edges();
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(sim.edges(), []);
    assert_eq!(board.outputs().unwrap().outputs.pins, 1 << 5);
    assert_eq!(board.take_interruptions(), []);
}

/// Started by the next test in a process of its own; waits to be killed.
#[test]
#[ignore = "a part of the test below"]
fn hold_a_light() {
    let Some(port) = std::env::var_os("WEAVELIGHT_TEST_PORT") else { return };
    let board = Board::open(PortChoice::Path(port.into()), Some(10)).unwrap();
    light(&board, 3);
    std::thread::sleep(Duration::from_secs(60));
}

#[test]
fn a_killed_program_leaves_the_board_dark() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "link::hold_a_light", "--ignored"])
        .env("WEAVELIGHT_TEST_PORT", sim.port())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    sim.wait_for_pins(8);
    std::thread::sleep(Duration::from_millis(700));
    let (killed_us, pins) = sim.pins();
    assert_eq!(pins, 8, "lit until then");
    sim.edges();
    child.kill().unwrap();
    child.wait().unwrap();
    sim.wait_for_pins(0);
    let dark_us = sim.edges()[0].0;
    println!("dark {} ms after the program was killed", (dark_us - killed_us) / 1000);
    assert!(dark_us - killed_us < DARK_AFTER_US);
}

/// A fault while light 3 is on: within a second the light is off or still the right one, the program learns of it, and the
/// next light works.
fn check_fault(fault: &[&str], expected: &[Interruption]) {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let board = open(&sim);
    light(&board, 3);
    sim.edges();
    let (start_us, _) = sim.pins();
    for command in fault {
        match command.strip_prefix("sleep ") {
            Some(ms) => std::thread::sleep(Duration::from_millis(ms.parse().unwrap())),
            None => drop(sim.command(command)),
        }
    }
    board.wait_until_connected(Duration::from_secs(20)).unwrap();
    // A command may meet the end of the fault; the board is asked again as a scan would.
    let start = Instant::now();
    while let Err(error) = board.light(4, None) {
        assert!(start.elapsed() < Duration::from_secs(20), "{fault:?}: {error}");
        board.wait_until_connected(Duration::from_secs(20)).unwrap();
    }
    let interruptions = board.take_interruptions();
    println!("{fault:?}: {interruptions:?}");
    for one in expected {
        assert!(interruptions.contains(one), "{fault:?}: {one:?} is not among {interruptions:?}");
    }
    let edges = sim.edges();
    println!("{fault:?}: dark {:?} ms later", edges.first().map(|edge| (edge.0 - start_us) / 1000));
    assert!(edges.iter().all(|edge| [0, 8, 16].contains(&edge.1)), "{fault:?}: {edges:?}");
    assert!(
        edges.first().is_some_and(|edge| edge.0 - start_us < DARK_AFTER_US),
        "{fault:?}: {edges:?}"
    );
    assert_eq!(sim.pins().1, 16);
}

#[test]
fn a_hung_program_on_the_board() {
    check_fault(&["hang", "sleep 600"], &[Interruption::Booted { cause: "WATCHDOG".to_owned() }]);
}

#[test]
fn the_reset_button() {
    check_fault(&["reset", "sleep 200"], &[Interruption::Booted { cause: "RESET".to_owned() }]);
}

#[test]
fn a_cable_cut_for_a_moment() {
    check_fault(
        &["mute 1", "sleep 1000", "mute 0", "sleep 300"],
        &[Interruption::LightsChanged { expected: 8, read: 0 }],
    );
}

#[test]
fn a_cable_cut_for_long() {
    check_fault(
        &["mute 1", "sleep 4000", "mute 0"],
        &[Interruption::Silent, Interruption::Unplugged],
    );
}

#[test]
fn unplugged_and_plugged_in_again() {
    check_fault(&["unplug 800", "sleep 300"], &[Interruption::Unplugged]);
}

#[test]
fn a_board_that_takes_long_to_start() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    sim.command("boot-delay 1500");
    let start = Instant::now();
    let board = open(&sim);
    println!("connected after {:?}", start.elapsed());
    light(&board, 1);
}

#[test]
fn the_real_bootloader() {
    let Some(sim) = SimBoard::on_a_port(&["--bootloader", BOOTLOADER]) else { return };
    let start = Instant::now();
    let board = open(&sim);
    println!("connected after {:?}", start.elapsed());
    light(&board, 1);
}

#[test]
fn a_board_that_stands_still_for_a_moment() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let board = open(&sim);
    sim.command("freeze 700");
    let shown = board.light(6, None).unwrap();
    assert!(shown.tries > 1);
    assert_eq!(shown.outputs.pins, 1 << 6);
}

#[test]
fn a_bad_wire() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let board = open(&sim);
    sim.command("seed 7");
    for fault in ["drop 0.005", "flip 0.005", "delay 0.001 20"] {
        sim.command(fault);
    }
    board.off().unwrap();
    sim.edges();
    let (mut tries, count) = (0, 200u8);
    for number in (0..count).map(|i| i % 10) {
        let shown = board.light(number, None).unwrap();
        assert_eq!(shown.outputs.lights(), 1 << number);
        tries += shown.tries;
    }
    let lit: Vec<u32> =
        sim.edges().into_iter().map(|edge| edge.1).filter(|pins| *pins != 0).collect();
    let asked: Vec<u32> = (0..count).map(|i| 1 << (i % 10)).collect();
    assert_eq!(lit, asked, "every light once, in order, and no other");
    println!("{count} lights in {tries} tries");
    assert!(tries > u32::from(count), "the wire was not bad");
}

fn error_at(port: &Path, lights: usize) -> String {
    Board::open(PortChoice::Path(port.to_owned()), Some(lights))
        .map(|_| ())
        .unwrap_err()
        .to_string()
}

#[test]
fn what_is_wrong_with_a_port() {
    let folder = tempfile::tempdir().unwrap();
    let missing = error_at(&folder.path().join("ttyACM9"), 10);
    assert!(missing.contains("ttyACM9: there is no such port"), "{missing}");
    let file = folder.path().join("file");
    std::fs::write(&file, "no port").unwrap();
    let unusable = error_at(&file, 10);
    assert!(unusable.contains("cannot be used as a serial port"), "{unusable}");

    let Some(sim) = SimBoard::on_a_port(&[]) else { return };
    let count = error_at(&sim.port(), 8);
    assert!(count.contains("the board has 10 lights, rig.toml has 8"), "{count}");
    let board = open(&sim);
    let busy = error_at(&sim.port(), 10);
    assert!(busy.contains("another program is using this port"), "{busy}");
    drop(board);
    drop(open(&sim));
}

/// What something that is not our board answers to a request with this number.
type Answer = fn(&str) -> String;

/// Something that is not our board, behind a port of this name.
fn something_else(answer: Answer) -> String {
    let (mut ours, mut theirs) = serialport::TTYPort::pair().unwrap();
    std::thread::spawn(move || {
        let mut bytes = [0; 64];
        loop {
            match ours.read(&mut bytes) {
                Ok(count) => {
                    let heard = String::from_utf8_lossy(&bytes[..count]).trim().to_owned();
                    let said = answer(heard.split(' ').next().unwrap_or_default());
                    let _ = ours.write_all(said.as_bytes());
                }
                // Nobody has it open.
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    });
    theirs.set_exclusive(false).unwrap();
    theirs.name().unwrap()
}

fn error_from(answer: Answer) -> String {
    let findings = diagnose(&PortChoice::Path(something_else(answer).into()), Some(10));
    findings.into_iter().next().unwrap().result.unwrap_err().to_string()
}

#[test]
fn a_port_with_something_else_behind_it() {
    let check = |answer: Answer, expected: &'static str| {
        std::thread::spawn(move || {
            let error = error_from(answer);
            assert!(error.contains(expected), "{error}");
        })
    };
    let checks = [
        check(|_| "echo: Unknown command\n".to_owned(), "it says \"echo: Unknown command\""),
        check(|_| String::new(), "nothing answers"),
        check(
            |seq| seal(&format!("{seq} OK WEAVELIGHT 0.9.2 0 10 -")),
            "firmware 0.9.2 speaks protocol 0, this program 1; load the firmware",
        ),
        check(
            |seq| seal(&format!("{seq} OK WEAVELIGHT 3.0.0 2 10 x y")),
            "protocol 2, this program 1; update",
        ),
        check(
            |seq| seal(&format!("{seq} OK WEAVELIGHT 1.0.0 1 12 LBT")),
            "the board has 12 lights, rig.toml has 10",
        ),
    ];
    for check in checks {
        check.join().unwrap();
    }
}

#[test]
fn doctor_finds_the_board_of_the_rig() {
    let Some(sim) = SimBoard::on_a_port(&[]) else { return };
    let rig = sim.port().with_file_name("rig.toml");
    let doctor = |lights: usize| {
        let mut text = format!(
            "schema = 1\n[camera]\nwidth_px = 64\nheight_px = 48\n[controller]\nkind = \"serial\"\nport = {:?}\n",
            sim.port()
        );
        for i in 0..lights {
            text += &format!(
                "[[lights]]\nposition_mm = [{}.0, {}.0, 400.0]\n",
                100 * (i % 4),
                100 * (i / 4)
            );
        }
        std::fs::write(&rig, text).unwrap();
        let output = assert_cmd::Command::cargo_bin("weavelight")
            .unwrap()
            .arg("doctor")
            .arg("--rig")
            .arg(&rig)
            .output();
        String::from_utf8(output.unwrap().stdout).unwrap()
    };
    let found = doctor(10);
    assert!(
        found.contains("light board with firmware 1.0.0, 10 lights, back light, camera trigger"),
        "{found}"
    );
    let found = doctor(8);
    assert!(found.contains("the board has 10 lights, rig.toml has 8"), "{found}");
}

#[test]
fn a_simulated_board_behaves_as_one_at_a_port() {
    let simulated = SimulatedBoard::new(16);
    let board = Board::open(PortChoice::Simulated(simulated.clone()), Some(16)).unwrap();
    for number in [0, 15, 7] {
        light(&board, number);
        assert_eq!(simulated.pins(), 1 << number);
    }
    std::thread::sleep(Duration::from_millis(700));
    assert_eq!(simulated.pins(), 1 << 7, "kept awake");
    assert_eq!(board.take_interruptions(), []);
    drop(board);
    assert_eq!(simulated.pins(), 0);
    let error = Board::open(PortChoice::Simulated(simulated), Some(10)).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("the board has 16 lights"), "{error}");
}

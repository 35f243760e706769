//! PROTOCOL.md's exchanges, replayed at both ends.

use crate::exchange::{Host, Step, filled_in, of_protocol, sealed, with_clock};
use crate::simboard::Stepped;
use std::time::Duration;
use weavelight::device::board::BoardModel;
use weavelight::device::board::wire::Line;

#[test]
fn the_host_keeps_to_the_protocol() {
    for (number, steps) in of_protocol() {
        let mut host = Host::new();
        let asks = steps.iter().any(|step| matches!(step, Step::Ask(_)));
        for step in steps {
            println!("exchange {number}: {step:?}");
            match (&step, asks) {
                (_, true) => host.replay(&step),
                // What the host would never send; it must all the same understand the answer.
                (Step::FromBoard(line), false) => {
                    let line = sealed(&with_clock(line, Duration::ZERO));
                    assert!(Line::parse(line.as_bytes()).is_some(), "{line}");
                }
                _ => {}
            }
        }
        assert_eq!(host.next_words(), None, "exchange {number} does not tell everything");
    }
}

#[test]
fn the_firmware_keeps_to_the_protocol() {
    for (number, steps) in of_protocol() {
        let Some(mut board) = Stepped::start() else { return };
        if !matches!(&steps[0], Step::FromBoard(line) if line.starts_with("! BOOT")) {
            board.expect_line("! BOOT POWER*HH");
        }
        for step in steps {
            println!("exchange {number}: {step:?}");
            replay(&mut board, &step);
        }
        assert_eq!(board.next_line(20_000), None, "exchange {number}: the board says more");
    }
}

fn replay(board: &mut Stepped, step: &Step) {
    match step {
        Step::ToBoard(line) => board.send(format!("{line}\n").as_bytes()),
        Step::FromBoard(line) => board.expect_line(line),
        Step::Wait(duration) | Step::Silence(duration) => {
            board.run(u64::try_from(duration.as_micros()).unwrap());
        }
        Step::Reset => board.command("reset"),
        Step::Pins(pins) => assert_eq!(board.pins(), *pins, "pins"),
        Step::Ask(_) | Step::Told(_) => {}
    }
}

#[test]
fn the_simulated_board_keeps_to_the_protocol() {
    for (number, steps) in of_protocol() {
        let mut board = BoardModel::new(10, Duration::ZERO);
        if !matches!(&steps[0], Step::FromBoard(line) if line.starts_with("! BOOT")) {
            board.take_output();
        }
        let mut said = String::from_utf8(board.take_output()).unwrap().trim_start().to_owned();
        let mut now = Duration::ZERO;
        for step in steps {
            println!("exchange {number}: {step:?}");
            now += Duration::from_millis(4);
            match step {
                Step::ToBoard(line) => board.receive(format!("{line}\n").as_bytes(), now),
                Step::Wait(duration) | Step::Silence(duration) => {
                    now += duration;
                    board.advance(now);
                }
                Step::Reset => board.reset(now),
                Step::Pins(pins) => assert_eq!(board.pins(), pins),
                Step::FromBoard(pattern) => {
                    let line = said.lines().next().unwrap_or_default().to_owned();
                    assert_eq!(line, filled_in(&pattern, &line));
                    said.drain(..=line.len());
                }
                Step::Ask(_) | Step::Told(_) => {}
            }
            said += String::from_utf8(board.take_output()).unwrap().trim_start();
        }
        assert_eq!(said, "", "exchange {number}: the board says more");
    }
}

//! The firmware by itself, in simulated time: what turns the light off, break before make, levels, restarts.

use crate::simboard::Stepped;
use weavelight::device::board::wire::{Request, seal};

fn started() -> Option<Stepped> {
    let mut board = Stepped::start()?;
    board.expect_line("! BOOT POWER*HH");
    Some(board)
}

fn light(board: &mut Stepped, seq: u16, light: u8, level: Option<u8>) {
    board.send(Request::Light { light, level }.line(seq).as_bytes());
    board.expect_line(&format!("{seq} OK {:05X} <ms>*HH", 1 << light));
}

#[test]
fn lights_go_off_half_a_second_after_the_last_word() {
    let Some(mut board) = started() else { return };
    light(&mut board, 1, 3, None);
    for seq in 2..8 {
        board.run(450_000);
        board.send(Request::Ping.line(seq).as_bytes());
        board.expect_line(&format!("{seq} OK 00008 <ms>*HH"));
    }
    let spoke_us = board.now_us();
    board.edges();
    board.expect_line("! SAFE SILENCE*HH");
    let edges = board.edges();
    assert_eq!(edges.len(), 1, "{edges:?}");
    let after_ms = (edges[0].0 - spoke_us) as f64 / 1000.0;
    println!("dark {after_ms:.2} ms after the last word");
    assert!((495.0..505.0).contains(&after_ms), "dark after {after_ms} ms");
}

#[test]
fn nothing_but_valid_lines_keeps_the_light_on() {
    let Some(mut board) = started() else { return };
    light(&mut board, 1, 3, None);
    for _ in 0..10 {
        board.run(60_000);
        board.send(b"2 PING*00\n3 PING\nnoise");
    }
    assert_eq!(board.pins(), 0);
}

#[test]
fn old_light_off_before_new_light_on() {
    let Some(mut board) = started() else { return };
    for (seq, next) in (1..).zip([0, 1, 9, 4, 4, 2]) {
        light(&mut board, seq, next, None);
    }
    board.send(seal("9 BACK").as_bytes());
    board.expect_line("9 OK 10000 <ms>*HH");
    let edges = board.edges();
    let lit: Vec<u32> = edges.iter().map(|edge| edge.1).filter(|pins| *pins != 0).collect();
    assert_eq!(lit, [1, 2, 512, 16, 4, 1 << 16]);
    assert!(edges.iter().all(|edge| edge.1.count_ones() <= 1));
    let gaps: Vec<u64> =
        edges.windows(2).filter(|pair| pair[0].1 == 0).map(|pair| pair[1].0 - pair[0].0).collect();
    println!("breaks in microseconds: {gaps:?}");
    assert_eq!(gaps.len(), 5);
    assert!(gaps.iter().all(|gap| (50..200).contains(gap)), "{gaps:?}");
}

#[test]
fn a_light_is_acknowledged_after_it_has_settled() {
    let Some(mut board) = started() else { return };
    board.send(seal("1 SET SETTLE 00020").as_bytes());
    board.expect_line("1 OK 20*HH");
    light(&mut board, 2, 3, None);
    let on_us = board.edges()[0].0;
    let settled_ms = (board.now_us() - on_us) as f64 / 1000.0;
    assert!((19.0..24.0).contains(&settled_ms), "acknowledged after {settled_ms} ms");
}

#[test]
fn settings_outlive_a_restart_and_lights_do_not() {
    let Some(mut board) = started() else { return };
    board.send(seal("1 SET SETTLE 00007").as_bytes());
    board.expect_line("1 OK 7*HH");
    light(&mut board, 2, 3, None);
    board.command("reset");
    board.expect_line("! BOOT RESET*HH");
    assert_eq!(board.pins(), 0);
    board.send(seal("3 GET SETTLE").as_bytes());
    board.expect_line("3 OK 7*HH");
}

#[test]
fn a_level_is_a_share_of_the_time() {
    let Some(mut board) = started() else { return };
    for (seq, level) in (1..).zip([1u8, 64, 128, 254]) {
        light(&mut board, seq, 3, Some(level));
        board.edges();
        board.run(200_000);
        let edges = board.edges();
        let on_us: u64 =
            edges.windows(2).filter(|pair| pair[0].1 != 0).map(|pair| pair[1].0 - pair[0].0).sum();
        let share = on_us as f64 / (edges[edges.len() - 1].0 - edges[0].0) as f64;
        // Two interrupts' worth of a period of 1024 microseconds, and one step.
        assert!((share - f64::from(level) / 256.0).abs() < 0.012, "level {level} is {share}");
    }
    board.send(Request::Light { light: 3, level: None }.line(9).as_bytes());
    board.expect_line("9 OK 00008 <ms>*HH");
    board.edges();
    board.run(100_000);
    assert_eq!(board.edges(), [], "full level has no pulses");
}

#[test]
fn a_program_that_hangs_is_restarted_dark() {
    let Some(mut board) = started() else { return };
    light(&mut board, 1, 3, None);
    board.edges();
    let hung_us = board.now_us();
    board.command("hang");
    board.expect_line("! BOOT WATCHDOG*HH");
    let dark_us = board.edges()[0].0;
    println!("dark {} ms after the program hung", (dark_us - hung_us) / 1000);
    assert!(dark_us - hung_us < 500_000);
    light(&mut board, 2, 4, None);
}

#[test]
fn lights_on_for_too_long_rest() {
    let Some(mut board) = started() else { return };
    board.send(seal("1 SET MAXON 00200").as_bytes());
    board.expect_line("1 OK 200*HH");
    board.send(seal("2 SET REST 00300").as_bytes());
    board.expect_line("2 OK 300*HH");
    light(&mut board, 3, 5, None);
    // Asking again, or for another level, does not start the time again.
    for seq in 4..9 {
        board.run(30_000);
        board.send(Request::Light { light: 5, level: Some(250) }.line(seq).as_bytes());
        board.expect_line(&format!("{seq} OK 00020 <ms>*HH"));
    }
    board.expect_line("! SAFE MAXON*HH");
    board.run(250_000);
    board.send(Request::Light { light: 6, level: None }.line(10).as_bytes());
    board.expect_line("10 ERR 6 INTERLOCK*HH");
    board.run(60_000);
    light(&mut board, 11, 6, None);
}

#[test]
fn a_bootloader_delays_the_first_answer() {
    let Some(mut board) = Stepped::start_with_bootloader() else { return };
    board.command("reset");
    let line = Request::Identify.line(1);
    let mut answered_us = None;
    while answered_us.is_none() && board.now_us() < 5_000_000 {
        board.send(line.as_bytes());
        let arrived = board.run_to_line(200_000);
        if String::from_utf8_lossy(&arrived).contains("WEAVELIGHT") {
            answered_us = Some(board.now_us());
        }
    }
    println!("first answer after {answered_us:?} us");
    assert!(answered_us.is_some());
    board.run(20_000);
    board.run_to_line(0); // answers to what was asked meanwhile
    light(&mut board, 2, 3, None);
}

#[test]
fn a_restart_in_the_middle_of_a_line_is_still_told() {
    let Some(mut board) = started() else { return };
    board.send(Request::Identify.line(1).as_bytes());
    // The request takes 0.8 ms on the wire, the answer 2.9.
    board.run(2_000);
    board.command("reset");
    let cut = board.next_line(100_000).unwrap();
    assert!("1 OK WEAVELIGHT 1.0.0 1 10 LBT*AE".starts_with(&cut) && !cut.contains('*'), "{cut:?}");
    board.expect_line("! BOOT RESET*HH");
}

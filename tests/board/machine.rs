//! The host's end of the protocol: what it makes of good, late, damaged and missing answers.

use crate::exchange::{Host, parse};
use proptest::prelude::*;
use std::time::Duration;
use weavelight::device::board::wire::{Request, crc8, seal};
use weavelight::device::board::{BUDGET, Event, LightBoard};

/// Replays `exchange`; `expected` is everything that the program learns, in order.
fn check(exchange: &str, expected: &[&str]) {
    let mut host = Host::new();
    for step in parse(exchange) {
        host.replay(&step);
    }
    let words: Vec<String> = std::iter::from_fn(|| host.next_words()).collect();
    assert_eq!(words, expected, "{exchange}");
}

#[test]
fn an_answer_counts_if_it_is_the_requests_own() {
    check("ask light 3 | < 1 OK 00008 17*HH", &["lit 3"]);
    check("ask light 3 | < 7 OK 00008 17*HH", &[]);
    check("ask light 3 | < 1 OK 00008 17*HH | ask light 4 | < 1 OK 00010 18*HH", &["lit 3"]);
    check(
        "ask light 3 | < 1 OK 00008 17*HH | ask light 4 | < 2 OK 00010 18*HH",
        &["lit 3", "lit 4"],
    );
    check("ask light 3 | < 1 OK 5*HH | < 1 OK 00008 17*HH", &["lit 3"]);
    check("< 1 OK 00008 17*HH", &[]);
}

#[test]
fn a_lost_answer_is_asked_for_again() {
    check(
        "ask light 3 | > 1 LIGHT 03*HH | wait 49 ms | wait 1 ms | > 1 LIGHT 03*HH | < 1 OK 00008 17*HH",
        &["lit 3 in 2 tries"],
    );
    check("ask light 3 | wait 120 ms | < 1 OK 00008 17*HH", &["lit 3 in 3 tries"]);
    check("ask light 3 | wait 2999 ms", &[]);
    check("ask light 3 | wait 3000 ms", &["gave up: no answer"]);
    check("ask identify | wait 4999 ms", &[]);
    check("ask identify | wait 5000 ms", &["gave up: no answer"]);
}

#[test]
fn a_damaged_answer_is_asked_for_again_at_once() {
    check(
        "ask light 3 | < 1 OK 00008 17*00 | wait 1 ms | < 1 OK 00008 17*HH",
        &["lit 3 in 2 tries"],
    );
    check(
        "ask light 3 | < ? ERR 2 CHECKSUM*HH | wait 1 ms | < 1 OK 00008 17*HH",
        &["lit 3 in 2 tries"],
    );
    check("ask light 3 | < 1 OK 00008 17*00 | wait 3000 ms", &["gave up: noise"]);
    check("ask light 3 | < 1 OK 00008 17", &[]);
    check("ask light 3 | < 1 OK 00008*HH", &[]);
    check("ask light 3 | < 1 OK 0000G 17*HH", &[]);
    check("ask light 3 | < 1 OK 0008 17*HH", &[]);
    check("ask light 3 | < 1 OK 00008 12345678901*HH", &[]);
    check("ask light 3 | < 1 YES 00008 17*HH", &[]);
}

#[test]
fn pins_that_read_otherwise_are_no_success() {
    check(
        "ask light 3 | < 1 OK 00010 17*HH | wait 1 ms | < 1 OK 00008 18*HH",
        &["lit 3 in 2 tries"],
    );
    check(
        "ask light 3 | < 1 OK 00018 17*HH | wait 3000 ms",
        &["gave up: asked 00008, reads 00018"],
    );
    // The trigger may still be closed.
    check("ask light 3 | < 1 OK 20008 17*HH", &["lit 3"]);
    check(
        "ask light 3 | < 1 OK 00008 17*HH | ask ping | < 2 OK 00000 18*HH",
        &["lit 3", "changed: 00008 to 00000", "outputs 00000"],
    );
}

#[test]
fn a_refusal_counts_when_it_comes_twice() {
    check("ask light 12 | < 1 ERR 4 RANGE*HH", &[]);
    check("ask light 12 | < 1 ERR 4 RANGE*HH | < 1 ERR 4 RANGE*HH", &["refused: RANGE"]);
    check("ask light 2 | < 1 ERR 4 RANGE*HH | < 1 OK 00004 17*HH", &["lit 2"]);
    check(
        "ask light 2 | < 1 ERR 2 CHECKSUM*HH | < 1 ERR 2 CHECKSUM*HH | < 1 OK 00004 17*HH",
        &["lit 2"],
    );
    check("ask light 12 | < 1 ERR 4 VERB*HH | < 1 ERR 4 VERB*HH", &[]);
}

#[test]
fn a_restart_voids_the_frame() {
    check(
        "ask light 3 | < 1 OK 00008 99*HH | < ! BOOT WATCHDOG*HH",
        &["lit 3", "restarted: WATCHDOG"],
    );
    // Its message lost: the clock tells. Once is enough.
    check(
        "ask light 3 | < 1 OK 00008 99*HH | ask light 4 | < 2 OK 00010 5*HH | ask ping | < 3 OK 00010 6*HH",
        &["lit 3", "restarted: CLOCK", "lit 4", "outputs 00010"],
    );
    check(
        "ask light 3 | < 1 OK 00008 99*HH | < ! BOOT RESET*HH | ask ping | < 2 OK 00000 6*HH",
        &["lit 3", "restarted: RESET", "outputs 00000"],
    );
    // After 49 days the clock starts again by itself.
    check(
        "ask light 3 | < 1 OK 00008 4294967290*HH | ask light 4 | < 2 OK 00010 5*HH",
        &["lit 3", "lit 4"],
    );
    check(
        "ask light 3 | < ! BOOT RESET*HH | wait 1 ms | < 1 OK 00008 5*HH",
        &["restarted: RESET", "lit 3 in 2 tries"],
    );
}

#[test]
fn the_board_is_kept_awake_until_it_falls_silent() {
    let lit = "ask light 3 | > 1 LIGHT 03*HH | < 1 OK 00008 17*HH";
    check(&format!("{lit} | wait 99 ms | wait 100 ms"), &["lit 3"]);
    check(&format!("{lit} | wait 3200 ms"), &["lit 3", "silent"]);
    check(&format!("{lit} | < ! SAFE SILENCE*HH"), &["lit 3", "went dark: SILENCE"]);
}

fn board_that_lit_three() -> LightBoard {
    let mut board = LightBoard::new(0);
    board.ask(Request::Light { light: 3, level: None }, Duration::ZERO).unwrap();
    board.take_output();
    board.receive(seal("1 OK 00008 0000000017").as_bytes(), Duration::from_millis(4));
    board.next_event();
    board
}

#[test]
fn keep_alives_come_in_time() {
    let mut board = board_that_lit_three();
    let mut board_ms = 17;
    let mut last = Duration::ZERO;
    for _ in 0..100 {
        let now = board.wakeup().unwrap();
        assert!(now - last <= Duration::from_millis(100));
        board.expire(now);
        let sent = String::from_utf8(board.take_output()).unwrap();
        let seq = sent.split(' ').next().unwrap().to_owned();
        assert!(sent.contains("PING"), "{sent}");
        board_ms += 100;
        board.receive(seal(&format!("{seq} OK 00008 {board_ms:010}")).as_bytes(), now);
        last = now;
    }
    assert_eq!(board.next_event(), None);
}

#[test]
fn a_keep_alive_gives_way_to_a_request() {
    let mut board = board_that_lit_three();
    board.expire(Duration::from_millis(100));
    let ask = |board: &mut LightBoard| board.ask(Request::Off, Duration::from_millis(101));
    assert!(ask(&mut board).is_ok());
    assert!(ask(&mut board).is_err());
    board.receive(seal("2 OK 00008 0000000113").as_bytes(), Duration::from_millis(102));
    assert_eq!(board.next_event(), None);
    board.receive(seal("3 OK 00000 0000000115").as_bytes(), Duration::from_millis(104));
    assert!(matches!(board.next_event(), Some(Event::Done { request: Request::Off, .. })));
}

#[test]
fn giving_up_leaves_the_board_dark() {
    let mut board = board_that_lit_three();
    board.ask(Request::Light { light: 4, level: None }, Duration::ZERO).unwrap();
    board.expire(BUDGET);
    assert!(
        String::from_utf8(board.take_output())
            .unwrap()
            .trim_end()
            .ends_with(seal("3 OFF").trim_end())
    );
    assert_eq!(board.wakeup(), None, "no more keep-alives");
}

#[test]
fn the_checksum_is_the_published_one() {
    assert_eq!(crc8(b"123456789"), 0xF4);
    assert_eq!(crc8(b""), 0);
}

proptest! {
    #[test]
    fn any_bytes_in_any_pieces_do_no_harm(bytes: Vec<u8>, cut in 1usize..7) {
        let mut board = LightBoard::new(65_535);
        board.ask(Request::Light { light: 3, level: None }, Duration::ZERO).unwrap();
        for (i, piece) in bytes.chunks(cut).enumerate() {
            board.receive(piece, Duration::from_millis(i as u64));
            board.expire(Duration::from_millis(i as u64));
        }
        prop_assert_eq!(board.next_event(), None);
    }

    #[test]
    fn an_answer_may_come_in_pieces_and_after_noise(cut in 1usize..20, noise in "[^\n]{0,300}\n") {
        let mut board = LightBoard::new(0);
        board.ask(Request::Light { light: 3, level: None }, Duration::ZERO).unwrap();
        for piece in (noise + &seal("1 OK 00008 0000000017")).as_bytes().chunks(cut) {
            board.receive(piece, Duration::ZERO);
        }
        let done = matches!(board.next_event(), Some(Event::Done { .. }));
        prop_assert!(done);
    }

    #[test]
    fn up_to_three_wrong_bits_never_pass(light in 0u8..16, seq: u16, flips in prop::collection::btree_set(0usize..112, 1..=3)) {
        let text = format!("{seq} {}", Request::Light { light, level: None }.line(0).trim_start_matches("0 "));
        let (text, _) = text.split_once('*').unwrap();
        let mut damaged = text.as_bytes().to_vec();
        let flips: Vec<usize> = flips.into_iter().filter(|bit| *bit < 8 * damaged.len()).collect();
        prop_assume!(!flips.is_empty());
        for bit in flips {
            damaged[bit / 8] ^= 1 << (bit % 8);
        }
        prop_assert_ne!(crc8(&damaged), crc8(text.as_bytes()));
    }
}

//! Many requests over a bad wire, and for a long time.

use crate::simboard::{SimBoard, Stepped};
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};
use std::collections::VecDeque;
use std::time::{Duration, Instant};
use weavelight::device::board::wire::{Answer, Request};
use weavelight::device::board::{Board, BoardModel, Event, LightBoard, PortChoice};

/// The host's state machine at the simulated board, in the board's time.
struct Pair {
    host: LightBoard,
    board: Stepped,
}

impl Pair {
    fn start() -> Option<Self> {
        let mut board = Stepped::start()?;
        board.expect_line("! BOOT POWER*HH");
        Some(Self { host: LightBoard::new(0), board })
    }

    fn now(&self) -> Duration {
        Duration::from_micros(self.board.now_us())
    }

    /// Until the host has something to tell.
    fn next_event(&mut self) -> Event {
        loop {
            self.host.expire(self.now());
            self.board.send(&self.host.take_output());
            if let Some(event) = self.host.next_event() {
                return event;
            }
            let pause = self.host.wakeup().unwrap().saturating_sub(self.now());
            let bytes = self.board.run_to_line(u64::try_from(pause.as_micros()).unwrap().max(1));
            self.host.receive(&bytes, self.now());
        }
    }

    /// Switches a light; how often it had to be asked for.
    fn light(&mut self, light: u8) -> u32 {
        let request = Request::Light { light, level: None };
        self.host.ask(request, self.now()).unwrap();
        match self.next_event() {
            Event::Done { request: done, tries, .. } if done == request => tries,
            other => panic!("light {light}: {other:?}"),
        }
    }
}

#[test]
fn ten_thousand_lights_over_a_wire_with_one_percent_byte_errors() {
    const COUNT: usize = 10_000;
    let Some(mut pair) = Pair::start() else { return };
    pair.board.command("seed 1");
    pair.board.command("drop 0.005");
    pair.board.command("flip 0.005");
    let (mut tries, mut most, mut asked, mut lit) = (0, 0, Vec::new(), Vec::new());
    for i in 0..COUNT {
        let light = u8::try_from((i * 7 + i / 10) % 10).unwrap();
        let these = pair.light(light);
        assert_eq!(pair.board.pins(), 1 << light);
        tries += these;
        most = most.max(these);
        if asked.last() != Some(&(1 << light)) {
            asked.push(1 << light);
        }
        lit.extend(pair.board.edges().into_iter().map(|edge| edge.1).filter(|pins| *pins != 0));
    }
    assert_eq!(lit, asked, "every light that was asked for, in order, and no other");
    println!(
        "{COUNT} lights in {tries} tries (at most {most}), {:.1} s of the board's time",
        pair.now().as_secs_f64()
    );
    assert!(tries > 11_000, "the wire was not bad");
}

#[test]
fn four_hours_of_the_hosts_clock() {
    let mut model = Model::new();
    let mut host = LightBoard::new(0);
    let hours = Duration::from_secs(4 * 3600);
    let (mut now, mut lights, mut gaps) = (Duration::ZERO, 0u32, Duration::ZERO);
    let mut next_light = Duration::ZERO;
    while now < hours {
        if now >= next_light && !host.is_busy() {
            host.ask(
                Request::Light { light: u8::try_from(lights % 10).unwrap(), level: None },
                now,
            )
            .unwrap();
            next_light = now + Duration::from_secs(3);
        }
        host.expire(now);
        model.receive(&host.take_output(), now);
        while let Some(event) = host.next_event() {
            match event {
                Event::Done { answer: Answer::Outputs(outputs), .. } => {
                    assert_eq!(outputs.pins, 1 << (lights % 10));
                    lights += 1;
                }
                other => panic!("at {now:?}: {other:?}"),
            }
        }
        let due = [host.wakeup(), model.due(), Some(next_light).filter(|_| !host.is_busy())];
        now = due.into_iter().flatten().min().unwrap().max(now + Duration::from_micros(1));
        host.receive(&model.send(now), now);
        gaps = gaps.max(now.saturating_sub(model.spoken_to));
    }
    println!("{lights} lights, {} lines, longest silence {gaps:?}", model.lines);
    assert!(
        (4790..=4800).contains(&lights),
        "no drift: one light every three seconds, but {lights}"
    );
    assert!(gaps < Duration::from_millis(500), "the board would have gone dark: {gaps:?}");
}

/// The simulated board behind a bad wire: one in a hundred lines is damaged on either way.
struct Model {
    random: TestRng,
    board: BoardModel,
    answers: VecDeque<(Duration, String)>,
    spoken_to: Duration,
    lines: u64,
}

impl Model {
    fn new() -> Self {
        let mut board = BoardModel::new(10, Duration::ZERO);
        board.take_output();
        let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        Self { random, board, answers: VecDeque::new(), spoken_to: Duration::ZERO, lines: 0 }
    }

    fn perhaps_damaged(&mut self, line: &str) -> String {
        self.lines += 1;
        if self.random.next_u32().is_multiple_of(100) {
            line.replacen(' ', "", 1)
        } else {
            line.to_owned()
        }
    }

    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for line in
            String::from_utf8(bytes.to_vec()).unwrap().lines().filter(|line| !line.is_empty())
        {
            let arrived = self.perhaps_damaged(line);
            if arrived == line {
                self.spoken_to = now;
            }
            self.board.receive(format!("{arrived}\n").as_bytes(), now);
            let answer = String::from_utf8(self.board.take_output()).unwrap();
            let answer = self.perhaps_damaged(&answer);
            self.answers.push_back((now + Duration::from_millis(4), answer));
        }
    }

    fn due(&self) -> Option<Duration> {
        self.answers.front().map(|answer| answer.0)
    }

    fn send(&mut self, now: Duration) -> Vec<u8> {
        let mut bytes = Vec::new();
        while self.due().is_some_and(|due| due <= now) {
            bytes.extend(self.answers.pop_front().unwrap().1.into_bytes());
        }
        bytes
    }
}

/// `make soak`: fifteen minutes at the simulated board's port with a bad wire and resets, or as many seconds as
/// WEAVELIGHT_SOAK_S says.
#[test]
#[ignore = "takes fifteen minutes: make soak"]
fn fifteen_minutes_at_the_port() {
    let Some(mut sim) = SimBoard::on_a_port(&[]) else { return };
    let seconds = std::env::var("WEAVELIGHT_SOAK_S").map_or(900, |text| text.parse().unwrap());
    let board = Board::open(PortChoice::Path(sim.port()), Some(10)).unwrap();
    for fault in ["seed 3", "drop 0.001", "flip 0.001"] {
        sim.command(fault);
    }
    let start = Instant::now();
    let (mut lights, mut tries, mut memory_kb) = (0u32, 0, Vec::new());
    while start.elapsed() < Duration::from_secs(seconds) {
        let shown = board.light(u8::try_from(lights % 10).unwrap(), None).unwrap();
        assert_eq!(shown.outputs.lights(), 1 << (lights % 10));
        lights += 1;
        tries += shown.tries;
        std::thread::sleep(Duration::from_millis(20));
        if lights.is_multiple_of(500) {
            memory_kb.push(resident_kb());
            sim.edges();
        }
    }
    println!("{lights} lights in {tries} tries, {:?}; resident kB: {memory_kb:?}", start.elapsed());
    println!("interruptions: {:?}", board.take_interruptions());
    if let (Some(first), Some(last)) = (memory_kb.get(1), memory_kb.last()) {
        assert!(*last < first + 2048, "memory grows: {memory_kb:?}");
    }
}

fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or("0");
    line.trim().trim_end_matches(" kB").parse().unwrap_or_default()
}

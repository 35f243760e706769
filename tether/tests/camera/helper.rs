//! The helper process itself: it ends when nobody needs it any more.

use crate::fake::Fault;
use crate::rigging::Bench;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use weavelight::device::camera::CameraError;
use weavelight::device::camera::tethered::{Tether, TetheredCamera};

/// A helper whose parent the test is.
struct Orphan(Child);

impl Orphan {
    fn start(bench: &Bench) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_weavelight-tether"));
        command.env("HOME", bench.home()).stdin(Stdio::piped()).stdout(Stdio::piped());
        std::fs::create_dir_all(bench.home()).unwrap();
        Self(command.spawn().unwrap())
    }

    fn say(&mut self, line: &str) {
        writeln!(self.0.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    /// The parent ends; how long the helper lives on.
    fn abandon(mut self) -> Duration {
        let start = Instant::now();
        drop(self.0.stdin.take());
        while self.0.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < Duration::from_secs(30), "it outlives its parent");
            std::thread::sleep(Duration::from_millis(5));
        }
        start.elapsed()
    }
}

impl Drop for Orphan {
    fn drop(&mut self) {
        let _ended = self.0.kill().and_then(|()| self.0.wait());
    }
}

#[test]
fn it_ends_with_its_parent_idle_or_blocked() {
    let bench = Bench::new();
    let idle = Orphan::start(&bench);
    assert!(idle.abandon() < Duration::from_secs(10));

    let mut blocked = Orphan::start(&bench);
    bench.camera.fail(Fault::NeverReady);
    blocked.say(&format!(r#"{{"id":1,"do":"open","port":"{}"}}"#, bench.camera.port()));
    let frame = bench.frames().join("x");
    blocked.say(&format!(
        r#"{{"id":2,"do":"capture","file":"{}","exposure_s":0,"picture_within_s":1}}"#,
        frame.display()
    ));
    let start = Instant::now();
    while bench.camera.count(0x9207) == 0 {
        assert!(start.elapsed() < Duration::from_secs(30), "it never released");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(blocked.abandon() < Duration::from_secs(10));
}

#[test]
fn lines_that_are_no_requests_are_passed_over() {
    let bench = Bench::new();
    let mut helper = Orphan::start(&bench);
    for line in ["", "hello", "{}", r#"{"id":1,"do":"juggle"}"#, r#"{"id":7,"do":"hello"}"#] {
        helper.say(line);
    }
    let mut answer = String::new();
    BufReader::new(helper.0.stdout.as_mut().unwrap()).read_line(&mut answer).unwrap();
    assert!(answer.contains(r#""id":7"#) && answer.contains(r#""protocol":1"#), "{answer}");
}

#[test]
fn a_missing_or_foreign_helper_is_named() {
    let bench = Bench::new();
    let check = |helper: &str, expected: &str| {
        let tether = Tether { helper: helper.into(), ..bench.tether() };
        let error = TetheredCamera::open(tether).unwrap_err();
        assert!(matches!(error, CameraError::Helper { .. }), "{error}");
        assert!(error.to_string().contains(expected), "{error}");
        assert!(error.to_string().contains("make build"), "{error}");
    };
    check("/nowhere/weavelight-tether", "which is not there");
    check("/bin/true", "does not answer");
    check("/bin/cat", "does not answer");
    check("/etc/hostname", "(os error");
}

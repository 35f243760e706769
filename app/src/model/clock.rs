//! When something was, as the clock on the wall had it.

use jiff::Timestamp;
use jiff::tz::TimeZone;
use std::sync::LazyLock;

/// The system's time zone, asked for once: no frame waits for the disk.
static SYSTEM: LazyLock<TimeZone> = LazyLock::new(TimeZone::system);

/// Asks for the time zone, before the first frame.
pub fn start() {
    LazyLock::force(&SYSTEM);
}

/// A moment in the system's time zone.
pub fn local(when: Timestamp) -> String {
    in_zone(when, SYSTEM.clone())
}

/// A moment in a time zone; where that is not known, in UTC, which is said.
pub fn in_zone(when: Timestamp, zone: TimeZone) -> String {
    let utc = if zone.is_unknown() { " UTC" } else { "" };
    format!("{}{utc}", when.to_zoned(zone).strftime("%Y-%m-%d %H:%M"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_told_as_the_clock_has_them() {
        let berlin = || TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
        let check = |when: &str, zone: TimeZone, expected: &str| {
            assert_eq!(in_zone(when.parse().unwrap(), zone), expected, "{when}");
        };
        check("2026-01-31T23:30:00Z", berlin(), "2026-02-01 00:30");
        check("2026-07-01T22:05:59Z", berlin(), "2026-07-02 00:05");
        check("2026-07-01T22:05:59Z", TimeZone::fixed(jiff::tz::offset(-8)), "2026-07-01 14:05");
        check("2026-07-01T22:05:59Z", TimeZone::UTC, "2026-07-01 22:05");
        check("2026-07-01T22:05:59Z", TimeZone::unknown(), "2026-07-01 22:05 UTC");
    }
}

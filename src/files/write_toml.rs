use super::{FileError, write_atomic};
use serde::Serialize;
use std::path::Path;
use toml::Value;
use toml::value::Datetime;

/// Writes a value as TOML, whole or not at all.
///
/// # Errors
/// As [`toml_bytes`], or what [`write_atomic`] reports.
pub fn write_toml<T: Serialize>(path: &Path, value: &T) -> Result<(), FileError> {
    write_atomic(path, &toml_bytes(path, value)?)
}

/// A value as TOML, to be written to `path`.
///
/// # Errors
/// A number that is not finite: the reader would refuse the file.
pub fn toml_bytes<T: Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, FileError> {
    let unwritable = |error: toml::ser::Error| FileError::Unwritable {
        path: path.to_owned(),
        what: error.to_string(),
    };
    let tree = Value::try_from(value).map_err(unwritable)?;
    if let Some(key) = not_finite("", &tree) {
        return Err(FileError::NotFinite { path: path.to_owned(), key });
    }
    Ok(toml::to_string(value).map_err(unwritable)?.into_bytes())
}

/// The key of the first number that is NaN or infinite.
fn not_finite(key: &str, value: &Value) -> Option<String> {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        Value::Float(number) if !number.is_finite() => Some(key.to_owned()),
        Value::Array(values) => values
            .iter()
            .enumerate()
            .find_map(|(k, value)| not_finite(&below(&k.to_string()), value)),
        Value::Table(table) => {
            table.iter().find_map(|(name, value)| not_finite(&below(name), value))
        }
        _ => None,
    }
}

/// A TOML date and time that is no moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("is no moment in time; write date, time and offset, as in 2026-11-22T10:00:00Z")]
pub struct DateTimeError;

/// The moment a TOML date and time with an offset stands for.
///
/// # Errors
/// Where date, time or offset is absent, or the moment is out of range.
pub fn timestamp_from_datetime(datetime: &Datetime) -> Result<jiff::Timestamp, DateTimeError> {
    datetime.to_string().parse().map_err(|_| DateTimeError)
}

/// The TOML form of a moment, UTC.
pub fn datetime_from_timestamp(timestamp: jiff::Timestamp) -> Option<Datetime> {
    timestamp.to_string().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_survive_the_round_trip() {
        for text in ["2026-11-22T10:00:00Z", "1999-01-01T00:00:00.123456789Z"] {
            let timestamp: jiff::Timestamp = text.parse().unwrap();
            let datetime = datetime_from_timestamp(timestamp).unwrap();
            assert_eq!(timestamp_from_datetime(&datetime), Ok(timestamp), "{text}");
        }
        let with_offset: Datetime = "2026-11-22T12:00:00+02:00".parse().unwrap();
        assert_eq!(
            timestamp_from_datetime(&with_offset).unwrap().to_string(),
            "2026-11-22T10:00:00Z"
        );
        for text in ["2026-11-22", "10:00:00", "2026-11-22T10:00:00"] {
            assert_eq!(
                timestamp_from_datetime(&text.parse().unwrap()),
                Err(DateTimeError),
                "{text}"
            );
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_not_written() {
        #[derive(Serialize)]
        struct Example {
            place: Vec<f64>,
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let error = write_toml(&path, &Example { place: vec![1.0, f64::NAN] }).unwrap_err();
        assert!(error.to_string().contains("`place.1` is not a finite number"), "{error}");
        assert!(!path.exists());
        write_toml(&path, &Example { place: vec![1.0, -0.125] }).unwrap();
        assert_eq!(std::fs::read_to_string(path).unwrap(), "place = [1.0, -0.125]\n");
    }
}

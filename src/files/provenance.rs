use super::{PROGRAM, datetime_from_timestamp, timestamp_from_datetime};
use serde::{Deserialize, Serialize};

/// What a calibration file records of its making.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// Program and version, as in "weavelight 0.1.0"; empty where the file does not say.
    pub program: String,
    /// When; `None` where the file does not say.
    pub created: Option<jiff::Timestamp>,
    /// What it was made from.
    pub inputs: Vec<Input>,
    /// Quality figures, keyed by name with the unit in it.
    pub quality: toml::Table,
}

/// One input: a capture session, a rig, another file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The session's or the file's name.
    pub name: String,
    /// SHA-256 of its manifest (which holds the hashes of its frames) or of the file itself.
    pub sha256: String,
}

impl Provenance {
    /// Of something this program makes now.
    pub fn of_this_program(
        created: Option<jiff::Timestamp>,
        inputs: Vec<Input>,
        quality: toml::Table,
    ) -> Self {
        Self { program: PROGRAM.to_owned(), created, inputs, quality }
    }
}

/// The `[provenance]` table of a calibration file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProvenanceTable {
    /// [`Provenance::program`].
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub program: String,
    /// [`Provenance::created`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub created: Option<toml::value::Datetime>,
    /// [`Provenance::inputs`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<Input>,
    /// [`Provenance::quality`].
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub quality: toml::Table,
}

impl From<&Provenance> for ProvenanceTable {
    fn from(value: &Provenance) -> Self {
        Self {
            program: value.program.clone(),
            created: value.created.and_then(datetime_from_timestamp),
            inputs: value.inputs.clone(),
            quality: value.quality.clone(),
        }
    }
}

impl From<ProvenanceTable> for Provenance {
    fn from(table: ProvenanceTable) -> Self {
        Self {
            program: table.program,
            // A date without a time of day is no reason to refuse a calibration.
            created: table.created.and_then(|datetime| timestamp_from_datetime(&datetime).ok()),
            inputs: table.inputs,
            quality: table.quality,
        }
    }
}

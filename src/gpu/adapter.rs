use serde::{Deserialize, Serialize};

/// A graphics processor as its driver presents it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Adapter {
    /// As the driver calls it.
    pub name: String,
    /// The driver and its version.
    pub driver: String,
    /// Whether it is a program that plays a graphics processor.
    pub software: bool,
}

/// Why there is no answer from a graphics processor.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// Built without the feature.
    #[error(
        "this program was built without its GPU part; build it with its `gpu` feature, or solve on the processor"
    )]
    NotBuilt,
    /// No adapter.
    #[error(
        "no Vulkan device was found; install the graphics card's Vulkan driver (Debian: mesa-vulkan-drivers, which also has one in software), or solve on the processor"
    )]
    NoAdapter,
    /// The adapter refuses to work.
    #[error(
        "{adapter} cannot be used ({why}); update its Vulkan driver, or solve on the processor"
    )]
    Unusable {
        /// Its name.
        adapter: String,
        /// What the driver says.
        why: String,
    },
    /// It stopped working.
    #[error("{adapter} failed ({why})")]
    Failed {
        /// Its name.
        adapter: String,
        /// What the driver says.
        why: String,
    },
}

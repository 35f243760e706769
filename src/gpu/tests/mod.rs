//! The graphics processor against the processor, on whatever Vulkan device there is: in continuous integration, one in software.

mod rows;

use super::Gpu;
use std::sync::OnceLock;

/// The device, opened once for all tests of a process. There must be one: `make test` installs a software driver.
pub(crate) fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| match Gpu::open() {
        Ok(gpu) => {
            println!("on {} ({})", gpu.adapter().name, gpu.adapter().driver);
            gpu
        }
        Err(error) => panic!("the GPU part was not tested: {error}"),
    })
}

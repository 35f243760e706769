//! The buffers of one tile in flight: up, on the device, and down.

use super::pack::Packed;
use super::{Answer, Gpu, GpuError, Tile};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use wgpu::{BufferUsages as Usages, MapMode, PollType};

/// A driver that takes longer for a tile hangs.
const PATIENCE: Duration = Duration::from_secs(60);
/// Workgroups that a dimension may have.
const MOST_GROUPS: usize = 65_535;
/// Buffers grow in such steps.
const GRAIN: usize = 1 << 20;

/// Buffers, used again and again.
pub(super) struct Buffers {
    /// Mapped for writing while no tile is in flight.
    up: wgpu::Buffer,
    input: wgpu::Buffer,
    found: wgpu::Buffer,
    down: wgpu::Buffer,
}

/// A tile on its way.
pub struct Flight<'g> {
    gpu: &'g Gpu,
    buffers: Buffers,
    packed: Packed,
    submission: wgpu::SubmissionIndex,
    /// How mapping went, for what goes up next time and for what comes down.
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

impl Buffers {
    /// Buffers that a tile fits.
    pub(super) fn new(device: &wgpu::Device, packed: &Packed) -> Self {
        let sizes = [packed.up_bytes(), packed.found_bytes()];
        let [up, down] = sizes.map(|bytes| bytes.max(1).next_multiple_of(GRAIN));
        let buffer = |bytes: usize, usage: Usages, mapped_at_creation: bool| {
            let size = bytes as u64;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation,
            })
        };
        let on_device = Usages::UNIFORM | Usages::STORAGE | Usages::COPY_DST;
        Self {
            up: buffer(up, Usages::MAP_WRITE | Usages::COPY_SRC, true),
            input: buffer(up, on_device, false),
            found: buffer(down, Usages::STORAGE | Usages::COPY_SRC, false),
            down: buffer(down, Usages::MAP_READ | Usages::COPY_DST, false),
        }
    }

    /// Whether a tile fits.
    pub(super) fn fit(&self, packed: &Packed) -> bool {
        self.up.size() >= packed.up_bytes() as u64
            && self.down.size() >= packed.found_bytes() as u64
    }

    /// Writes a tile where the device can copy it from.
    pub(super) fn fill(&self, gpu: &Gpu, tile: &Tile, packed: &Packed) -> Result<(), GpuError> {
        let view = self.up.get_mapped_range_mut(..);
        let mut view = view.map_err(|error| gpu.failed(&error))?;
        packed.write(tile, |at, bytes| {
            view.slice(at..at + bytes.len()).copy_from_slice(bytes);
        });
        drop(view);
        self.up.unmap();
        Ok(())
    }

    /// Copies up, solves, copies down.
    pub(super) fn launch<'g>(
        self,
        gpu: &'g Gpu,
        pipeline: &wgpu::ComputePipeline,
        packed: Packed,
    ) -> Flight<'g> {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.record(gpu, pipeline, &packed, &mut encoder);
        let submission = gpu.queue.submit([encoder.finish()]);
        let (told, mapped) = channel();
        for (buffer, mode) in [(&self.up, MapMode::Write), (&self.down, MapMode::Read)] {
            let told = told.clone();
            // Nobody listens where the flight was dropped.
            buffer.map_async(mode, .., move |result| drop(told.send(result)));
        }
        Flight { gpu, buffers: self, packed, submission, mapped }
    }

    fn record(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::ComputePipeline,
        packed: &Packed,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let regions = packed.regions();
        for region in &regions {
            let (at, bytes) = (region.start as u64, region.len() as u64);
            encoder.copy_buffer_to_buffer(&self.up, at, &self.input, at, bytes);
        }
        let binding = |(binding, region): (u32, &std::ops::Range<usize>)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &self.input,
                offset: region.start as u64,
                size: std::num::NonZeroU64::new(region.len() as u64),
            }),
        };
        let mut entries: Vec<wgpu::BindGroupEntry> = (0..).zip(&regions).map(binding).collect();
        entries.push(wgpu::BindGroupEntry {
            binding: regions.len() as u32,
            resource: self.found.as_entire_binding(),
        });
        let layout = &gpu.layout;
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        let bindings = gpu.device.create_bind_group(&descriptor);
        let across = packed.workgroups().clamp(1, MOST_GROUPS);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.dispatch_workgroups(across as u32, packed.workgroups().div_ceil(across) as u32, 1);
        drop(pass);
        let bytes = packed.found_bytes() as u64;
        encoder.copy_buffer_to_buffer(&self.found, 0, &self.down, 0, bytes);
    }
}

impl Flight<'_> {
    /// Bytes sent to the device, and to be brought back.
    pub fn bytes(&self) -> [u64; 2] {
        let up: usize = self.packed.regions().iter().map(ExactSizeIterator::len).sum();
        [up as u64, self.packed.found_bytes() as u64]
    }

    /// Waits for the answer and hands it to `read`.
    ///
    /// # Errors
    /// Where the driver fails or hangs.
    pub fn land<T>(self, read: impl FnOnce(&Answer) -> T) -> Result<T, GpuError> {
        let Self { gpu, buffers, packed, submission, mapped } = self;
        let wait = PollType::Wait { submission_index: Some(submission), timeout: Some(PATIENCE) };
        let waited = gpu.device.poll(wait);
        if let Some(why) = gpu.complaint() {
            return Err(gpu.failed(&why));
        }
        waited.map_err(|error| gpu.failed(&error))?;
        for _ in 0..2 {
            let result = mapped.recv_timeout(PATIENCE).map_err(|error| gpu.failed(&error))?;
            result.map_err(|error| gpu.failed(&error))?;
        }
        let value = {
            let bytes = packed.found_bytes() as u64;
            let view = buffers.down.get_mapped_range(0..bytes.max(4));
            let view = view.map_err(|error| gpu.failed(&error))?;
            let values = bytemuck::try_cast_slice(&view).map_err(|error| gpu.failed(&error))?;
            read(&Answer { values, before: &packed.before })
        };
        buffers.down.unmap();
        gpu.give_back(buffers);
        Ok(value)
    }
}

//! A graphics processor, opened through Vulkan.

use super::buffers::{Buffers, Flight};
use super::pack::Packed;
use super::{Adapter, GpuError, Tile};
use crate::machine::Quiet;
use crate::photometry::Method;
use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use wgpu::wgt::{BufferBindingType, DeviceType};

/// What every Vulkan device offers.
const LARGEST_BINDING: usize = 128 << 20;
/// The most that a tile's coefficients take: enough photosites to fill a processor, little enough to have several in flight.
const LARGEST_COEFFICIENTS: usize = 64 << 20;
/// More rows at once save nothing.
const MOST_ROWS: usize = 32;

/// An opened graphics processor; threads share it.
pub struct Gpu {
    adapter: Adapter,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) layout: wgpu::BindGroupLayout,
    least_squares: wgpu::ComputePipeline,
    weighted: wgpu::ComputePipeline,
    /// Buffers that no tile uses.
    idle: Mutex<Vec<Buffers>>,
    /// The first complaint of the driver.
    complaint: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the fastest-looking Vulkan device: a graphics card before a part of the processor before a program.
    ///
    /// # Errors
    /// Where there is none, or it refuses.
    pub fn open() -> Result<Self, GpuError> {
        let quiet = Quiet::begin();
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            flags: wgpu::InstanceFlags::empty(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let wanted = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let found = now(instance.request_adapter(&wanted)).map_err(|_| GpuError::NoAdapter)?;
        drop(quiet);
        let adapter = described(&found.get_info());
        let unusable = |why: String| GpuError::Unusable { adapter: adapter.name.clone(), why };
        let (device, queue) = now(found.request_device(&wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits::downlevel_defaults(),
            ..Default::default()
        }))
        .map_err(|error| unusable(one_line(&error.to_string())))?;
        let complaint = Arc::new(Mutex::new(None));
        let listener = complaint.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&listener, &error.to_string());
        }));
        let (layout, [least_squares, weighted]) = pipelines(&device);
        let idle = Mutex::new(vec![]);
        let gpu = Self { adapter, device, queue, layout, least_squares, weighted, idle, complaint };
        match gpu.complaint() {
            Some(why) => Err(GpuError::Unusable { adapter: gpu.adapter.name.clone(), why }),
            None => Ok(gpu),
        }
    }

    /// What was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Rows of a tile, at most: whatever their pieces, every binding stays below what all devices offer.
    pub fn rows_at_once(&self, width: usize, lights: usize) -> usize {
        let bytes = Packed::most_coefficients(width, lights) * size_of::<f32>();
        (LARGEST_COEFFICIENTS / bytes.max(1)).clamp(1, MOST_ROWS)
    }

    /// Sends a tile off.
    ///
    /// # Errors
    /// Where the driver fails, or the tile has more rows than [`Gpu::rows_at_once`] allows.
    pub fn submit(&self, tile: &Tile) -> Result<Flight<'_>, GpuError> {
        let packed = Packed::new(tile);
        if packed.largest_binding() > LARGEST_BINDING {
            return Err(self.failed(&"a tile of more than 128 MB"));
        }
        let buffers = self.buffers_for(&packed);
        buffers.fill(self, tile, &packed)?;
        let pipeline = match tile.method {
            Method::LeastSquares => &self.least_squares,
            _ => &self.weighted,
        };
        Ok(buffers.launch(self, pipeline, packed))
    }

    /// Idle buffers, or larger ones in their place.
    fn buffers_for(&self, packed: &Packed) -> Buffers {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let fit = idle.filter(|buffers| buffers.fit(packed));
        fit.unwrap_or_else(|| Buffers::new(&self.device, packed))
    }

    pub(super) fn give_back(&self, buffers: Buffers) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(buffers);
    }

    /// Makes the driver complain from now on.
    #[cfg(test)]
    pub(crate) fn spoil(&self) {
        note(&self.complaint, "spoilt\nby a test");
    }

    /// What the driver has complained of.
    pub(super) fn complaint(&self) -> Option<String> {
        self.complaint.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn failed(&self, why: &dyn std::fmt::Display) -> GpuError {
        GpuError::Failed { adapter: self.adapter.name.clone(), why: one_line(&why.to_string()) }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("Gpu").field(&self.adapter).finish()
    }
}

fn note(complaint: &Mutex<Option<String>>, text: &str) {
    complaint.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| one_line(text));
}

/// Messages of drivers span lines.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn described(info: &wgpu::AdapterInfo) -> Adapter {
    Adapter {
        name: info.name.clone(),
        driver: one_line(&format!("{} {}", info.driver, info.driver_info)),
        software: info.device_type == DeviceType::Cpu,
    }
}

/// Plain and weighted, with what they bind.
fn pipelines(device: &wgpu::Device) -> (wgpu::BindGroupLayout, [wgpu::ComputePipeline; 2]) {
    let storage = |read_only: bool| BufferBindingType::Storage { read_only };
    let kinds = [
        BufferBindingType::Uniform,
        BufferBindingType::Uniform,
        storage(true),
        storage(true),
        storage(true),
        storage(false),
    ];
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..).zip(kinds).map(entry).collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    });
    let of_both = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::include_wgsl!("solve.wgsl"));
    let pipeline = |name: &str| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&of_both),
            module: &module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    };
    let both = [pipeline("least_squares_of_piece"), pipeline("weighted_of_piece")];
    (layout, both)
}

fn entry((binding, ty): (u32, BufferBindingType)) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

/// The value of a future that is ready, as all of wgpu's are outside browsers, or will be without being woken.
fn now<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        match future.as_mut().poll(&mut context) {
            Poll::Ready(value) => return value,
            Poll::Pending => std::thread::yield_now(),
        }
    }
}

//! The shader with its pipeline, and what each view keeps on the graphics card.

use crate::viewer::appearance::Compose;
use crate::viewer::canvas::Canvas;
use crate::viewer::coarse::{Enlarger, Small};
use crate::viewer::pool::{Locator, NOWHERE, Pool};
use crate::viewer::pyramid::{Place, Pyramid, TILE, Texel};
use crate::viewer::scales;
use crate::viewer::shade::Uniform;
use crate::viewer::viewport::Viewport;
use eframe::egui;
use eframe::egui::{Id, PaintCallbackInfo, Vec2};
use eframe::egui_wgpu::wgpu::util::DeviceExt;
use eframe::egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor, wgpu};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Most tiles sent to the card in one frame, all pictures together.
const TILES_PER_FRAME: usize = 8;
/// Time after which a frame sends no further tile, so that slow memory costs sharpness for a moment and not a frame.
const SENDING: Duration = Duration::from_millis(2);
/// Frames after which a view that is not drawn lets go of its tiles.
const FORGOTTEN: u64 = 600;
/// Pictures that a view draws from: surface, albedo, and one for each side.
const ROLES: usize = 4;

/// One tile's corner and its place in every picture; the shader's `Instance`.
type Instance = [[f32; 4]; 1 + ROLES];

/// What is shared by all views.
#[derive(Debug)]
struct Gpu {
    pipeline: wgpu::RenderPipeline,
    enlarger: Enlarger,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    scales: wgpu::TextureView,
    views: HashMap<Id, OnCard>,
    now: u64,
    texels: Vec<Texel>,
}

/// What a view has on the card.
#[derive(Debug)]
struct OnCard {
    pools: [Pool; ROLES],
    uniform: wgpu::Buffer,
    instances: wgpu::Buffer,
    count: u32,
    bound: Option<wgpu::BindGroup>,
    /// At half resolution, once that was wanted.
    small: Option<Small>,
    drawn: u64,
}

/// Whether there is a card to draw with, and whether its target encodes sRGB itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Renderer {
    pub(super) encoding_target: bool,
}

/// Gets a renderer ready; views say so where there is none.
pub fn install(ctx: &egui::Context, renderer: Option<&RenderState>) {
    let Some(state) = renderer else { return };
    let gpu = Gpu::new(&state.device, &state.queue, state.target_format);
    state.renderer.write().callback_resources.insert(gpu);
    let renderer = Renderer { encoding_target: state.target_format.is_srgb() };
    ctx.data_mut(|data| data.insert_temp(Id::unique("look renderer"), renderer));
}

/// The renderer, where one was installed.
pub(super) fn renderer(ctx: &egui::Context) -> Option<Renderer> {
    ctx.data(|data| data.get_temp(Id::unique("look renderer")))
}

/// One frame of one view.
pub(super) struct Frame {
    pub(super) id: Id,
    pub(super) ctx: egui::Context,
    pub(super) pictures: [Option<Arc<Pyramid>>; ROLES],
    pub(super) viewport: Viewport,
    /// Size of the view in points, and pixels per point.
    pub(super) screen: (Vec2, f32),
    pub(super) coarse: bool,
    pub(super) uniform: Box<Uniform>,
}

impl Frame {
    /// The pictures that the canvas asks for.
    pub(super) fn pictures(canvas: &Canvas) -> [Option<Arc<Pyramid>>; ROLES] {
        let look = canvas.appearance;
        let size = canvas.maps.size();
        let of_side = |k: usize| {
            let seen = k == 0 || look.compose != Compose::Single;
            let picture = look.sides[k].picture.as_ref();
            picture.filter(|picture| seen && picture.size() == size).cloned()
        };
        [
            Some(canvas.maps.surface.clone()),
            Some(canvas.maps.albedo.clone()),
            of_side(0),
            of_side(1),
        ]
    }

    /// Pixels of the view at half resolution.
    fn half_size_px(&self) -> [u32; 2] {
        let (size, pixels_per_point) = self.screen;
        [size.x, size.y].map(|points| (0.5 * points * pixels_per_point).ceil().max(1.0) as u32)
    }

    /// Brings what is seen to the card, a few tiles a frame, coarser ones standing in for the rest; true where some are still
    /// missing.
    fn upload(&self, gpu: &mut Gpu, device: &wgpu::Device, queue: &wgpu::Queue) -> bool {
        let Some(surface) = &self.pictures[0] else { return false };
        let now = gpu.now;
        let view = gpu.views.entry(self.id).or_insert_with(|| OnCard::new(device));
        view.drawn = now;
        let (screen, pixels_per_point) = self.screen;
        let places = self.viewport.tiles(surface, screen, pixels_per_point);
        let room = Viewport::most_tiles(surface, screen, pixels_per_point);
        for (pool, picture) in view.pools.iter_mut().zip(&self.pictures) {
            if picture.is_some() && pool.reserve(device, room) {
                view.bound = None;
            }
        }
        let missing = self.missing(view, &places, now);
        let sent = self.send_some(view, queue, &missing, &mut gpu.texels, now);
        let instances: Vec<Instance> =
            places.iter().map(|place| self.instance(view, surface, *place, now)).collect();
        view.send(device, queue, &self.uniform, &instances);
        sent < missing.len()
    }

    /// Which pictures lack which tiles: the coarsest first, so that there is always something to see, then from the middle of
    /// the screen outwards. Those that are there count as seen.
    fn missing(&self, view: &mut OnCard, places: &[Place], now: u64) -> Vec<(usize, Place)> {
        let mut missing = Vec::new();
        for (role, (pool, picture)) in view.pools.iter_mut().zip(&self.pictures).enumerate() {
            let Some(picture) = picture else { continue };
            let wanted = std::iter::once(whole(picture)).chain(places.iter().copied());
            let lacking = wanted.filter(|place| !pool.holds(picture, *place, now));
            missing.extend(lacking.map(|place| (role, place)));
        }
        missing.sort_by_key(|(_, place)| (std::cmp::Reverse(place.level), self.off_centre(*place)));
        missing.dedup();
        missing
    }

    /// How far a tile's middle is from the screen's, pixels.
    fn off_centre(&self, place: Place) -> u64 {
        let side = (TILE << place.level) as f64;
        let away = |at: usize, centre: f64| (at as f64 + 0.5) * side - centre;
        let [x, y] = self.viewport.centre;
        away(place.x, x).hypot(away(place.y, y)) as u64
    }

    /// Sends the first of the tiles, as many as a frame may take; how many that were.
    fn send_some(
        &self,
        view: &mut OnCard,
        queue: &wgpu::Queue,
        missing: &[(usize, Place)],
        texels: &mut Vec<Texel>,
        now: u64,
    ) -> usize {
        let started = Instant::now();
        for (sent, (role, place)) in missing.iter().enumerate() {
            let Some(picture) = &self.pictures[*role] else { continue };
            let enough = sent >= TILES_PER_FRAME || (sent > 0 && started.elapsed() > SENDING);
            if enough && *place != whole(picture) {
                return sent;
            }
            view.pools[*role].put(queue, picture, *place, now, texels);
        }
        missing.len()
    }

    fn instance(&self, view: &mut OnCard, picture: &Pyramid, place: Place, now: u64) -> Instance {
        let [width, height] = picture.size();
        let side = TILE << place.level;
        let corner = |k: usize, length: usize| (k * side).min(length) as f32;
        let mut instance = [NOWHERE; 1 + ROLES];
        instance[0] = [
            corner(place.x, width),
            corner(place.y, height),
            corner(place.x + 1, width),
            corner(place.y + 1, height),
        ];
        let pools = view.pools.iter_mut().zip(&self.pictures);
        for (locator, (pool, picture)) in instance[1..].iter_mut().zip(pools) {
            let found: Option<Locator> =
                picture.as_ref().and_then(|picture| pool.find(picture, place, now));
            *locator = found.unwrap_or(NOWHERE);
        }
        instance
    }
}

/// The tile that shows all of a picture.
fn whole(picture: &Pyramid) -> Place {
    Place { level: picture.coarsest(), x: 0, y: 0 }
}

impl CallbackTrait for Frame {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(gpu) = resources.get_mut::<Gpu>() {
            gpu.now += 1;
            let now = gpu.now;
            gpu.views.retain(|_, view| view.drawn + FORGOTTEN > now);
            if self.upload(gpu, device, queue) {
                self.ctx.request_repaint();
            }
            gpu.bind(self.id, device);
            if self.coarse {
                gpu.draw_small(self.id, self.half_size_px(), device, encoder);
            }
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(gpu) = resources.get::<Gpu>() else { return };
        let Some(view) = gpu.views.get(&self.id) else { return };
        match view.small.as_ref().filter(|_| self.coarse) {
            Some(small) => gpu.enlarger.draw(small, pass),
            None => view.draw(&gpu.pipeline, pass),
        }
    }
}

impl OnCard {
    fn new(device: &wgpu::Device) -> Self {
        let buffer = |size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("view"),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self {
            pools: std::array::from_fn(|_| Pool::empty(device)),
            uniform: buffer(size_of::<Uniform>(), wgpu::BufferUsages::UNIFORM),
            instances: buffer(64 * size_of::<Instance>(), wgpu::BufferUsages::VERTEX),
            count: 0,
            bound: None,
            small: None,
            drawn: 0,
        }
    }

    fn draw(&self, pipeline: &wgpu::RenderPipeline, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(bound) = self.bound.as_ref().filter(|_| self.count > 0) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bound, &[]);
            pass.set_vertex_buffer(0, self.instances.slice(..));
            pass.draw(0..4, 0..self.count);
        }
    }

    fn send(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        uniform: &Uniform,
        instances: &[Instance],
    ) {
        queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(uniform));
        self.count = instances.len() as u32;
        let bytes: &[u8] = bytemuck::cast_slice(instances);
        if self.instances.size() < bytes.len() as u64 {
            self.instances = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("tiles of a view"),
                contents: bytes,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            });
        } else {
            queue.write_buffer(&self.instances, 0, bytes);
        }
    }
}

impl Gpu {
    fn new(device: &wgpu::Device, queue: &wgpu::Queue, target: wgpu::TextureFormat) -> Self {
        let layout = layout(device);
        Self {
            pipeline: pipeline(device, &layout, target),
            enlarger: Enlarger::new(device, target),
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            scales: scales_on_card(device, queue),
            layout,
            views: HashMap::new(),
            now: 0,
            texels: Vec::new(),
        }
    }

    /// Draws a view at half resolution, beside the window.
    fn draw_small(
        &mut self,
        id: Id,
        size: [u32; 2],
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        let Some(view) = self.views.get_mut(&id) else { return };
        self.enlarger.fit(device, &self.sampler, &mut view.small, size);
        if let Some(small) = &view.small {
            view.draw(&self.pipeline, &mut small.pass(encoder));
        }
    }

    fn bind(&mut self, id: Id, device: &wgpu::Device) {
        let Some(view) = self.views.get_mut(&id).filter(|view| view.bound.is_none()) else {
            return;
        };
        let pools = view.pools.each_ref().map(Pool::view);
        let texture = |binding: u32, view| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        };
        view.bound = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: view.uniform.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
                texture(2, &self.scales),
                texture(3, &pools[0]),
                texture(4, &pools[1]),
                texture(5, &pools[2]),
                texture(6, &pools[3]),
            ],
        }));
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding: u32, visibility, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    };
    let texture = |view_dimension| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let fragment = wgpu::ShaderStages::FRAGMENT;
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let mut entries = vec![
        entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, uniform),
        entry(1, fragment, sampler),
        entry(2, fragment, texture(wgpu::TextureViewDimension::D2)),
    ];
    let tiles = texture(wgpu::TextureViewDimension::D2Array);
    entries.extend((0..ROLES as u32).map(|k| entry(3 + k, fragment, tiles)));
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("view"),
        entries: &entries,
    })
}

fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    target: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let shader = device.create_shader_module(wgpu::include_wgsl!("shade.wgsl"));
    let attributes = wgpu::vertex_attr_array![
        0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4, 4 => Float32x4
    ];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("maps"),
        layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("maps"),
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        })),
        vertex: wgpu::VertexState {
            module: &shader,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &attributes,
            })],
        },
        fragment: Some(wgpu::FragmentState {
            module: &shader,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(target.into())],
        }),
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: None,
        multisample: Default::default(),
        multiview_mask: None,
        cache: None,
    })
}

fn scales_on_card(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texture = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: Some("scales"),
            size: wgpu::Extent3d {
                width: scales::STEPS as u32,
                height: 2,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        scales::table().as_flattened(),
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

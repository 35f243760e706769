//! The window's own time per frame on 16 megapixels: opening them, panning near and from afar, zooming, and dragging a lamp.
//!
//! Own time is the processor's time for everything that the window's thread does: laying out the Look room, tessellating, sending
//! tiles, recording the pass and handing it over. Beside it stands the time on the clock until the picture is drawn; with a
//! software driver that is mostly the drawing, and whatever else the machine does.

#![allow(clippy::print_stdout, reason = "a benchmark tells its figures")]
#![allow(clippy::unwrap_used, reason = "a benchmark that cannot draw has failed")]

use eframe::egui::{
    self, Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, RawInput,
    Rect, TouchPhase, Vec2, pos2, vec2,
};
use eframe::egui_wgpu::{
    RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup, wgpu,
};
use rustix::time::{ClockId, clock_gettime};
use std::time::{Duration, Instant};
use weavelight_app::jobs::look;
use weavelight_app::jobs::look::opened::Opened;
use weavelight_app::jobs::messages::Update;
use weavelight_app::jobs::state::AppState;
use weavelight_app::model::settings::Settings;
use weavelight_app::rooms::RoomPanel;
use weavelight_app::rooms::look::Look;
use weavelight_app::viewer::geometry::Geometry;
use weavelight_app::viewer::gpu::install;
use weavelight_app::viewer::maps::Maps;
use weavelight_app::viewer::slopes;
use weavelight_calibration::description::Plane;

/// The reference camera's frame.
const SIZE_PX: [usize; 2] = [4928, 3264];
/// The window, pixels.
const WINDOW: [u32; 2] = [1920, 1080];
/// Where dragging begins.
const MIDDLE: Pos2 = pos2(700.0, 500.0);
/// Frames of each kind.
const FRAMES: usize = 200;

/// A window without a screen.
struct Window {
    ctx: egui::Context,
    state: RenderState,
    target: wgpu::TextureView,
    look: Look,
    app: AppState,
    frame: usize,
}

/// What one frame took.
struct Took {
    /// The thread's.
    own: Duration,
    /// On the clock, with the driver.
    all: Duration,
}

fn main() {
    // Test runners ask what there is.
    if std::env::args().any(|argument| argument == "--list") {
        return;
    }
    let before = memory_mib("VmRSS");
    let maps = maps();
    println!(
        "{} x {} px: maps {:.0} MiB in main memory ({:.0} MiB of the process)",
        SIZE_PX[0],
        SIZE_PX[1],
        maps.bytes() as f64 / f64::from(1 << 20),
        memory_mib("VmRSS") - before
    );
    let mut window = Window::new(maps);
    println!("window {} x {} px, renderer: {}", WINDOW[0], WINDOW[1], window.renderer());
    window.measure("opening", 40, |_| Vec::new());
    window.drag("lamp, all of it", PointerButton::Primary, circle);
    window.drag("panning, all of it", PointerButton::Secondary, circle);
    window.measure("zooming", FRAMES, zoom);
    window.frame(vec![key(Key::Num1)]);
    window.settle();
    window.drag("panning, 1 : 1", PointerButton::Secondary, circle);
    window.drag("lamp, 1 : 1", PointerButton::Primary, circle);
    window.drag("across all, 1 : 1", PointerButton::Secondary, back_and_forth);
    println!("most memory of the process: {:.0} MiB", memory_mib("VmHWM"));
}

/// A weave.
fn maps() -> Maps {
    let [width, _] = SIZE_PX;
    let normal = move |k: usize| {
        let (x, y) = ((k % width) as f32, (k / width) as f32);
        let (a, b) = (0.5 * (0.31 * x).sin(), 0.5 * (0.27 * y).sin());
        let length = (a * a + b * b + 1.0).sqrt();
        [a / length, b / length, 1.0 / length]
    };
    let albedo = move |k: usize| [0.6, 0.5, 0.3 + 0.2 * ((k % width) as f32 * 0.05).sin()];
    let geometry = Geometry::new(SIZE_PX, None, Plane::table(), 1);
    Maps::new(geometry, &normal, &|_| 0.5, &albedo)
}

impl Window {
    fn new(maps: Maps) -> Self {
        let ctx = egui::Context::default();
        let state = render_state();
        install(&ctx, Some(&state));
        let settings = Settings::load_from(std::path::Path::new("none"));
        weavelight_app::ui::theme::apply(&ctx, &settings);
        let (mut room, mut app) = (Look::default(), AppState::new(settings));
        let opened = Opened {
            name: "weave".to_owned(),
            folder: "weave".into(),
            slopes: slopes::of_surface(&maps.surface),
            maps,
            mm_per_px: None,
            warnings: Vec::new(),
            method: "auto".to_owned(),
            frames: Err(String::new()),
            lights: Vec::new(),
        };
        room.hear(Update::Look(look::Event::Opened(Box::new(opened))), &mut app);
        let target = target(&state);
        Self { ctx, state, target, look: room, app, frame: 0 }
    }

    fn renderer(&self) -> String {
        let info = self.state.adapter.get_info();
        format!("{} ({:?}, {:?})", info.name, info.backend, info.device_type)
    }

    /// Until every tile that is seen is there.
    fn settle(&mut self) {
        (0..40).for_each(|_| {
            self.frame(Vec::new());
        });
    }

    /// Drags along a path, and tells what the frames took.
    fn drag(&mut self, name: &str, button: PointerButton, path: fn(usize) -> Vec2) {
        let pressed = |pressed| Event::PointerButton {
            pos: MIDDLE,
            button,
            pressed,
            modifiers: Modifiers::NONE,
        };
        self.frame(vec![Event::PointerMoved(MIDDLE), pressed(true)]);
        self.measure(name, FRAMES, |k| vec![Event::PointerMoved(MIDDLE + path(k))]);
        self.frame(vec![pressed(false)]);
    }

    /// Tells what so many frames took.
    fn measure(&mut self, name: &str, frames: usize, events: impl Fn(usize) -> Vec<Event>) {
        let mut took: Vec<Took> = (0..frames).map(|k| self.frame(events(k))).collect();
        let mut figures = |of: fn(&Took) -> Duration| {
            took.sort_by_key(of);
            let ms = |k: usize| of(&took[k]).as_secs_f64() * 1e3;
            (ms(frames / 2), ms(frames * 99 / 100), ms(frames - 1))
        };
        let (own, all) = (figures(|took| took.own), figures(|took| took.all));
        println!(
            "{name:20} own time: median {:5.2} ms, 99th percentile {:5.2} ms, most {:5.2} ms; drawn after {:6.1} / {:6.1} ms",
            own.0, own.1, own.2, all.0, all.1
        );
    }

    fn frame(&mut self, events: Vec<Event>) -> Took {
        let (started, started_own) = (Instant::now(), thread_time());
        self.frame += 1;
        let size = vec2(WINDOW[0] as f32, WINDOW[1] as f32);
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
            time: Some(self.frame as f64 / 60.0),
            events,
            ..RawInput::default()
        };
        let (look, app) = (&mut self.look, &mut self.app);
        let mut output = self.ctx.run_ui(input, |ui| look.ui(ui, app));
        let shapes = self.ctx.tessellate(output.shapes, output.pixels_per_point);
        let screen = ScreenDescriptor { size_in_pixels: WINDOW, pixels_per_point: 1.0 };
        let (device, queue) = (&self.state.device, &self.state.queue);
        let mut renderer = self.state.renderer.write();
        for (id, deltas) in output.textures_delta.set.drain() {
            deltas.iter().for_each(|delta| renderer.update_texture(device, queue, id, delta));
        }
        output.textures_delta.free.drain().for_each(|id| renderer.free_texture(&id));
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut buffers = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let attachment = wgpu::RenderPassColorAttachment {
            view: &self.target,
            resolve_target: None,
            ops: wgpu::Operations::default(),
            depth_slice: None,
        };
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(attachment)],
                ..Default::default()
            })
            .forget_lifetime();
        renderer.render(&mut pass, &shapes, &screen);
        drop(pass);
        buffers.push(encoder.finish());
        queue.submit(buffers);
        let own = thread_time().saturating_sub(started_own);
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        Took { own, all: started.elapsed() }
    }
}

/// Around in circles of 300 pixels.
fn circle(k: usize) -> Vec2 {
    let angle = k as f32 * 0.05;
    300.0 * vec2(angle.cos() - 1.0, angle.sin())
}

/// From one end of the picture towards the other and back, 50 pixels a frame: new tiles all the time.
fn back_and_forth(k: usize) -> Vec2 {
    let there = (k % 100).min(100 - k % 100) as f32;
    -50.0 * there * vec2(1.0, 0.6)
}

/// Nearer for half of the time, and back.
fn zoom(k: usize) -> Vec<Event> {
    let delta = if k % 100 < 50 { vec2(0.0, 20.0) } else { vec2(0.0, -20.0) };
    let wheel = Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta,
        phase: TouchPhase::Move,
        source: MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    };
    vec![Event::PointerMoved(MIDDLE), wheel]
}

fn key(key: Key) -> Event {
    Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers: Modifiers::NONE }
}

fn render_state() -> RenderState {
    let setup =
        WgpuSetup::CreateNew(eframe::egui_wgpu::WgpuSetupCreateNew::without_display_handle());
    let configuration =
        WgpuConfiguration { wgpu_setup: setup.clone(), ..WgpuConfiguration::default() };
    pollster::block_on(async {
        let instance = setup.new_instance().await;
        RenderState::create(&configuration, &instance, None, RendererOptions::default()).await
    })
    .unwrap()
}

fn target(state: &RenderState) -> wgpu::TextureView {
    let texture = state.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: WINDOW[0], height: WINDOW[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: state.target_format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Time that the processor has spent on this thread.
fn thread_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// A line of this process's status; 0 where the system tells none.
fn memory_mib(name: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    let kib = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kib.unwrap_or(0.0) / 1024.0
}

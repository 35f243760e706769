//! A scan that is turned, mirrored or shifted, or whose lights have other numbers, is the same scan: the maps are the same
//! ones turned, whether the sensor's noise is calibrated or found in the pictures.

use crate::photograph::{Field, Scan};
use crate::thorough;
use nalgebra::{
    IsometryMatrix3, Matrix2, Matrix3, Point3, Rotation3, Translation3, UnitVector3, Vector2,
    Vector3,
};
use weavelight::gpu::Device;
use weavelight::photometry::Maps;
use weavelight::photometry::{Method, Outcome};
use weavelight::raw::{Frame, Layout, Samples};
use weavelight::simulate::Material;
use weavelight::solve::Scene;
use weavelight_calibration::description::{Camera, Cfa, Image, Light, Plane};
use weavelight_sim::cloth::Preset;

const SIZE: [usize; 2] = [264, 176];
/// float32 and the interpolated light field leave less than this between two ways to one normal, degrees.
const SAME_DEG: f64 = 2e-3;
/// Photosites, of a million, at which two subsets are so nearly as good, or the residual is so near the limit of the subset test,
/// that rounding decides. Measured: 280 at most (knit, lights in another order); a noise estimate that depends on the layout
/// changes 4,000 to 40,000.
const UNDECIDED_PER_MILLION: usize = 500;

/// One of the eight ways to lay a picture.
#[derive(Clone, Copy, Debug)]
struct Turn(Matrix2<f64>);

impl Turn {
    fn all() -> [Self; 8] {
        let quarter = Matrix2::new(0.0, -1.0, 1.0, 0.0);
        let mirror = Matrix2::new(-1.0, 0.0, 0.0, 1.0);
        let quarters = [Matrix2::identity(), quarter, quarter * quarter, quarter.transpose()];
        let of = |k: usize| if k < 4 { quarters[k] } else { quarters[k - 4] * mirror };
        [0, 1, 2, 3, 4, 5, 6, 7].map(|k| Self(of(k)))
    }

    fn size(self, [width, height]: [usize; 2]) -> [usize; 2] {
        if self.0[(0, 0)] == 0.0 { [height, width] } else { [width, height] }
    }

    /// Where a place of the picture comes to lie.
    fn place(self, [u, v]: [f64; 2], size: [usize; 2]) -> [f64; 2] {
        let middle = |[w, h]: [usize; 2]| Vector2::new((w - 1) as f64, (h - 1) as f64) / 2.0;
        let turned = self.0 * (Vector2::new(u, v) - middle(size)) + middle(self.size(size));
        [turned.x, turned.y]
    }

    fn pixel(self, x: usize, y: usize, size: [usize; 2]) -> [usize; 2] {
        self.place([x as f64, y as f64], size).map(|c| c.round() as usize)
    }

    /// What becomes of the rig: a mirrored picture is one of a mirrored world.
    fn world(self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(self.0.determinant().signum(), 1.0, 1.0))
    }

    fn image<T: Copy>(self, image: &Image<T>, like: T) -> Image<T> {
        let size = [image.width, image.height];
        let [width, height] = self.size(size);
        let mut out = Image::filled(width, height, like);
        for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
            let [to_x, to_y] = self.pixel(x, y, size);
            out.data[to_y * width + to_x] = *image.at(x, y);
        }
        out
    }

    fn frame(self, frame: &Frame) -> Frame {
        let (Layout::Mosaic(cfa), Samples::U16(samples)) = (frame.layout, &frame.samples) else {
            panic!("the simulated camera writes mosaics of integers")
        };
        let size = [frame.width, frame.height];
        let image = Image { width: size[0], height: size[1], data: samples.clone() };
        let channels = Image {
            width: size[0],
            height: size[1],
            data: (0..size[0] * size[1])
                .map(|at| cfa.channel(at % size[0], at / size[0]))
                .collect(),
        };
        let (turned, channels) = (self.image(&image, 0), self.image(&channels, cfa.cell[0]));
        let cell = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| *channels.at(x, y));
        Frame {
            width: turned.width,
            height: turned.height,
            layout: Layout::Mosaic(Cfa { cell }),
            samples: Samples::U16(turned.data),
            ..frame.clone()
        }
    }

    fn camera(self, camera: &Camera) -> Camera {
        let size = [camera.width_px, camera.height_px];
        let [width_px, height_px] = self.size(size);
        let [cx, cy] = self.place([camera.cx, camera.cy], size);
        let swapped = self.0[(0, 0)] == 0.0;
        let [fx, fy] = if swapped { [camera.fy, camera.fx] } else { [camera.fx, camera.fy] };
        let [k1, k2, p1, p2, k3] = camera.distortion;
        // The tangential part is a vector (p2, p1) of the picture.
        let p = self.0 * Vector2::new(p2, p1);
        let mut turn = Matrix3::identity();
        turn.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.0);
        let (pose, mirrored) = (&camera.camera_from_rig, self.world());
        let rotation = turn * pose.rotation.matrix() * mirrored;
        let camera_from_rig = IsometryMatrix3::from_parts(
            Translation3::from(turn * pose.translation.vector),
            Rotation3::from_matrix_unchecked(rotation),
        );
        Camera {
            width_px,
            height_px,
            fx,
            fy,
            cx,
            cy,
            distortion: [k1, k2, p.y, p.x, k3],
            camera_from_rig,
        }
    }

    fn scene(self, scene: &Scene) -> Scene {
        let world = self.world();
        let turned = |v: &UnitVector3<f64>| UnitVector3::new_normalize(world * v.into_inner());
        let mut out = scene.clone();
        let frames = out.lights.iter_mut().flat_map(|light| &mut light.exposures);
        frames
            .chain(&mut out.ambient)
            .for_each(|exposure| exposure.frame = self.frame(&exposure.frame));
        [out.width, out.height] = self.size([scene.width, scene.height]);
        out.layout = out.lights[0].exposures[0].frame.layout;
        for light in &mut out.lights {
            let gain = light.calibrated.gain_map.as_ref();
            light.calibrated.gain_map = gain.map(|map| self.image(map, [0.0; 3]));
            match &mut light.calibrated.light {
                Light::Point(light) => {
                    light.position_mm = Point3::from(world * light.position_mm.coords);
                    light.axis = turned(&light.axis);
                }
                Light::Directional(light) => light.direction = turned(&light.direction),
            }
        }
        out.camera = scene.camera.as_ref().map(|camera| self.camera(camera));
        out.plane = Plane {
            point_mm: Point3::from(world * scene.plane.point_mm.coords),
            normal: turned(&scene.plane.normal),
        };
        out.mask = scene.mask.as_ref().map(|mask| self.image(mask, false));
        out
    }
}

fn solve(scene: &Scene) -> Maps {
    scene.check().unwrap().solve(Method::Auto, &Device::Cpu, None, &|_| {}).unwrap().maps
}

/// How far two maps of one surface are apart.
#[derive(Debug, Default)]
struct Apart {
    photosites: usize,
    /// Decided otherwise, or more than [`SAME_DEG`] apart.
    different: usize,
    worst_deg: f64,
}

impl Apart {
    fn add(&mut self, a: ([f32; 3], Outcome), b: (Vector3<f64>, Outcome)) {
        let [a_normal, b_normal] = [Vector3::from(a.0).cast::<f64>(), b.0];
        let angle = a_normal.cross(&b_normal).norm().atan2(a_normal.dot(&b_normal)).to_degrees();
        self.photosites += 1;
        let same = a.1 == b.1 && (angle < SAME_DEG || a_normal == Vector3::zeros());
        self.different += usize::from(!same);
        self.worst_deg = self.worst_deg.max(angle);
    }

    fn check(&self, what: &str) {
        println!("{what}: {self:?}");
        let most = self.photosites * UNDECIDED_PER_MILLION / 1_000_000 + 1;
        assert!(self.different <= most, "{what}: {self:?}");
    }
}

/// `known`, turned, beside the maps of the turned scene.
fn compare_turned(turn: Turn, known: &Maps, found: &Maps) -> Apart {
    let size = [known.normal.width, known.normal.height];
    let mut apart = Apart::default();
    for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
        let [to_x, to_y] = turn.pixel(x, y, size);
        let expected = turn.world() * Vector3::from(*known.normal.at(x, y)).cast::<f64>();
        let found = (*found.normal.at(to_x, to_y), *found.outcome.at(to_x, to_y));
        apart.add(found, (expected, *known.outcome.at(x, y)));
    }
    apart
}

fn scene_of(preset: Preset) -> Scene {
    let material = Material { preset, ..Material::default() };
    let (scene, _) = Scan::new(Field::Close, SIZE, material, |options| options.seed = 3).load();
    scene
}

#[test]
fn turned_and_mirrored_scans_have_the_same_maps() {
    for (cloth, preset) in Preset::ALL.into_iter().enumerate() {
        for known_noise in [true, false] {
            let mut scene = scene_of(preset);
            if !known_noise {
                scene.color.noise = None;
            }
            let known = solve(&scene);
            let mut all = Apart::default();
            let turns = Turn::all().into_iter().enumerate();
            let turn_of = cloth + usize::from(known_noise);
            for (_, turn) in turns.filter(|(k, _)| thorough::runs(*k, 2, turn_of)) {
                let apart = compare_turned(turn, &known, &solve(&turn.scene(&scene)));
                all.photosites += apart.photosites;
                all.different += apart.different;
                all.worst_deg = all.worst_deg.max(apart.worst_deg);
            }
            all.check(&format!("{}, noise known: {known_noise}", preset.name()));
        }
    }
}

#[test]
fn lights_and_frames_in_another_order_have_the_same_maps() {
    for preset in [Preset::Satin, Preset::Knit] {
        let mut scene = scene_of(preset);
        scene.color.noise = None;
        let known = solve(&scene);
        scene.lights.reverse();
        scene.lights.swap(2, 5);
        let [identity, ..] = Turn::all();
        compare_turned(identity, &known, &solve(&scene)).check(preset.name());
    }
}

/// Two columns less on the left, and two rows less at the top: what remains is what it was, but for what the border said of the
/// noise.
#[test]
fn shifted_scans_have_the_same_maps() {
    const SHIFT: usize = 2;
    for preset in [Preset::Satin, Preset::Velvet] {
        let mut scene = scene_of(preset);
        scene.color.noise = None;
        scene.lights.iter_mut().for_each(|light| light.calibrated.gain_map = None);
        scene.ambient.clear();
        let known = solve(&scene);
        let [width, height] = [scene.width - SHIFT, scene.height - SHIFT];
        for exposure in scene.lights.iter_mut().flat_map(|light| &mut light.exposures) {
            let Samples::U16(samples) = &mut exposure.frame.samples else { panic!("integers") };
            let rows = samples.chunks(width + SHIFT).skip(SHIFT);
            *samples = rows.flat_map(|row| row[SHIFT..].to_vec()).collect();
            (exposure.frame.width, exposure.frame.height) = (width, height);
        }
        (scene.width, scene.height) = (width, height);
        let camera = scene.camera.as_mut().unwrap();
        (camera.width_px, camera.height_px) = (width, height);
        camera.cx -= SHIFT as f64;
        camera.cy -= SHIFT as f64;
        let found = solve(&scene);
        let mut apart = 0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let a = Vector3::from(*found.normal.at(x, y)).cast::<f64>();
            let b = Vector3::from(*known.normal.at(x + SHIFT, y + SHIFT)).cast::<f64>();
            let angle = a.cross(&b).norm().atan2(a.dot(&b)).to_degrees();
            apart += usize::from(angle > 0.05);
        }
        println!("{}: {apart} of {}", preset.name(), width * height);
        assert!(apart * 2000 < width * height, "{}: {apart}", preset.name());
    }
}

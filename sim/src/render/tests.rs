use super::*;
use crate::cloth::{Cloth, Facets, Preset, Relief, Structure, Wrinkles};
use crate::reflectance::{Reflectance, dot};
use crate::rig::{REFERENCE_LIGHTS_MM, leds_at, reference_camera};
use crate::sensor::Sensor;
use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::PointLight;

fn stage(width: usize, height: usize) -> Stage {
    let positions: Vec<Point3<f64>> =
        REFERENCE_LIGHTS_MM.iter().map(|&p| Point3::from(p)).collect();
    Stage {
        view: View { camera: reference_camera(width, height, 1), vignetting: 0.1, psf_px: 0.0 },
        lights: leds_at(&positions, 1).into_iter().map(Light::Point).collect(),
        ambient: [0.004, 0.005, 0.003],
        cfa: Cfa::RGGB,
    }
}

fn fabric(cloth: Cloth) -> Fabric {
    Fabric { cloth, thickness_mm: 0.0, extent: None, bounce: Bounce::None, samples: None }
}

fn flat() -> Cloth {
    Cloth {
        relief: Structure::Flat.relief(None, None, 0),
        wrinkles: None,
        print: None,
        reflectance: Reflectance::Lambert,
    }
}

fn shots() -> Vec<Shot> {
    let one = |number: u64, light| Shot { light, exposure: 0.4, strength: 1.0, number };
    (0..10).map(|k| one(k, Some(k as usize))).chain([one(10, None)]).collect()
}

fn in_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

#[test]
fn the_same_seed_gives_the_same_pictures_whatever_the_threads() {
    let stage = stage(200, 136);
    let mut linen = fabric(Preset::Linen.cloth(3));
    linen.bounce = Bounce::Once;
    linen.samples = Some(1);
    let shoot = |seed| {
        shoot_with_truth(&linen, &stage, &Sensor { seed, ..Sensor::default() }, &shots(), &|_| {})
    };
    let one = in_threads(1, || shoot(5));
    assert!(one == in_threads(2, || shoot(5)), "two threads");
    assert!(one == in_threads(5, || shoot(5)), "five threads");
    assert!(one.0 != shoot(6).0, "another seed");
}

/// A camera photographs light after light, a simulation may render all at once: both see the same yarns.
#[test]
fn a_light_alone_lights_the_weave_that_all_lights_light() {
    let all = stage(120, 80);
    let linen = fabric(Preset::Linen.cloth(3));
    let sensor = Sensor::default().without_noise();
    let together = shoot(&linen, &all, &sensor, &shots(), &|_| {});
    for (k, light) in all.lights.iter().enumerate() {
        let stage = Stage { lights: vec![light.clone()], ..stage(120, 80) };
        let shot = Shot { light: Some(0), exposure: 0.4, strength: 1.0, number: k as u64 };
        let alone = shoot(&linen, &stage, &sensor, &[shot], &|_| {});
        let pairs = alone[0].iter().zip(&together[k]);
        let apart = pairs.filter(|&(a, b)| a.abs_diff(*b) > 2).count();
        assert!(apart * 100 < 120 * 80, "light {k}: {apart} photosites differ");
    }
}

/// The signal of one photosite, all lights, without noise: what the physics says, written down directly.
#[test]
fn a_lambertian_facet_shows_what_the_formula_says() {
    let mut stage = stage(176, 120);
    let led = PointLight {
        position_mm: Point3::new(300.0, -120.0, 420.0),
        axis: nalgebra::UnitVector3::new_normalize(Vector3::new(-0.5, 0.2, -1.0)),
        exponent: 1.3,
        intensity: [0.5, 1.0, 0.7],
    };
    stage.lights = vec![Light::Point(led.clone())];
    let facets = Facets { patch_mm: 40.0, albedo: [0.5; 3] };
    let cloth = Cloth { relief: Relief::Facets(facets), ..flat() };
    let mut out =
        Signals { lights: vec![vec![0.0; 176 * 120]], ambient: vec![0.0; 176 * 120], truth: None };
    fabric(cloth.clone()).expose(&stage, Tile { x: 0, y: 0, width: 176, height: 120 }, &mut out);
    let mut compared = 0;
    for (x, y) in (3..173).step_by(7).flat_map(|x| (3..117).step_by(5).map(move |y| (x, y))) {
        let at = |u: f64, v: f64| {
            stage.view.ray(u, v).meet(&weavelight_calibration::description::Plane::table()).unwrap()
        };
        let p = at(x as f64, y as f64);
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]
            .map(|(a, b)| at(x as f64 + a, y as f64 + b));
        let orientation = |p: &Point3<f64>| {
            let Relief::Facets(facets) = &cloth.relief else { unreachable!() };
            facets.orientation_deg(p.x, p.y)
        };
        let (tilt, azimuth) = orientation(&p);
        if corners.iter().any(|c| orientation(c) != (tilt, azimuth)) {
            continue; // the edge of a facet passes through
        }
        let (tilt, azimuth) = (tilt.to_radians(), azimuth.to_radians());
        let normal =
            Vector3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
        let to_light = led.position_mm - p;
        let distance_m = to_light.norm() / 1000.0;
        let direction = to_light.normalize();
        let emission = (-direction.dot(&led.axis)).powf(1.3);
        let channel = [0, 1, 1, 2][(y % 2) * 2 + x % 2];
        let expected = led.intensity[channel] * emission / distance_m.powi(2)
            * 0.5
            * normal.dot(&direction).max(0.0)
            * stage.view.transmission(x as f64, y as f64);
        let seen = f64::from(out.lights[0][y * 176 + x]);
        // The teeth stand up to a quarter of a millimetre off the plane: 0.25 / 500 in the distance, squared.
        assert!(
            (seen - expected).abs() <= 2e-3 * expected + 1e-3 * emission,
            "({x}, {y}): {seen} against {expected}"
        );
        compared += 1;
    }
    assert!(compared > 250, "only {compared} places compared");
}

#[test]
fn the_sensor_adds_black_exposure_and_ambient() {
    let stage = stage(64, 48);
    let sensor = Sensor::default().without_noise();
    let frames = shoot(&fabric(flat()), &stage, &sensor, &shots(), &|_| {});
    let mut out =
        Signals { lights: vec![vec![0.0; 64 * 48]; 10], ambient: vec![0.0; 64 * 48], truth: None };
    fabric(flat()).expose(&stage, Tile { x: 0, y: 0, width: 64, height: 48 }, &mut out);
    for at in [0, 1, 64, 65, 64 * 48 - 1] {
        let ambient = out.ambient[at];
        assert!(ambient > 0.0);
        for (frame, light) in frames.iter().zip(&out.lights) {
            let expected = 600.0 + 15783.0 * 0.4 * (light[at] + ambient);
            assert!((f32::from(frame[at]) - expected).abs() <= 0.51);
        }
        assert!((f32::from(frames[10][at]) - 600.0 - 15783.0 * 0.4 * ambient).abs() <= 0.51);
    }
}

#[test]
fn truth_is_what_the_cloth_says() {
    let stage = stage(300, 200);
    let mut cloth = Preset::Facets.cloth(1);
    cloth.wrinkles = Some(Wrinkles::new(1.0, 2));
    let (_, truth) =
        shoot_with_truth(&fabric(cloth.clone()), &stage, &Sensor::default(), &[], &|_| {});
    assert!(
        truth
            .normal
            .iter()
            .all(|n| (n[0].powi(2) + n[1].powi(2) + n[2].powi(2) - 1.0).abs() < 1e-5 && n[2] > 0.0)
    );
    assert!(truth.albedo.iter().all(|a| *a == [0.5; 3]));
    let [low, high] = cloth.range_mm().map(|z| z as f32);
    assert!(truth.height_mm.iter().all(|z| (low..=high).contains(z)));
}

#[test]
fn a_thick_swatch_is_nearer_to_the_lights() {
    let stage = stage(64, 48);
    let signal = |thickness_mm| {
        let mut out = Signals {
            lights: vec![vec![0.0; 64 * 48]; 10],
            ambient: vec![0.0; 64 * 48],
            truth: None,
        };
        let fabric = Fabric { thickness_mm, ..fabric(flat()) };
        fabric.expose(&stage, Tile { x: 0, y: 0, width: 64, height: 48 }, &mut out);
        out.lights[6][24 * 64 + 32]
    };
    assert!(signal(20.0) > 1.02 * signal(0.0));
}

#[test]
fn bounced_light_only_adds_and_more_so_in_white_cloth() {
    let stage = stage(96, 64);
    let gain = |albedo: f32| {
        let mut cloth = Preset::Linen.cloth(3);
        if let Relief::Woven(woven) = &mut cloth.relief {
            for yarn in [&mut woven.warp, &mut woven.weft] {
                (yarn.color, yarn.color_low) = ([albedo; 3], [albedo; 3]);
            }
        }
        let tile = Tile { x: 20, y: 20, width: 24, height: 24 };
        let expose = |bounce| {
            let blank = vec![0.0; tile.pixels()];
            let mut out = Signals { lights: vec![blank.clone(); 10], ambient: blank, truth: None };
            Fabric { bounce, ..fabric(cloth.clone()) }.expose(&stage, tile, &mut out);
            out.lights.concat()
        };
        let (direct, all) = (expose(Bounce::None), expose(Bounce::Once));
        assert!(direct.iter().zip(&all).all(|(direct, all)| all >= direct));
        all.iter().sum::<f32>() / direct.iter().sum::<f32>() - 1.0
    };
    let (dark, white) = (gain(0.1), gain(0.7));
    assert!(white > 0.01 && white < 0.5, "white cloth gains {white}");
    assert!(dark < 0.25 * white, "dark cloth gains {dark}, white {white}");
}

#[test]
fn the_exposure_brings_the_brightest_light_to_half() {
    let stage = stage(240, 160);
    let subject = fabric(Preset::Denim.cloth(3));
    let exposure =
        auto_exposure(&subject, &stage, &(0..10).collect::<Vec<_>>(), 0.995, 0.5).unwrap();
    let sensor = Sensor::default().without_noise();
    let shots: Vec<Shot> = shots().into_iter().map(|shot| Shot { exposure, ..shot }).collect();
    let high: Vec<f64> = shoot(&subject, &stage, &sensor, &shots, &|_| {})[..10]
        .iter()
        .map(|frame| {
            let mut sorted = frame.clone();
            sorted.sort_unstable();
            (f64::from(sorted[sorted.len() * 995 / 1000]) - 600.0) / 15783.0
        })
        .collect();
    let brightest = high.iter().copied().fold(0.0, f64::max);
    assert!((brightest - 0.5).abs() < 0.03, "{high:?}");
}

/// A shiny cloth lies on the same matt table as a dull one.
#[test]
fn the_table_does_not_shine_with_the_cloth() {
    let stage = stage(120, 80);
    let sensor = Sensor::default().without_noise();
    let photograph = |reflectance: Reflectance| {
        let extent = Some(Extent { width_mm: 150.0, height_mm: 100.0 });
        let swatch = Fabric { extent, ..fabric(Cloth { reflectance, ..flat() }) };
        shoot(&swatch, &stage, &sensor, &shots(), &|_| {})
    };
    let dull = photograph(Reflectance::Lambert);
    let shiny = photograph(Reflectance::Satin { f0: 0.05, alpha: 0.28 });
    let (corner, middle) = (5 * 120 + 5, 40 * 120 + 60);
    for (light, (dull, shiny)) in dull.iter().zip(&shiny).enumerate().take(10) {
        assert_eq!(dull[corner], shiny[corner], "light {light}");
        assert!(dull[middle] < shiny[middle], "light {light}");
    }
}

/// Signals and truth of a part of the frame through a lens that blurs.
fn blurred(cloth: Cloth, psf_px: f64, tile: Tile) -> Signals {
    let mut stage = stage(240, 160);
    stage.view.psf_px = psf_px;
    let blank = vec![0.0; tile.pixels()];
    let truth = Some(Truth::sized(tile.pixels()));
    let mut out = Signals { lights: vec![blank.clone(); 10], ambient: blank, truth };
    fabric(cloth).expose(&stage, tile, &mut out);
    out
}

#[test]
fn blur_leaves_what_is_even() {
    let tile = Tile { x: 0, y: 64, width: 48, height: 40 };
    let (sharp, soft) = (blurred(flat(), 0.0, tile), blurred(flat(), 0.7, tile));
    let all = |signals: &Signals| [signals.lights.concat(), signals.ambient.clone()].concat();
    for (sharp, soft) in all(&sharp).iter().zip(all(&soft)) {
        assert!((soft / sharp - 1.0).abs() < 1e-4, "{soft}, not {sharp}");
    }
    let (sharp, soft) = (sharp.truth.unwrap(), soft.truth.unwrap());
    for (sharp, soft) in sharp.albedo.iter().zip(&soft.albedo) {
        assert!((0..3).all(|c| (sharp[c] - soft[c]).abs() < 1e-5));
    }
}

/// Tiles do not show, and the coarser the blur, the less is left of the yarns.
#[test]
fn blur_knows_no_tiles_and_flattens_yarns() {
    let cloth = || Preset::Linen.cloth(3);
    let tile = Tile { x: 70, y: 50, width: 24, height: 20 };
    let whole = blurred(cloth(), 0.7, tile);
    for (x, y) in [(70, 50), (82, 50), (70, 60), (82, 60)] {
        let part = blurred(cloth(), 0.7, Tile { x, y, width: 12, height: 10 });
        for at in 0..120 {
            let place = (y - 50 + at / 12) * 24 + x - 70 + at % 12;
            let (part, whole) = (part.lights[4][at], whole.lights[4][place]);
            // Shadows may end on either side of a node of the height grid.
            assert!((part - whole).abs() < 0.03 * whole.max(0.02), "{part}, not {whole}");
        }
    }
    let spread = |signals: &Signals| {
        let values = &signals.truth.as_ref().unwrap().height_mm;
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter().map(|z| (z - mean).powi(2)).sum::<f32>().sqrt()
    };
    let [none, some, much] = [0.0, 0.7, 2.0].map(|psf| spread(&blurred(cloth(), psf, tile)));
    assert!(much < 0.5 * some && some < 0.8 * none, "{none}, {some}, {much}");
    let normals = &whole.truth.unwrap().normal;
    assert!(normals.iter().all(|n| (dot(*n, *n) - 1.0).abs() < 1e-5));
}

#[test]
fn a_board_blurs_at_its_edges_only() {
    use crate::target::{Art, BoardShape, Panel};
    let board = || Panel {
        rig_from_panel: nalgebra::IsometryMatrix3::identity(),
        art: Art::Board(BoardShape { columns: 7, rows: 5, square_mm: 20.0 }),
    };
    let expose = |psf_px| {
        let mut stage = stage(240, 160);
        stage.view.psf_px = psf_px;
        let tile = Tile { x: 0, y: 0, width: 240, height: 160 };
        let blank = vec![0.0; tile.pixels()];
        let mut out = Signals { lights: vec![blank.clone(); 10], ambient: blank, truth: None };
        board().expose(&stage, tile, &mut out);
        out.lights[0].clone()
    };
    let (sharp, soft) = (expose(0.0), expose(0.7));
    let differ = sharp.iter().zip(&soft).filter(|(a, b)| (*a / *b - 1.0).abs() > 1e-3).count();
    assert!(differ > 0 && differ < sharp.len() / 4, "{differ} of {}", sharp.len());
    let (a, b): (f32, f32) = (sharp.iter().sum(), soft.iter().sum());
    assert!((a / b - 1.0).abs() < 2e-3, "{a}, {b}");
}

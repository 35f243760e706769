//! The whole run, from folders to a folder.

use crate::files::{PROGRAM, StagedFolder, write_atomic};
use crate::instrument::{CAMERA_FILE, Calibration, MeasuredCamera, write_camera};
use crate::linear::Exposure;
use crate::linear::preview;
use crate::machine::Pool;
use crate::photometry::Counts;
use crate::photometry::Outcome;
use crate::session::Session;
use crate::solution::{
    ALBEDO_EXR, Finished, Grid, InputFolders, OUTPUT, Outputs, PlaneReport, REPORT_HTML,
    REPORT_JSON, REPORT_SCHEMA, Report, Residuals, Reuse, Scale,
};
use crate::solve::SolveError;
use crate::solve::bands::SolvedScene;
use crate::solve::bands::residual::ResidualFiles;
use crate::solve::current::{Inputs, still_current};
use crate::solve::options::Options;
use crate::solve::output::encode::write_maps;
use crate::solve::output::finish::{
    color_space, finish, leave_out_what_is_not_finite, pinhole, undistort,
};
use crate::solve::output::level::{check_reference, scale_to_reference};
use crate::solve::progress::{Progress, Stage};
use crate::solve::scene::Scene;
use crate::solve::scene::load::{Loaded, load, unverified};
use crate::swatch::MaskChoice;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use weavelight_calibration::description::{Camera, Image, Plane};
use weavelight_calibration::projection::Projector;

/// A solution that stands on disk.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// Its `report.json`.
    pub report: Report,
    /// Whether it was there already, made from the same inputs with the same settings.
    pub up_to_date: bool,
}

/// Solves a capture session and writes the solution's folder, with a page beside the maps where `page` writes one; nothing stands under its name before it is whole.
///
/// The same inputs give the same maps, byte for byte, whatever the number of threads and the order of the frames. A graphics
/// processor rounds otherwise: its normals agree within 0.001 degrees.
///
/// # Errors
/// [`SolveError`] names the file and the remedy; nothing is left behind then.
pub fn run(
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
    page: Option<Page>,
) -> Result<Solved, SolveError> {
    Pool::new(options.threads).install(|| run_on_this_pool(options, progress, page))
}

/// Writes the page that a person looks at.
type Page<'a> = &'a (dyn Fn(&Shown) -> String + Sync);

/// What a page can show, before the solution stands under its name.
pub struct Shown<'a> {
    /// The capture session's name.
    pub name: &'a str,
    /// The maps.
    pub maps: &'a Finished,
    /// The frames made small, in light order, ambient frames last; linear, white-balanced for its light, each with its caption.
    pub frames: &'a [(String, Image<[f32; 3]>)],
    /// What the solve says of itself; the page's own time is not in it yet.
    pub report: &'a Report,
}

fn run_on_this_pool(
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
    page: Option<Page>,
) -> Result<Solved, SolveError> {
    let watch = Stopwatch::start();
    let session = Session::load(&options.session)?;
    // Hashed before it is read, and once more after that: what is read is what was hashed.
    let inputs = Inputs::of(options, &session).or_else(|error| {
        // A calibration that is missing or broken says so better.
        Calibration::load(&options.calibration).map_err(SolveError::from)?;
        Err(SolveError::from(error))
    })?;
    let calibration = Calibration::load(&options.calibration)?;
    if options.grid == Grid::Undistorted && calibration.camera.is_none() {
        return Err(SolveError::NothingToUndistort { calibration: calibration.folder });
    }
    check_reference(options, calibration.color.camera_to_linear_srgb.is_some())?;
    let before = match options.reuse {
        Reuse::IfCurrent => still_current(options, &inputs.key(options), &session, page.is_some()),
        Reuse::Never => None,
    };
    if let Some(report) = before {
        return Ok(Solved { report, up_to_date: true });
    }
    let report = make(options, &session, calibration, &inputs, watch, (progress, page))?;
    Ok(Solved { report, up_to_date: false })
}

fn make(
    options: &Options,
    session: &Session,
    calibration: Calibration,
    inputs: &Inputs,
    mut watch: Stopwatch,
    (progress, page): (&(dyn Fn(Progress) + Sync), Option<Page>),
) -> Result<Report, SolveError> {
    // Before the work: a place that cannot be written is told at once.
    let staged = StagedFolder::create(&options.out, OUTPUT)?;
    let Loaded { mut scene, mut warnings } =
        load(options, &inputs.sealed(session), calibration, progress)
            .map_err(|error| inputs.error_of(session, error))?;
    inputs.still_the_same(session)?;
    warnings.extend(unverified(session));
    watch.lap(Stage::Read);
    warnings.extend(scene.leave_out_what_adds_nothing()?);
    let mut swatch = None;
    if options.mask == MaskChoice::Found {
        let found = scene.find_swatch(&|_| {})?;
        scene.mask = (found.table_share > 0.0).then_some(found.mask);
        swatch = Some(found.said);
    }
    if options.scale != Scale::Full {
        scene = scene.reduced(options.scale);
    }
    let (solved, residuals) = solve_into(&staged, &scene, options, progress)?;
    let SolvedScene { maps, warnings: of_solve, device } = solved;
    warnings.extend(of_solve);
    watch.lap(Stage::Solve);
    let frames = if page.is_some() { previews(&scene) } else { Vec::new() };
    let rest = Rest::of(scene);
    let undistorted = rest.camera.as_ref().filter(|_| options.grid == Grid::Undistorted);
    let residuals = residuals.map(|files| files.finish(undistorted)).transpose()?;
    let counts = maps.counts;
    let shown = page.is_some();
    let wanted = Outputs {
        albedo: options.outputs.albedo || shown || options.reference_lab.is_some(),
        shade: options.outputs.shade || shown,
        ..options.outputs
    };
    let mut maps = finish(maps, &rest.color, wanted, options.albedo);
    if options.scale == Scale::Full {
        warnings.append(&mut maps.said);
    }
    warnings.extend(leave_out_what_is_not_finite(&mut maps));
    if let Some(lab) = options.reference_lab {
        warnings.extend(scale_to_reference(&mut maps, lab)?);
    }
    let finished = on_grid(maps, rest.camera.as_ref(), options.grid);
    watch.lap(Stage::Colour);
    write_maps(staged.path(), &finished, options, progress)?;
    copy_camera(&rest, options, staged.path())?;
    watch.lap(Stage::Write);
    let mut report = report(options, &rest, &finished, counts);
    warnings.extend(albedo_changes(&options.out, &report));
    report.residuals = residuals.unwrap_or_default();
    report.warnings = warnings;
    report.device = Some(device);
    report.inputs = inputs.for_report();
    report.folders = Some(InputFolders::new(&options.session, &options.calibration));
    report.key = Some(inputs.key(options));
    report.swatch = swatch;
    report.seconds = watch.seconds.clone();
    if let Some(page) = page {
        let shown =
            Shown { name: &session.name, maps: &finished, frames: &frames, report: &report };
        write_atomic(&staged.join(REPORT_HTML), page(&shown).as_bytes())?;
        watch.lap(Stage::Page);
        report.seconds = watch.seconds;
    }
    report.write(&staged.join(REPORT_JSON))?;
    staged.commit()?;
    Ok(report)
}

/// Solves; residuals, where asked for, go to their files meanwhile.
fn solve_into(
    staged: &StagedFolder,
    scene: &Scene,
    options: &Options,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<(SolvedScene, Option<ResidualFiles>), SolveError> {
    let (method, device) = (options.method, &options.device);
    let checked = scene.check()?;
    if options.residuals == Residuals::Leave {
        return Ok((checked.solve(method, device, None, progress)?, None));
    }
    let lights = scene.lights.iter().map(|light| light.index).collect();
    let size_px = [scene.width, scene.height];
    let resampled = options.grid == Grid::Undistorted && scene.camera.is_some();
    let files = ResidualFiles::create(staged.path(), lights, size_px, resampled)?;
    let write = |light: usize, y: usize, values: &[f32]| files.write_row(light, y, values);
    let solved = checked.solve(method, device, Some(&write), progress)?;
    Ok((solved, Some(files)))
}

/// Longest side of the frames on a page, pixels.
const PREVIEW_SIDE: usize = 320;

fn previews(scene: &Scene) -> Vec<(String, Image<[f32; 3]>)> {
    let lit = scene.lights.iter().flat_map(|light| {
        let balance = balance(light.calibrated.light.intensity());
        let name = format!("light {}", light.index);
        light.exposures.iter().map(move |exposure| (name.clone(), exposure, balance))
    });
    let dark = scene.ambient.iter().map(|exposure| ("ambient".to_owned(), exposure, [1.0; 3]));
    let all: Vec<(String, &Exposure, [f32; 3])> = lit.chain(dark).collect();
    all.into_par_iter()
        .map(|(name, exposure, balance)| {
            let file = exposure.path.file_name().unwrap_or_default().to_string_lossy();
            let caption =
                format!("{name}: {file}, {} s, ISO {}", exposure.exposure_s, exposure.iso);
            let mut small = preview(&exposure.frame, PREVIEW_SIDE);
            let channels = small.data.iter_mut().flat_map(|rgb| rgb.iter_mut().zip(balance));
            channels.for_each(|(value, gain)| *value *= gain);
            (caption, small)
        })
        .collect()
}

/// Gains that show white as white under a light, green = 1.
fn balance(intensity: [f64; 3]) -> [f32; 3] {
    intensity.map(|channel| if channel > 0.0 { (intensity[1] / channel) as f32 } else { 1.0 })
}

/// What is still needed of a scene when its frames are not: they make room for the files being encoded.
struct Rest {
    camera: Option<Camera>,
    calibrated_camera: std::path::PathBuf,
    plane: Plane,
    color: crate::instrument::Color,
    lights_used: Vec<usize>,
    pixels: usize,
}

impl Rest {
    fn of(scene: Scene) -> Self {
        Self {
            lights_used: scene.lights.iter().map(|light| light.index).collect(),
            pixels: scene.width * scene.height,
            calibrated_camera: scene.origin.calibration.join(CAMERA_FILE),
            camera: scene.camera,
            plane: scene.plane,
            color: scene.color,
        }
    }
}

fn on_grid(maps: Finished, camera: Option<&Camera>, grid: Grid) -> Finished {
    match (grid, camera) {
        (Grid::Undistorted, Some(camera)) => undistort(&maps, camera),
        _ => maps,
    }
}

/// The camera that the maps' pixels belong to: the calibration's file as it is, or without its distortion, or of a preview.
fn copy_camera(rest: &Rest, options: &Options, folder: &Path) -> Result<(), SolveError> {
    let Some(camera) = &rest.camera else { return Ok(()) };
    let target = folder.join(CAMERA_FILE);
    match options.grid {
        Grid::Sensor if options.scale == Scale::Full => {
            let copied = crate::files::copy_input(&rest.calibrated_camera, &target);
            copied.map_err(|source| crate::files::FileError::write(&target, source))?;
        }
        Grid::Sensor => {
            write_camera(folder, &MeasuredCamera::new(camera.clone()), &Default::default())?;
        }
        Grid::Undistorted => {
            write_camera(folder, &MeasuredCamera::new(pinhole(camera)), &Default::default())?;
        }
    }
    Ok(())
}

/// What to say where this albedo takes the place of one of another meaning: a solution from before shade was divided out.
pub(super) fn albedo_changes(out: &Path, report: &Report) -> Option<String> {
    let earlier = Report::read(&out.join(REPORT_JSON)).ok()?;
    let appeared = earlier.albedo.is_none() && out.join(ALBEDO_EXR).is_file();
    let reflects = report.albedo.as_ref().is_some_and(|albedo| albedo.kind == "reflectance");
    (appeared && reflects).then(|| {
        "The albedo differs from that of the earlier solution here: the shading of unresolved relief was in it; now it is \
         divided out, and lies in shade.exr."
            .to_owned()
    })
}

fn report(options: &Options, rest: &Rest, maps: &Finished, counts: Counts) -> Report {
    let undistorted = options.grid == Grid::Undistorted;
    let camera = rest
        .camera
        .as_ref()
        .map(|camera| if undistorted { pinhole(camera) } else { camera.clone() });
    Report {
        schema: REPORT_SCHEMA,
        program: PROGRAM.to_owned(),
        method: options.method.name().to_owned(),
        size_px: [maps.mask.width, maps.mask.height],
        scale: options.scale as usize,
        lights_used: rest.lights_used.clone(),
        pixels: rest.pixels as u64,
        solved: maps.mask.data.iter().filter(|&&solved| solved != 0).count() as u64,
        robust_pixels: counts.robust() as u64,
        saturated_pixels: counts.saturated as u64,
        defective_pixels: counts.of(Outcome::Defective) as u64,
        outcomes: outcomes(&counts),
        residual_rms: (counts.solved() > 0).then(|| counts.residual_rms()),
        seconds: BTreeMap::new(),
        mm_per_px: camera.and_then(|camera| mm_per_px(&camera, &rest.plane)),
        undistorted,
        plane: PlaneReport {
            point_mm: rest.plane.point_mm.coords.into(),
            normal: rest.plane.normal.into_inner().into(),
        },
        color_space: color_space(&rest.color).to_owned(),
        albedo: (!maps.albedo.data.is_empty() || !maps.shade.data.is_empty())
            .then(|| maps.albedo_report.clone()),
        residuals: vec![],
        warnings: vec![],
        inputs: vec![],
        folders: None,
        device: None,
        key: None,
        swatch: None,
    }
}

fn outcomes(counts: &Counts) -> BTreeMap<String, u64> {
    let names = [
        (Outcome::Fitted, "fitted"),
        (Outcome::Shadow, "shadow"),
        (Outcome::Highlight, "highlight"),
        (Outcome::Other, "other"),
        (Outcome::TooFewLights, "too_few_lights"),
        (Outcome::CoplanarLights, "coplanar_lights"),
        (Outcome::NoSurface, "no_surface"),
        (Outcome::Masked, "masked"),
        (Outcome::Defective, "defective"),
    ];
    names.into_iter().map(|(outcome, name)| (name.to_owned(), counts.of(outcome) as u64)).collect()
}

/// Side of the square on the plane that the picture's middle pixel sees the area of.
fn mm_per_px(camera: &Camera, plane: &Plane) -> Option<f64> {
    let projector = Projector::new(camera);
    let (u, v) = ((camera.width_px - 1) as f64 / 2.0, (camera.height_px - 1) as f64 / 2.0);
    let at = |du: f64, dv: f64| projector.on_plane([u + du, v + dv], plane);
    let across = at(0.5, 0.0)? - at(-0.5, 0.0)?;
    let down = at(0.0, 0.5)? - at(0.0, -0.5)?;
    Some(across.cross(&down).norm().sqrt())
}

/// Seconds per stage.
struct Stopwatch {
    lap: Instant,
    seconds: BTreeMap<String, f64>,
}

impl Stopwatch {
    fn start() -> Self {
        Self { lap: Instant::now(), seconds: BTreeMap::new() }
    }

    fn lap(&mut self, stage: Stage) {
        self.seconds.insert(stage.name().to_owned(), self.lap.elapsed().as_secs_f64());
        self.lap = Instant::now();
    }
}

//! Who solves complete neighbours: the processor, or a graphics processor where that is asked for or measured to be faster.

use crate::files::PROGRAM;
use crate::gpu::{Device, Gpu};
use crate::gpu::{Measured, Memory};
use crate::photometry::Method;
use crate::solve::SolveError;
use crate::solve::bands::Run;
use crate::solve::bands::on_gpu::OnGpu;
use crate::solve::current::REVISION;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Who it came to be.
pub(crate) struct Chosen {
    pub(crate) gpu: Option<Arc<Gpu>>,
    pub(crate) why: String,
}

/// Samples of a picture that the processor solves before a graphics processor is found: two megapixels under ten lights.
const WORTH_ASKING: usize = 20_000_000;
/// Rows to begin with, a thread: a graphics processor that takes this many times as long there is not worth more time.
const FEW_ROWS: usize = 16;
const HOPELESS: f64 = 4.0;
/// Rows to measure with, a thread.
const MEASURED_ROWS: usize = 128;
/// Measurements of each, the shortest counts.
const MEASUREMENTS: usize = 2;

impl Chosen {
    fn processor(why: impl Into<String>) -> Self {
        Self { gpu: None, why: why.into() }
    }
}

/// Decides on the current thread pool.
///
/// # Errors
/// Where a graphics processor is asked for and there is none.
pub(crate) fn choose(run: &Run, device: &Device) -> Result<Chosen, SolveError> {
    if run.method() == Method::Robust {
        return Ok(Chosen::processor("the subset test of every photosite is the processor's"));
    }
    let asked = "asked for";
    Ok(match device {
        Device::Cpu => Chosen::processor(asked),
        Device::Gpu => Chosen { gpu: Some(Arc::new(Gpu::open()?)), why: asked.to_owned() },
        Device::Opened(gpu) => Chosen { gpu: Some(gpu.clone()), why: asked.to_owned() },
        Device::Auto { memory } => {
            let samples = run.photosites() * run.lights();
            if samples < WORTH_ASKING {
                Chosen::processor("the picture is too small to look for a graphics processor")
            } else {
                faster(run, memory.as_deref())
            }
        }
    })
}

/// The faster of the two, as remembered, else as measured now.
pub(crate) fn faster(run: &Run, memory: Option<&Path>) -> Chosen {
    let mut known =
        memory.map_or_else(|| Memory::new(revision()), |path| Memory::read(path, revision()));
    let kind = kind_of(run);
    let remembered = known.of(&kind).cloned();
    if let Some(measured) = remembered.as_ref().filter(|measured| !measured.gpu_is_faster()) {
        return Chosen::processor(format!("remembered: {}", measured.text()));
    }
    let gpu = match Gpu::open() {
        Ok(gpu) => Arc::new(gpu),
        Err(error) => return Chosen::processor(error.to_string()),
    };
    if let Some(measured) = remembered.filter(|measured| measured.adapter == *gpu.adapter()) {
        return Chosen { gpu: Some(gpu), why: format!("remembered: {}", measured.text()) };
    }
    let [processor_ns, gpu_ns] = match measure(run, &gpu) {
        Ok(measured) => measured,
        Err(why) => return Chosen::processor(why),
    };
    let measured = Measured { kind, adapter: gpu.adapter().clone(), processor_ns, gpu_ns };
    let chosen = measured.gpu_is_faster().then_some(gpu);
    let why = format!("measured: {}", measured.text());
    known.remember(measured);
    if let Some(path) = memory {
        known.write(path);
    }
    Chosen { gpu: chosen, why }
}

/// Another revision of the solve may be faster on either.
fn revision() -> String {
    format!("{PROGRAM}, solve {REVISION}")
}

/// What a measurement holds for, besides the machine.
fn kind_of(run: &Run) -> String {
    let threads = rayon::current_num_threads();
    format!("{}, {} lights, {threads} threads", run.method().name(), run.lights())
}

/// Nanoseconds a photosite by the processor and by the graphics processor, transfers and what it leaves over included.
fn measure(run: &Run, gpu: &Gpu) -> Result<[f64; 2], String> {
    let on = OnGpu::new(gpu);
    let threads = rayon::current_num_threads();
    let few = middle_rows(run, FEW_ROWS * threads);
    // The first one warms up.
    let _ = time_rows(run, &on, few.clone());
    let mut least = time_rows(run, &on, few);
    if least[1] < HOPELESS * least[0] {
        let many = middle_rows(run, MEASURED_ROWS * threads);
        least = [f64::INFINITY; 2];
        for _ in 0..MEASUREMENTS {
            let times = time_rows(run, &on, many.clone());
            least.iter_mut().zip(times).for_each(|(least, time)| *least = least.min(time));
        }
    }
    match on.failure() {
        Some(failure) => Err(failure.to_string()),
        None => Ok(least),
    }
}

/// One measurement of both.
fn time_rows(run: &Run, on: &OnGpu, rows: Range<usize>) -> [f64; 2] {
    [None, Some(on)].map(|who| {
        let begun = Instant::now();
        let maps = run.solve_rows(rows.clone(), who, &|_| {});
        let photosites = maps.outcome.width * maps.outcome.height;
        1e9 * begun.elapsed().as_secs_f64() / photosites as f64
    })
}

/// Rows out of the middle of what is to be solved.
fn middle_rows(run: &Run, most: usize) -> Range<usize> {
    let all = run.rows_inside();
    let count = all.len().min(most);
    let first = all.start + (all.len() - count) / 2;
    first..first + count
}

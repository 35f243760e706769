//! A band of rows whose complete neighbours a graphics processor solves. While it works on one tile the next is normalised;
//! what it leaves over of the one before is solved here.

use crate::gpu::{Adapter, Flight, Gpu, GpuError, Tile, TileRow};
use crate::linear::SignalRows;
use crate::photometry::Counts;
use crate::photometry::{
    CutRow, FieldRow, Method, Outcome, RowError, RowInput, RowOutput, RowSolver,
};
use crate::solution::DeviceReport;
use crate::solve::bands::{Band, ReadRow, Run, Worker};
use crate::solve::light_field::FieldRows;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// A graphics processor in the service of a run.
pub(crate) struct OnGpu<'g> {
    gpu: &'g Gpu,
    /// Why it is not asked any more.
    failure: OnceLock<GpuError>,
    bytes_up: AtomicU64,
    bytes_down: AtomicU64,
    busy_ns: AtomicU64,
}

/// A row that is read and cut.
#[derive(Default)]
struct Prepared {
    y: usize,
    /// Empty where the whole row is outside the mask.
    columns: Range<usize>,
    signal: SignalRows,
    vectors: Vec<[f64; 3]>,
    step: usize,
    lights: usize,
    cut: CutRow,
}

/// Rows of a tile, kept from tile to tile.
#[derive(Default)]
pub(crate) struct TileRows {
    rows: Vec<Prepared>,
    used: usize,
}

impl<'g> OnGpu<'g> {
    pub(crate) fn new(gpu: &'g Gpu) -> Self {
        Self {
            gpu,
            failure: OnceLock::new(),
            bytes_up: AtomicU64::new(0),
            bytes_down: AtomicU64::new(0),
            busy_ns: AtomicU64::new(0),
        }
    }

    /// Whether it has something to do: it has not failed, and the method does not test every photosite.
    pub(crate) fn serves(&self, method: Method) -> bool {
        method != Method::Robust && self.failure.get().is_none()
    }

    /// Why it is not asked any more, if it failed.
    pub(crate) fn failure(&self) -> Option<&GpuError> {
        self.failure.get()
    }

    /// Sends a tile off; `None` where that fails, for good.
    fn submit(&self, tile: &Tile) -> Option<Flight<'g>> {
        if self.failure.get().is_some() {
            return None;
        }
        let sending = Instant::now();
        let flight = self.gpu.submit(tile).map_err(|error| self.note(error)).ok()?;
        self.busy(sending);
        let [up, down] = flight.bytes();
        self.bytes_up.fetch_add(up, Ordering::Relaxed);
        self.bytes_down.fetch_add(down, Ordering::Relaxed);
        Some(flight)
    }

    fn note(&self, error: GpuError) {
        // The first failure is the one to tell.
        let _ = self.failure.set(error);
    }

    fn busy(&self, since: Instant) {
        let nanoseconds = u64::try_from(since.elapsed().as_nanos()).unwrap_or(u64::MAX);
        self.busy_ns.fetch_add(nanoseconds, Ordering::Relaxed);
    }
}

impl Run<'_> {
    /// Solves a band, tile by tile.
    pub(crate) fn solve_band_on(
        &self,
        on: &OnGpu,
        worker: &mut Worker,
        band: &mut Band,
        done: &(dyn Fn(usize) + Sync),
    ) -> Counts {
        let rows_at_once = on.gpu.rows_at_once(self.scene.width, self.scene.lights.len());
        let mut field = FieldRows::new(self.field);
        let mut counts = Counts::default();
        let [mut next, mut before] = std::mem::take(&mut worker.tiles);
        let mut flying = None;
        let end = band.first_row + band.outcome.len() / self.scene.width;
        for first in (band.first_row..end).step_by(rows_at_once) {
            let rows = first..end.min(first + rows_at_once);
            self.prepare(rows.clone(), &mut field, &mut next);
            let flight = on.submit(&self.tile(&next));
            if let Some((flight, rows)) = flying.replace((flight, rows.len())) {
                self.settle((on, flight), &mut before, worker, band, &mut counts);
                done(rows);
            }
            std::mem::swap(&mut next, &mut before);
        }
        if let Some((flight, rows)) = flying {
            self.settle((on, flight), &mut before, worker, band, &mut counts);
            done(rows);
        }
        worker.tiles = [next, before];
        counts
    }

    /// Reads and cuts rows.
    fn prepare(&self, rows: Range<usize>, field: &mut FieldRows, tile: &mut TileRows) {
        tile.used = rows.len();
        tile.rows.resize_with(tile.rows.len().max(tile.used), Prepared::default);
        for (y, row) in rows.zip(&mut tile.rows) {
            row.y = y;
            row.columns = self.columns_inside(y).unwrap_or(0..0);
            if row.columns.is_empty() {
                continue;
            }
            self.read_row(y, row.columns.clone(), &mut row.signal);
            let of_row = field.row(y, row.columns.start);
            row.cut.cut(&of_row, row.columns.len());
            row.vectors.clear();
            row.vectors.extend_from_slice(of_row.vectors);
            (row.step, row.lights) = (of_row.step, of_row.lights);
        }
    }

    /// The rows of a tile inside the mask, as the graphics processor wants them.
    fn tile<'t>(&'t self, tile: &'t TileRows) -> Tile<'t> {
        let rows = tile.rows[..tile.used].iter().filter(|row| !row.columns.is_empty());
        let of_row = |row: &'t Prepared| TileRow {
            signal: row.signal.signals().iter().map(Vec::as_slice).collect(),
            noise_scale: row.signal.noise_scale(),
            cut: &row.cut,
            parity: row.y,
        };
        Tile {
            rows: rows.map(of_row).collect(),
            lights: self.scene.lights.len(),
            variance: &self.variance,
            method: self.method,
        }
    }

    /// Waits for a tile and writes its rows; solves them here where there is no answer.
    fn settle(
        &self,
        (on, flight): (&OnGpu, Option<Flight>),
        tile: &mut TileRows,
        worker: &mut Worker,
        band: &mut Band,
        counts: &mut Counts,
    ) {
        let mut answered = false;
        if let Some(flight) = flight {
            let waiting = Instant::now();
            let landed = flight.land(|answer| {
                on.busy(waiting);
                answered = true;
                let mut number = 0;
                self.write_tile(tile, worker, band, counts, |solver, input, output, cut| {
                    number += 1;
                    solver.solve_rest(input, output, self.method, (cut, &answer.row(number - 1)))
                });
            });
            landed.unwrap_or_else(|error| on.note(error));
        }
        if !answered {
            self.write_tile(tile, worker, band, counts, |solver, input, output, _| {
                solver.solve(input, output, self.method)
            });
        }
    }

    fn write_tile(
        &self,
        tile: &mut TileRows,
        worker: &mut Worker,
        band: &mut Band,
        counts: &mut Counts,
        mut kernel: impl FnMut(
            &mut RowSolver,
            &RowInput,
            &mut RowOutput,
            &mut CutRow,
        ) -> Result<(), RowError>,
    ) {
        for row in &mut tile.rows[..tile.used] {
            if row.columns.is_empty() {
                counts.outcomes[Outcome::Masked as usize] += self.scene.width;
                self.no_residuals(worker, row.y);
                continue;
            }
            let Prepared { y, columns, signal, vectors, step, lights, cut } = row;
            let field = FieldRow { step: *step, vectors, lights: *lights };
            let read = ReadRow { y: *y, columns: columns.clone(), rows: signal, field };
            self.write_row(worker, band, read, counts, |solver, input, output| {
                kernel(solver, input, output, cut)
            });
        }
    }
}

/// What the report says of who solved, and a warning where a graphics processor failed.
pub(crate) fn report_of(why: String, on: Option<&OnGpu>) -> (DeviceReport, Option<String>) {
    let Some(on) = on else { return (DeviceReport::processor(why), None) };
    let megabytes = |bytes: &AtomicU64| 1e-6 * bytes.load(Ordering::Relaxed) as f64;
    let Adapter { name, driver, software } = on.gpu.adapter();
    let report = DeviceReport {
        kind: "gpu".to_owned(),
        why,
        adapter: Some(name.clone()),
        driver: Some(driver.clone()),
        software: Some(*software),
        sent_mb: Some(megabytes(&on.bytes_up)),
        received_mb: Some(megabytes(&on.bytes_down)),
        busy_s: Some(1e-9 * on.busy_ns.load(Ordering::Relaxed) as f64),
    };
    let failure = on.failure().map(|error| format!("{error}; the processor solved the rest."));
    (report, failure)
}

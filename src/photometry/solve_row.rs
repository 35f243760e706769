//! The fast path of a row: blocks of neighbours first, then those photosites that need more.

use multiversion::multiversion;
use pulp::Arch;

use super::block::{Block, LANES, Lanes, Place, ZERO};
use super::complete::{LeastSquares, Neighbours, Weighted};
use super::elsewhere::{CutRow, Found};
use super::least_squares::solve_masked;
use super::method::{MOST_LENGTHENING, Method};
use super::pieces::Pieces;
use super::reference::solve_column;
use super::robust::RobustSolver;
use super::row::{Outcome, RowError, RowInput, RowOutput, check_shapes};
use super::surface::Surface;
use super::weighted::solve_weighted;

/// Solves rows; keeps its buffers from one row to the next. One for every thread.
#[derive(Default)]
pub struct RowSolver {
    pieces: Pieces,
    block: Block,
    surface: Surface,
    weights: Vec<Lanes>,
    arch: Arch,
    robust: RobustSolver,
    queues: Queues,
}

/// Photosites that wait for a slower path.
#[derive(Default)]
struct Queues {
    /// Samples missing, or too little explained by what suffices for most.
    apart: Vec<Place>,
    /// Residual too large, where that is tested.
    suspect: Vec<Place>,
    /// Beyond float32.
    deferred: Vec<usize>,
}

impl RowSolver {
    /// A solver without a row.
    pub fn new() -> Self {
        Self::default()
    }

    /// Solves a row: what [`reference_row`](super::reference_row) says, to within 0.001 degrees wherever both keep the same
    /// samples.
    ///
    /// # Errors
    /// [`RowError`] where the slices' lengths do not belong together; the output is untouched then.
    pub fn solve(
        &mut self,
        input: &RowInput,
        output: &mut RowOutput,
        method: Method,
    ) -> Result<(), RowError> {
        check_shapes(input, output)?;
        if output.outcome.is_empty() {
            return Ok(());
        }
        self.pieces.cut(&input.field, output.outcome.len());
        self.solve_cut(input, output, method, None);
        Ok(())
    }

    /// Solves a row whose neighbours have been solved elsewhere, all but what these leave open.
    ///
    /// `cut` is how the row was cut for that; it is as it was afterwards.
    ///
    /// # Errors
    /// As [`RowSolver::solve`].
    pub fn solve_rest(
        &mut self,
        input: &RowInput,
        output: &mut RowOutput,
        method: Method,
        (cut, found): (&mut CutRow, &Found),
    ) -> Result<(), RowError> {
        check_shapes(input, output)?;
        cut.check_shape(input.field.lights, output.outcome.len())?;
        found.check_lengths(output.outcome.len())?;
        std::mem::swap(&mut self.pieces, &mut cut.0);
        self.solve_cut(input, output, method, Some(found));
        std::mem::swap(&mut self.pieces, &mut cut.0);
        Ok(())
    }

    /// Solves the row that the pieces were cut from.
    fn solve_cut(
        &mut self,
        input: &RowInput,
        output: &mut RowOutput,
        method: Method,
        found: Option<&Found>,
    ) {
        self.block.reset(input);
        self.weights.resize(input.field.lights, ZERO);
        self.queues.apart.clear();
        self.queues.suspect.clear();
        self.queues.deferred.clear();
        for index in 0..self.pieces.list.len() {
            let piece = self.pieces.list[index];
            let columns = piece.start..piece.end;
            match method {
                _ if !piece.float32 => self.queues.deferred.extend(columns),
                Method::Robust => {
                    let places = columns.map(|column| Place { column, piece: index });
                    self.queues.suspect.extend(places);
                }
                _ => self.neighbours(index, input, output, (method, found)),
            }
        }
        self.apart(input, output, method);
        self.suspects(input, output);
        for &column in &self.queues.deferred {
            let pixel = solve_column(input, column, method);
            output.write(column, &pixel);
        }
    }

    /// Solves a piece, a block of neighbours at a time; or takes over what was found of it.
    fn neighbours(
        &mut self,
        index: usize,
        input: &RowInput,
        output: &mut RowOutput,
        (method, found): (Method, Option<&Found>),
    ) {
        let piece = &self.pieces.list[index];
        for start in (piece.start..piece.end).step_by(LANES) {
            let columns = start..piece.end.min(start + LANES);
            self.block.place(&columns);
            let found = found.filter(|found| found.is_decided(&columns));
            if found.is_none() {
                self.block.load(input, &columns);
            }
            let at = Neighbours { block: &self.block, pieces: &self.pieces, piece, input };
            let surface = &mut self.surface;
            let plain = method == Method::LeastSquares;
            surface.most_lengthening = if plain { 0.0 } else { MOST_LENGTHENING as f32 };
            match found {
                Some(found) => found.load(&columns, input.field.lights, surface),
                None if plain => self.arch.dispatch(LeastSquares { at, surface }),
                None => {
                    self.arch.dispatch(Weighted { at, surface, weights: &mut self.weights });
                }
            }
            write_or_refuse(&mut self.block, surface, self.pieces.unit, output);
            for k in 0..self.block.refused.len() {
                self.queues.refuse(self.block.refused[k], index, input, output);
            }
        }
    }

    /// Photosites by normal equations of their own.
    fn apart(&mut self, input: &RowInput, output: &mut RowOutput, method: Method) {
        for places in self.queues.apart.chunks(LANES) {
            let (block, pieces) = (&mut self.block, &self.pieces);
            let deferred = &mut self.queues.deferred;
            match method {
                Method::LeastSquares => {
                    least_squares_apart(block, pieces, places, input, output, deferred);
                }
                _ => {
                    let suspect = (method == Method::Auto).then_some(&mut self.queues.suspect);
                    weighted_apart(block, pieces, places, input, output, (suspect, deferred));
                }
            }
        }
    }

    /// The subset test for those that ask for it.
    fn suspects(&mut self, input: &RowInput, output: &mut RowOutput) {
        for places in self.queues.suspect.chunks(LANES) {
            let (block, robust, pieces) = (&mut self.block, &mut self.robust, &self.pieces);
            let deferred = &mut self.queues.deferred;
            robust_of_block(block, robust, pieces, places, input, output, deferred);
        }
    }
}

impl Queues {
    /// A photosite that its neighbours' way has not solved.
    fn refuse(&mut self, column: usize, piece: usize, input: &RowInput, output: &mut RowOutput) {
        let dark = |y: &&[f32]| y[column] == 0.0 || !y[column].is_finite();
        if usable_samples(input, column) < 3 {
            output.clear(column, Outcome::TooFewLights);
        } else if input.signal.iter().all(dark) {
            output.clear(column, Outcome::NoSurface);
        } else {
            self.apart.push(Place { column, piece });
        }
    }
}

/// Writes a surface of neighbours and notes which columns it does not carry.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn write_or_refuse(block: &mut Block, surface: &Surface, unit: f64, output: &mut RowOutput) {
    let mut refused = std::mem::take(&mut block.refused);
    refused.clear();
    surface.write(block, unit, output, |k, _| refused.push(block.column[k]));
    block.refused = refused;
}

/// Samples that a column can use.
fn usable_samples(input: &RowInput, column: usize) -> usize {
    input.signal.iter().filter(|y| y[column].is_finite()).count()
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn least_squares_apart(
    block: &mut Block,
    pieces: &Pieces,
    places: &[Place],
    input: &RowInput,
    output: &mut RowOutput,
    deferred: &mut Vec<usize>,
) {
    block.gather(input, pieces, places);
    let surface = solve_masked(block);
    surface.write(block, pieces.unit, output, |k, _| deferred.push(block.column[k]));
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn weighted_apart(
    block: &mut Block,
    pieces: &Pieces,
    places: &[Place],
    input: &RowInput,
    output: &mut RowOutput,
    (suspects, deferred): (Option<&mut Vec<Place>>, &mut Vec<usize>),
) {
    block.gather(input, pieces, places);
    let mut solved = solve_weighted(block);
    let mut withdrawn = [false; LANES];
    if let Some(suspects) = suspects {
        for k in 0..block.len {
            withdrawn[k] = solved.surface.carried[k] && solved.is_suspect(k);
            if withdrawn[k] {
                suspects.push(places[k]);
                solved.surface.carried[k] = false;
            }
        }
    }
    solved.surface.write(block, pieces.unit, output, |k, _| {
        if !withdrawn[k] {
            deferred.push(block.column[k]);
        }
    });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2+fma"))]
fn robust_of_block(
    block: &mut Block,
    robust: &mut RobustSolver,
    pieces: &Pieces,
    places: &[Place],
    input: &RowInput,
    output: &mut RowOutput,
    deferred: &mut Vec<usize>,
) {
    block.gather(input, pieces, places);
    if block.is_dark() {
        return dark(block, output);
    }
    let solved = robust.solve(block);
    let unit = pieces.unit;
    solved.surface.write(block, unit, output, |k, output| {
        defer(input, block.column[k], output, deferred);
    });
}

/// Sends a photosite to float64 unless it is clear without that nothing can be solved.
fn defer(input: &RowInput, column: usize, output: &mut RowOutput, deferred: &mut Vec<usize>) {
    match usable_samples(input, column) {
        0..3 => output.clear(column, Outcome::TooFewLights),
        _ => deferred.push(column),
    }
}

/// A block without light: nothing to solve, as over the table when a mask is set.
fn dark(block: &Block, output: &mut RowOutput) {
    for k in 0..block.len {
        let few = block.usable_samples(k) < 3;
        output.clear(block.column[k], if few { Outcome::TooFewLights } else { Outcome::NoSurface });
    }
}

//! The fast path of a row: blocks of neighbours first, then those photosites that need more.

use std::ops::Range;

use multiversion::multiversion;

use super::block::{Block, LANES, Place};
use super::least_squares::{solve_complete, solve_masked};
use super::method::Method;
use super::pieces::{Needs, Pieces};
use super::reference::solve_column;
use super::robust::RobustSolver;
use super::row::{Outcome, RowError, RowInput, RowOutput, check_shapes};
use super::weighted::solve_weighted;

/// Solves rows; keeps its buffers from one row to the next. One for every thread.
#[derive(Default)]
pub struct RowSolver {
    pieces: Pieces,
    block: Block,
    robust: RobustSolver,
    queues: Queues,
}

/// Photosites that wait for a slower path.
#[derive(Default)]
struct Queues {
    /// Samples missing.
    masked: Vec<Place>,
    /// Residual too large, where that is tested.
    suspect: Vec<Place>,
    test: bool,
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
        let needs = if method == Method::LeastSquares { Needs::Inverse } else { Needs::Lights };
        self.pieces.cut(&input.field, output.outcome.len(), needs);
        self.block.reset(input);
        self.queues.masked.clear();
        self.queues.suspect.clear();
        self.queues.test = method == Method::Auto;
        self.queues.deferred.clear();
        for index in 0..self.pieces.list.len() {
            let piece = self.pieces.list[index];
            match method {
                _ if !piece.float32 => self.queues.deferred.extend(piece.start..piece.end),
                Method::LeastSquares => {
                    self.neighbours(index, input, output, least_squares_of_block);
                }
                Method::Weighted | Method::Auto => {
                    self.neighbours(index, input, output, weighted_of_block);
                }
                Method::Robust => {
                    self.queues.suspect.extend(
                        (piece.start..piece.end).map(|column| Place { column, piece: index }),
                    );
                }
            }
        }
        self.masked(input, output);
        self.suspects(input, output);
        for &column in &self.queues.deferred {
            let pixel = solve_column(input, column, method);
            output.write(column, &pixel);
        }
        Ok(())
    }

    /// Solves a piece, a block of neighbours at a time.
    fn neighbours(
        &mut self,
        index: usize,
        input: &RowInput,
        output: &mut RowOutput,
        solve: BlockSolve,
    ) {
        let piece = &self.pieces.list[index];
        for start in (piece.start..piece.end).step_by(LANES) {
            let len = LANES.min(piece.end - start);
            solve(
                &mut self.block,
                &self.pieces,
                index,
                start..start + len,
                input,
                output,
                &mut self.queues,
            );
        }
    }

    /// Least squares of photosites with samples missing.
    fn masked(&mut self, input: &RowInput, output: &mut RowOutput) {
        for places in self.queues.masked.chunks(LANES) {
            self.block.gather(input, &self.pieces, places);
            masked_of_block(&mut self.block, self.pieces.unit, output, &mut self.queues.deferred);
        }
    }
}

impl RowSolver {
    /// The subset test for those that ask for it.
    fn suspects(&mut self, input: &RowInput, output: &mut RowOutput) {
        for places in self.queues.suspect.chunks(LANES) {
            self.block.gather(input, &self.pieces, places);
            let unit = self.pieces.unit;
            robust_of_block(
                &mut self.block,
                &mut self.robust,
                unit,
                output,
                &mut self.queues.deferred,
            );
        }
    }
}

/// Solves the columns of a range, which lie on one piece.
type BlockSolve =
    fn(&mut Block, &Pieces, usize, Range<usize>, &RowInput, &mut RowOutput, &mut Queues);

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn least_squares_of_block(
    block: &mut Block,
    pieces: &Pieces,
    piece: usize,
    columns: Range<usize>,
    input: &RowInput,
    output: &mut RowOutput,
    queues: &mut Queues,
) {
    block.load(input, pieces, &pieces.list[piece], columns);
    if block.is_dark() {
        return dark(block, output);
    }
    if output.kept.is_some() {
        block.weigh_equally();
    }
    let surface = solve_complete(block, pieces, &pieces.list[piece]);
    surface.write(block, pieces.unit, output, |k, output| {
        let column = block.column[k];
        match block.usable_samples(k) {
            0..3 => output.clear(column, Outcome::TooFewLights),
            all if all == block.sample.len() => queues.deferred.push(column),
            _ => queues.masked.push(Place { column, piece }),
        }
    });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn masked_of_block(
    block: &mut Block,
    unit: f64,
    output: &mut RowOutput,
    deferred: &mut Vec<usize>,
) {
    let surface = solve_masked(block);
    surface.write(block, unit, output, |k, _| deferred.push(block.column[k]));
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn weighted_of_block(
    block: &mut Block,
    pieces: &Pieces,
    piece: usize,
    columns: Range<usize>,
    input: &RowInput,
    output: &mut RowOutput,
    queues: &mut Queues,
) {
    block.load(input, pieces, &pieces.list[piece], columns);
    if block.is_dark() {
        return dark(block, output);
    }
    let mut solved = solve_weighted(block);
    let mut suspect = [false; LANES];
    for k in 0..LANES {
        suspect[k] = queues.test && solved.surface.carried[k] && solved.is_suspect(k);
        solved.surface.carried[k] &= !suspect[k];
    }
    solved.surface.write(block, pieces.unit, output, |k, output| {
        if suspect[k] {
            queues.suspect.push(Place { column: block.column[k], piece });
        } else {
            defer(block, k, output, &mut queues.deferred);
        }
    });
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn robust_of_block(
    block: &mut Block,
    robust: &mut RobustSolver,
    unit: f64,
    output: &mut RowOutput,
    deferred: &mut Vec<usize>,
) {
    if block.is_dark() {
        return dark(block, output);
    }
    let solved = robust.solve(block);
    solved.surface.write(block, unit, output, |k, output| defer(block, k, output, deferred));
}

/// Sends a photosite to float64 unless it is clear without that nothing can be solved.
fn defer(block: &Block, k: usize, output: &mut RowOutput, deferred: &mut Vec<usize>) {
    match block.usable_samples(k) {
        0..3 => output.clear(block.column[k], Outcome::TooFewLights),
        _ => deferred.push(block.column[k]),
    }
}

/// A block without light: nothing to solve, as over the table when a mask is set.
fn dark(block: &Block, output: &mut RowOutput) {
    for k in 0..block.len {
        let few = block.usable_samples(k) < 3;
        output.clear(block.column[k], if few { Outcome::TooFewLights } else { Outcome::NoSurface });
    }
}

//! What can be undone in this room, in the order in which it was done: the mask's steps and the line that is measured along.

use crate::rooms::look::Look;

/// Edits that can be undone.
const MOST: usize = crate::viewer::mask::MOST_STEPS;

/// A line that is measured along, pixel coordinates of its ends.
pub(super) type Ends = [[f64; 2]; 2];

/// An edit, as it takes to undo it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Edit {
    /// A step of the mask; the mask knows which.
    Mask,
    /// Another line; this one was there before.
    Line(Option<Ends>),
}

/// Edits, the last one at the end.
#[derive(Clone, Debug, Default)]
pub(super) struct Edits {
    done: Vec<Edit>,
    undone: Vec<Edit>,
}

impl Edits {
    /// Whether something can be undone, and redone.
    pub(super) fn steps(&self) -> [bool; 2] {
        [!self.done.is_empty(), !self.undone.is_empty()]
    }

    /// The mask was changed.
    pub(super) fn changed_mask(&mut self) {
        self.did(Edit::Mask);
    }

    /// Another line was drawn, or it was put away.
    pub(super) fn changed_line(&mut self, before: Option<Ends>) {
        self.did(Edit::Line(before));
    }

    /// The mask has been replaced by another one, whose steps are not these.
    pub(super) fn forget_mask(&mut self) {
        self.done.retain(|edit| *edit != Edit::Mask);
        self.undone.retain(|edit| *edit != Edit::Mask);
    }

    /// A mask has been taken up with as many steps that can be undone and redone; lines are older.
    pub(super) fn begin_with(&mut self, [done, undone]: [usize; 2]) {
        let count = |edits: &[Edit]| edits.iter().filter(|edit| **edit == Edit::Mask).count();
        if [count(&self.done), count(&self.undone)] != [done, undone] {
            self.forget_mask();
            self.done.extend(std::iter::repeat_n(Edit::Mask, done));
            self.undone.extend(std::iter::repeat_n(Edit::Mask, undone));
        }
    }

    fn did(&mut self, edit: Edit) {
        self.done.push(edit);
        self.undone.clear();
        if self.done.len() > MOST {
            self.done.remove(0);
        }
    }
}

impl Look {
    /// Takes the last edit back.
    pub(super) fn undo(&mut self) {
        if let Some(edit) = self.edits.done.pop() {
            let back = self.turn(edit, crate::viewer::mask::Painting::undo);
            self.edits.undone.push(back);
        }
    }

    /// Does it again.
    pub(super) fn redo(&mut self) {
        if let Some(edit) = self.edits.undone.pop() {
            let back = self.turn(edit, crate::viewer::mask::Painting::redo);
            self.edits.done.push(back);
        }
    }

    /// Puts another line there, or none.
    pub(super) fn set_line(&mut self, line: Option<Ends>) {
        if line != self.line {
            self.edits.changed_line(self.line);
            self.line = line;
            self.measure();
        }
    }

    /// Undoes or redoes an edit; what it takes to turn it back.
    fn turn(&mut self, edit: Edit, of_mask: fn(&mut crate::viewer::mask::Painting)) -> Edit {
        match edit {
            Edit::Mask => {
                self.painting.iter_mut().for_each(of_mask);
                Edit::Mask
            }
            Edit::Line(line) => {
                let there = std::mem::replace(&mut self.line, line);
                self.measure();
                Edit::Line(there)
            }
        }
    }
}

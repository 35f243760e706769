//! A field for a number: dragged, or written as people write numbers. What cannot be read stays in the field, what is wrong
//! with it is said beside it, and the number stays what it was before it was written.

use crate::model::number::{Unit, Unreadable, number};
use crate::texts::shell as texts;
use crate::ui::theme::meaning;
use eframe::egui;
use eframe::egui::emath::Numeric;
use eframe::egui::{DragValue, Id, Key, RectAlign, Response, TextEdit, Ui};
use std::cell::RefCell;
use std::ops::RangeInclusive;

/// A number and how it is written.
#[derive(Clone, Debug)]
pub struct Number {
    unit: Unit,
    range: RangeInclusive<f64>,
    speed: f64,
    decimals: RangeInclusive<usize>,
    unset: Option<&'static str>,
}

/// A field as it was drawn.
#[derive(Debug)]
pub struct Field {
    /// What the mouse and the keyboard did to it.
    pub response: Response,
    /// Whether what stands in it is the number. Where not, nothing should begin that needs it.
    pub is_read: bool,
}

impl Number {
    /// A number of a range.
    pub fn of(unit: Unit, range: RangeInclusive<f64>) -> Self {
        let most = if unit.is_whole() { 0 } else { 3 };
        Self { unit, range, speed: 0.1, decimals: 0..=most, unset: None }
    }

    /// How much a drag by one point changes it.
    pub fn speed(mut self, speed: f64) -> Self {
        self.speed = speed;
        self
    }

    /// Fewest and most decimals that are shown.
    pub fn decimals(mut self, decimals: RangeInclusive<usize>) -> Self {
        self.decimals = decimals;
        self
    }

    /// Zero stands for no number, and these words for zero; an empty field is one, too.
    pub fn unset(mut self, words: &'static str) -> Self {
        self.unset = Some(words);
        self
    }

    /// The range.
    pub fn range(&self) -> RangeInclusive<f64> {
        self.range.clone()
    }

    /// Draws the field. `name` distinguishes it from others beside it.
    pub fn show<N: Numeric>(&self, ui: &mut Ui, name: &str, value: &mut N) -> Field {
        let enabled = ui.is_enabled();
        let mut current = value.to_f64();
        let id = ui.scope_id().with(("number", name));
        if ui.data(|data| data.get_temp::<Kept>(id)).is_some_and(|kept| kept.left != current) {
            // Something else has changed it, as a slider beside it: that counts, not what was written here.
            keep(ui, id, None);
            ui.data_mut(|data| data.remove::<String>(id));
        }
        let mut field = match ui.data(|data| data.get_temp::<String>(id)) {
            Some(draft) => self.draft(ui, id, draft, &mut current),
            None => self.drag(ui, id, &mut current),
        };
        if current != value.to_f64() {
            *value = N::from_f64(current);
            field.response.mark_changed();
        }
        ui.data_mut(|data| {
            if let Some(kept) = data.get_temp::<Kept>(id) {
                data.insert_temp(id, Kept { left: value.to_f64(), ..kept });
            }
        });
        // What cannot be used cannot be missed.
        field.is_read |= !enabled;
        field
    }

    /// As the number that it is.
    fn drag(&self, ui: &mut Ui, id: Id, value: &mut f64) -> Field {
        let before = *value;
        // What is half written may be a number, and an empty field may be one: neither is what stood there.
        let kept = kept(ui, id).unwrap_or(before);
        // A field counts as just left for two frames: what was given up in the first must not be read in the second.
        let given_up = id.with("given up");
        let was_given_up = ui.data_mut(|data| data.remove_temp(given_up)).unwrap_or(false);
        let unread: RefCell<Option<Option<String>>> = RefCell::new(None);
        let written = RefCell::new(String::new());
        let parse = |text: &str| {
            // A field that was only visited keeps the digits that it does not show.
            if was_given_up || text == *written.borrow() {
                *unread.borrow_mut() = Some(None);
                return Some(before);
            }
            let read = self.read(text).ok();
            *unread.borrow_mut() = Some(read.is_none().then(|| text.to_owned()));
            Some(read.unwrap_or(kept))
        };
        let write = |value: f64, shown: RangeInclusive<usize>| {
            written.replace(self.written(value, shown));
            written.borrow().clone()
        };
        let suffix = if self.unset.is_some() { "" } else { self.unit.suffix() };
        let drag = DragValue::new(value)
            .range(self.range.clone())
            .speed(self.speed)
            .min_decimals(*self.decimals.start())
            .max_decimals(*self.decimals.end())
            .suffix(suffix)
            .custom_formatter(write)
            .custom_parser(parse);
        let response = ui.add(drag);
        if gives_up(ui, &response) {
            *value = kept;
            ui.data_mut(|data| data.insert_temp(given_up, true));
        }
        let live = id.with("unread");
        if let Some(found) = unread.into_inner() {
            let text = found.filter(|text| !text.trim().is_empty());
            ui.data_mut(|data| data.insert_temp(live, text.is_some()));
            if let Some(text) = text.filter(|_| !response.has_focus()) {
                ui.data_mut(|data| data.insert_temp(id, text));
                ui.ctx().request_repaint();
            }
        }
        let is_unread =
            response.has_focus() && ui.data(|data| data.get_temp(live).unwrap_or(false));
        if !response.has_focus() {
            ui.data_mut(|data| data.remove::<bool>(live));
        }
        let is_draft = ui.data(|data| data.get_temp::<String>(id).is_some());
        keep(ui, id, (response.has_focus() || is_draft).then_some(kept));
        Field { response, is_read: !is_unread && !is_draft }
    }

    /// As the text that was written and is no number.
    fn draft(&self, ui: &mut Ui, id: Id, mut text: String, value: &mut f64) -> Field {
        let width = ui.spacing().interact_size.x.max(64.0);
        let edit = TextEdit::singleline(&mut text).id(id.with("edit")).desired_width(width);
        let response = ui.add(edit.text_color(ui.visuals().error_fg_color));
        let read = self.read(&text);
        let kept = kept(ui, id).unwrap_or(*value);
        let given_up = gives_up(ui, &response);
        *value = read.ok().filter(|_| !given_up).unwrap_or(kept);
        let empty = text.trim().is_empty() && !response.has_focus();
        if given_up || empty || (read.is_ok() && !response.has_focus()) {
            ui.data_mut(|data| data.remove::<String>(id));
            keep(ui, id, None);
            return Field { response, is_read: true };
        }
        keep(ui, id, Some(kept));
        ui.data_mut(|data| data.insert_temp(id, text.clone()));
        if let Err(why) = read
            && ui.is_rect_visible(response.rect)
        {
            say_why(&response, &texts::unreadable(&text, why, self.unit, &self.range));
        }
        Field { response, is_read: read.is_ok() }
    }

    /// The number that a text stands for.
    fn read(&self, text: &str) -> Result<f64, Unreadable> {
        let is_unset = text.trim().is_empty() || Some(text.trim()) == self.unset;
        match self.unset {
            Some(_) if is_unset => Ok(0.0),
            _ => number(text, self.unit, &self.range),
        }
    }

    fn written(&self, value: f64, decimals: RangeInclusive<usize>) -> String {
        let number = egui::emath::format_with_decimals_in_range(value, decimals);
        match self.unset {
            Some(words) if value == 0.0 => words.to_owned(),
            // The words have no unit, so that it belongs to the number.
            Some(_) => number + self.unit.suffix(),
            None => number,
        }
    }
}

/// Of a field that is written into.
#[derive(Clone, Copy, Debug)]
struct Kept {
    /// The number that stood there before.
    number: f64,
    /// The number as the field has left it.
    left: f64,
}

fn kept(ui: &Ui, id: Id) -> Option<f64> {
    ui.data(|data| data.get_temp::<Kept>(id)).map(|kept| kept.number)
}

fn keep(ui: &Ui, id: Id, number: Option<f64>) {
    ui.data_mut(|data| {
        data.remove::<Kept>(id);
        if let Some(number) = number {
            data.insert_temp(id, Kept { number, left: number });
        }
    });
}

/// Escape leaves a field as if nothing had been written.
fn gives_up(ui: &Ui, field: &Response) -> bool {
    field.lost_focus() && ui.input(|input| input.key_pressed(Key::Escape))
}

/// Beside the field, where it covers no other one.
fn say_why(field: &Response, why: &str) {
    let beside = [RectAlign::LEFT, RectAlign::BOTTOM_START, RectAlign::TOP_START];
    egui::Popup::from_response(field)
        .id(field.id.with("why"))
        .kind(egui::PopupKind::Tooltip)
        .align(RectAlign::RIGHT)
        .align_alternatives(&beside)
        .open(true)
        .interactable(false)
        .gap(6.0)
        .width(240.0)
        .show(|ui| {
            ui.horizontal_top(|ui| {
                crate::ui::widgets::Sign::Bad.ui(ui);
                ui.add(egui::Label::new(why).wrap());
            });
        });
    // The same in colour, right at the field.
    let painter =
        field.ctx.layer_painter(field.layer_id).with_clip_rect(field.interact_rect.expand(2.0));
    let line = egui::Stroke::new(1.5, meaning::BAD);
    painter.rect_stroke(field.rect, 4.0, line, egui::StrokeKind::Inside);
}

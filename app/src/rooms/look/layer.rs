//! What can be shown, and what that takes.

use crate::rooms::look::Look;
use crate::rooms::look::lamp::Kind;
use crate::texts::look as texts;
use crate::viewer::appearance::{Appearance, Compose, Mode, Scales, Side};

/// What a side shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layer {
    Relit,
    Normal,
    Albedo,
    Error,
    Slope,
    Frame,
    Residual,
    OtherNormal,
    Angle,
}

impl Layer {
    pub(super) const ALL: [Layer; 9] = [
        Layer::Relit,
        Layer::Normal,
        Layer::Albedo,
        Layer::Error,
        Layer::Slope,
        Layer::Frame,
        Layer::Residual,
        Layer::OtherNormal,
        Layer::Angle,
    ];

    pub(super) fn name(self) -> &'static str {
        texts::LAYERS[self as usize]
    }

    fn mode(self) -> Mode {
        match self {
            Layer::Relit => Mode::Relit,
            Layer::Normal => Mode::Normal,
            Layer::Albedo => Mode::Albedo,
            Layer::Error => Mode::Error,
            Layer::Slope => Mode::Slope,
            Layer::Frame => Mode::Picture,
            Layer::Residual => Mode::Residual,
            Layer::OtherNormal => Mode::OtherNormal,
            Layer::Angle => Mode::Angle,
        }
    }
}

/// What both sides show.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) sides: [Layer; 2],
    pub(super) compose: Compose,
    pub(super) divider: f32,
    pub(super) scales: Scales,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            sides: [Layer::Relit, Layer::Normal],
            compose: Compose::Single,
            divider: 0.5,
            scales: Scales::default(),
        }
    }
}

impl Layers {
    /// The layers that are seen.
    pub(super) fn seen(&self) -> &[Layer] {
        if self.compose == Compose::Single { &self.sides[..1] } else { &self.sides }
    }

    pub(super) fn shows(&self, layer: Layer) -> bool {
        self.seen().contains(&layer)
    }

    pub(super) fn shows_frame(&self) -> bool {
        self.shows(Layer::Frame)
    }

    pub(super) fn shows_residual(&self) -> bool {
        self.shows(Layer::Residual)
    }

    /// Without what only a comparison shows.
    pub(super) fn of_one_solution(mut self) -> Self {
        for (side, instead) in self.sides.iter_mut().zip(Self::default().sides) {
            if matches!(side, Layer::OtherNormal | Layer::Angle) {
                *side = instead;
            }
        }
        self
    }

    /// Another solution has come: shows where both differ.
    pub(super) fn compare(&mut self) {
        (self.sides[0], self.compose) = (Layer::Angle, Compose::Single);
    }
}

impl Look {
    /// Whether a layer can be shown, and why not.
    pub(super) fn why_not(&self, layer: Layer) -> Option<&str> {
        let opened = self.opened.as_ref()?;
        let of_frames = matches!(layer, Layer::Frame | Layer::Residual);
        let of_other = matches!(layer, Layer::OtherNormal | Layer::Angle);
        if of_frames {
            opened.frames.as_ref().err().map(String::as_str)
        } else if of_other && self.other.is_none() {
            Some(texts::NO_OTHER)
        } else {
            None
        }
    }

    /// All that the view needs to know.
    pub(super) fn appearance(&self) -> Appearance {
        let Some(opened) = &self.opened else { return Appearance::default() };
        let light = self.lamp.light;
        let of_light = |of: &Option<(usize, _)>| match of {
            Some((of, picture)) if *of == light => Some(std::sync::Arc::clone(picture)),
            _ => None,
        };
        let side = |layer: Layer| Side {
            mode: layer.mode(),
            picture: match layer {
                Layer::Frame => of_light(&self.picture),
                Layer::Residual => of_light(&self.residual),
                Layer::OtherNormal | Layer::Angle => {
                    self.other.as_ref().map(|other| other.surface.clone())
                }
                _ => None,
            },
        };
        Appearance {
            sides: self.layers.sides.map(side),
            compose: self.layers.compose,
            divider: self.layers.divider,
            light: self.lamp.light(opened),
            gain: self.lamp.gain(),
            picture_gain: self.lamp.frame_gain(opened),
            gloss: self.lamp.gloss,
            scales: self.layers.scales,
            ..Appearance::default()
        }
    }

    /// Whether the mouse moves a light.
    pub(super) fn light_is_in_hand(&self) -> bool {
        self.layers.shows(Layer::Relit) && self.lamp.kind != Kind::Rig
    }
}

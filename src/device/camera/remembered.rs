//! What a simulated camera has seen once: the geometry of a weave costs far more than a light on it, and it lies still.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use weavelight_sim::render::{Signals, Stage, Subject, Tile};

/// Pictures under all lights may take so much memory, bytes; larger ones are rendered anew each time.
const MOST_BYTES: usize = 256 << 20;

/// A subject and the light that each of the stage's lights throws on it, kept from the first picture on where that fits.
pub(super) struct Remembered {
    subject: Box<dyn Subject + Send>,
    tiles: Option<Mutex<Tiles>>,
}

/// By the place of the tile's corner.
type Tiles = HashMap<(usize, usize), Arc<Signals>>;

impl Remembered {
    /// Nothing has been seen yet. `stage` is the one that all pictures are taken on.
    pub(super) fn new(subject: Box<dyn Subject + Send>, stage: &Stage) -> Self {
        let camera = &stage.view.camera;
        let layers = stage.lights.len() + 1;
        let bytes = camera.width_px * camera.height_px * layers * size_of::<f32>();
        Self { subject, tiles: (bytes <= MOST_BYTES).then(Mutex::default) }
    }

    /// Sum of the light that the stage's lights `lit` throw on a tile, each with its strength, and the ambient light.
    pub(super) fn sum(
        &self,
        stage: &Stage,
        lit: &[(usize, f32)],
        tile: Tile,
    ) -> (Vec<f32>, Vec<f32>) {
        match &self.tiles {
            Some(tiles) => {
                let seen = self.seen(tiles, stage, tile);
                let layers = lit.iter().map(|&(light, strength)| (&seen.lights[light], strength));
                (add(layers, tile), seen.ambient.clone())
            }
            None => {
                let lights = lit.iter().map(|&(light, _)| stage.lights[light].clone()).collect();
                let seen = self.render(&Stage { lights, ..stage.clone() }, tile);
                let layers = seen.lights.iter().zip(lit.iter().map(|&(_, strength)| strength));
                (add(layers, tile), seen.ambient)
            }
        }
    }

    fn seen(
        &self,
        tiles: &Mutex<HashMap<(usize, usize), Arc<Signals>>>,
        stage: &Stage,
        tile: Tile,
    ) -> Arc<Signals> {
        let place = (tile.x, tile.y);
        let known = tiles.lock().ok().and_then(|tiles| tiles.get(&place).cloned());
        known.filter(|signals| signals.ambient.len() == tile.pixels()).unwrap_or_else(|| {
            let rendered = Arc::new(self.render(stage, tile));
            if let Ok(mut tiles) = tiles.lock() {
                tiles.insert(place, rendered.clone());
            }
            rendered
        })
    }

    fn render(&self, stage: &Stage, tile: Tile) -> Signals {
        let blank = vec![0.0; tile.pixels()];
        let lights = vec![blank.clone(); stage.lights.len()];
        let mut signals = Signals { lights, ambient: blank, truth: None };
        self.subject.expose(stage, tile, &mut signals);
        signals
    }
}

fn add<'a>(layers: impl Iterator<Item = (&'a Vec<f32>, f32)>, tile: Tile) -> Vec<f32> {
    let mut sum = vec![0.0; tile.pixels()];
    for (layer, strength) in layers {
        sum.iter_mut().zip(layer).for_each(|(sum, light)| *sum += strength * light);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Instrument, Options, Scene};

    #[test]
    fn what_is_remembered_is_what_would_be_seen() {
        let options = Options { size_px: Some([48, 32]), ..Options::default() };
        let instrument = Instrument::from_options(&options).unwrap();
        let scene = Scene::of(&options, &instrument);
        let subject = || scene.subject(&instrument).unwrap();
        let remembering = Remembered::new(subject(), &instrument.stage);
        let forgetful = Remembered { subject: subject(), tiles: None };
        let tile = Tile { x: 0, y: 0, width: 48, height: 32 };
        for lit in [vec![], vec![(3, 1.0)], vec![(7, 0.5), (2, 1.25)], vec![(3, 1.0)]] {
            let sum = |of: &Remembered| of.sum(&instrument.stage, &lit, tile);
            let ((light, ambient), (same_light, same_ambient)) =
                (sum(&remembering), sum(&forgetful));
            assert_eq!(light, same_light, "{lit:?}");
            // Without any light the ambient light is added up in another order.
            let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-6 * b;
            assert!(ambient.iter().zip(&same_ambient).all(close), "{lit:?}");
        }
    }
}

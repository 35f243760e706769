//! The worker's part of the Rig room.

use super::{Ask, Told};
use crate::texts::rig as texts;
use crate::worker::{Outbox, Tools, Update, instruments::with_instruments};
use std::time::Duration;
use weavelight::device::board::{BoardError, PortChoice};
use weavelight::device::scan::diagnose_camera;
use weavelight::doctor::examine_boards;
use weavelight::instrument::Calibration;

/// How long each light shines in a test.
const SHOW: Duration = Duration::from_millis(600);

pub(super) fn act(ask: Ask, tools: &mut Tools, out: &Outbox) {
    match ask {
        Ask::Find => find(tools, out),
        Ask::Light(light) => show(light, tools, out),
        Ask::TestEach => test_each(tools, out),
        Ask::ReadCalibration(place) => {
            let lights = Calibration::load(&place.calibration()).ok();
            let lights = lights.map(|calibration| calibration.lights).unwrap_or_default();
            out.tell(Update::Rig(Told::Lights(lights)));
        }
    }
}

/// What we hold ourselves would be told as busy, so it is let go first.
fn find(tools: &mut Tools, out: &Outbox) {
    tools.instruments = None;
    let Some(place) = &tools.place else { return };
    let found = out.job(texts::FINDING, || -> Result<_, String> {
        out.tick(0.1, texts::FINDING_BOARD);
        let boards = match PortChoice::of_rig(&place.rig) {
            // There is no port to ask at; it is what the rig says it is.
            PortChoice::Simulated(_) => vec![texts::simulated_board(place.rig.lights.len())],
            choice => examine_boards(&choice, Some(place.rig.lights.len())),
        };
        out.tick(0.6, texts::FINDING_CAMERA);
        let file = place.rig_file();
        Ok((boards, diagnose_camera(Some((&place.rig, &file)))))
    });
    if let Ok((boards, cameras)) = found {
        out.tell(Update::Rig(Told::Found { boards, cameras }));
    }
}

fn show(light: Option<usize>, tools: &mut Tools, out: &Outbox) {
    match switch(light, tools) {
        Ok(()) => out.tell(Update::Rig(Told::Lit(light))),
        Err(error) => {
            out.fail(texts::LIGHTING, &error);
            out.tell(Update::Rig(Told::Lit(None)));
        }
    }
}

fn switch(light: Option<usize>, tools: &mut Tools) -> Result<(), String> {
    with_instruments(tools, |place, with| -> Result<(), BoardError> {
        match light {
            None => with.board.off()?,
            Some(light) => {
                let output = u8::try_from(place.rig.channel(light)).unwrap_or(u8::MAX);
                with.board.light(output, None)?
            }
        };
        Ok(())
    })
}

fn test_each(tools: &mut Tools, out: &Outbox) {
    let count = tools.place.as_ref().map_or(0, |place| place.rig.lights.len());
    let mut lit = || -> Result<(), String> {
        for light in 0..count {
            out.tick(light as f64 / count as f64, &texts::light(light, true));
            switch(Some(light), tools)?;
            out.tell(Update::Rig(Told::Lit(Some(light))));
            std::thread::sleep(SHOW);
        }
        Ok(())
    };
    let _ = out.job(texts::TESTING, &mut lit);
    // Dark again, whether it was cancelled or not.
    show(None, tools, out);
}

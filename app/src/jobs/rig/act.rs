//! The worker's part of the Rig room.

use crate::jobs::instruments::with_instruments;
use crate::jobs::messages::Update;
use crate::jobs::outbox::Outbox;
use crate::jobs::rig::{Command, Event};
use crate::jobs::tools::Tools;
use crate::texts::rig as texts;
use std::time::Duration;
use weavelight::device::board::{BoardError, PortChoice};
use weavelight::device::scan::diagnose_camera;
use weavelight::doctor::examine_boards;
use weavelight::instrument::Calibration;

/// How long each light shines in a test.
const SHOW: Duration = Duration::from_millis(600);

pub(crate) fn act(command: Command, tools: &mut Tools, out: &Outbox) {
    match command {
        Command::Find => find(tools, out),
        Command::Light(light) => show(light, tools, out),
        Command::TestEach => test_each(tools, out),
        Command::ReadCalibration(project) => {
            let lights = Calibration::load(&project.calibration()).ok();
            let lights = lights.map(|calibration| calibration.lights).unwrap_or_default();
            out.send(Update::Rig(Event::Lights(lights)));
        }
    }
}

/// Closes board and camera first: those that this program holds would be reported as busy.
fn find(tools: &mut Tools, out: &Outbox) {
    tools.instruments = None;
    let Some(project) = &tools.project else { return };
    let found = out.job(texts::FINDING, || -> Result<_, String> {
        out.tick(0.1, texts::FINDING_BOARD);
        let boards = match PortChoice::of_rig(&project.rig) {
            // There is no port to ask at; it is what the rig says it is.
            PortChoice::Simulated(_) => vec![texts::simulated_board(project.rig.lights.len())],
            choice => examine_boards(&choice, Some(project.rig.lights.len())),
        };
        out.tick(0.6, texts::FINDING_CAMERA);
        let file = project.rig_file();
        Ok((boards, diagnose_camera(Some((&project.rig, &file)))))
    });
    if let Ok((boards, cameras)) = found {
        out.send(Update::Rig(Event::Found { boards, cameras }));
    }
}

fn show(light: Option<usize>, tools: &mut Tools, out: &Outbox) {
    match switch(light, tools) {
        Ok(()) => out.send(Update::Rig(Event::Lit(light))),
        Err(error) => {
            out.fail(texts::LIGHTING, &error);
            out.send(Update::Rig(Event::Lit(None)));
        }
    }
}

fn switch(light: Option<usize>, tools: &mut Tools) -> Result<(), String> {
    with_instruments(tools, |project, with| -> Result<(), BoardError> {
        match light {
            None => with.board.off()?,
            Some(light) => {
                let output = u8::try_from(project.rig.channel(light)).unwrap_or(u8::MAX);
                with.board.light(output, None)?
            }
        };
        Ok(())
    })
}

fn test_each(tools: &mut Tools, out: &Outbox) {
    let count = tools.project.as_ref().map_or(0, |project| project.rig.lights.len());
    let mut lit = || -> Result<(), String> {
        for light in 0..count {
            out.tick(light as f64 / count as f64, &texts::light(light, true));
            switch(Some(light), tools)?;
            out.send(Update::Rig(Event::Lit(Some(light))));
            std::thread::sleep(SHOW);
        }
        Ok(())
    };
    let _ = out.job(texts::TESTING, &mut lit);
    // Dark again, whether it was cancelled or not.
    show(None, tools, out);
}

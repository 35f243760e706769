//! Pictures that clip below their files' full scale, and a color.toml that was edited by hand.

use super::bench::{Bench, edit};
use weavelight::raster::{PngContent, write_png_grey16};
use weavelight::raw::{self, Hint, Layout, Samples};
use weavelight::session::{Encoding, Session};
use weavelight::simulate::Part;

const BLACK: f64 = 600.0;
const CEILING: f64 = 4095.0;

/// Makes 16-bit PNG files of a capture session's frames as a converter of 12 bits does: black taken off, and the brightest of
/// all frames at `peak` before it clips at 4095.
fn converted(bench: &Bench, name: &str, peak: f64) {
    let mut session = Session::load(&bench.rig(name)).unwrap();
    let frame =
        |path: &std::path::Path| raw::decode(&std::fs::read(path).unwrap(), &Hint::default());
    let frames: Vec<raw::Frame> =
        session.frames.iter().map(|e| frame(&session.frame_path(e)).unwrap()).collect();
    let samples = |frame: &raw::Frame| match &frame.samples {
        Samples::U16(samples) => samples.clone(),
        Samples::F32(_) => panic!("simulated RAW is integer"),
    };
    let brightest = frames.iter().flat_map(samples).max().unwrap();
    let scale = peak / (f64::from(brightest) - BLACK);
    for (entry, frame) in session.frames.iter_mut().zip(&frames) {
        let Layout::Mosaic(cfa) = frame.layout else { panic!("simulated RAW is a mosaic") };
        let samples = samples(frame);
        let row = |y: usize, out: &mut [u16]| {
            for (x, out) in out.iter_mut().enumerate() {
                let value = (f64::from(samples[y * frame.width + x]) - BLACK) * scale;
                *out = value.clamp(0.0, CEILING) as u16;
            }
        };
        entry.file.set_extension("png");
        let path = bench.rig(name).join(&entry.file);
        write_png_grey16(&path, [frame.width, frame.height], PngContent::Data, row).unwrap();
        (entry.cfa, entry.sha256) = (Some(cfa), None);
        entry.encoding = Some(Encoding::Linear);
    }
    session.save().unwrap();
}

#[test]
fn a_sheet_that_clips_unseen_at_12_bits_is_overexposed() {
    let bench = Bench::new(&[Part::WhiteFlat], |_| ());
    bench.know(&["camera.toml"]);
    converted(&bench, "white-flat", 1.4 * CEILING);
    let error = bench.lights(&["white-flat"]).unwrap_err().to_string();
    assert!(error.contains("overexposes"), "{error}");
}

#[test]
fn a_few_samples_that_clip_at_12_bits_are_left_out_and_told() {
    let bench = Bench::new(&[Part::WhiteFlat], |_| ());
    bench.know(&["camera.toml"]);
    converted(&bench, "white-flat", 1.06 * CEILING);
    let report = bench.lights(&["white-flat"]).unwrap();
    let told = |what: &str| report.warnings.iter().any(|warning| warning.contains(what));
    assert!(told("white-flat: The pictures clip at 4095 (12 bits"), "{:?}", report.warnings);
    // Of what lies below the ceiling, not of 65535: no advice to expose 16 times as long.
    let brightest = report.sheets[0].brightest;
    assert!((0.6..1.0).contains(&brightest), "{brightest}");
    assert!(!told("times longer"), "{:?}", report.warnings);
}

#[test]
fn a_color_file_that_was_edited_stays_and_that_is_told() {
    let bench = Bench::new(&[Part::WhiteFlat, Part::Grey], |_| ());
    bench.know(&["camera.toml"]);
    bench.color().unwrap();
    let path = bench.found().join("color.toml");
    let read = || std::fs::read_to_string(&path).unwrap();
    let of_color = read();
    let report = bench.lights(&["white-flat"]).unwrap();
    assert!(read() != of_color && report.warnings.iter().all(|w| !w.contains("was edited")));
    edit(&path, |text| format!("# Our own black level.\n{text}"));
    let edited = read();
    let report = bench.lights(&["white-flat"]).unwrap();
    assert_eq!(read(), edited);
    let told = report.warnings.iter().find(|warning| warning.contains("color.toml was edited"));
    let told = told.unwrap_or_else(|| panic!("{:?}", report.warnings));
    assert!(told.contains("kappa = "), "{told}");
}

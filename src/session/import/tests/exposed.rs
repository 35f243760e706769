//! Exposures that the files state.

use super::*;

/// A grey TIFF of 16 bits, different for each `shade`, whose tags state what is given: seconds as a fraction, ISO, and the
/// f-number in tenths.
fn stating(
    path: &Path,
    shade: u16,
    seconds: Option<[u32; 2]>,
    iso: Option<u16>,
    tenths: Option<u32>,
) {
    let mut tags: Vec<[u32; 4]> = vec![
        [0x100, 4, 1, 4],
        [0x101, 4, 1, 3],
        [0x102, 3, 1, 16],
        [0x103, 3, 1, 1],
        [0x106, 3, 1, 1],
        [0x111, 4, 1, 8],
        [0x115, 3, 1, 1],
        [0x116, 4, 1, 3],
        [0x117, 4, 1, 24],
    ];
    let mut data: Vec<u8> = (0..12_u16).flat_map(|k| (shade + 100 * k).to_le_bytes()).collect();
    let mut fraction = |data: &mut Vec<u8>, tag, [over, under]: [u32; 2]| {
        tags.push([tag, 5, 1, 8 + data.len() as u32]);
        data.extend(over.to_le_bytes());
        data.extend(under.to_le_bytes());
    };
    if let Some(seconds) = seconds {
        fraction(&mut data, 0x829a, seconds);
    }
    if let Some(tenths) = tenths {
        fraction(&mut data, 0x829d, [tenths, 10]);
    }
    tags.extend(iso.map(|iso| [0x8827, 3, 1, u32::from(iso)]));
    tags.sort_unstable();
    let mut bytes = b"II*\0".to_vec();
    bytes.extend((8 + data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.extend((tags.len() as u16).to_le_bytes());
    for [tag, kind, count, value] in tags {
        bytes.extend((tag as u16).to_le_bytes());
        bytes.extend((kind as u16).to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    fs::write(path, bytes).unwrap();
}

type Stating = (Option<[u32; 2]>, Option<u16>, Option<u32>);

/// Imports three pictures that state this.
fn import(
    stated: [Stating; 3],
    same_exposure: bool,
    beside: Option<&str>,
) -> Result<(Vec<[f64; 2]>, Summary), String> {
    let mut set = Set::new("l.txt", DIRECTIONS, &[]);
    if let Some(text) = beside {
        set = set.with("light_intensities.txt", text);
    }
    let names = ["a.tif", "b.tif", "c.tif"];
    for (k, (name, (seconds, iso, tenths))) in names.iter().zip(stated).enumerate() {
        stating(&set.path(name), k as u16, seconds, iso, tenths);
    }
    let options = Options { same_exposure, ..set.options("l.txt", &names) };
    let (session, summary) = set.import(&options)?;
    Ok((session.frames.iter().map(|frame| [frame.exposure_s, frame.iso]).collect(), summary))
}

#[test]
fn exposures_come_from_the_files() {
    let (found, summary) = import(
        [
            (Some([1, 4]), Some(100), Some(80)),
            (Some([1, 2]), Some(200), Some(80)),
            (Some([10, 10]), Some(100), None),
        ],
        false,
        None,
    )
    .unwrap();
    assert_eq!(found, [[0.25, 100.0], [0.5, 200.0], [1.0, 100.0]]);
    assert_eq!(summary.exposures.as_deref(), Some("1/4 s to 1 s, ISO 100 to 200"));
    assert_eq!(summary.warnings, Vec::<String>::new());
    let (found, summary) = import([(None, None, None); 3], false, None).unwrap();
    assert_eq!((found, summary.exposures), (vec![[1.0, 100.0]; 3], None));
}

#[test]
fn silent_files_among_others() {
    let quarter = (Some([1, 4]), Some(400), None);
    let (found, summary) =
        import([quarter, (None, Some(400), None), quarter], false, None).unwrap();
    assert_eq!(found, [[0.25, 400.0]; 3]);
    let [warning] = summary.warnings.as_slice() else { panic!("{:?}", summary.warnings) };
    assert!(warning.contains("b.tif states no exposure time; taken as 1/4 s"), "{warning}");
    let second = (Some([1, 1]), Some(400), None);
    let stated = [quarter, (None, Some(400), None), second];
    let error = import(stated, false, None).unwrap_err();
    assert!(
        error.starts_with("b.tif: states no exposure time, but the others state 1/4 s to 1 s"),
        "{error}"
    );
    let (found, _) = import(stated, true, None).unwrap();
    assert_eq!(found, [[0.25, 400.0]; 3]);
}

#[test]
fn apertures_must_agree() {
    let at = |tenths| (Some([1, 4]), Some(100), Some(tenths));
    let error = import([at(56), at(56), at(80)], false, None).unwrap_err();
    assert!(error.starts_with("c.tif: was taken at f/8, but a.tif at f/5.6"), "{error}");
    assert!(import([at(56), at(56), at(57)], false, None).is_ok());
    assert!(import([at(56), at(56), at(80)], true, None).is_ok());
}

#[test]
fn intensities_that_may_hold_the_exposure_are_told() {
    let at = |under| (Some([1, under]), Some(100), None);
    let intensities = Some("1 1 1\n1 1 1\n1 1 1\n");
    let (_, summary) = import([at(4), at(4), at(2)], false, intensities).unwrap();
    assert!(summary.warnings[0].contains("import with same exposure"), "{:?}", summary.warnings);
    let (_, summary) = import([at(4), at(4), at(4)], false, intensities).unwrap();
    assert_eq!(summary.warnings, Vec::<String>::new());
}

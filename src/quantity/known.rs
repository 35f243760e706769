//! The quantities that files and options hold.

use super::{Problem, Quantity, plain};
use std::ops::RangeInclusive;

const fn new(what: &'static str, unit: &'static str, least: f64, most: f64) -> Quantity {
    Quantity { what, unit, least, most, mistaken: &[] }
}

const fn mistaken(quantity: &Quantity, mistaken: &'static [(&'static str, f64)]) -> Quantity {
    Quantity { mistaken, ..*quantity }
}

/// Units of length that are written for millimetres.
const FOR_MM: &[(&str, f64)] = &[("metres", 1e3), ("centimetres", 10.0), ("micrometres", 1e-3)];

/// A frame's width or height, pixels: what a JPEG can hold, and more than any sensor.
pub const SIDE_PX: RangeInclusive<usize> = 1..=65_535;

/// Nominal focal lengths: of a telephone, of a telescope.
pub const FOCAL_LENGTH_MM: Quantity = mistaken(
    &new("focal lengths", "millimetres", 0.5, 10_000.0),
    &[("metres", 1e3), ("micrometres", 1e-3)],
);
/// Distances of photosites: 0.5 micrometres on telephones, 30 on binned sensors; pictures simulated at a few pixels have
/// over a thousand.
pub const PIXEL_PITCH_UM: Quantity = mistaken(
    &new("pixels", "micrometres", 0.4, 5_000.0),
    &[("millimetres", 1e3), ("nanometres", 1e-3)],
);
/// The camera over the table.
pub const CAMERA_HEIGHT_MM: Quantity =
    mistaken(&new("cameras over the table", "millimetres", 5.0, 20_000.0), FOR_MM);
/// What a picture spans of the table.
pub const VIEW_MM: Quantity = new("pictures on the table", "millimetres", 0.05, 20_000.0);
/// What a pixel spans of the table.
pub const MM_PER_PX: Quantity = new("pixels on the table", "millimetres", 1e-6, 20_000.0);
/// A light's distance from the centre of the scan area.
pub const LIGHT_DISTANCE_MM: Quantity =
    mistaken(&new("lights from the centre of the scan area", "millimetres", 5.0, 20_000.0), FOR_MM);
/// A light's height; a light under the table lights nothing.
pub const LIGHT_HEIGHT_MM: Quantity =
    new("lights above the table (z = 0)", "millimetres", 0.1, 20_000.0);
/// How well a place is known. The least is a simulation's exact truth.
pub const POSITION_SIGMA_MM: Quantity = new("errors of a place", "millimetres", 1e-9, 1e6);
/// Coordinates on and above the table.
pub const PLACE_MM: Quantity = new("places on the table", "millimetres", -20_000.0, 20_000.0);
/// The plane of a swatch or sheet.
pub const SURFACE_MM: Quantity = mistaken(
    &new("places of a surface", "millimetres", -5_000.0, 5_000.0),
    &[("micrometres", 1e-3)],
);
/// Entries of directions and normals, before they are made unit vectors.
pub const DIRECTION: Quantity = new("parts of a direction", "", -1e6, 1e6);
/// Squares of a chessboard.
pub const SQUARE_MM: Quantity =
    mistaken(&new("squares of a chessboard", "millimetres", 0.05, 2_000.0), FOR_MM);
/// How thick a swatch or sheet is, or how far it is raised.
pub const THICKNESS_MM: Quantity =
    mistaken(&new("thicknesses", "millimetres", 0.0, 100.0), &[("micrometres", 1e-3)]);

/// Exposure times: of a flash, of a day.
pub const EXPOSURE_S: Quantity =
    mistaken(&new("exposures", "seconds", 1e-6, 86_400.0), &[("milliseconds", 1e-3)]);
/// Sensitivities.
pub const ISO: Quantity = new("sensitivities", "ISO", 1.0, 10_000_000.0);
/// Reflectances relative to a perfect white diffuser; fluorescent paper sends back a little more than it gets.
pub const REFLECTANCE: Quantity =
    mistaken(&new("reflectances", "(1 is perfect white)", 1e-4, 1.5), &[("per cent", 1e-2)]);
/// Errors of angles that can be asked for.
pub const ANGLE_DEG: Quantity = new("angles", "degrees", 0.0, 180.0);
/// CIE lightness.
pub const LAB_L: Quantity = new("lightnesses L*", "", 0.0, 150.0);
/// CIE a* and b*.
pub const LAB_AB: Quantity = new("a* and b*", "", -200.0, 200.0);
/// Corners of patches.
pub const PATCH_PX: Quantity = new("places in a picture", "pixels", 0.0, 65_535.0);

/// Focal lengths in pixels: width of a picture of a few pixels, ten metres over the smallest pixel.
pub const FOCAL_LENGTH_PX: Quantity = new("focal lengths", "pixels", 1.0, 1e8);
/// Principal points; a crop may lie far off its lens's axis.
pub const PRINCIPAL_POINT_PX: Quantity = new("principal points", "pixels", -1e6, 1e6);
/// Coefficients of distortion: of a telephoto lens, whose pictures span a small angle, they are large.
pub const DISTORTION: Quantity = new("distortion coefficients", "", -1e9, 1e9);
/// Reprojection errors.
pub const REPROJECTION_PX: Quantity = new("reprojection errors", "pixels", 0.0, 1e5);

/// Black levels: of 32-bit integers, of floating point numbers around 1.
pub const BLACK_DN: Quantity = new("black levels", "raw numbers", -1e6, 4.3e9);
/// Saturation levels.
pub const SATURATION_DN: Quantity = new("saturation levels", "raw numbers", 1e-3, 4.3e9);
/// Coefficients of a response curve over 0..1.
pub const RESPONSE: Quantity = new("response coefficients", "", -100.0, 100.0);
/// Gains of white balance.
pub const WHITE_BALANCE: Quantity = new("white balance gains", "", 1e-3, 1e3);
/// Entries of a colour matrix whose rows sum to 1.
pub const COLOR_MATRIX: Quantity = new("colour matrix entries", "", -50.0, 50.0);
/// Electrons per raw number.
pub const ELECTRONS_PER_DN: Quantity = new("gains", "electrons per raw number", 1e-6, 1e9);
/// Read noise.
pub const READ_NOISE_E: Quantity = new("read noises", "electrons", 0.0, 1e6);
/// What a light model leaves over, relative.
pub const KAPPA: Quantity = new("kappas", "of the signal", 0.0, 1.0);

/// Intensities of any unit that a sensor could tell; beyond, quotients leave the range of float32.
pub const INTENSITY: Quantity = new("intensities", "of full scale per second at 1 m", 1e-9, 1e9);
/// Exponents of a beam's cosine: 1 of a bare LED, thousands of a spot light.
pub const BEAM_EXPONENT: Quantity = new("beam exponents", "", 0.0, 10_000.0);
/// Factors of a gain map.
pub const GAIN: Quantity = new("gains", "", 1e-6, 1e6);

/// # Errors
/// A width or height that no frame has.
pub fn check_side(key: &str, value: usize) -> Result<(), Problem> {
    if SIDE_PX.contains(&value) {
        return Ok(());
    }
    let (least, most) = (SIDE_PX.start(), SIDE_PX.end());
    Err(Problem::new(key, format!("is {value}; frames are {least} to {most} pixels on a side")))
}

/// What a camera sees of the table, by its figures: each may be in range, and still no camera have them all.
///
/// # Errors
/// A picture that spans less than a hair or more than a hall.
pub fn check_view(
    key: &str,
    width_px: usize,
    pitch_um: f64,
    focal_length_mm: f64,
    height_mm: f64,
) -> Result<(), Problem> {
    let width_mm = width_px as f64 * pitch_um * 1e-3 * height_mm / focal_length_mm;
    VIEW_MM.check(width_mm).map_err(|what| {
        let figures = format!(
            "{width_px} pixels of {} um behind {} mm, {} mm over the table",
            plain(pitch_um),
            plain(focal_length_mm),
            plain(height_mm)
        );
        Problem::new(
            key,
            format!("does not fit the rest: {figures}: the picture's width on the table {what}"),
        )
    })
}

/// # Errors
/// A number of inner corners that no chessboard has.
pub fn check_corners(key: &str, count: usize) -> Result<(), Problem> {
    if (2..=1000).contains(&count) {
        return Ok(());
    }
    Err(Problem::new(key, format!("is {count}; count the inner corners, 2 to 1000")))
}

/// A point light's place: near enough, far enough, and over the table.
///
/// # Errors
/// What is wrong with it.
pub fn check_light_place(key: &str, [x, y, z]: [f64; 3]) -> Result<(), Problem> {
    let distance_mm = (x * x + y * y + z * z).sqrt();
    LIGHT_DISTANCE_MM
        .check(distance_mm)
        .map_err(|what| Problem::new(key, format!("is a place whose distance {what}")))?;
    LIGHT_HEIGHT_MM.check(z).map_err(|what| Problem::new(key, format!("is a place whose z {what}")))
}

/// A response curve: finite, of a few terms, and rising with the light over the whole range.
///
/// # Errors
/// What is wrong with it.
pub fn check_response(key: &str, coefficients: &[f64]) -> Result<(), Problem> {
    let wrong = |what: &str| Err(Problem::new(key, what));
    if !(2..=16).contains(&coefficients.len()) {
        return wrong("needs 2 to 16 coefficients; [0, 1] is linear, the second belongs to x");
    }
    RESPONSE.all_at(key, coefficients)?;
    let at = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    let values: Vec<f64> = (0..=64).map(|k| at(f64::from(k) / 64.0)).collect();
    if values[64] - values[0] < 1e-3 || values.windows(2).any(|pair| pair[1] < pair[0] - 1e-9) {
        return wrong(
            "does not rise with the signal from black (x = 0) to saturation (x = 1); [0, 1] is linear",
        );
    }
    Ok(())
}

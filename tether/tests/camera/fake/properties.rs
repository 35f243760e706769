//! The settings of a D5100, with the lists and ranges that it offers.

use super::dataset::Dataset;
use super::response;

/// Codes of the settings.
pub(crate) mod code {
    pub(crate) const BATTERY: u16 = 0x5001;
    pub(crate) const QUALITY: u16 = 0x5004;
    pub(crate) const WHITE_BALANCE: u16 = 0x5005;
    pub(crate) const APERTURE: u16 = 0x5007;
    pub(crate) const FOCUS: u16 = 0x500A;
    pub(crate) const SHUTTER: u16 = 0x500D;
    pub(crate) const PROGRAM: u16 = 0x500E;
    pub(crate) const ISO: u16 = 0x500F;
    pub(crate) const RELEASE: u16 = 0x5013;
    pub(crate) const AUTO_ISO: u16 = 0xD054;
    pub(crate) const LONG_EXPOSURE_NOISE: u16 = 0xD06B;
}

/// Values of the mode dial.
pub(crate) mod dial {
    pub(crate) const MANUAL: u32 = 1;
    pub(crate) const PROGRAM: u32 = 2;
    pub(crate) const AUTO: u32 = 0x8010;
}

/// Values of the picture quality.
pub(crate) mod quality {
    pub(crate) const JPEG_FINE: u32 = 2;
    pub(crate) const NEF: u32 = 4;
}

/// How a number is stored, as PTP counts the types.
#[derive(Clone, Copy, PartialEq)]
enum Width {
    U8 = 2,
    U16 = 4,
    U32 = 6,
}

#[derive(Clone)]
enum Form {
    Range(u32, u32),
    Choices(Vec<u32>),
}

/// A setting.
#[derive(Clone)]
pub(crate) struct Property {
    pub(crate) code: u16,
    width: Width,
    form: Form,
    pub(crate) writable: bool,
    pub(crate) value: u32,
}

impl Property {
    fn number(&self, dataset: Dataset, value: u32) -> Dataset {
        match self.width {
            Width::U8 => dataset.u8(value as u8),
            Width::U16 => dataset.u16(value as u16),
            Width::U32 => dataset.u32(value),
        }
    }

    pub(super) fn encode_value(&self) -> Vec<u8> {
        self.number(Dataset::default(), self.value).finish()
    }

    pub(super) fn describe(&self) -> Vec<u8> {
        let head = Dataset::default().u16(self.code).u16(self.width as u16);
        let head = head.u8(u8::from(self.writable));
        let head = self.number(head, self.value); // what it was in the factory
        let head = self.number(head, self.value);
        match &self.form {
            Form::Range(from, to) => {
                let range = self.number(self.number(head.u8(1), *from), *to);
                self.number(range, 1).finish()
            }
            Form::Choices(choices) => {
                let list = head.u8(2).u16(u16::try_from(choices.len()).expect("a short list"));
                choices.iter().fold(list, |list, choice| self.number(list, *choice)).finish()
            }
        }
    }

    /// What the host sends; the response code where the camera does not take it.
    pub(super) fn set(&mut self, data: &[u8]) -> Result<(), u16> {
        let mut bytes = [0; 4];
        let length = match self.width {
            Width::U8 => 1,
            Width::U16 => 2,
            Width::U32 => 4,
        };
        bytes[..length].copy_from_slice(data.get(..length).ok_or(response::BAD_FORMAT)?);
        let value = u32::from_le_bytes(bytes);
        if !self.writable {
            return Err(response::ACCESS_DENIED);
        }
        let offered = match &self.form {
            Form::Range(from, to) => (*from..=*to).contains(&value),
            Form::Choices(choices) => choices.contains(&value),
        };
        if !offered {
            return Err(response::BAD_VALUE);
        }
        self.value = value;
        Ok(())
    }
}

/// In units of 0.1 ms, as the camera rounds them; the last is "Bulb".
const SHUTTER_TENTHS_MS: [u32; 54] = [
    2,
    3,
    4,
    5,
    6,
    8,
    10,
    12,
    15,
    20,
    25,
    31,
    40,
    50,
    62,
    80,
    100,
    125,
    166,
    200,
    250,
    333,
    400,
    500,
    666,
    769,
    1000,
    1250,
    1666,
    2000,
    2500,
    3333,
    4000,
    5000,
    6250,
    7692,
    10_000,
    13_000,
    16_000,
    20_000,
    25_000,
    30_000,
    40_000,
    50_000,
    60_000,
    80_000,
    100_000,
    130_000,
    150_000,
    200_000,
    250_000,
    300_000,
    0xFFFF_FFFD,
    0xFFFF_FFFF,
];
const ISO: [u32; 19] = [
    100, 125, 160, 200, 250, 320, 400, 500, 640, 800, 1000, 1250, 1600, 2000, 2500, 3200, 4000,
    5000, 6400,
];
const APERTURE_HUNDREDTHS: [u32; 16] =
    [180, 200, 220, 250, 280, 320, 350, 400, 450, 500, 560, 630, 710, 800, 1100, 1600];

/// As a D5100 on manual exposure leaves the technician's hands: JPEG, automatic ISO and white balance.
pub(super) fn factory() -> Vec<Property> {
    let list = |code, width, value, choices: &[u32]| Property {
        code,
        width,
        form: Form::Choices(choices.to_vec()),
        writable: true,
        value,
    };
    let range = |code, value, to| Property {
        code,
        width: Width::U8,
        form: Form::Range(0, to),
        writable: true,
        value,
    };
    let fixed = |property: Property| Property { writable: false, ..property };
    let programs = [dial::MANUAL, dial::PROGRAM, 3, 4, dial::AUTO, 0x8011, 0x8018];
    vec![
        fixed(range(code::BATTERY, 79, 99)),
        list(code::QUALITY, Width::U8, quality::JPEG_FINE, &[0, 1, 2, quality::NEF, 5, 6, 7]),
        list(code::WHITE_BALANCE, Width::U16, 2, &[2, 4, 5, 6, 7, 0x8010, 0x8011, 0x8013]),
        list(code::APERTURE, Width::U16, 560, &APERTURE_HUNDREDTHS),
        list(code::FOCUS, Width::U16, 1, &[1, 0x8010, 0x8011, 0x8012]),
        list(code::SHUTTER, Width::U32, 166, &SHUTTER_TENTHS_MS),
        fixed(list(code::PROGRAM, Width::U16, dial::MANUAL, &programs)),
        list(code::ISO, Width::U16, 400, &ISO),
        list(code::RELEASE, Width::U16, 1, &[1, 2, 0x8011, 0x8014]),
        range(code::AUTO_ISO, 1, 1),
        range(code::LONG_EXPOSURE_NOISE, 1, 1),
    ]
}

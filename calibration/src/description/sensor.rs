/// A colour channel of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red.
    R = 0,
    /// Green.
    G = 1,
    /// Blue.
    B = 2,
}

/// The colour-filter array: which channel each photosite of the repeating 2 x 2 cell sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cfa {
    /// Row-major from the frame's top left.
    pub cell: [Channel; 4],
}

impl Cfa {
    /// Red at the top left, as most cameras of the project.
    pub const RGGB: Cfa = Cfa { cell: [Channel::R, Channel::G, Channel::G, Channel::B] };

    /// Reads "RGGB" and the like. `None` for anything but four letters of R, G, B.
    pub fn parse(name: &str) -> Option<Self> {
        let channel = |letter| match letter {
            b'R' => Some(Channel::R),
            b'G' => Some(Channel::G),
            b'B' => Some(Channel::B),
            _ => None,
        };
        let letters: [u8; 4] = name.as_bytes().try_into().ok()?;
        let [a, b, c, d] = letters.map(channel);
        Some(Self { cell: [a?, b?, c?, d?] })
    }

    /// The channel of the photosite at column `x`, row `y`.
    pub fn channel(&self, x: usize, y: usize) -> Channel {
        self.cell[(y & 1) * 2 + (x & 1)]
    }

    /// "RGGB" and the like.
    pub fn name(&self) -> String {
        self.cell
            .iter()
            .map(|channel| match channel {
                Channel::R => 'R',
                Channel::G => 'G',
                Channel::B => 'B',
            })
            .collect()
    }
}

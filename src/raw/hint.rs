use weavelight_calibration::description::Cfa;

/// What the capture session knows of a frame and the file may not say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hint {
    /// Mosaic of a picture that cannot say so itself, from the picture's top left. A file that says otherwise is refused.
    pub cfa: Option<Cfa>,
    /// How the picture encodes light: required for 8 bits, linear by default for more.
    pub encoding: Option<Encoding>,
}

/// How a picture encodes light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Proportional.
    Linear,
    /// sRGB's curve.
    Srgb,
}

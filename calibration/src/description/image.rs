/// A plane of values, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values, row-major.
    pub data: Vec<T>,
}

impl<T: Clone> Image<T> {
    /// An image of one value.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }
}

impl<T> Image<T> {
    /// Row `y`, left to right.
    ///
    /// # Panics
    /// Where `y` is outside the image.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// The value at column `x`, row `y`.
    ///
    /// # Panics
    /// Where the place is outside the image.
    pub fn at(&self, x: usize, y: usize) -> &T {
        assert!(x < self.width, "column {x} of an image {} wide", self.width);
        &self.data[y * self.width + x]
    }
}

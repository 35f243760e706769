use super::method::MAX_LIGHTS;

const WORDS: usize = MAX_LIGHTS / 64;

/// A set of lights, by their place in the row's list (0 to [`MAX_LIGHTS`] - 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightSet([u64; WORDS]);

impl LightSet {
    /// No light.
    pub const NONE: Self = Self([0; WORDS]);

    /// Lights 0 to `count` - 1.
    pub fn first(count: usize) -> Self {
        Self(std::array::from_fn(|word| match count.saturating_sub(64 * word) {
            0 => 0,
            bits => u64::MAX >> (64 - bits.min(64)),
        }))
    }

    /// Whether `light` is in it.
    #[inline(always)]
    pub fn contains(&self, light: usize) -> bool {
        self.0[light / 64] >> (light % 64) & 1 == 1
    }

    /// Adds `light`.
    #[inline(always)]
    pub fn insert(&mut self, light: usize) {
        self.insert_if(light, true);
    }

    /// Adds `light` where `is_in`; without a branch, for kernels.
    #[inline(always)]
    pub(crate) fn insert_if(&mut self, light: usize, is_in: bool) {
        self.0[light / 64] |= u64::from(is_in) << (light % 64);
    }

    /// Whether no light is in it.
    pub fn is_empty(&self) -> bool {
        *self == Self::NONE
    }

    /// How many lights are in it.
    pub fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Lights that are in both.
    pub fn and(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|word| self.0[word] & other.0[word]))
    }
}

/// Bit i for light i.
impl From<u64> for LightSet {
    fn from(bits: u64) -> Self {
        let mut set = Self::NONE;
        set.0[0] = bits;
        set
    }
}

impl FromIterator<usize> for LightSet {
    fn from_iter<I: IntoIterator<Item = usize>>(lights: I) -> Self {
        let mut set = Self::NONE;
        lights.into_iter().for_each(|light| set.insert(light));
        set
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_what_was_put_in_at_every_place() {
        for count in [0, 1, 63, 64, 65, 127, 128, 200, 255, MAX_LIGHTS] {
            let set = LightSet::first(count);
            assert_eq!(set, (0..count).collect(), "{count}");
            assert_eq!(set.len(), count);
            assert!((0..MAX_LIGHTS).all(|light| set.contains(light) == (light < count)));
        }
        let ends: LightSet = [0, 63, 64, 255].into_iter().collect();
        assert_eq!(ends.and(&LightSet::first(64)), LightSet::from(1 | 1 << 63));
        assert!(ends.and(&[1, 128].into_iter().collect()).is_empty());
    }
}

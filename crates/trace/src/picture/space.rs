//! What numbers of a colour stand for.

use crate::picture::srgb;

crate::options! {
    /// What numbers of a colour stand for.
    #[derive(Default)]
    pub enum Space {
        #[default]
        Linear = "linear": "amounts of light",
        Encoded = "encoded": "what an sRGB display is sent, 0 to 1: as Gaussian splats are trained to be blended",
    }
}

impl Space {
    /// Whether numbers are amounts of light: what is meant where nothing is said.
    pub fn is_linear(&self) -> bool {
        *self == Space::Linear
    }

    /// The amount of light of a number, which may lie outside of 0 to 1.
    pub fn to_linear(self, value: f64) -> f64 {
        match self {
            Space::Linear => value,
            Space::Encoded if value < 0.0 => -srgb::decode(-value),
            Space::Encoded => srgb::decode(value),
        }
    }

    /// What a display is sent, 0 to 1.
    pub fn to_encoded(self, value: f64) -> f64 {
        match self {
            Space::Linear => srgb::encode(value),
            Space::Encoded => value.clamp(0.0, 1.0),
        }
    }

    /// The number of an amount of light.
    pub fn of_linear(self, linear: f64) -> f64 {
        match self {
            Space::Linear => linear,
            Space::Encoded => srgb::encode_beyond(linear),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        for value in [-0.5, -0.001, 0.0, 0.002, 0.3, 1.0, 2.5] {
            for space in [Space::Linear, Space::Encoded] {
                let back = space.of_linear(space.to_linear(value));
                assert!((back - value).abs() < 1e-6, "{space:?} {value} {back}");
            }
            let encoded = Space::Encoded.to_encoded(value);
            assert_eq!(encoded, value.clamp(0.0, 1.0));
            let same = Space::Linear.to_encoded(Space::Encoded.to_linear(value));
            assert!((same - encoded).abs() < 1e-6);
        }
    }
}

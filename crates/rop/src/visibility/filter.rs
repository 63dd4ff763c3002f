//! Percentage-closer filtering (Reeves, Salesin, Cook, SIGGRAPH 1987): a receiver is compared
//! with several of the map's pixels, and the answers are averaged.

use crate::visibility::map::VisibilityMap;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::random::hash;
use screendoor_trace::trace::Unorm32;

screendoor_trace::options! {
    /// Where a filter's taps lie.
    pub enum Taps {
        Regular = "regular": "on a square grid",
        Stochastic = "stochastic": "at random, anew for each fragment",
    }
}

/// A region of a light's map, and what is compared there.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Filter {
    /// How many places of the region are looked up: 1 to 64; a square number where regular.
    pub taps: u32,
    /// The region's half width, in the map's pixels.
    pub radius: f64,
    /// Where the taps lie.
    pub kind: Taps,
    /// How far a receiver is drawn towards the light before it is compared, as a share of the
    /// depth range, so that a surface does not shadow itself.
    pub bias: f64,
    /// The same, in pixels that the surface's depth is followed for: steep ones are drawn further.
    pub slope_bias: f64,
    /// Which random places.
    pub seed: u32,
}

impl Default for Filter {
    /// One tap, and as much bias as the middle of a pixel lies from its corner.
    fn default() -> Self {
        Filter { taps: 1, radius: 0.0, kind: Taps::Regular, bias: 1e-4, slope_bias: 1.0, seed: 0 }
    }
}

/// What light falls on, in the light's map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Receiver {
    /// Where it lies in the map, in pixels from the left and the top edge.
    pub at: [f32; 2],
    /// Its depth there.
    pub z: Unorm32,
    /// By how much its surface's depth changes over a pixel of the map, along the axis where that
    /// is more.
    pub slope: u32,
    /// Whose random places it has: a word for each thing that these depend on.
    pub key: [u32; 2],
}

impl Filter {
    /// The most taps.
    pub const MOST_TAPS: u32 = 64;

    /// Checks that there is such a filter.
    ///
    /// # Errors
    /// [`Error::Config`] for numbers out of range.
    pub fn check(&self) -> Result<()> {
        let side = self.taps.isqrt();
        if !(1..=Self::MOST_TAPS).contains(&self.taps) {
            return Err(Error::config(
                format_args!("{} taps", self.taps),
                format_args!("a filter has 1 to {}", Self::MOST_TAPS),
            ));
        }
        if self.kind == Taps::Regular && side * side != self.taps {
            return Err(Error::config(
                format_args!("{} taps do not lie on a square grid", self.taps),
                format_args!(
                    "take {} or {}, or stochastic ones",
                    side * side,
                    ((side + 1) * (side + 1)).min(Self::MOST_TAPS)
                ),
            ));
        }
        for (name, value, most) in [
            ("the radius", self.radius, 1024.0),
            ("the bias", self.bias, 1.0),
            ("the slope bias", self.slope_bias, 1024.0),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(Error::config(
                    format_args!("{name} of a filter cannot be {value}"),
                    format_args!("it lies in [0, {most}]"),
                ));
            }
        }
        Ok(())
    }

    /// The depth that is compared: the receiver's, drawn towards the light.
    fn depth(&self, receiver: &Receiver) -> Unorm32 {
        let towards =
            self.bias * f64::from(u32::MAX) + self.slope_bias.max(0.0) * f64::from(receiver.slope);
        // Saturates at 0, where nothing lies nearer.
        Unorm32((f64::from(receiver.z.0) - towards) as u32)
    }

    /// Where a tap lies from the middle of the region, in half widths.
    fn tap(&self, i: u32, key: [u32; 2]) -> [f64; 2] {
        match self.kind {
            Taps::Regular => {
                let side = self.taps.isqrt();
                [i % side, i / side].map(|k| (2 * k + 1) as f64 / f64::from(side) - 1.0)
            }
            Taps::Stochastic => [0, 1].map(|axis| {
                let word = hash([self.seed, key[0], key[1], 2 * i + axis]);
                f64::from(word) / f64::from(1_u32 << 31) - 1.0
            }),
        }
    }

    /// The share of the light that reaches a receiver, 0 to 1: the mean over the taps. Taps
    /// outside the map are lit.
    pub fn visibility(&self, map: &VisibilityMap, receiver: &Receiver) -> f64 {
        let z = self.depth(receiver);
        let tap = |i: u32| {
            let offset = self.tap(i, receiver.key);
            let at = [0, 1]
                .map(|axis| (f64::from(receiver.at[axis]) + self.radius * offset[axis]).floor());
            let inside =
                at.iter().zip(map.size()).all(|(p, size)| (0.0..f64::from(size)).contains(p));
            if inside { map.pixel(at[0] as u32, at[1] as u32, z) } else { 1.0 }
        };
        (0..self.taps).map(tap).sum::<f64>() / f64::from(self.taps)
    }
}

//! Fragments' depths at the samples of sixteen pixels.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i32x16, u32x16};

use crate::contract::frame::Frame;
use crate::stochastic::fast::abreast::lists::{LANES, Row};
use crate::stochastic::fast::abreast::window::STEEP;
use crate::stochastic::fast::state::SIGN;
use screendoor_trace::trace::{DepthPlane, Unorm32};

/// Where samples lie, and how wide depths are.
pub(super) struct Depths<'a, S: Simd, const N: usize> {
    offsets: [[i32x16<S>; 2]; N],
    /// Whether the first sample lies at the centre.
    central: bool,
    frame: &'a Frame,
    bits: u32,
}

impl<'a, S: Simd, const N: usize> Depths<'a, S, N> {
    #[inline(always)]
    pub(super) fn of(simd: S, frame: &'a Frame, bits: u32) -> Self {
        let mut offsets = [[i32x16::splat(simd, 0); 2]; N];
        for i in 0..N {
            offsets[i] = frame.positions[i].map(|p| i32x16::splat(simd, p.into()));
        }
        Depths { offsets, central: frame.positions[0] == [0, 0], frame, bits }
    }

    /// Depths of rows at each sample, one less, their upper bit flipped.
    #[inline(always)]
    pub(super) fn at(&self, simd: S, row: [u32x16<S>; 4], rows: &[Row; LANES]) -> [i32x16<S>; N] {
        let signed = |word: u32x16<S>| word.bitcast::<i32x16<S>>();
        let [z, across, down] = [row[0], row[1], row[2]].map(signed);
        let mut depths = [z; N];
        for i in 0..N {
            if i > 0 || !self.central {
                let [x, y] = self.offsets[i];
                depths[i] = z + ((across * x + down * y) >> 4);
            }
        }
        if i32x16::splat(simd, 0).simd_gt(signed(row[3])).any_true() {
            let mut words = [[0; LANES]; N];
            for i in 0..N {
                depths[i].store_slice(&mut words[i]);
            }
            self.correct(rows, &mut words);
            for i in 0..N {
                depths[i] = i32x16::from_slice(simd, &words[i]);
            }
        }
        if self.bits < 32 {
            let one = i32x16::splat(simd, 1);
            let narrow = i32x16::splat(simd, ((1_u64 << (32 - self.bits)) - 1) as i32);
            for i in 0..N {
                depths[i] = ((depths[i] + one) | narrow) - one;
            }
        }
        depths
    }

    /// Depths of steep planes, and of those near an end of the range.
    #[cold]
    #[inline(never)]
    fn correct(&self, rows: &[Row; LANES], words: &mut [[i32; LANES]; N]) {
        for (lane, row) in rows.iter().enumerate().filter(|(_, row)| row[3] & STEEP != 0) {
            let z = Unorm32(row[0].wrapping_add(1) ^ SIGN);
            let plane = DepthPlane { z, dzdx: row[1] as i32, dzdy: row[2] as i32 };
            for (i, words) in words.iter_mut().enumerate() {
                let depth = plane.at(self.frame.positions[i]);
                words[lane] = ((depth.0 ^ SIGN) as i32).wrapping_sub(1);
            }
        }
    }
}

//! The choice of samples and the account of its errors with pixels in lanes: what
//! [`FastResidual`] does to one, done to sixteen.

#![allow(clippy::needless_range_loop, reason = "loops over samples are unrolled into registers")]

#[cfg(test)]
mod tests;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16, u32x16};

use crate::residual::errors::POINT;
use crate::residual::fast::{FastResidual, Kept};
use crate::residual::products::{Share, attenuated, centre, shown};
use screendoor_rop::fast::{
    self, Abreast, Count, Counted, Met, Ranks, Source, bit, exchanged_teeth, gather, white,
};
use screendoor_rop::{Probe, Round};
use screendoor_trace::tile::TILE_PIXELS;

/// [`Kept`] of sixteen pixels.
#[derive(Clone, Copy)]
pub(super) struct ResidueLanes<S: Simd, const N: usize> {
    white: u32x16<S>,
    fragments: u32x16<S>,
    /// 1 where anything was drawn.
    begun: u32x16<S>,
    z: u32x16<S>,
    mass: u32x16<S>,
    sums: [i32x16<S>; 4],
    fixed: [[i32x16<S>; N]; 3],
}

/// The words of a vector.
#[inline(always)]
fn words<S: Simd>(vector: u32x16<S>) -> [u32; 16] {
    let mut words = [0; 16];
    vector.store_slice(&mut words);
    words
}

#[inline(always)]
fn signed<S: Simd>(vector: u32x16<S>) -> i32x16<S> {
    vector.bitcast()
}

#[inline(always)]
fn unsigned<S: Simd>(vector: i32x16<S>) -> u32x16<S> {
    vector.bitcast()
}

impl<const N: usize> Abreast<N> for FastResidual<N>
where
    Count<N>: fast::Width,
{
    type Kept = Kept<<Count<N> as fast::Width>::Row>;
    type Lanes<S: Simd> = ResidueLanes<S, N>;

    const COLOURS: bool = true;

    fn source(&self) -> Source {
        Source::Nothing
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        _: &Round,
        kept: &[Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    ) -> ResidueLanes<S, N> {
        let begun = gather(simd, pixels, |p| kept[p].begun.into());
        let mut sums = [i32x16::splat(simd, 0); 4];
        // Of samples that nothing was written to.
        let mut fixed = [[i32x16::splat(simd, 0); N]; 3];
        if begun.simd_gt(u32x16::splat(simd, 0)).any_true() {
            for c in 0..4 {
                sums[c] = signed(gather(simd, pixels, |p| kept[p].sums[c] as u32));
            }
            for (c, s) in (0..3).flat_map(|c| (0..N).map(move |s| (c, s))) {
                let word = |p: usize| kept[p].fixed[c].as_ref()[s] as u32;
                fixed[c][s] = signed(gather(simd, pixels, word));
            }
        }
        ResidueLanes {
            white: gather(simd, pixels, |p| kept[p].white),
            fragments: gather(simd, pixels, |p| kept[p].fragments),
            begun,
            z: gather(simd, pixels, |p| kept[p].z),
            mass: gather(simd, pixels, |p| kept[p].mass),
            sums,
            fixed,
        }
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        lanes: &ResidueLanes<S, N>,
        kept: &mut [Self::Kept; TILE_PIXELS],
        pixels: &[u8; 16],
    ) {
        let [fragments, begun] = [lanes.fragments, lanes.begun].map(words);
        let [z, mass] = [lanes.z, lanes.mass].map(words);
        let sums = lanes.sums.map(|sum| words(unsigned(sum)));
        for (lane, pixel) in pixels.iter().enumerate() {
            let to = &mut kept[usize::from(*pixel)];
            (to.fragments, to.begun) = (fragments[lane], begun[lane] != 0);
            (to.z, to.mass) = (z[lane], mass[lane]);
            to.sums = sums.map(|sum| sum[lane] as i32);
        }
        for (c, s) in (0..3).flat_map(|c| (0..N).map(move |s| (c, s))) {
            for (word, pixel) in words(unsigned(lanes.fixed[c][s])).into_iter().zip(pixels) {
                kept[usize::from(*pixel)].fixed[c].as_mut()[s] = word as i32;
            }
        }
    }

    #[inline(always)]
    fn excess<S: Simd>(&self, lanes: &ResidueLanes<S, N>) -> [[f64; 3]; 16] {
        let sums = lanes.sums.map(|sum| words(unsigned(sum)));
        std::array::from_fn(|lane| self.shown_wrongly(&sums.map(|sum| sum[lane] as i32)))
    }

    #[inline(always)]
    fn choose<S: Simd, P: Probe>(
        &self,
        simd: S,
        lanes: &mut ResidueLanes<S, N>,
        met: &Met<'_, S, N>,
        counted: &mut Counted<S, P>,
    ) -> [mask32x16<S>; N] {
        let word = |word: u32| u32x16::splat(simd, word);
        let (none, one) = (word(0), word(1));
        let here = met.coverage.simd_gt(none);

        let xi = white(simd, lanes.white, lanes.fragments);
        lanes.fragments = here.select(lanes.fragments + one, lanes.fragments);
        let hits = exchanged_teeth(simd, xi, met);
        let ranks = match self.plain.sort {
            true => Ranks::of(simd, met.keys),
            false => Ranks::in_sample_order(simd, met.passed),
        };
        let written = ranks.picked(simd, hits, met.passed);

        let drawn = self.fixed_abreast(simd, &met.colours);
        let (changes, read) = lanes.change(simd, met, &written, &drawn);

        // The entry: which of the two is in front, and what that does to the one behind.
        let covered = met.coverage.count_ones();
        let attenuation = Share::of_pixel::<N>(simd, [met.threshold, covered], met.opaque);
        let mass = attenuation.mass(simd);
        let z = depth(simd, met);
        let begun = lanes.begun.simd_gt(none);
        let behind = lanes.z.simd_ge(z);
        let shares = lanes.sums.map(
            #[inline(always)]
            |sum| attenuation.of(simd, sum),
        );
        let opacity = Share::of_threshold(met.threshold, met.opaque);
        for c in 0..4 {
            let through = match drawn.get(c) {
                Some(colour) => shown(simd, shares[3], *colour),
                // Of the coverage itself.
                None => shares[3],
            };
            let in_front =
                lanes.sums[c].saturating_add(i32x16::splat(simd, 0).saturating_sub(through));
            let sum = behind.select(lanes.sums[c] - shares[c], in_front);
            let [all, some] = changes[c];
            lanes.sums[c] = sum.saturating_add(some - opacity.of(simd, all));
        }
        let left = attenuated(lanes.mass, mass);
        let near = [behind.select(z, lanes.z), behind.select(mass, lanes.mass)];
        let far = [behind.select(lanes.z, z), behind.select(left, mass)];
        let both = centre(simd, near, far);
        for (kept, (own, both)) in
            [&mut lanes.z, &mut lanes.mass].into_iter().zip([z, mass].into_iter().zip(both))
        {
            *kept = here.select(begun.select(both, own), *kept);
        }
        lanes.begun = here.select(one, lanes.begun);
        #[cfg(test)]
        self.plant(simd, here, lanes);

        let merged = here & begun;
        counted.compared(merged.select(one, none));
        // As the plain text's: an error behind has a mass, too; both have a centre of mass.
        let made = merged.select(behind.select(word(6), word(5)), none);
        let some = met.passed.simd_gt(none);
        counted.multiplied(some.select(made + word(4), made));
        counted.colours_read(read);
        counted.tracked(here);
        counted.hashed(here.select(one, none));
        if self.plain.sort {
            counted.sorted(met.passed.count_ones());
        }
        written
    }
}

/// A wrong bit in all lanes, for the test that finds it.
#[cfg(test)]
#[derive(Clone, Copy, Debug)]
pub(super) enum LaneFlaw {
    Fragments,
    Depth,
    Mass,
    Sum(usize),
    /// Of a channel, what a sample holds.
    Held(usize, usize),
}

#[cfg(test)]
impl<const N: usize> FastResidual<N> {
    fn plant<S: Simd>(&self, simd: S, here: mask32x16<S>, lanes: &mut ResidueLanes<S, N>) {
        // What a pixel holds is told with few digits: a bit that shows.
        let word = here.select(u32x16::splat(simd, 1 << 16), u32x16::splat(simd, 0));
        match self.flaw {
            None => {}
            Some(LaneFlaw::Fragments) => lanes.fragments ^= word,
            Some(LaneFlaw::Depth) => lanes.z ^= word,
            Some(LaneFlaw::Mass) => lanes.mass ^= word,
            Some(LaneFlaw::Sum(c)) => lanes.sums[c] ^= signed(word),
            Some(LaneFlaw::Held(c, s)) => lanes.fixed[c][s] ^= signed(word),
        }
    }
}

impl<const N: usize> FastResidual<N> {
    /// [`ResidualSampler::fixed`](crate::residual::ResidualSampler::fixed) of sixteen colours.
    #[inline(always)]
    fn fixed_abreast<S: Simd>(&self, simd: S, colours: &[f32x16<S>; 3]) -> [i32x16<S>; 3] {
        let most = f32x16::splat(simd, ((1 << 29) / N) as f32);
        let mut fixed = [i32x16::splat(simd, 0); 3];
        for c in 0..3 {
            let above = colours[c] - f32x16::splat(simd, self.plain.background[c]);
            let scaled = above * f32x16::splat(simd, (1 << POINT) as f32);
            let number = scaled.simd_eq(scaled);
            let within = scaled.max(f32x16::splat(simd, 0.0) - most).min(most);
            fixed[c] = number.select(simd.cvt_i32_f32x16(within), fixed[c]);
        }
        fixed
    }
}

/// Pairs of sums: over the samples that passed and over those that are written.
type Changes<S> = [[i32x16<S>; 2]; 4];

impl<S: Simd, const N: usize> ResidueLanes<S, N> {
    /// What comes less what goes, if all that passed were written, and what is; how many
    /// samples' colours that takes. The samples then hold what is written.
    #[inline(always)]
    fn change(
        &mut self,
        simd: S,
        met: &Met<'_, S, N>,
        written: &[mask32x16<S>; N],
        drawn: &[i32x16<S>; 3],
    ) -> (Changes<S>, u32x16<S>) {
        let none = i32x16::splat(simd, 0);
        let one = i32x16::splat(simd, 1);
        // What lies at the far plane counts as nothing, as it does everywhere; depths are one
        // less here.
        let far = i32x16::splat(simd, i32::MAX - 1);
        let mut gone = [[none; 2]; 3];
        let [mut full, mut writes, mut replaced] = [none; 3];
        for s in 0..N {
            let held = met.stored[s].simd_lt(far);
            let (met, left) = (met.passes[s] & held, written[s] & held);
            full = met.select(full + one, full);
            writes = written[s].select(writes + one, writes);
            replaced = left.select(replaced + one, replaced);
            for c in 0..3 {
                let x = self.fixed[c][s];
                gone[c][0] = met.select(gone[c][0] + x, gone[c][0]);
                gone[c][1] = left.select(gone[c][1] + x, gone[c][1]);
                self.fixed[c][s] = written[s].select(drawn[c], x);
            }
        }
        let passed = signed(met.passed.count_ones());
        let mut changes = [[none; 2]; 4];
        for c in 0..3 {
            changes[c] = [passed * drawn[c] - gone[c][0], writes * drawn[c] - gone[c][1]];
        }
        changes[3] = [(passed - full) << POINT, (writes - replaced) << POINT];
        (changes, unsigned(full))
    }
}

/// Depths at the lowest samples that are covered.
#[inline(always)]
fn depth<S: Simd, const N: usize>(simd: S, met: &Met<'_, S, N>) -> u32x16<S> {
    let mut z = met.depths[N - 1];
    for s in (0..N - 1).rev() {
        let covers = (met.coverage & u32x16::splat(simd, bit(s))).simd_gt(u32x16::splat(simd, 0));
        z = covers.select(met.depths[s], z);
    }
    // Lanes hold one less, the upper bit flipped.
    (unsigned(z) + u32x16::splat(simd, 1)) ^ u32x16::splat(simd, 1 << 31)
}

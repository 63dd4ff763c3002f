//! `merging` with sixteen pixels side by side.
//!
//! A list has room for one layer more than the design, which is there between a fragment's
//! coming and the merging of two. What merging costs is worked out anew each time: to look for
//! the neighbours of a layer whose place differs from lane to lane takes longer.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over channels and halves are unrolled into registers; closures would be called"
)]

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, i32x16, mask32x16, u32x16};
use screendoor_rop::Probe;
use screendoor_rop::in_lanes::{
    HasLanes, InLanes, LANES, Met, Told, Wide, counted, depth_at, hashed, reaches_ends, widened,
    words,
};
use screendoor_rop::layers::DEPTH_BITS;
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::{DepthPlane, SampleMask, Unorm32};

use crate::merging::sheet::{Listed, Sheet};
use crate::merging::{MergingAt, Place, Rules};

/// A [`Sheet`] of each of sixteen pixels. One that is not there lies behind all others and
/// covers nothing.
#[derive(Clone, Copy)]
struct Sheets<S: Simd> {
    z: u32x16<S>,
    slopes: [i32x16<S>; 2],
    depth: u32x16<S>,
    coverage: u32x16<S>,
    colour: [f32x16<S>; 3],
    alpha: f32x16<S>,
}

impl<S: Simd> Sheets<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Sheets {
            z: u32x16::splat(simd, u32::MAX),
            slopes: [i32x16::splat(simd, 0); 2],
            depth: u32x16::splat(simd, u32::MAX),
            coverage: u32x16::splat(simd, 0),
            colour: [f32x16::splat(simd, 0.0); 3],
            alpha: f32x16::splat(simd, 0.0),
        }
    }

    /// These where `mask` says, and the others elsewhere.
    #[inline(always)]
    fn or(&self, mask: mask32x16<S>, other: &Self) -> Self {
        let mut chosen = *other;
        chosen.z = mask.select(self.z, other.z);
        for axis in 0..2 {
            chosen.slopes[axis] = mask.select(self.slopes[axis], other.slopes[axis]);
        }
        chosen.depth = mask.select(self.depth, other.depth);
        chosen.coverage = mask.select(self.coverage, other.coverage);
        for c in 0..3 {
            chosen.colour[c] = mask.select(self.colour[c], other.colour[c]);
        }
        chosen.alpha = mask.select(self.alpha, other.alpha);
        chosen
    }

    /// Where they are not the same.
    #[inline(always)]
    fn differ(&self, other: &Self) -> mask32x16<S> {
        let mut differ = self.z.simd_ne(other.z) | self.depth.simd_ne(other.depth);
        for axis in 0..2 {
            differ |= self.slopes[axis].simd_ne(other.slopes[axis]);
        }
        differ |= self.coverage.simd_ne(other.coverage);
        for c in 0..3 {
            differ |= self.colour[c].simd_ne(other.colour[c]);
        }
        differ | self.alpha.simd_ne(other.alpha)
    }
}

/// [`Shown`](super::Shown) of sixteen pairs.
struct Shown<S: Simd> {
    near: f32x16<S>,
    far: f32x16<S>,
    covered: f32x16<S>,
    spread: f32x16<S>,
}

impl<S: Simd> Shown<S> {
    #[inline(always)]
    fn of(simd: S, a: &Sheets<S>, b: &Sheets<S>) -> Self {
        let one = f32x16::splat(simd, 1.0);
        let both = counted(simd, a.coverage & b.coverage);
        let (first, second) = (counted(simd, a.coverage) - both, counted(simd, b.coverage) - both);
        let covered = first + second + both;
        let behind = (one - a.alpha) * b.alpha;
        let near = a.alpha * (first + both);
        let far = b.alpha * second + behind * both;
        let mean = (near + far) * (one / covered);
        let of_both = squared(a.alpha + behind - mean) * both;
        let spread = squared(a.alpha - mean) * first + squared(b.alpha - mean) * second + of_both;
        Shown { near, far, covered, spread }
    }
}

#[inline(always)]
fn squared<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    x * x
}

/// Lists of sixteen pixels.
pub struct Lists<S: Simd> {
    /// From near to far, and room for one more.
    sheets: Vec<Sheets<S>>,
    /// How many of them are there in any of the pixels, at most.
    used: usize,
    /// What they were before the last fragment, where somebody asks.
    before: Vec<Sheets<S>>,
    held: u32x16<S>,
}

/// The design in lanes.
#[derive(Debug)]
pub struct MergingInLanes {
    rules: Rules,
    /// Where samples lie.
    places: Vec<[f32; 2]>,
}

impl<const N: usize> HasLanes<N> for MergingAt<N> {
    type InLanes = MergingInLanes;

    fn in_lanes(&self) -> Option<MergingInLanes> {
        let rules = self.rules.clone();
        let place = |s| rules.middles.position(s).map(f32::from);
        let places = (0..N).map(place).collect();
        Some(MergingInLanes { rules, places })
    }
}

impl MergingInLanes {
    /// The middles of samples: [`Middles::of_samples`](super::Middles::of_samples).
    #[inline(always)]
    fn middles<S: Simd>(&self, simd: S, coverage: u32x16<S>) -> [i32x16<S>; 2] {
        let nought = f32x16::splat(simd, 0.0);
        let mut sums = [nought; 2];
        for (s, place) in self.places.iter().enumerate() {
            let covers = (coverage & u32x16::splat(simd, 1 << s)).simd_ne(0);
            for axis in 0..2 {
                sums[axis] = covers.select(sums[axis] + place[axis], sums[axis]);
            }
        }
        // Of small whole numbers: no quotient is rounded to the next whole one.
        let count = counted(simd, coverage).max(1.0);
        let [x, y] = sums;
        [simd.cvt_i32_f32x16(x / count), simd.cvt_i32_f32x16(y / count)]
    }

    /// [`Rules::sheet`] of sixteen fragments.
    #[inline(always)]
    fn sheets<S: Simd>(&self, simd: S, met: &Met<S>) -> Sheets<S> {
        let [across, down] = met.slopes;
        let mut slopes = [slope(simd, across), slope(simd, down)];
        let depth = depth_at(simd, met.z, slopes, self.middles(simd, met.coverage));
        let mut z = met.z;
        if !self.rules.slopes {
            z = depth;
            slopes = [i32x16::splat(simd, 0); 2];
        }
        let mut colour = met.colour;
        for c in 0..3 {
            colour[c] = self.rules.store.channels(simd, colour[c]);
        }
        let alpha = self.rules.store.channels(simd, met.alpha);
        Sheets { z, slopes, depth, coverage: met.coverage, colour, alpha }
    }

    /// [`Rules::merged`] of sixteen pairs.
    #[inline(always)]
    fn both<S: Simd>(&self, simd: S, a: &Sheets<S>, b: &Sheets<S>, word: u32x16<S>) -> Sheets<S> {
        let one = f32x16::splat(simd, 1.0);
        let Shown { near, far, covered, .. } = Shown::of(simd, a, b);
        let sum = near + far;
        let first = match self.rules.place {
            Place::Random => {
                let part = f32x16::splat(simd, 1.0 / (1 << 24) as f32);
                (simd.cvt_f32_u32x16(word >> 8) * part * sum).simd_lt(near)
            }
            Place::Heavier => near.simd_ge(far),
        };
        let mut merged = a.or(first, b);
        merged.coverage = a.coverage | b.coverage;
        merged.depth = depth_at(simd, merged.z, merged.slopes, self.middles(simd, merged.coverage));
        let shows = sum.simd_gt(f32x16::splat(simd, 0.0));
        for c in 0..3 {
            let mean = (a.colour[c] * near + b.colour[c] * far) / sum;
            let colour = shows.select(mean, a.colour[c]);
            merged.colour[c] = self.rules.store.channels(simd, colour);
        }
        merged.alpha = self.rules.store.channels(simd, (sum * (one / covered)).min(1.0));
        merged
    }

    /// [`Listed::cheapest`].
    #[inline(always)]
    fn cheapest<S: Simd>(&self, simd: S, list: &[Sheets<S>]) -> u32x16<S> {
        let real = f32x16::splat(simd, 0.0);
        let (mut best, mut least) = (u32x16::splat(simd, 0), real + f32::INFINITY);
        let mut through = real + 1.0;
        let range = list[list.len() - 1].depth - list[0].depth;
        let range = simd.cvt_f32_u32x16(range.max(1));
        for (i, pair) in list.windows(2).enumerate() {
            let [a, b] = [&pair[0], &pair[1]];
            let Shown { near, far, covered, spread } = Shown::of(simd, a, b);
            let gap = simd.cvt_f32_u32x16(b.depth - a.depth);
            let apart = near * far * gap * 6.0;
            let cost = (apart + covered * spread * range) * (through * through);
            let better = cost.simd_lt(least);
            best = better.select(u32x16::splat(simd, i as u32), best);
            least = better.select(cost, least);
            let opaque = a.alpha * (counted(simd, a.coverage) / self.rules.samples as f32);
            through *= f32x16::splat(simd, 1.0) - opaque;
        }
        best
    }
}

/// [`slope`](super::slope) of sixteen.
#[inline(always)]
fn slope<S: Simd>(simd: S, v: i32x16<S>) -> i32x16<S> {
    let word = |word: u32| u32x16::splat(simd, word);
    let size = v.abs().bitcast::<u32x16<S>>();
    // The exponent is the place of the upper bit; with the next one cleared no conversion carries
    // into a higher one.
    let upper = simd.cvt_f32_u32x16(size & !(size >> 1)).bitcast::<u32x16<S>>() >> 23;
    let shift = upper.max(word(127 + 9)) - word(127 + 9);
    let half = simd.shlv_u32x16(word(1), shift) >> 1;
    let kept = simd.shlv_u32x16(simd.shrv_u32x16(size + half, shift), shift);
    let kept = kept.min(word(i32::MAX as u32)).bitcast::<i32x16<S>>();
    let negative = v.simd_lt(i32x16::splat(simd, 0));
    negative.select(i32x16::splat(simd, 0) - kept, kept)
}

impl MergingInLanes {
    /// Puts layers into their places, where there are any.
    #[inline(always)]
    fn insert<S: Simd>(new: &Sheets<S>, any: mask32x16<S>, list: &mut [Sheets<S>]) {
        let mut carried = *new;
        for sheets in list {
            // Those behind them all move by one.
            let moves = !sheets.depth.simd_lt(new.depth) & any;
            let moved = sheets.or(moves, &carried);
            *sheets = carried.or(moves, sheets);
            carried = moved;
        }
    }

    /// Merges two where `of` says.
    #[inline(always)]
    fn merge<S: Simd>(&self, simd: S, of: mask32x16<S>, list: &mut [Sheets<S>], word: u32x16<S>) {
        let place = |i: usize| u32x16::splat(simd, i as u32);
        let best = self.cheapest(simd, list);
        let [mut near, mut far] = [list[0], list[1]];
        for (i, pair) in list.windows(2).enumerate().skip(1) {
            let here = best.simd_eq(place(i));
            near = pair[0].or(here, &near);
            far = pair[1].or(here, &far);
        }
        let merged = self.both(simd, &near, &far, word);
        // Both are taken out where they are, and what they became is put into its place.
        let best = of.select(best, place(list.len()));
        let none = Sheets::none(simd);
        let mut carried = merged;
        for j in 0..list.len() {
            let later = list.get(j + 2).unwrap_or(&none);
            let left = list[j].or(place(j).simd_lt(best), later);
            let moves = !left.depth.simd_lt(merged.depth) & of;
            list[j] = carried.or(moves, &left);
            carried = left.or(moves, &carried);
        }
    }

    /// Tells of fragments that have come before two were merged.
    #[inline(always)]
    fn tell_put<S: Simd, P: Probe>(
        &self,
        simd: S,
        lists: &Lists<S>,
        new: &Sheets<S>,
        [any, full]: [mask32x16<S>; 2],
        told: &mut Told<S, P>,
    ) {
        let word = |word: u32| u32x16::splat(simd, word);
        let mut place = word(0);
        for sheets in &lists.sheets[..lists.used] {
            place = sheets.depth.simd_lt(new.depth).select(place + word(1), place);
        }
        told.compared(any, lists.held);
        told.state(any, lists.held * word(DEPTH_BITS), word(0));
        let [rest, all] = [self.rules.bits - DEPTH_BITS, self.rules.bits].map(word);
        // What lies behind the new layer moves by one.
        let moved = lists.held - place;
        told.state(any & !full, rest * moved, all * (moved + word(1)));
        let merges = any & full;
        let room = self.rules.room as u32;
        told.hashed(merges, u32::from(self.rules.place == Place::Random));
        told.compared(merges, word(room - 1));
        told.multiplied(merges, word(self.rules.products(room)));
        told.state(merges, rest * word(room), word(0));
    }
}

impl InLanes for MergingInLanes {
    type State = Vec<Listed>;
    type Lanes<S: Simd> = Lists<S>;

    fn clear<S: Simd>(&self, simd: S) -> Lists<S> {
        let sheets = vec![Sheets::none(simd); self.rules.room + 1];
        Lists { sheets, used: 0, before: Vec::new(), held: u32x16::splat(simd, 0) }
    }

    #[inline(always)]
    fn clear_again<S: Simd>(&self, simd: S, lists: &mut Lists<S>) {
        lists.sheets[..lists.used].fill(Sheets::none(simd));
        lists.used = 0;
        lists.held = u32x16::splat(simd, 0);
    }

    #[inline(always)]
    fn load<S: Simd>(
        &self,
        simd: S,
        lists: &mut Lists<S>,
        states: &[Vec<Listed>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let mut held = [0; LANES];
        for (held, pixel) in held.iter_mut().zip(pixels) {
            *held = states[usize::from(*pixel)].len() as u32;
        }
        self.clear_again(simd, lists);
        lists.held = u32x16::from_slice(simd, &held);
        lists.used = held.into_iter().max().unwrap_or_default() as usize;
        for (i, to) in lists.sheets[..lists.used].iter_mut().enumerate() {
            let mut columns = [[0_u32; LANES]; 9];
            for depth in [0, 3] {
                columns[depth] = [u32::MAX; LANES];
            }
            for (lane, pixel) in pixels.iter().enumerate() {
                let Some(Listed { sheet, .. }) = states[usize::from(*pixel)].get(i) else {
                    continue;
                };
                let DepthPlane { z, dzdx, dzdy } = sheet.plane;
                let [r, g, b] = sheet.colour.map(f32::to_bits);
                let row = [
                    z.0,
                    dzdx as u32,
                    dzdy as u32,
                    sheet.depth.0,
                    sheet.coverage.0 as u32,
                    r,
                    g,
                    b,
                    sheet.alpha.to_bits(),
                ];
                for (column, word) in columns.iter_mut().zip(row) {
                    column[lane] = word;
                }
            }
            let [z, across, down, depth, coverage, r, g, b, alpha] =
                columns.map(|column| u32x16::from_slice(simd, &column));
            *to = Sheets {
                z,
                slopes: [across.bitcast(), down.bitcast()],
                depth,
                coverage,
                colour: [r.bitcast(), g.bitcast(), b.bitcast()],
                alpha: alpha.bitcast(),
            };
        }
    }

    #[inline(always)]
    fn store<S: Simd>(
        &self,
        lists: &Lists<S>,
        states: &mut [Vec<Listed>; TILE_PIXELS],
        pixels: &[u8; LANES],
    ) {
        let held = words(lists.held);
        let sheets: Vec<_> = lists.sheets[..lists.used].iter().map(sixteen).collect();
        for (lane, pixel) in pixels.iter().enumerate() {
            let list = sheets.iter().take(held[lane] as usize).map(|sheets| sheets[lane]);
            states[usize::from(*pixel)] = self.rules.listed(list);
        }
    }

    #[inline(always)]
    fn draw<S: Simd, P: Probe>(
        &self,
        simd: S,
        lists: &mut Lists<S>,
        _pass: u32,
        met: &Met<S>,
        told: &mut Told<S, P>,
    ) {
        let word = |word: u32| u32x16::splat(simd, word);
        let new = self.sheets(simd, met);
        let any = met.any;
        let full = lists.held.simd_ge(word(self.rules.room as u32));
        if P::LISTENS {
            self.tell_put(simd, lists, &new, [any, full], told);
            lists.before.clone_from(&lists.sheets);
        }
        // The next that is not there takes what moves out.
        lists.used = (lists.used + 1).min(lists.sheets.len());
        Self::insert(&new, any, &mut lists.sheets[..lists.used]);
        lists.held = (any & !full).select(lists.held + word(1), lists.held);
        let merges = any & full;
        if merges.any_true() {
            let mut chosen = word(0);
            if self.rules.place == Place::Random {
                let seed = word(self.rules.seed);
                chosen = hashed(simd, [seed, met.pixel, met.primitive, new.depth]);
            }
            self.merge(simd, merges, &mut lists.sheets, chosen);
            if P::LISTENS {
                // Written is each place that holds something else.
                for (old, new) in lists.before.iter().zip(&lists.sheets) {
                    told.state(merges & new.differ(old), word(0), word(self.rules.bits));
                }
            }
        }
        told.written(any, met.coverage);
    }

    #[inline(always)]
    fn resolve<S: Simd>(
        &self,
        simd: S,
        lists: &Lists<S>,
        behind: &[[f32x16<S>; 3]],
    ) -> [Wide<S>; 3] {
        let nought = f64x8::splat(simd, 0.0);
        let mut sums = [[nought; 2]; 3];
        let mut crossing = lists.held.simd_lt(0);
        let list = &lists.sheets[..lists.used.min(self.rules.room)];
        let sheets: Vec<_> = list.iter().map(|sheets| Resolved::of(simd, sheets)).collect();
        for sheets in list {
            let covers = sheets.coverage.simd_ne(0);
            crossing |= covers & reaches_ends(simd, sheets.z, sheets.slopes);
        }
        for (s, behind) in behind.iter().enumerate() {
            let [x, y] = self.rules.middles.position(s).map(|p| i32x16::splat(simd, p.into()));
            let mut last = u32x16::splat(simd, 0);
            let mut through = [f64x8::splat(simd, 1.0); 2];
            for (sheets, seen) in list.iter().zip(&sheets) {
                let covers = (sheets.coverage & u32x16::splat(simd, 1 << s)).simd_ne(0);
                let [across, down] = sheets.slopes;
                let z = sheets.z + ((across * x + down * y) >> 4).bitcast::<u32x16<S>>();
                crossing |= covers & z.simd_lt(last);
                last = covers.select(z, last);
                // What is not covered adds nothing, which keeps all bits.
                let alpha = widened(simd, covers.select(sheets.alpha, f32x16::splat(simd, 0.0)));
                for half in 0..2 {
                    let share = through[half] * alpha[half];
                    for c in 0..3 {
                        sums[c][half] += seen.colour[c][half] * share;
                    }
                    through[half] *= f64x8::splat(simd, 1.0) - alpha[half];
                }
            }
            for c in 0..3 {
                let behind = widened(simd, behind[c]);
                for half in 0..2 {
                    sums[c][half] += behind[half] * through[half];
                }
            }
        }
        for c in 0..3 {
            for half in 0..2 {
                sums[c][half] /= self.rules.samples as f64;
            }
        }
        if crossing.any_true() {
            self.resolve_crossing(lists, behind, crossing.to_bitmask(), &mut sums);
        }
        sums
    }
}

/// Colours as they are summed.
struct Resolved<S: Simd> {
    colour: [Wide<S>; 3],
}

impl<S: Simd> Resolved<S> {
    #[inline(always)]
    fn of(simd: S, sheets: &Sheets<S>) -> Self {
        let [r, g, b] = sheets.colour;
        Resolved { colour: [widened(simd, r), widened(simd, g), widened(simd, b)] }
    }
}

/// The layers of sixteen pixels, pixel by pixel.
fn sixteen<S: Simd>(sheets: &Sheets<S>) -> [Sheet; LANES] {
    let [z, depth, coverage] = [sheets.z, sheets.depth, sheets.coverage].map(words);
    let [across, down] = sheets.slopes.map(|slope| words(slope.bitcast()));
    let [r, g, b] = sheets.colour.map(|c| words(c.bitcast()));
    let alpha = words(sheets.alpha.bitcast());
    std::array::from_fn(|i| {
        let (dzdx, dzdy) = (across[i] as i32, down[i] as i32);
        let coverage = SampleMask(coverage[i].into());
        Sheet {
            plane: DepthPlane { z: Unorm32(z[i]), dzdx, dzdy },
            depth: Unorm32(depth[i]),
            coverage,
            count: coverage.count(),
            colour: [r[i], g[i], b[i]].map(f32::from_bits),
            alpha: f32::from_bits(alpha[i]),
        }
    })
}

impl MergingInLanes {
    /// The colours of pixels of which layers change places between samples, one by one.
    #[cold]
    #[inline(never)]
    fn resolve_crossing<S: Simd>(
        &self,
        lists: &Lists<S>,
        behind: &[[f32x16<S>; 3]],
        crossing: u64,
        sums: &mut [Wide<S>; 3],
    ) {
        let held = words(lists.held);
        let sheets: Vec<_> = lists.sheets[..lists.used].iter().map(sixteen).collect();
        let behind: Vec<_> = behind.iter().map(|b| b.map(|c| words(c.bitcast()))).collect();
        for lane in SampleMask(crossing).iter() {
            let list = sheets.iter().take(held[lane] as usize).map(|sheets| &sheets[lane]);
            let behind: Vec<_> =
                behind.iter().map(|b| b.map(|c| f32::from_bits(c[lane]))).collect();
            let colour = self.rules.resolve(list, &behind);
            for (sums, c) in sums.iter_mut().zip(colour) {
                let half = &mut sums[lane / (LANES / 2)];
                half.as_mut_slice()[lane % (LANES / 2)] = c;
            }
        }
    }
}

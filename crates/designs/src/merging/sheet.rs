//! A layer of `merging`, what two of them show together, and the list in which they lie.

use std::sync::Arc;

use screendoor_rop::layers::Deep;
use screendoor_trace::trace::{DepthPlane, SampleMask, Unorm32};

/// Bits of a stored slope: its sign, how far the others are shifted, and ten of them.
pub(super) const SLOPE_BITS: u32 = 16;

/// A slope as that many bits hold it.
pub(super) fn slope(v: i32) -> i32 {
    let shift = (32 - v.unsigned_abs().leading_zeros()).saturating_sub(10);
    let half = 1 << shift >> 1;
    let rounded = (v.unsigned_abs().saturating_add(half)) >> shift << shift;
    (rounded.min(i32::MAX as u32) as i32) * v.signum()
}

/// One divided by each count of samples, to nearest: devices divide less exactly.
pub(super) const SHARES: [f32; 65] = {
    let mut list = [0.0; 65];
    let mut n = 1;
    while n < list.len() {
        list[n] = 1.0 / n as f32;
        n += 1;
    }
    list
};

/// Where the middle of some samples lies, in whole sixteenths of a pixel.
#[derive(Clone, Debug)]
pub(super) struct Middles {
    positions: Arc<[[i8; 2]]>,
    /// Those of all sets of the first eight samples, by their masks.
    known: Arc<[[i8; 2]]>,
}

impl Middles {
    pub(super) fn of(positions: Arc<[[i8; 2]]>) -> Self {
        let masks = (0..1 << positions.len().min(8)).map(SampleMask);
        let known = masks.map(|mask| middle(&positions, mask)).collect();
        Middles { positions, known }
    }

    pub(super) fn of_samples(&self, mask: SampleMask) -> [i8; 2] {
        let known = usize::try_from(mask.0).ok().and_then(|i| self.known.get(i));
        known.copied().unwrap_or_else(|| middle(&self.positions, mask))
    }

    pub(super) fn position(&self, sample: usize) -> [i8; 2] {
        self.positions[sample]
    }
}

fn middle(positions: &[[i8; 2]], mask: SampleMask) -> [i8; 2] {
    let mut sum = [0; 2];
    for s in mask.iter() {
        sum = [0, 1].map(|axis| sum[axis] + i32::from(positions[s][axis]));
    }
    sum.map(|sum| (sum / mask.count().max(1) as i32) as i8)
}

/// A layer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sheet {
    pub(super) plane: DepthPlane,
    /// The plane's depth at the middle of the samples that are covered: follows from the others.
    pub(super) depth: Unorm32,
    pub(super) coverage: SampleMask,
    /// How many samples these are.
    pub(super) count: u32,
    pub(super) colour: [f32; 3],
    pub(super) alpha: f32,
}

/// What two layers show together, the near one first.
pub(super) struct Shown {
    /// Samples that show the near one, as if alone.
    pub(super) near: f32,
    /// Those that show the far one through it.
    pub(super) far: f32,
    /// Samples that either covers.
    pub(super) covered: usize,
    /// By how much opacity varies over these: the sum of squared differences from its mean.
    spread: f32,
}

impl Shown {
    pub(super) fn of(a: &Sheet, b: &Sheet) -> Self {
        // Without the machine's own instruction a count takes a dozen: one of them, not four.
        let common = (a.coverage & b.coverage).count();
        let covered = (a.count + b.count - common) as usize;
        let both = common as f32;
        let (first, second) = (a.count as f32 - both, b.count as f32 - both);
        let behind = (1.0 - a.alpha) * b.alpha;
        let near = a.alpha * (first + both);
        let far = b.alpha * second + behind * both;
        let mean = (near + far) * SHARES[covered];
        let square = |x: f32| (x - mean) * (x - mean);
        let of_both = square(a.alpha + behind) * both;
        let spread = square(a.alpha) * first + square(b.alpha) * second + of_both;
        Shown { near, far, covered, spread }
    }
}

/// A layer in its list, with what is asked of it at each fragment although it changes seldom.
/// All of that follows from the layer and the next one: it is no state.
#[derive(Clone, Copy, Debug)]
pub struct Listed {
    pub(super) sheet: Sheet,
    /// How much of the pixel it hides.
    opaque: f32,
    /// What merging it with the next one costs since they lie apart, ...
    apart: f32,
    /// ... and since they do not cover the same samples, as a share of the depth range.
    uneven: f32,
}

impl Deep for Listed {
    #[inline]
    fn depth(&self) -> Unorm32 {
        self.sheet.depth
    }
}

impl Listed {
    /// A layer of a pixel of `samples` samples, whose next one is not looked at yet.
    pub(super) fn of(sheet: Sheet, samples: usize) -> Self {
        let opaque = sheet.alpha * (sheet.count as f32 / samples as f32);
        Listed { sheet, opaque, apart: 0.0, uneven: 0.0 }
    }

    /// Looks at the one after the `i`-th, if there are both.
    ///
    /// Merging them puts one transmittance in place of two: where they lie apart, a fragment to
    /// come may fall between them (`6·near·far·gap`), and where masks differ, the mean opacity
    /// is wrong at each sample (`covered·spread`). Both are variances, as far as the weight 6 has
    /// been fitted to pictures.
    pub(super) fn link(list: &mut [Listed], i: usize) {
        let Some([a, b]) = list.get_mut(i..).and_then(<[Listed]>::first_chunk_mut) else { return };
        let Shown { near, far, covered, spread } = Shown::of(&a.sheet, &b.sheet);
        a.apart = near * far * (b.sheet.depth.0 - a.sheet.depth.0) as f32 * 6.0;
        a.uneven = covered as f32 * spread;
    }

    /// The same for the one before the `i`-th.
    pub(super) fn link_before(list: &mut [Listed], i: usize) {
        if let Some(before) = i.checked_sub(1) {
            Listed::link(list, before);
        }
    }

    /// Moves the `i`-th, which alone may be out of order, to its place, and looks at those that
    /// have a new neighbour.
    pub(super) fn settle(list: &mut [Listed], i: usize) {
        let depth = list[i].depth();
        // Strictly nearer ones stay in front, as when a layer comes.
        let before = |list: &[Listed]| list.iter().filter(|l| l.depth() < depth).count();
        let [nearer, behind] = [before(&list[..i]), before(&list[i + 1..])];
        if nearer < i {
            list[nearer..=i].rotate_right(1);
            Listed::link(list, i);
        } else if behind > 0 {
            list[i..=i + behind].rotate_left(1);
            Listed::link_before(list, i);
        }
        let place = if nearer < i { nearer } else { i + behind };
        Listed::link(list, place);
        Listed::link_before(list, place);
    }

    /// The place of the layer that costs least to merge with the next: what is in front lets t
    /// of both through.
    pub(super) fn cheapest(list: &[Listed]) -> usize {
        let depth = |i: usize| list[i].sheet.depth.0;
        let range = (depth(list.len() - 1) - depth(0)).max(1) as f32;
        let (mut best, mut least, mut through) = (0, f32::INFINITY, 1.0_f32);
        for (i, a) in list[..list.len() - 1].iter().enumerate() {
            let cost = (a.apart + a.uneven * range) * (through * through);
            if cost < least {
                (best, least) = (i, cost);
            }
            through *= 1.0 - a.opaque;
        }
        best
    }
}

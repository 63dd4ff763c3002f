//! What the samples are wrong by: a short list of errors, each at a depth.
//!
//! An error has four sums over the samples of a part of the pixel: red, green and blue less
//! the background's, and coverage. They are signed, in units of 2^-20 of a sample, and so small
//! that 32 bits hold each and every product is one of 32 bits with 32, as a device has it.

use screendoor_rop::{Layout, Probe, Threshold};
use screendoor_trace::random::{GOLDEN, hash};
use screendoor_trace::trace::SampleMask;

screendoor_trace::options! {
    /// How wide an error's sums are stored.
    pub enum Width {
        Whole = "32": "32 bits, in units of 2^-20 of a sample",
        Half = "16": "16 bits, in units of 2^-12 of a part of the pixel, rounded to nearest",
        Byte = "8": "8 bits, in units of 2^-6 of a part of the pixel, rounded at random",
    }
}

impl Width {
    /// Bits of a sum.
    pub(super) fn bits(self) -> u32 {
        match self {
            Width::Whole => 32,
            Width::Half => 16,
            Width::Byte => 8,
        }
    }

    /// Binary digits below a stored sum's last, of a part of `samples` samples.
    pub(super) fn below(self, samples: u32) -> u32 {
        match self {
            Width::Whole => 0,
            Width::Half => POINT - 12 + samples.ilog2(),
            Width::Byte => POINT - 6 + samples.ilog2(),
        }
    }
}

/// Binary digits after the point of what is computed with.
pub(super) const POINT: u32 = 20;

/// Binary digits after the point of a mass.
pub(super) const MASS: u32 = 15;

/// Red, green, blue and coverage.
pub(super) type Sums = [i32; 4];

/// What tests plant, to see that it is found.
#[cfg(test)]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Flaw {
    /// Errors are attenuated by the share of samples that passed, not of those covered.
    ByPassed,
    /// Products are rounded down.
    RoundedDown,
    /// What a fragment adds goes to the last entry.
    Misplaced,
    /// No samples are exchanged.
    NoExchange,
}

/// An error at one depth.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Entry {
    /// Its depth.
    pub(super) z: u32,
    /// How much opacity was drawn here, attenuated as the error is: multiples of 2^-15.
    pub(super) mass: u32,
    /// Its sums, for each part of the pixel.
    pub(super) parts: Box<[Sums]>,
}

/// How errors are kept: of a pixel of so many samples, in so many parts, at so many depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Store {
    pub samples: u32,
    pub parts: usize,
    pub layers: usize,
    pub width: Width,
    #[cfg(test)]
    pub flaw: Option<Flaw>,
}

/// What a fragment is to the errors: all that their attenuation may depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// Its depth at the lowest sample that it covers.
    pub z: u32,
    pub coverage: SampleMask,
    /// Its colour less the background's, and 1.
    pub colour: Sums,
    pub threshold: Threshold,
    /// What its sums are rounded by, where they are at random.
    pub random: u32,
}

/// `threshold / 2^32` of `x`, to nearest, halves upwards.
#[inline(always)]
pub(super) fn share(threshold: u64, x: i32) -> i32 {
    ((threshold as i64 * i64::from(x) + (1 << 31)) >> 32) as i32
}

/// `x / 2^digits`, to nearest, halves upwards.
fn rounded(x: i64, digits: u32) -> i64 {
    if digits == 0 { x } else { (x + (1 << (digits - 1))) >> digits }
}

/// The product of a coverage and a colour, as long as 32 bits hold it.
#[inline(always)]
pub(super) fn shown(coverage: i32, colour: i32) -> i32 {
    let product = rounded(i64::from(coverage) * i64::from(colour), POINT);
    product.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// A fragment's threshold times the share of a pixel of 2^`samples_log2` samples that it covers.
#[inline(always)]
pub(super) fn of_pixel(threshold: u64, covered: u32, samples_log2: u32) -> u64 {
    (threshold * u64::from(covered)) >> samples_log2
}

/// The mass of that.
#[inline(always)]
pub(super) fn mass_of(of_pixel: u64) -> u32 {
    (of_pixel >> (32 - MASS)) as u32
}

/// A mass behind a fragment of mass `drawn`.
#[inline(always)]
pub(super) fn attenuated(mass: u32, drawn: u32) -> u32 {
    mass - ((mass * drawn) >> MASS)
}

/// Depth and mass of two entries as one, the nearer one first: their centre of mass.
#[inline(always)]
pub(super) fn centre([z, mass]: [u32; 2], [far_z, far_mass]: [u32; 2]) -> [u32; 2] {
    let both = mass + far_mass;
    let odds = (far_mass << MASS) / both.max(1);
    let moved = (u64::from(far_z - z) * u64::from(odds)) >> MASS;
    [z + moved as u32, both.min(u16::MAX.into())]
}

impl Store {
    /// The product with `threshold / 2^32`.
    fn share(&self, threshold: u64, x: i32) -> i32 {
        #[cfg(test)]
        if self.flaw == Some(Flaw::RoundedDown) {
            return ((threshold as i64 * i64::from(x)) >> 32) as i32;
        }
        share(threshold, x)
    }

    /// What a pixel keeps: entries, and how many fragments there were.
    pub(super) fn layout(&self) -> Layout {
        let sums = 4 * self.parts as u32 * self.width.bits();
        let entry = [(32, "depth"), (16, "mass"), (sums, "error sums")];
        Layout::of(1, &[(32, "fragments")]).and(self.layers as u32, &entry)
    }

    /// The samples of a part.
    fn samples_of_part(&self) -> u32 {
        self.samples / self.parts as u32
    }

    /// The fragment's threshold times the share of the pixel that it covers.
    fn of_pixel(&self, drawn: &Drawn) -> u64 {
        of_pixel(drawn.threshold.value(), drawn.coverage.count(), self.samples.ilog2())
    }

    /// The fragment's threshold times the share of a part that it covers.
    fn of_part(&self, drawn: &Drawn, part: usize) -> u64 {
        match self.parts {
            1 => self.of_pixel(drawn),
            _ if drawn.coverage.contains(part) => drawn.threshold.value(),
            _ => 0,
        }
    }

    /// Attenuates the errors that lie behind a fragment, and makes an entry of its own for
    /// what shows of it wrongly, since the samples in front of it are wrong: its place.
    ///
    /// Nothing of this depends on which samples the fragment writes or has passed the depth
    /// test at: that keeps the errors 0 in the mean.
    pub(super) fn attenuate(&self, entries: &mut Vec<Entry>, drawn: &Drawn) -> usize {
        let place = entries.iter().take_while(|entry| entry.z < drawn.z).count();
        let mass = mass_of(self.of_pixel(drawn));
        for entry in &mut entries[place..] {
            entry.mass = attenuated(entry.mass, mass);
        }
        let mut own = vec![[0; 4]; self.parts].into_boxed_slice();
        for (part, own) in own.iter_mut().enumerate() {
            let threshold = self.of_part(drawn, part);
            let front = entries[..place].iter().map(|entry| entry.parts[part][3]);
            let hidden = self.share(threshold, front.fold(0, i32::saturating_add));
            *own = drawn.colour.map(|x| shown(hidden, x).saturating_neg());
            for entry in &mut entries[place..] {
                for d in &mut entry.parts[part] {
                    *d -= self.share(threshold, *d);
                }
            }
        }
        entries.insert(place, Entry { z: drawn.z, mass, parts: own });
        place
    }

    /// Multiplications of [`Store::attenuate`] where so many entries lie in front of a fragment
    /// and behind it: with `T`, of the mass and the sums of each that lies behind, and for what
    /// shows wrongly with the coverage in front, which is multiplied first.
    pub(super) fn attenuating(&self, drawn: &Drawn, [front, behind]: [usize; 2]) -> u32 {
        let parts = if self.parts == 1 { 1 } else { drawn.coverage.count() };
        let for_own = u32::from(front > 0);
        behind as u32 + 4 * parts * (for_own + behind as u32)
    }

    /// The entry nearest to a stored depth, the nearer one of two as near.
    pub(super) fn nearest(&self, entries: &[Entry], z: u32) -> usize {
        let distance = |i: &usize| entries[*i].z.abs_diff(z);
        (0..entries.len()).min_by_key(distance).expect("the fragment's own is one")
    }

    /// Where there is an entry too many, merges two neighbours: those of the least mass times
    /// distance. The place of the one at `own` after that.
    pub(super) fn make_room<P: Probe>(
        &self,
        entries: &mut Vec<Entry>,
        own: usize,
        probe: &mut P,
    ) -> usize {
        if entries.len() <= self.layers {
            return own;
        }
        let cost = |i: &usize| {
            let [near, far] = [&entries[*i], &entries[*i + 1]];
            let reduced = near.mass * far.mass / (near.mass + far.mass).max(1);
            (u64::from(reduced) * u64::from(far.z - near.z)) >> 16
        };
        // The least of the neighbours' costs.
        let pairs = entries.len() as u32 - 1;
        probe.compared(pairs - 1);
        // Two masses and the distance, where there is a choice; the centre of mass.
        probe.multiplied(if pairs > 1 { 2 * pairs } else { 0 } + 1);
        let least = (0..entries.len() - 1).min_by_key(cost).expect("there are two");
        let far = entries.remove(least + 1);
        let near = &mut entries[least];
        [near.z, near.mass] = centre([near.z, near.mass], [far.z, far.mass]);
        for (near, far) in near.parts.iter_mut().flatten().zip(far.parts.iter().flatten()) {
            *near = near.saturating_add(*far);
        }
        if own > least { own - 1 } else { own }
    }

    /// Adds to a sum what was written of something less its expectation, where `passed` of it
    /// met the fragment.
    pub(super) fn innovate(
        &self,
        sum: &mut i32,
        threshold: Threshold,
        [passed, written]: [i32; 2],
    ) {
        *sum = sum.saturating_add(written - self.share(threshold.value(), passed));
    }

    /// Rounds all sums to what is stored of them.
    pub(super) fn round(&self, entries: &mut [Entry], random: u32) {
        let below = self.width.below(self.samples_of_part());
        if below == 0 {
            return;
        }
        let greatest = (1 << (self.width.bits() - 1)) - 1;
        let all = entries.iter_mut().flat_map(|entry| entry.parts.iter_mut().flatten());
        // Words an even step apart: each is uniform, and together they are more even than
        // independent ones.
        let first = hash([random, ROUNDING]);
        for (i, sum) in (0..).zip(all) {
            let dither = match self.width {
                Width::Byte => first.wrapping_add(GOLDEN.wrapping_mul(i)) >> (32 - below),
                _ => 1 << (below - 1),
            };
            let stored = sum.saturating_add(dither as i32) >> below;
            *sum = stored.clamp(-greatest, greatest) << below;
        }
    }

    /// Fractions of the pixel by which what shows is more than right: red, green, blue and
    /// coverage.
    pub(super) fn of_whole_pixel(&self, entries: &[Entry]) -> [f64; 4] {
        self.fractions(entries.iter().flat_map(|entry| &entry.parts))
    }

    /// The same of the sums themselves.
    pub(super) fn fractions<'a>(&self, sums: impl Iterator<Item = &'a Sums>) -> [f64; 4] {
        let unit = f64::from(1 << POINT) * f64::from(self.samples);
        let mut all = [0_i64; 4];
        for sums in sums {
            for (all, x) in all.iter_mut().zip(sums) {
                *all += i64::from(*x);
            }
        }
        all.map(|sum| sum as f64 / unit)
    }
}

/// Keeps the words for rounding apart from others that ξ might be hashed with.
const ROUNDING: u32 = 0x0d17_4e12;

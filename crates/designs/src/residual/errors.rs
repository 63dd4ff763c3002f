//! The error that chance made in a pixel, kept at a few depths.

use arrayvec::ArrayVec;

use screendoor_rop::Layout;
use screendoor_trace::random::mix;
use screendoor_trace::trace::SampleMask;

screendoor_trace::options! {
    /// For what part of a pixel errors are kept.
    pub enum Parts {
        Pixel = "pixel": "one sum over all samples",
        Sample = "sample": "one for each: what covers a part of the pixel fades only that",
    }
}

screendoor_trace::options! {
    /// How wide errors are stored.
    pub enum Width {
        Full = "32": "32 bits, steps of 2^-20",
        Narrow = "16": "16 bits, to the nearest value: biased by what that rounds off",
        Byte = "8": "8 bits, dithered",
    }
}

/// Fractional bits of colours and errors.
pub(super) const POINT: u32 = 20;

/// Red, green, blue and coverage, in steps of 2^-20: what samples hold less what they would
/// hold on average, summed over a part of the pixel. Colours are less the background's.
pub(super) type Quad = [i32; 4];

/// The product with `T`/2^32, `T` up to 2^32, to the nearest step.
pub(super) fn share(t: u64, x: i32) -> i32 {
    ((t as i64 * i64::from(x) + (1 << 31)) >> 32) as i32
}

/// The most entries that there are for a moment: one more than are kept.
const MOST: usize = 9;

/// Where an entry lies, and how much opacity was drawn there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Head {
    pub z: u32,
    /// In steps of 2^-24; fades as the error does.
    pub weight: u32,
}

/// How errors are kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Format {
    pub parts: usize,
    samples: u32,
    bits: u32,
    dithered: bool,
}

impl Format {
    pub(super) fn new(parts: Parts, width: Width, samples: u32) -> Self {
        Format {
            parts: if parts == Parts::Sample { samples as usize } else { 1 },
            samples,
            bits: [32, 16, 8][width as usize],
            dithered: width == Width::Byte,
        }
    }

    /// What `room` entries hold.
    pub(super) fn layout(self, room: usize) -> Layout {
        let room = room as u32;
        Layout::of(room, &[(32, "error's depth"), (32, "mass")])
            .and(room * self.parts as u32, &[(3 * self.bits, "error"), (self.bits, "of coverage")])
    }

    /// Samples of a part.
    fn each(self) -> u32 {
        self.samples / self.parts as u32
    }

    /// The part that holds a sample.
    pub(super) fn part(self, sample: usize) -> usize {
        if self.parts == 1 { 0 } else { sample }
    }

    /// A fragment's threshold times the share of a part that it covers.
    fn threshold(self, part: usize, covered: SampleMask, t: u64) -> u64 {
        match self.parts {
            1 => (t * u64::from(covered.count())) >> self.samples.ilog2(),
            _ => t * u64::from(covered.contains(part)),
        }
    }

    /// The greatest distance from the background that errors are told of: a sum of all
    /// samples', and as much again, fits. What lies further is taken to lie there, which
    /// leaves noise and makes no bias: the same is taken for what is held and for what is
    /// held on average.
    pub(super) fn most(self) -> i32 {
        i32::MAX >> (self.each().ilog2() + 2)
    }

    /// A step of what is stored, as a power of two of those that are computed with. 16 bits
    /// reach errors of 4, 8 bits of 2, as means over the part.
    fn step(self) -> u32 {
        let reach = match self.bits {
            32 => return 0,
            16 => POINT + 2,
            _ => POINT + 1,
        };
        reach + self.each().ilog2() - (self.bits - 1)
    }

    /// Hashes that storing all of `count` sums takes.
    pub(super) fn hashes(self, count: usize) -> u32 {
        if self.dithered { 2 * count as u32 } else { 0 }
    }

    /// Rounds sums to what is stored of them. `word` names the fragment, for dithering.
    fn store(self, sums: &mut [Quad], word: u32) {
        let step = self.step();
        if step == 0 {
            return;
        }
        let most = i64::from((1 << (self.bits - 1)) - 1);
        for (i, quad) in sums.iter_mut().enumerate() {
            let words = [2 * i as u32, 2 * i as u32 + 1].map(|i| mix(word.wrapping_add(i)));
            for (j, value) in quad.iter_mut().enumerate() {
                let below = if self.dithered {
                    // Uniform over a step, as far as 16 bits are.
                    let random = i64::from(words[j / 2] >> (16 * (j as u32 % 2)) & 0xffff);
                    if step <= 16 { random >> (16 - step) } else { random << (step - 16) }
                } else {
                    1 << (step - 1)
                };
                let stored = (i64::from(*value) + below) >> step;
                *value = (stored.clamp(-most, most) << step) as i32;
            }
        }
    }
}

/// A fragment as errors meet it.
pub(super) struct Met {
    /// Its depth at the lowest sample that it covers.
    pub z: u32,
    /// Its threshold, of 2^32.
    pub t: u64,
    pub coverage: SampleMask,
    /// Its colour less the background's, and a coverage of 1.
    pub x: Quad,
}

/// The errors of a pixel, from near to far.
#[derive(Clone, Debug, Default)]
pub(super) struct Errors {
    pub heads: ArrayVec<Head, MOST>,
    /// Those of each part, entry by entry.
    pub sums: Vec<Quad>,
}

impl Errors {
    /// Fades what lies behind a fragment, and makes an entry of what shows wrongly of the
    /// fragment, since samples in front of it hold too much or too little; its place.
    /// Nothing here depends on chance but what is faded.
    pub(super) fn fade(&mut self, format: Format, met: &Met) -> usize {
        let Met { z, t, coverage, x } = *met;
        let parts = format.parts;
        let whole = (t * u64::from(coverage.count())) >> format.samples.ilog2();
        // Of those at its own depth it lies in front, as what is drawn later does.
        let place = self.heads.iter().take_while(|e| e.z < z).count();
        for head in &mut self.heads[place..] {
            head.weight -= ((whole * u64::from(head.weight)) >> 32) as u32;
        }
        let own = place * parts;
        let mut new = ArrayVec::<Quad, 64>::new();
        for p in 0..parts {
            let t = format.threshold(p, coverage, t);
            let before: i64 =
                self.sums[..own].iter().skip(p).step_by(parts).map(|d| i64::from(d[3])).sum();
            new.push(x.map(|x| -share(t, bounded((before * i64::from(x)) >> POINT))));
            for d in self.sums[own..].iter_mut().skip(p).step_by(parts).flatten() {
                *d -= share(t, *d);
            }
        }
        self.heads.insert(place, Head { z, weight: (whole >> 8) as u32 });
        self.sums.splice(own..own, new);
        place
    }

    /// Adds to the error of a part of entry `place`.
    pub(super) fn add(&mut self, format: Format, place: usize, part: usize, more: Quad) {
        let sum = &mut self.sums[place * format.parts + part];
        for (d, x) in sum.iter_mut().zip(more) {
            *d = d.saturating_add(x);
        }
    }

    /// The entry nearest to a depth; of two the nearer to the eye.
    pub(super) fn nearest(&self, z: u32) -> usize {
        (0..self.heads.len()).min_by_key(|i| self.heads[*i].z.abs_diff(z)).unwrap_or(0)
    }

    /// Of one entry too many, makes one of the two neighbours that weigh least times their
    /// distance; then rounds all to what is stored.
    pub(super) fn keep(&mut self, format: Format, room: usize, word: u32) {
        if self.heads.len() > room {
            let i = (0..self.heads.len() - 1).min_by_key(|i| self.cost(*i)).unwrap_or(0);
            self.merge(format, i);
        }
        format.store(&mut self.sums, word);
    }

    /// What it costs to make one of entry `i` and the next.
    fn cost(&self, i: usize) -> u64 {
        let [a, b] = [self.heads[i], self.heads[i + 1]];
        let [v, w] = [a, b].map(|e| u64::from(e.weight));
        v * w / (v + w).max(1) * (u64::from(b.z - a.z) + 1)
    }

    fn merge(&mut self, format: Format, i: usize) {
        let far = self.heads.remove(i + 1);
        let near = &mut self.heads[i];
        let [v, w] = [&*near, &far].map(|e| u64::from(e.weight));
        near.z += (u64::from(far.z - near.z) * w / (v + w).max(1)) as u32;
        near.weight = near.weight.saturating_add(far.weight);
        let parts = format.parts;
        let behind: ArrayVec<Quad, 64> =
            self.sums.drain((i + 1) * parts..(i + 2) * parts).collect();
        for (p, far) in behind.into_iter().enumerate() {
            self.add(format, i, p, far);
        }
    }

    /// All errors together, as a mean over the pixel: red, green, blue and coverage.
    pub(super) fn mean(&self, format: Format) -> [f64; 4] {
        let unit = f64::from(1 << POINT) * f64::from(format.samples);
        std::array::from_fn(|i| self.sums.iter().map(|d| f64::from(d[i])).sum::<f64>() / unit)
    }
}

/// A number that fits.
fn bounded(x: i64) -> i32 {
    x.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

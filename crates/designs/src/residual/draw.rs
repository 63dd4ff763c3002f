//! What a fragment does to a pixel, and what the pixel shows.

use screendoor_rop::{
    ColourStore, Contents, Design, Frame, Layout, PixelIndex, PixelOrder, Probe, ReferenceKey,
    SampleList, Samples, Site, Threshold, in_sample_order, resolve, sort_by_stored_depth,
};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

use super::choice::Choice;
use super::errors::{Errors, Format, Met, POINT, Quad, share};

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct ResidualAt<const N: usize> {
    pub(super) frame: Frame,
    pub(super) room: usize,
    pub(super) format: Format,
    pub(super) choice: Choice,
    pub(super) sort: bool,
    pub(super) depth_bits: u32,
    pub(super) colour: ColourStore,
}

/// A pixel.
#[derive(Clone, Debug)]
pub struct ResidualPixel<const N: usize> {
    pub(super) samples: Samples<N>,
    pub(super) errors: Errors,
}

/// A hash's last word that keeps dithering apart from the choice of samples.
const DITHER: u32 = 0x0d17_e400;

impl<const N: usize> ResidualAt<N> {
    /// A colour less the background's, and a coverage of 1.
    fn fixed(&self, colour: [f32; 3]) -> Quad {
        let one = (1 << POINT) as f32;
        let most = self.format.most();
        let channel = |i: usize| {
            // What is too large for an integer becomes the greatest there is.
            let x = ((colour[i] - self.frame.background[i]) * one).round() as i32;
            x.clamp(-most, most)
        };
        [channel(0), channel(1), channel(2), 1 << POINT]
    }

    /// The samples in the order in which they are numbered.
    fn order<P: Probe>(
        &self,
        passed: SampleMask,
        stored: &[Unorm32; N],
        probe: &mut P,
    ) -> SampleList<N> {
        let mut order = in_sample_order(passed);
        if self.sort {
            sort_by_stored_depth(&mut order, stored);
            probe.sorted(&order);
        }
        order
    }

    /// Draws a fragment that writes the samples `written` of those that `passed`.
    pub(super) fn write(
        &self,
        pixel: &mut ResidualPixel<N>,
        fragment: &Fragment,
        z: &[Unorm32; N],
        [passed, written]: [SampleMask; 2],
        word: u32,
    ) {
        let ResidualPixel { samples, errors } = pixel;
        let Some(first) = fragment.coverage.iter().next() else { return };
        let colour = self.colour.colour(fragment.colour);
        let t = Threshold::of(fragment.alpha).value();
        let x = self.fixed(colour);
        let met = Met { z: z[first].0, t, coverage: fragment.coverage, x };
        let own = errors.fade(self.format, &met);
        for s in passed.iter() {
            // What the sample holds of `x` now, less what it does on average.
            let hit = |x: i32| if written.contains(s) { x - share(t, x) } else { -share(t, x) };
            let part = self.format.part(s);
            errors.add(self.format, own, part, x.map(hit));
            let stored = samples.depth[s];
            if stored != Unorm32::FAR {
                let lost = self.fixed(samples.colour[s]).map(|y| -hit(y));
                errors.add(self.format, errors.nearest(stored.0), part, lost);
            }
        }
        errors.keep(self.format, self.room, word);
        for s in written.iter() {
            samples.write(s, z[s], colour);
        }
    }
}

impl<const N: usize> Design for ResidualAt<N> {
    type Pixel = ResidualPixel<N>;

    fn layout(&self) -> Layout {
        let sample = [(self.depth_bits, "depth"), (self.colour.colour_bits(), "colour")];
        Layout::samples(N as u32, &sample).joined(self.format.layout(self.room))
    }

    fn clear(&self, _site: Site) -> ResidualPixel<N> {
        ResidualPixel {
            samples: Samples::cleared(self.frame.background),
            errors: Errors::default(),
        }
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        site: Site,
        pixel: &mut ResidualPixel<N>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let z: [Unorm32; N] = self.frame.depths(fragment, self.depth_bits);
        let passed = pixel.samples.depth_test(fragment.coverage, &z);
        probe.depth_test(fragment.coverage, passed);
        let order = self.order(passed, &pixel.samples.depth, probe);
        let index = PixelOrder::Hilbert.index(site, self.frame.grid);
        let (seed, surface) = (self.frame.seed, fragment.primitive);
        let key = ReferenceKey { pixel: index, surface, seed };
        let written = self.choice.choose(&key, Threshold::of(fragment.alpha), &order, probe);

        // All entries are held against the fragment's depth; where there are several, against
        // those of the colours that it may replace, and the cheapest merge is found.
        let held = pixel.errors.heads.len() as u32;
        let replaced = passed.iter().filter(|s| pixel.samples.depth[*s] != Unorm32::FAR).count();
        let among = if self.room > 1 { replaced as u32 * held } else { 0 };
        let merges = if self.room > 1 && held as usize == self.room { held - 1 } else { 0 };
        probe.compared(held + among + merges);
        probe.hashed(self.format.hashes(self.format.parts * self.room.min(held as usize + 1)));

        let colour_bits = self.colour.colour_bits();
        let tested = self.depth_bits * fragment.coverage.count();
        let errors = self.format.layout(self.room).bits().total();
        probe.state(tested + colour_bits * replaced as u32 + errors, errors);

        let PixelIndex(pixel_word) = index;
        let word = hash([seed, pixel_word, surface, DITHER]);
        self.write(pixel, fragment, &z, [passed, written], word);
        probe.written(written);
        probe.state(0, (self.depth_bits + colour_bits) * written.count());
    }

    /// The samples' mean less their mean error.
    fn resolve(&self, _site: Site, pixel: &ResidualPixel<N>) -> [f64; 3] {
        let mean = resolve::box_filter(&pixel.samples.colour);
        let error = pixel.errors.mean(self.format);
        std::array::from_fn(|i| mean[i] - error[i])
    }

    fn contents(&self, pixel: &ResidualPixel<N>) -> Contents {
        let unit = f64::from(1 << POINT) * N as f64;
        let mut fields = Vec::new();
        for (i, head) in pixel.errors.heads.iter().enumerate() {
            let of_entry = &pixel.errors.sums[i * self.format.parts..][..self.format.parts];
            let sum = |c: usize| of_entry.iter().map(|d| f64::from(d[c])).sum::<f64>() / unit;
            let depth = f64::from(head.z) / f64::from(u32::MAX);
            let weight = f64::from(head.weight) / f64::from(1 << 24);
            let [r, g, b, coverage] = std::array::from_fn(sum);
            fields.push((
                "error",
                format!(
                    "z {depth:.6} weight {weight:.3}: rgb {r:+.4} {g:+.4} {b:+.4}, \
                     coverage {coverage:+.4} too much"
                ),
            ));
        }
        Contents { samples: pixel.samples.contents(), fields }
    }
}

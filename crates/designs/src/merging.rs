//! Layers with masks and depth planes; of one too many, the two neighbours become one whose
//! merging changes the picture least. Multi-layer alpha blending (Salvi, Vaidyanathan, I3D
//! 2014) merges the last two; adaptive transparency (Salvi, Montgomery, Lefohn, HPG 2011) chose
//! what to drop by cost. What that approximates, and where it is biased: `docs/MERGING.md`.
//!
//! What decides is arithmetic that any device has in the same bits: integers, and sums and
//! products of single precision that are rounded one by one.

use std::sync::Arc;

use screendoor_rop::layers::{DEPTH_BITS, Deep, LAYERS, nearer, room};
use screendoor_rop::shader;
use screendoor_rop::view_depth::fraction;
use screendoor_rop::{
    Blueprint, ColourStore, Contents, Declaration, Family, Frame, Info, Layout, NoProbe, OnDevice,
    OpaquePromise, OrderPromise, OverOpaque, PixelWords, Port, Probe, Promises, Site, Transparent,
    colour, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::random::hash;
use screendoor_trace::trace::{DepthPlane, Fragment, SampleMask, Unorm32};

screendoor_trace::options! {
    /// Where two layers that are merged come to lie.
    pub enum Place {
        Random = "random": "in either's plane, each as often as is its share of what both show",
        Heavier = "heavier": "in the plane of the one that shows more",
    }
}

const PLACE: Typed<Place> =
    Typed::choice("place", "random", "where two layers that are merged come to lie");
const SLOPES: Typed<bool> =
    Typed::flag("slopes", true, "keep the slopes of depth planes, in 16 bits each");

/// The design's entry in the registry.
pub struct Merging;

impl Blueprint for Merging {
    const INFO: Info = Info {
        name: "merging",
        family: Family::Layered,
        summary: "layers with masks; of one too many those two are merged that cost least",
        citation: "screendoor's own (docs/MERGING.md), on Salvi, Vaidyanathan 2014",
        params: &[
            over_opaque::PARAM.param,
            LAYERS.param,
            PLACE.param,
            SLOPES.param,
            colour::PARAM.param,
        ],
        combinations: &["opaque=together,layers=3", "place=heavier,slopes=false,layers=4"],
    };

    type At<const N: usize> = OverOpaque<MergingAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = MergingAt::of(values, frame);
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        let plain = Self::at::<N>(values, frame)?;
        Ok(Some(Port::of(shader!("merging"), &Self::INFO, values, frame, plain)))
    }

    fn promises(values: &Values) -> Promises {
        Promises {
            // What comes between two that are already merged cannot part them.
            order: OrderPromise::Dependent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::WholePixels),
            seeded: values.get(PLACE) == Place::Random,
            ..Promises::NONE
        }
    }
}

/// Bits of a stored slope: its sign, how far the others are shifted, and ten of them.
const SLOPE_BITS: u32 = 16;

/// A slope as that many bits hold it.
fn slope(v: i32) -> i32 {
    let shift = (32 - v.unsigned_abs().leading_zeros()).saturating_sub(10);
    let half = 1 << shift >> 1;
    let rounded = (v.unsigned_abs().saturating_add(half)) >> shift << shift;
    (rounded.min(i32::MAX as u32) as i32) * v.signum()
}

/// One divided by each count of samples, to nearest: devices divide less exactly.
const SHARES: [f32; 65] = {
    let mut list = [0.0; 65];
    let mut n = 1;
    while n < list.len() {
        list[n] = 1.0 / n as f32;
        n += 1;
    }
    list
};

/// A layer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sheet {
    plane: DepthPlane,
    /// The plane's depth at the middle of the samples that are covered: follows from the others.
    depth: Unorm32,
    coverage: SampleMask,
    colour: [f32; 3],
    alpha: f32,
}

impl Deep for Sheet {
    fn depth(&self) -> Unorm32 {
        self.depth
    }
}

/// What two layers show together, the near one first.
struct Shown {
    /// Samples that show the near one, as if alone.
    near: f32,
    /// Those that show the far one through it.
    far: f32,
    /// Samples that either covers.
    covered: usize,
    /// By how much opacity varies over these: the sum of squared differences from its mean.
    spread: f32,
}

impl Shown {
    fn of(a: &Sheet, b: &Sheet) -> Self {
        let count = |mask: SampleMask| mask.count() as f32;
        let both = count(a.coverage & b.coverage);
        let (first, second) = (count(a.coverage) - both, count(b.coverage) - both);
        let behind = (1.0 - a.alpha) * b.alpha;
        let near = a.alpha * (first + both);
        let far = b.alpha * second + behind * both;
        let covered = (a.coverage | b.coverage).count() as usize;
        let mean = (near + far) * SHARES[covered];
        let square = |x: f32| (x - mean) * (x - mean);
        let of_both = square(a.alpha + behind) * both;
        let spread = square(a.alpha) * first + square(b.alpha) * second + of_both;
        Shown { near, far, covered, spread }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct MergingAt<const N: usize> {
    positions: Arc<[[i8; 2]]>,
    seed: u32,
    store: ColourStore,
    room: usize,
    place: Place,
    slopes: bool,
    /// Bits of a layer.
    bits: u32,
    layout: Layout,
}

impl<const N: usize> MergingAt<N> {
    fn of(values: &Values, frame: &Frame) -> Self {
        let store = ColourStore::of(values, frame);
        let slopes = values.get(SLOPES);
        let layout = Layout::of(
            room(values) as u32,
            &[
                (DEPTH_BITS, "depth"),
                (if slopes { 2 * SLOPE_BITS } else { 0 }, "slopes"),
                (N as u32, "coverage"),
                (store.colour_bits(), "colour"),
                (store.channel_bits(), "alpha"),
            ],
        );
        MergingAt {
            positions: frame.positions.clone(),
            seed: frame.seed,
            store,
            room: room(values),
            place: values.get(PLACE),
            slopes,
            bits: layout.bits().extra / room(values) as u32,
            layout,
        }
    }

    /// A plane's depth at the middle of samples, in whole sixteenths of a pixel.
    fn depth(&self, plane: DepthPlane, coverage: SampleMask) -> Unorm32 {
        let count = coverage.count().max(1) as i32;
        let middle = |axis: usize| {
            let places = coverage.iter().map(|s| i32::from(self.positions[s][axis]));
            (places.sum::<i32>() / count) as i8
        };
        plane.at([middle(0), middle(1)])
    }

    /// A fragment as a layer.
    fn sheet(&self, fragment: &Fragment) -> Sheet {
        let DepthPlane { z, dzdx, dzdy } = fragment.depth;
        let mut plane = DepthPlane { z, dzdx: slope(dzdx), dzdy: slope(dzdy) };
        let depth = self.depth(plane, fragment.coverage);
        if !self.slopes {
            plane = DepthPlane { z: depth, dzdx: 0, dzdy: 0 };
        }
        Sheet {
            plane,
            depth,
            coverage: fragment.coverage,
            colour: self.store.colour(fragment.colour),
            alpha: self.store.channel(fragment.alpha),
        }
    }

    /// Two neighbours as one, of which `word` chooses the plane.
    fn merged(&self, a: &Sheet, b: &Sheet, word: u32) -> Sheet {
        let Shown { near, far, covered, .. } = Shown::of(a, b);
        let sum = near + far;
        let first = match self.place {
            Place::Random => (word >> 8) as f32 / (1 << 24) as f32 * sum < near,
            Place::Heavier => near >= far,
        };
        let plane = if first { a.plane } else { b.plane };
        let coverage = a.coverage | b.coverage;
        let mean = |i: usize| (a.colour[i] * near + b.colour[i] * far) / sum;
        let colour = if sum > 0.0 { std::array::from_fn(mean) } else { a.colour };
        Sheet {
            plane,
            depth: self.depth(plane, coverage),
            coverage,
            colour: self.store.colour(colour),
            alpha: self.store.channel((sum * SHARES[covered]).min(1.0)),
        }
    }

    /// The place of the layer that costs least to merge with the next.
    ///
    /// What is in front lets t of both through. In place of two transmittances there is one:
    /// where layers lie apart, a fragment to come may fall between them (`6·near·far·gap`),
    /// and where masks differ, the mean opacity is wrong at each sample (`covered·spread`). Both
    /// are variances, as far as the weight 6 has been fitted to pictures.
    fn cheapest<P: Probe>(&self, sheets: &[Sheet], probe: &mut P) -> usize {
        let depth = |i: usize| sheets[i].depth.0;
        let range = (depth(sheets.len() - 1) - depth(0)).max(1) as f32;
        let (mut best, mut least, mut through) = (0, f32::INFINITY, 1.0_f32);
        for (i, pair) in sheets.windows(2).enumerate() {
            let Shown { near, far, covered, spread } = Shown::of(&pair[0], &pair[1]);
            let gap = (depth(i + 1) - depth(i)) as f32;
            let apart = near * far * gap * 6.0;
            let uneven = covered as f32 * spread * range;
            let cost = (apart + uneven) * (through * through);
            if cost < least {
                (best, least) = (i, cost);
            }
            let opaque = pair[0].alpha * (pair[0].coverage.count() as f32 / N as f32);
            through *= 1.0 - opaque;
        }
        probe.compared(sheets.len() as u32 - 2);
        best
    }

    /// The layers with one more, and with two of them merged where there is no room for it.
    fn insert<P: Probe>(&self, sheets: &mut Vec<Sheet>, sheet: Sheet, word: u32, probe: &mut P) {
        let place = nearer(sheets, sheet.depth, probe);
        if sheets.len() < self.room {
            // What lies behind the new layer moves by one.
            let moved = (sheets.len() - place) as u32;
            probe.state((self.bits - DEPTH_BITS) * moved, self.bits * (moved + 1));
            sheets.insert(place, sheet);
            return;
        }
        let before = if P::LISTENS { sheets.clone() } else { Vec::new() };
        sheets.insert(place, sheet);
        let i = self.cheapest(sheets, probe);
        let merged = self.merged(&sheets[i], &sheets[i + 1], word);
        sheets.drain(i..i + 2);
        // Among depths that were compared when its parts came.
        let place = nearer(sheets, merged.depth, &mut NoProbe);
        sheets.insert(place, merged);
        // All are read for their costs; written is each place that holds something else.
        let written = before.iter().zip(&*sheets).filter(|(old, new)| old != new).count() as u32;
        probe.state((self.bits - DEPTH_BITS) * self.room as u32, self.bits * written);
    }
}

impl<const N: usize> Transparent<N> for MergingAt<N> {
    /// From near to far.
    type Pixel = Vec<Sheet>;

    fn layout(&self) -> Layout {
        self.layout.clone()
    }

    fn clear(&self, _site: Site) -> Vec<Sheet> {
        Vec::new()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        site: Site,
        sheets: &mut Vec<Sheet>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let sheet = self.sheet(fragment);
        let full = sheets.len() >= self.room;
        let mut word = 0;
        if full && self.place == Place::Random {
            probe.hashed(1);
            let pixel = u32::from(site.x) | u32::from(site.y) << 16;
            word = hash([self.seed, pixel, fragment.primitive, sheet.depth.0]);
        }
        self.insert(sheets, sheet, word, probe);
        probe.written(fragment.coverage);
    }

    fn resolve(&self, _site: Site, sheets: &Vec<Sheet>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let mut mean = [0.0; 3];
        let mut order: Vec<(Unorm32, usize)> = Vec::new();
        for (s, behind) in behind.iter().enumerate() {
            let covering = sheets.iter().enumerate().filter(|(_, l)| l.coverage.contains(s));
            order.clear();
            order.extend(covering.map(|(i, l)| (l.plane.at(self.positions[s]), i)));
            order.sort_unstable();
            let mut through = 1.0;
            let mut add = |colour: [f32; 3], share: f64| {
                for (sum, c) in mean.iter_mut().zip(colour) {
                    *sum += f64::from(c) * share;
                }
            };
            for (_, i) in &order {
                let alpha = f64::from(sheets[*i].alpha);
                add(sheets[*i].colour, through * alpha);
                through *= 1.0 - alpha;
            }
            add(*behind, through);
        }
        mean.map(|sum| sum / N as f64)
    }

    fn contents(&self, sheets: &Vec<Sheet>) -> Contents {
        let text = |l: &Sheet| {
            let colour = l.colour.map(|c| format!("{c:.3}")).join(" ");
            let z = fraction(l.depth);
            format!("z {z:.6} rgb {colour} a {:.3} in {:#x}", l.alpha, l.coverage.0)
        };
        let text = Contents::list(sheets.iter().map(text));
        Contents { samples: Vec::new(), fields: vec![("layers", text)] }
    }
}

impl<const N: usize> OnDevice<Vec<Sheet>> for MergingAt<N> {
    fn declare(&self, to: &mut Declaration) {
        let (room, samples) = (self.room as u32, N as u32);
        to.field("SHEET_COUNT", 1);
        to.field("SHEET_PLANE", 3 * room);
        to.field("SHEET_DEPTH", room);
        to.field("SHEET_MASK", room * samples.div_ceil(32));
        to.field("SHEET_COLOUR", 3 * room);
        to.field("SHEET_ALPHA", room);
        // In and out, finding a place twice, moving twice, the costs, two middles of samples.
        to.iterations(8 * (room + 2) + 2 * samples);
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> Vec<Sheet> {
        let words = |name: &str| from.field(name).collect::<Vec<u32>>();
        let [planes, depths, masks] = ["SHEET_PLANE", "SHEET_DEPTH", "SHEET_MASK"].map(words);
        let [colours, alphas] = ["SHEET_COLOUR", "SHEET_ALPHA"].map(words);
        let width = masks.len() / self.room;
        let sheet = |i: usize| {
            let mask = masks[i * width..(i + 1) * width].iter().rev();
            Sheet {
                plane: DepthPlane {
                    z: Unorm32(planes[3 * i]),
                    dzdx: planes[3 * i + 1] as i32,
                    dzdy: planes[3 * i + 2] as i32,
                },
                depth: Unorm32(depths[i]),
                coverage: SampleMask(mask.fold(0, |m, word| m << 32 | u64::from(*word))),
                colour: std::array::from_fn(|c| f32::from_bits(colours[3 * i + c])),
                alpha: f32::from_bits(alphas[i]),
            }
        };
        (0..from.word("SHEET_COUNT") as usize).map(sheet).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configure;
    use screendoor_trace::tile::TileGrid;

    const SITE: Site = Site { x: 0, y: 0 };

    fn frame(seed: u32) -> Frame {
        Frame {
            grid: TileGrid::new(1, 1),
            positions: [[-4, -4], [4, -4], [-4, 4], [4, 4]].into(),
            background: [0.0; 3],
            seed,
            colour_bits: 96,
            view: None,
            opaque: false,
            primitive_depths: None,
            columns: Default::default(),
        }
    }

    fn design(settings: &str, seed: u32) -> MergingAt<4> {
        let separator = if settings.is_empty() { "" } else { ":" };
        let design = configure(&format!("merging{separator}{settings}"), &[]).unwrap();
        MergingAt::of(design.values(), &frame(seed))
    }

    fn shown(settings: &str, seed: u32, fragments: &[Fragment]) -> [f64; 3] {
        let design = design(settings, seed);
        let mut sheets = design.clear(SITE);
        for fragment in fragments {
            design.draw(0, SITE, &mut sheets, fragment, &mut NoProbe);
        }
        design.resolve(SITE, &sheets, &[[0.0; 3]; 4])
    }

    fn fragment(z: u32, mask: u64, colour: [f32; 3], alpha: f32) -> Fragment {
        Fragment {
            coverage: SampleMask(mask),
            depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
            colour,
            alpha,
            primitive: z,
            ..Fragment::default()
        }
    }

    #[test]
    fn slopes_keep_ten_bits() {
        for v in [0, 1, -1, 1023, -1024, 1025, 12_345, -87_654_321, i32::MAX, i32::MIN] {
            let (kept, v) = (i64::from(slope(v)), i64::from(v));
            assert!((kept - v).abs() * 1024 <= v.abs().max(1), "{v}: {kept}");
            assert_eq!(i64::from(slope(kept as i32)), kept);
        }
    }

    #[test]
    fn neighbours_that_nothing_parts_are_merged_exactly() {
        // Three layers of one mask, the last two nearer to each other: room for two.
        let layers = [(10, 1.0), (20, 0.0), (21, 1.0)];
        let three = layers.map(|(z, c)| fragment(z << 20, 15, [c; 3], 0.5));
        for settings in ["layers=2", "layers=2,place=heavier", "layers=2,slopes=false"] {
            // 0.5 + 0.5·(0 + 0.5·0.5·1).
            let [shown, ..] = shown(settings, 1, &three);
            assert!((shown - 0.625).abs() < 1e-6, "{settings}: {shown}");
        }
    }

    #[test]
    fn masks_that_differ_are_kept_apart_where_there_is_room() {
        let [a, b] = [fragment(10, 3, [1.0; 3], 1.0), fragment(20, 12, [0.5; 3], 0.5)];
        assert_eq!(shown("layers=2", 1, &[a, b]), [0.5 + 0.125; 3]);
        // As one layer over both: (2 + 1)/4 of it shows, of the mean colour.
        let one = shown("layers=1", 1, &[a, b]);
        assert!((one[0] - 0.625).abs() < 1e-6, "{one:?}");
    }

    /// Near and far are merged, and then something comes between them: how much of it shows
    /// is right on average, and the far one's colour shows too much, the near one's too little,
    /// by α·near·far/(near + far).
    #[test]
    fn the_bias_is_towards_the_far_colour() {
        let near = fragment(1 << 28, 15, [1.0, 0.0, 0.0], 0.5);
        let far = fragment(3 << 28, 15, [0.0, 1.0, 0.0], 0.5);
        let between = fragment(2 << 28, 15, [0.0, 0.0, 1.0], 0.25);
        const SEEDS: u32 = 4000;
        let mut mean = [0.0; 3];
        for seed in 0..SEEDS {
            let design = design("", seed);
            let [near, far, between] = [&near, &far, &between].map(|f| design.sheet(f));
            let mut sheets = vec![design.merged(&near, &far, hash([seed]))];
            design.insert(&mut sheets, between, 0, &mut NoProbe);
            let [r, g, b] = design.resolve(SITE, &sheets, &[[0.0; 3]; 4]);
            mean = [mean[0] + r, mean[1] + g, mean[2] + b];
        }
        let [r, g, b] = mean.map(|sum| sum / f64::from(SEEDS));
        // Exactly: 0.5; 0.5·0.25 = 0.125; 0.5·0.75·0.5 = 0.1875. near·far/(near + far) = 1/6.
        let bias = 0.25 / 6.0;
        // A deviation of 0.25·0.5 at most, six of them over the root of 4000.
        let near = |found: f64, expected: f64| (found - expected).abs() < 0.012;
        assert!(near(b, 0.125), "{b}");
        assert!(near(r, 0.5 - bias) && near(g, 0.1875 + bias), "{r} {g}");
        assert!(r < 0.5 - bias / 2.0 && g > 0.1875 + bias / 2.0, "{r} {g}");
    }

    #[test]
    fn the_cheapest_are_those_that_are_hidden() {
        // Behind what is opaque nothing matters, however far apart.
        let design = design("", 0);
        let layers = [(10, 0.5), (11, 1.0), (4000, 0.5)];
        let sheets = layers.map(|(z, a)| design.sheet(&fragment(z << 20, 15, [1.0; 3], a)));
        assert_eq!(design.cheapest(&sheets, &mut NoProbe), 1);
    }
}

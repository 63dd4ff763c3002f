//! Layers with masks and depth planes; of one too many, the two neighbours become one whose
//! merging changes the picture least. Multi-layer alpha blending (Salvi, Vaidyanathan, I3D
//! 2014) merges the last two; adaptive transparency (Salvi, Montgomery, Lefohn, HPG 2011) chose
//! what to drop by cost. What that approximates, and where it is biased: `docs/MERGING.md`.
//!
//! What decides is arithmetic that any device has in the same bits: integers, and sums and
//! products of single precision that are rounded one by one.

mod lanes;
mod sheet;
#[cfg(test)]
mod tests;

use self::sheet::{Listed, Middles, SHARES, SLOPE_BITS, Sheet, Shown, slope};
use fearless_simd::Level;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::in_lanes;
use screendoor_rop::layers::{DEPTH_BITS, LAYERS, nearer, room};
use screendoor_rop::shader;
use screendoor_rop::view_depth::fraction;
use screendoor_rop::{
    Blueprint, ColourStore, Contents, Declaration, Family, Frame, Info, Layout, OnDevice,
    OpaquePromise, OrderPromise, OverOpaque, PixelWords, Port, Probe, Promises, Site, TiledDesign,
    Transparent, colour, over_opaque,
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

    const MULTIPLICATIONS: bool = true;

    type At<const N: usize> = OverOpaque<MergingAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = MergingAt::of(values, frame);
        Ok(OverOpaque::new(values, frame, over_opaque::of(values), inner))
    }

    fn fast<const N: usize>(
        values: &Values,
        frame: &Frame,
        level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        Ok(in_lanes::engine(Self::at::<N>(values, frame)?, level))
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

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct MergingAt<const N: usize> {
    rules: Rules,
}

/// The same, whatever the number of samples.
#[derive(Clone, Debug)]
struct Rules {
    samples: usize,
    middles: Middles,
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
        MergingAt { rules: Rules::of(values, frame) }
    }
}

impl Rules {
    fn of(values: &Values, frame: &Frame) -> Self {
        let samples = frame.positions.len();
        let store = ColourStore::of(values, frame);
        let slopes = values.get(SLOPES);
        let layout = Layout::of(
            room(values) as u32,
            &[
                (DEPTH_BITS, "depth"),
                (if slopes { 2 * SLOPE_BITS } else { 0 }, "slopes"),
                (samples as u32, "coverage"),
                (store.colour_bits(), "colour"),
                (store.channel_bits(), "alpha"),
            ],
        );
        Rules {
            samples,
            middles: Middles::of(frame.positions.clone()),
            seed: frame.seed,
            store,
            room: room(values),
            place: values.get(PLACE),
            slopes,
            bits: layout.bits().extra / room(values) as u32,
            layout,
        }
    }

    /// A fragment as a layer.
    fn sheet(&self, fragment: &Fragment) -> Sheet {
        let DepthPlane { z, dzdx, dzdy } = fragment.depth;
        let mut plane = DepthPlane { z, dzdx: slope(dzdx), dzdy: slope(dzdy) };
        let depth = plane.at(self.middles.of_samples(fragment.coverage));
        if !self.slopes {
            plane = DepthPlane { z: depth, dzdx: 0, dzdy: 0 };
        }
        Sheet {
            plane,
            depth,
            coverage: fragment.coverage,
            count: fragment.coverage.count(),
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
            depth: plane.at(self.middles.of_samples(coverage)),
            coverage,
            count: covered as u32,
            colour: self.store.colour(colour),
            alpha: self.store.channel((sum * SHARES[covered]).min(1.0)),
        }
    }

    /// Layers from near to far as a list.
    fn listed(&self, sheets: impl Iterator<Item = Sheet>) -> Vec<Listed> {
        let mut list: Vec<Listed> = sheets.map(|sheet| Listed::of(sheet, self.samples)).collect();
        (0..list.len()).for_each(|i| Listed::link(&mut list, i));
        list
    }

    /// Puts a layer into its place and looks at its neighbours: the place.
    fn put<P: Probe>(&self, list: &mut Vec<Listed>, sheet: Sheet, probe: &mut P) -> usize {
        let place = nearer(list, sheet.depth, probe);
        list.insert(place, Listed::of(sheet, self.samples));
        // While there is room nobody asks what merging costs.
        if list.len() > self.room {
            Listed::link(list, place);
            Listed::link_before(list, place);
        }
        place
    }

    /// Multiplications to choose one of so many pairs of neighbours and to merge it: of hardware
    /// that keeps no costs, which are no state.
    fn products(&self, pairs: u32) -> u32 {
        // What shows of the far one through the near one; with a choice, three squares of
        // opacities' differences, `near·far·gap`, and what is uneven times the range.
        let of_a_pair = if pairs > 1 { 7 } else { 1 };
        // What the layers in front let through, but for the first two; squared, and times the
        // cost.
        let through = pairs.saturating_sub(2) + 2 * (pairs - 1);
        // Three colours weighed by two weights; the odds of the random plane.
        let merging = 6 + u32::from(self.place == Place::Random);
        of_a_pair * pairs + through + merging
    }

    /// The layers with one more, and with two of them merged where there is no room for it.
    fn insert<P: Probe>(&self, list: &mut Vec<Listed>, sheet: Sheet, word: u32, probe: &mut P) {
        if list.len() < self.room {
            if list.capacity() == 0 {
                list.reserve_exact(self.room.min(8) + 1);
            }
            let place = self.put(list, sheet, probe);
            // What lies behind the new layer moves by one.
            let moved = (list.len() - 1 - place) as u32;
            probe.state((self.bits - DEPTH_BITS) * moved, self.bits * (moved + 1));
            if list.len() == self.room {
                (0..self.room).for_each(|i| Listed::link(list, i));
            }
            return;
        }
        let before = if P::LISTENS { list.clone() } else { Vec::new() };
        list.reserve_exact(1);
        self.put(list, sheet, probe);
        probe.compared(list.len() as u32 - 2);
        probe.multiplied(self.products(list.len() as u32 - 1));
        let i = Listed::cheapest(list);
        let merged = self.merged(&list[i].sheet, &list[i + 1].sheet, word);
        list.remove(i + 1);
        list[i] = Listed::of(merged, self.samples);
        Listed::settle(list, i);
        // All are read for their costs; written is each place that holds something else.
        let pairs = before.iter().zip(&*list);
        let written = pairs.filter(|(old, new)| old.sheet != new.sheet).count() as u32;
        probe.state((self.bits - DEPTH_BITS) * self.room as u32, self.bits * written);
    }
    /// The colour of a pixel, whose samples behind all layers are `behind`.
    fn resolve<'a>(
        &self,
        sheets: impl Iterator<Item = &'a Sheet> + Clone,
        behind: &[[f32; 3]],
    ) -> [f64; 3] {
        let mut mean = [0.0; 3];
        let mut order: Vec<(Unorm32, &Sheet)> = Vec::new();
        for (s, behind) in behind.iter().enumerate() {
            let position = self.middles.position(s);
            order.clear();
            for sheet in sheets.clone().filter(|sheet| sheet.coverage.contains(s)) {
                // In order already but where planes cross.
                let z = sheet.plane.at(position);
                let mut place = order.len();
                while place > 0 && order[place - 1].0 > z {
                    place -= 1;
                }
                order.insert(place, (z, sheet));
            }
            let mut through = 1.0;
            let mut add = |colour: [f32; 3], share: f64| {
                for (sum, c) in mean.iter_mut().zip(colour) {
                    *sum += f64::from(c) * share;
                }
            };
            for (_, sheet) in &order {
                let alpha = f64::from(sheet.alpha);
                add(sheet.colour, through * alpha);
                through *= 1.0 - alpha;
            }
            add(*behind, through);
        }
        mean.map(|sum| sum / self.samples as f64)
    }
}

impl<const N: usize> Transparent<N> for MergingAt<N> {
    /// From near to far.
    type Pixel = Vec<Listed>;

    fn layout(&self) -> Layout {
        self.rules.layout.clone()
    }

    fn clear(&self, _site: Site) -> Vec<Listed> {
        Vec::new()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        site: Site,
        list: &mut Vec<Listed>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let sheet = self.rules.sheet(fragment);
        let full = list.len() >= self.rules.room;
        let mut word = 0;
        if full && self.rules.place == Place::Random {
            probe.hashed(1);
            let pixel = u32::from(site.x) | u32::from(site.y) << 16;
            word = hash([self.rules.seed, pixel, fragment.primitive, sheet.depth.0]);
        }
        self.rules.insert(list, sheet, word, probe);
        probe.written(fragment.coverage);
    }

    fn resolve(&self, _site: Site, list: &Vec<Listed>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.rules.resolve(list.iter().map(|l| &l.sheet), behind)
    }

    fn visibility(&self, list: &Vec<Listed>, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let passes = |s: usize| {
            let position = self.rules.middles.position(s);
            let hides =
                |l: &&Listed| l.sheet.coverage.contains(s) && l.sheet.plane.at(position) < at[s];
            list.iter().filter(hides).map(|l| 1.0 - f64::from(l.sheet.alpha)).product()
        };
        Some(std::array::from_fn(passes))
    }

    fn contents(&self, list: &Vec<Listed>) -> Contents {
        let text = |l: &Sheet| {
            let colour = l.colour.map(|c| format!("{c:.3}")).join(" ");
            let z = fraction(l.depth);
            format!("z {z:.6} rgb {colour} a {:.3} in {:#x}", l.alpha, l.coverage.0)
        };
        let text = Contents::list(list.iter().map(|l| text(&l.sheet)));
        Contents { samples: Vec::new(), fields: vec![("layers", text)] }
    }
}

impl<const N: usize> OnDevice<Vec<Listed>> for MergingAt<N> {
    fn declare(&self, to: &mut Declaration) {
        let (room, samples) = (self.rules.room as u32, N as u32);
        to.field("SHEET_COUNT", 1);
        to.field("SHEET_PLANE", 3 * room);
        to.field("SHEET_DEPTH", room);
        to.field("SHEET_MASK", room * samples.div_ceil(32));
        to.field("SHEET_COLOUR", 3 * room);
        to.field("SHEET_ALPHA", room);
        // In and out, finding a place twice, moving twice, the costs, two middles of samples.
        to.iterations(8 * (room + 2) + 2 * samples);
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> Vec<Listed> {
        let words = |name: &str| from.field(name).collect::<Vec<u32>>();
        let [planes, depths, masks] = ["SHEET_PLANE", "SHEET_DEPTH", "SHEET_MASK"].map(words);
        let [colours, alphas] = ["SHEET_COLOUR", "SHEET_ALPHA"].map(words);
        let width = masks.len() / self.rules.room;
        let sheet = |i: usize| {
            let mask = masks[i * width..(i + 1) * width].iter().rev();
            let coverage = SampleMask(mask.fold(0, |m, word| m << 32 | u64::from(*word)));
            Sheet {
                plane: DepthPlane {
                    z: Unorm32(planes[3 * i]),
                    dzdx: planes[3 * i + 1] as i32,
                    dzdy: planes[3 * i + 2] as i32,
                },
                depth: Unorm32(depths[i]),
                coverage,
                count: coverage.count(),
                colour: std::array::from_fn(|c| f32::from_bits(colours[3 * i + c])),
                alpha: f32::from_bits(alphas[i]),
            }
        };
        let sheets = (0..from.word("SHEET_COUNT") as usize).map(sheet);
        self.rules.listed(sheets)
    }
}

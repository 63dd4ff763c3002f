//! Layers of a pixel in the order of their depths: what the designs share that keep
//! a bounded number of them.
//!
//! A layer lies at one depth, the fragment's at the pixel's centre, and covers
//! samples. Of layers at equal depths the later one lies in front, as a
//! less-or-equal depth test has it. A pixel is resolved in columns: one for each
//! sample, or a single one where coverage is but a share of alpha.

use crate::contract::colour::ColourStore;
use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::layout::Layout;
use crate::contract::words::{Declaration, OnDevice, PixelWords};
use screendoor_trace::param::{Typed, Values};
use screendoor_trace::trace::{Fragment, SampleMask, Unorm32};

/// Bits of a layer's depth.
pub const DEPTH_BITS: u32 = 32;

/// How many layers a pixel keeps.
pub const LAYERS: Typed<i64> =
    Typed::integer("layers", "8", (1, 32), "the most layers that a pixel keeps");

/// The value of [`LAYERS`].
pub fn room(values: &Values) -> usize {
    values.get(LAYERS) as usize
}

screendoor_trace::options! {
    /// How a layer keeps which samples it covers.
    pub enum Coverage {
        Mask = "mask": "a bit for each sample; layers are composited sample by sample",
        Share = "share": "no mask: alpha is scaled by the share of samples covered",
    }
}

/// How layers keep their coverage.
pub const COVERAGE: Typed<Coverage> =
    Typed::choice("coverage", "mask", "how layers keep the samples that they cover");

/// The columns in which the layers of a pixel of `N` samples are composited.
#[derive(Clone, Copy, Debug)]
pub struct Columns<const N: usize> {
    pub(super) coverage: Coverage,
    /// How layers store their colours, and one minus alpha beside them.
    pub store: ColourStore,
}

impl<const N: usize> Columns<N> {
    /// As the parameters [`COVERAGE`] and [`crate::colour::PARAM`] say.
    pub fn of(values: &Values, frame: &Frame) -> Self {
        let store = ColourStore::of(values, frame);
        Columns { coverage: values.get(COVERAGE), store }
    }

    /// How many there are.
    #[inline]
    pub fn count(self) -> usize {
        match self.coverage {
            Coverage::Mask => N,
            Coverage::Share => 1,
        }
    }

    /// Bits that a layer's coverage takes.
    pub fn mask_bits(self) -> u32 {
        match self.coverage {
            Coverage::Mask => N as u32,
            Coverage::Share => 0,
        }
    }

    /// The columns that a fragment covers, and its alpha there.
    #[inline]
    pub fn place(self, fragment: &Fragment) -> (SampleMask, f32) {
        match self.coverage {
            Coverage::Mask => (fragment.coverage, fragment.alpha),
            Coverage::Share => {
                let share = fragment.coverage.count() as f32 / N as f32;
                (SampleMask::first(1), fragment.alpha * share)
            }
        }
    }

    /// Multiplications of [`Columns::layer`]: the colour with its alpha.
    pub const LAYERED: u32 = 3;

    /// A fragment as a layer.
    #[inline]
    pub fn layer(self, fragment: &Fragment) -> Layer {
        let (coverage, alpha) = self.place(fragment);
        self.stored(Layer {
            depth: fragment.depth.z,
            coverage,
            colour: fragment.colour.map(|c| c * alpha),
            transmittance: 1.0 - alpha,
        })
    }

    /// A layer as it is stored.
    #[inline]
    pub fn stored(self, layer: Layer) -> Layer {
        Layer {
            colour: self.store.colour(layer.colour),
            transmittance: self.store.channel(layer.transmittance),
            ..layer
        }
    }

    /// How much passes at each sample those of the layers, near to far, that lie before the
    /// depth `at` there, by what `passes` them in a column. A layer lies at one depth in all of a
    /// pixel.
    pub fn passing_nearer<T: Deep>(
        self,
        layers: &[T],
        at: &[Unorm32; N],
        passes: impl Fn(&[T], usize) -> f64,
    ) -> [f64; N] {
        std::array::from_fn(|s| {
            let nearer = layers.partition_point(|l| l.depth() < at[s]);
            let column = if self.coverage == Coverage::Mask { s } else { 0 };
            passes(&layers[..nearer], column)
        })
    }

    /// What a whole layer holds.
    fn fields(self) -> [(u32, &'static str); 4] {
        [
            (DEPTH_BITS, "depth"),
            (self.mask_bits(), "coverage"),
            (self.store.colour_bits(), "colour"),
            (self.store.channel_bits(), "alpha"),
        ]
    }

    /// The mean over the columns of what `column` gives: the colour that lies before
    /// `behind`, and how much of `behind` passes it.
    pub fn over(
        self,
        behind: &[[f32; 3]; N],
        column: impl Fn(usize) -> ([f64; 3], f64),
    ) -> [f64; 3] {
        let mut mean = [0.0; 3];
        let mut add = |(colour, transmittance): ([f64; 3], f64), behind: [f64; 3]| {
            for ((sum, c), b) in mean.iter_mut().zip(colour).zip(behind) {
                *sum += c + transmittance * b;
            }
        };
        match self.coverage {
            Coverage::Mask => {
                behind.iter().enumerate().for_each(|(s, b)| add(column(s), b.map(f64::from)));
            }
            Coverage::Share => {
                let sum = |i| behind.iter().map(|b: &[f32; 3]| f64::from(b[i])).sum::<f64>();
                add(column(0), std::array::from_fn(|i| sum(i) / N as f64));
            }
        }
        mean.map(|sum| sum / self.count() as f64)
    }
}

/// What is sorted by depth.
pub trait Deep {
    /// Where it lies.
    fn depth(&self) -> Unorm32;
}

/// A layer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Layer {
    /// Where it lies.
    pub depth: Unorm32,
    /// The columns that it covers.
    pub coverage: SampleMask,
    /// Its colour, multiplied by its alpha.
    pub colour: [f32; 3],
    /// One minus its alpha.
    pub transmittance: f32,
}

impl Deep for Layer {
    #[inline]
    fn depth(&self) -> Unorm32 {
        self.depth
    }
}

impl Layer {
    /// As `explain` shows it.
    pub fn words(&self) -> String {
        let colour = self.colour.map(|c| format!("{c:.3}")).join(" ");
        let z = f64::from(self.depth.0) / f64::from(u32::MAX);
        format!("z {z:.6} rgb {colour} t {:.3} in {:#x}", self.transmittance, self.coverage.0)
    }

    /// Multiplications of [`Layer::merged`]: the colour and the transmittance of the one behind
    /// with that of the one in front. What samples they share is a fraction of numbers of samples.
    pub const MERGED: u32 = 4;

    /// This layer and one behind it as one, at this one's depth (Salvi and
    /// Vaidyanathan 2014: `rgb = s.rgb + d.rgb s.t`, `t = s.t d.t`). Where they do
    /// not cover the same columns, the mean over all that either covers.
    pub fn merged(&self, behind: &Layer) -> Layer {
        let both = (self.coverage & behind.coverage).count() as f32;
        let union = self.coverage | behind.coverage;
        // Published arithmetic, to the bit, wherever it applies.
        let (mine, shared, theirs) = if self.coverage == behind.coverage {
            (0.0, 1.0, 0.0)
        } else {
            let n = union.count() as f32;
            let [a, b] = [self, behind].map(|l| l.coverage.count() as f32 - both);
            (a / n, both / n, b / n)
        };
        let (s, d) = (self, behind);
        Layer {
            depth: s.depth,
            coverage: union,
            colour: std::array::from_fn(|i| {
                s.colour[i] * (mine + shared) + d.colour[i] * (theirs + shared * s.transmittance)
            }),
            transmittance: s.transmittance * (mine + shared * d.transmittance)
                + theirs * d.transmittance,
        }
    }
}

/// How many of a sorted list lie strictly before `depth`, which is told to be compared
/// with all of it: all depths are read.
#[inline]
pub fn nearer<T: Deep, P: Probe>(list: &[T], depth: Unorm32, probe: &mut P) -> usize {
    let held = list.len() as u32;
    probe.compared(held);
    probe.state(DEPTH_BITS * held, 0);
    // All of it, short as it is: where to stop nobody can foretell.
    list.iter().filter(|l| l.depth() < depth).count()
}

/// Puts `layer` of `bits` bits into a sorted list with room for `room`; the furthest
/// layer, if there is one too many.
pub fn insert<T: Deep, P: Probe>(
    list: &mut Vec<T>,
    room: usize,
    layer: T,
    bits: u32,
    probe: &mut P,
) -> Option<T> {
    let place = nearer(list, layer.depth(), probe);
    let held = list.len();
    // What lies behind the new layer moves by one.
    let moved = (held - place) as u32;
    let written = (room.min(held + 1) - place) as u32;
    probe.state((bits - DEPTH_BITS) * moved, bits * written);
    list.insert(place, layer);
    (list.len() > room).then(|| list.pop()).flatten()
}

/// What designs have in common that keep whole layers: how many, and how they are
/// kept.
#[derive(Clone, Copy, Debug)]
pub struct Layering<const N: usize> {
    /// The columns in which layers are composited.
    pub columns: Columns<N>,
    /// How many layers there is room for.
    pub room: usize,
    /// Bits of a layer.
    pub bits: u32,
}

impl<const N: usize> Layering<N> {
    /// As the parameters [`LAYERS`] and [`COVERAGE`] say: layers of a depth, a mask, a
    /// colour and an alpha.
    pub fn of(values: &Values, frame: &Frame) -> Self {
        let columns = Columns::of(values, frame);
        let bits = columns.fields().iter().map(|(bits, _)| bits).sum();
        Layering { columns, room: room(values), bits }
    }

    /// [`insert`], where there is room for [`Layering::room`] layers.
    pub fn insert<P: Probe>(
        &self,
        layers: &mut Vec<Layer>,
        layer: Layer,
        probe: &mut P,
    ) -> Option<Layer> {
        insert(layers, self.room, layer, self.bits, probe)
    }

    /// What all layers hold.
    pub fn layout(&self) -> Layout {
        Layout::of(self.room as u32, &self.columns.fields())
    }

    /// The layers, near to far, over what lies behind them.
    pub fn resolve(&self, layers: &[Layer], behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.columns.over(behind, |column| composite(layers, column))
    }
}

/// Declares a device's room for layers: where there is a list of `room` of them.
pub fn declare(room: usize, to: &mut Declaration) {
    let (room, words) = (room as u32, to.samples().div_ceil(32));
    to.field("LAYER_COUNT", 1);
    to.field("LAYER_DEPTH", room);
    to.field("LAYER_MASK", room * words);
    to.field("LAYER_COLOUR", 3 * room);
    to.field("LAYER_THROUGH", room);
    // Bringing them in and out, finding a place, moving what lies behind.
    to.iterations(4 * room);
}

/// The layers of a pixel that were declared so.
pub fn read(from: &PixelWords<'_>) -> Vec<Layer> {
    let masks: Vec<u32> = from.field("LAYER_MASK").collect();
    let colours: Vec<f32> = from.field("LAYER_COLOUR").map(f32::from_bits).collect();
    let mut through = from.field("LAYER_THROUGH").map(f32::from_bits);
    let mut depths = from.field("LAYER_DEPTH").map(Unorm32);
    let words = masks.len() / depths.len();
    let layer = |i: usize| {
        let mask = masks[i * words..(i + 1) * words].iter().rev();
        Some(Layer {
            depth: depths.next()?,
            coverage: SampleMask(mask.fold(0, |mask, word| mask << 32 | u64::from(*word))),
            colour: std::array::from_fn(|c| colours[3 * i + c]),
            transmittance: through.next()?,
        })
    };
    (0..from.word("LAYER_COUNT") as usize).map_while(layer).collect()
}

impl<const N: usize> OnDevice<Vec<Layer>> for Layering<N> {
    fn declare(&self, to: &mut Declaration) {
        declare(self.room, to);
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> Vec<Layer> {
        read(from)
    }
}

/// Layers as `explain` shows them.
pub fn contents<'a>(layers: impl IntoIterator<Item = &'a Layer>) -> Contents {
    let text = Contents::list(layers.into_iter().map(Layer::words));
    Contents { samples: Vec::new(), fields: vec![("layers", text)] }
}

/// What layers, near to far, show in a column, and how much passes them.
pub fn composite<'a>(
    layers: impl IntoIterator<Item = &'a Layer>,
    column: usize,
) -> ([f64; 3], f64) {
    let mut colour = [0.0; 3];
    let mut transmittance = 1.0;
    for layer in layers.into_iter().filter(|l| l.coverage.contains(column)) {
        for (c, l) in colour.iter_mut().zip(layer.colour) {
            *c += transmittance * f64::from(l);
        }
        transmittance *= f64::from(layer.transmittance);
    }
    (colour, transmittance)
}

/// How much passes layers, near to far, in each column: the second of [`composite`] for all of
/// them at once. A column that a layer does not cover is multiplied by 1, which changes no bit.
#[inline]
pub fn passing<'a, const N: usize>(layers: impl IntoIterator<Item = &'a Layer>) -> [f64; N] {
    let mut passing = [1.0; N];
    for layer in layers {
        let transmittance = f64::from(layer.transmittance);
        for (column, passes) in passing.iter_mut().enumerate() {
            *passes *= if layer.coverage.contains(column) { transmittance } else { 1.0 };
        }
    }
    passing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::event::NoProbe;

    fn layer(depth: u32, coverage: u64, colour: f32, transmittance: f32) -> Layer {
        Layer {
            depth: Unorm32(depth),
            coverage: SampleMask(coverage),
            colour: [colour; 3],
            transmittance,
        }
    }

    #[test]
    fn the_later_of_equal_depths_lies_in_front_and_the_furthest_falls_out() {
        let mut list = Vec::new();
        for (i, depth) in [5, 3, 5, 9].into_iter().enumerate() {
            let out = insert(&mut list, 3, layer(depth, 1, i as f32, 0.5), 99, &mut NoProbe);
            assert_eq!(out.map(|l| l.depth.0), (i == 3).then_some(9));
        }
        let order: Vec<f32> = list.iter().map(|l| l.colour[0]).collect();
        assert_eq!(order, [1.0, 2.0, 0.0]);
    }

    #[test]
    fn merging_is_compositing_where_masks_are_equal_and_a_mean_where_not() {
        let (s, d) = (layer(1, 0b11, 0.25, 0.5), layer(2, 0b11, 0.5, 0.25));
        assert_eq!(s.merged(&d), layer(1, 0b11, 0.5, 0.125));
        // Columns: 0 holds the first alone, 1 both, 2 the second alone.
        let d = layer(2, 0b110, 0.5, 0.25);
        let merged = s.merged(&d);
        assert_eq!((merged.depth, merged.coverage), (s.depth, SampleMask(0b111)));
        let near = |a: f32, b: f32| (a - b).abs() < 1e-6;
        assert!(near(merged.colour[0], (0.25 + 0.5 + 0.5) / 3.0), "{merged:?}");
        assert!(near(merged.transmittance, (0.5 + 0.125 + 0.25) / 3.0), "{merged:?}");
    }
}

//! A second pass over the geometry that lessens the noise of stochastic layers:
//! alpha correction and depth-based accumulation (Enderton et al. 2011, sections 3.3
//! and 3.4; Sintorn and Assarsson 2009).

use crate::contract::colour::ColourStore;
use crate::contract::layout::Layout;
use crate::contract::words::PixelWords;
use crate::layered::layers::Columns;
use screendoor_trace::trace::SampleMask;

screendoor_trace::options! {
    /// What a second pass over the fragments adds up.
    pub enum Normalise {
        None = "none": "nothing: the layers are the picture",
        Alpha = "alpha": "total alpha: colour is scaled to it, and it dims what lies behind",
        Depth = "depth": "all fragments' colours, by the visibility that the layers tell",
        Both = "both": "colours by visibility, scaled to total alpha",
    }
}

impl Normalise {
    /// Whether total alpha is needed.
    pub(crate) fn by_alpha(self) -> bool {
        matches!(self, Normalise::Alpha | Normalise::Both)
    }

    /// Whether colours are added up by visibility.
    pub fn by_depth(self) -> bool {
        matches!(self, Normalise::Depth | Normalise::Both)
    }

    /// What [`VisibilitySums`] hold over so many columns: a transmittance each, and one sum of
    /// colours, with one of alphas where these are scaled.
    pub fn layout(self, columns: u32, store: ColourStore) -> Layout {
        let [columns, colour, alpha] = self.parts(columns, store);
        Layout::of(columns, &[(store.channel_bits(), "transmittance")])
            .and(1, &[(colour, "summed colour"), (alpha, "summed alpha")])
    }

    /// The bits of that layout, which fragments ask for: a sum, and no list.
    pub fn bits(self, columns: u32, store: ColourStore) -> u32 {
        let [columns, colour, alpha] = self.parts(columns, store);
        columns * store.channel_bits() + colour + alpha
    }

    /// Columns with a transmittance, and the bits of the sums of colours and of alphas.
    fn parts(self, columns: u32, store: ColourStore) -> [u32; 3] {
        [
            if self.by_alpha() { columns } else { 0 },
            if self.by_depth() { store.colour_bits() } else { 0 },
            if self == Normalise::Both { store.channel_bits() } else { 0 },
        ]
    }
}

/// What the second pass adds up.
#[derive(Clone, Debug, Default)]
pub struct VisibilitySums {
    /// `Π(1 − α)` in each column, once there is a fragment.
    passes: Vec<f32>,
    /// `U = Σ vis(z) α c` over fragments and columns.
    colour: [f32; 3],
    /// `U₁ = Σ vis(z) α`.
    alpha: f32,
}

impl VisibilitySums {
    /// The sums as a device holds them: whether there are any, four, and the columns'.
    pub fn read(normalise: Normalise, from: &PixelWords<'_>) -> Self {
        if from.word("SUMMED") == 0 {
            return VisibilitySums::default();
        }
        let [r, g, b, alpha] = from.reals("SUM");
        let passes = from.field("PASSES").map(f32::from_bits);
        let passes = if normalise.by_alpha() { passes.collect() } else { Vec::new() };
        VisibilitySums { passes, colour: [r, g, b], alpha }
    }

    /// Adds a fragment of which the columns that it covers show `visible`, all together.
    #[expect(clippy::too_many_arguments, reason = "a fragment, and how it is summed")]
    pub fn add(
        &mut self,
        normalise: Normalise,
        store: ColourStore,
        columns: usize,
        coverage: SampleMask,
        colour: [f32; 3],
        alpha: f32,
        visible: f64,
    ) {
        if normalise.by_alpha() {
            self.passes.resize(columns, 1.0);
            for s in coverage.iter() {
                self.passes[s] = store.channel(self.passes[s] * (1.0 - alpha));
            }
        }
        let weight = visible as f32 * alpha;
        for (sum, c) in self.colour.iter_mut().zip(colour) {
            *sum = store.channel(*sum + weight * c);
        }
        self.alpha = store.channel(self.alpha + weight);
    }

    /// The pixel's colour over `behind`, where the layers by themselves show in a
    /// column what `own` says: a colour, and how much passes.
    ///
    /// As in section 3.5, total alpha dims what lies behind sample by sample, and
    /// scales the pixel's mean of the colours.
    pub fn resolve<const N: usize>(
        &self,
        normalise: Normalise,
        columns: Columns<N>,
        behind: &[[f32; 3]; N],
        own: impl Fn(usize) -> ([f64; 3], f64),
    ) -> [f64; 3] {
        if normalise == Normalise::None {
            return columns.over(behind, own);
        }
        let count = columns.count() as f64;
        let passes = |s: usize| match self.passes.get(s) {
            Some(passes) if normalise.by_alpha() => f64::from(*passes),
            None if normalise.by_alpha() => 1.0,
            _ => own(s).1,
        };
        let dimmed = columns.over(behind, |s| ([0.0; 3], passes(s)));
        let (colour, own_alpha) = if normalise.by_depth() {
            (self.colour.map(|c| f64::from(c) / count), f64::from(self.alpha) / count)
        } else {
            let black = &[[0.0; 3]; N];
            let passing = (0..columns.count()).map(|s| own(s).1).sum::<f64>() / count;
            (columns.over(black, &own), 1.0 - passing)
        };
        let scale = if !normalise.by_alpha() {
            1.0
        } else if own_alpha == 0.0 {
            // Nothing to scale: what should be there is lost.
            0.0
        } else {
            let passing = (0..columns.count()).map(passes).sum::<f64>() / count;
            (1.0 - passing) / own_alpha
        };
        std::array::from_fn(|i| colour[i] * scale + dimmed[i])
    }

    /// The sums as `explain` shows them.
    pub fn words(&self, normalise: Normalise) -> Vec<(&'static str, String)> {
        let mut words = Vec::new();
        if normalise.by_alpha() {
            let mean = self.passes.iter().sum::<f32>() / self.passes.len().max(1) as f32;
            let mean = if self.passes.is_empty() { 1.0 } else { mean };
            words.push(("total alpha", format!("{:.3}", 1.0 - mean)));
        }
        if normalise.by_depth() {
            let colour = self.colour.map(|c| format!("{c:.3}")).join(" ");
            words.push(("sum", format!("rgb {colour} alpha {:.3}", self.alpha)));
        }
        words
    }
}

//! A bounded list of layers, from near to far: the design of all who differ in what becomes
//! of the layer that does not fit.

use std::fmt::Debug;
use std::marker::PhantomData;

use fearless_simd::{Simd, mask32x16};
use screendoor_trace::param::Values;
use screendoor_trace::trace::{Fragment, Unorm32};

use crate::contract::contents::Contents;
use crate::contract::event::Probe;
use crate::contract::frame::{Frame, Site};
use crate::contract::layout::Layout;
use crate::contract::over_opaque::{self, OverOpaque, Transparent};
use crate::contract::words::{Declaration, OnDevice, PixelWords};
use crate::in_lanes::Told;
use crate::layered::in_lanes::{BoundedInLanes, EvictedLanes};
use crate::layered::layers::{Columns, Layer, Layering, composite, contents};

/// What becomes of the furthest of one layer too many.
pub trait Eviction: Clone + Copy + Debug + Send + Sync + 'static {
    /// `evicted` was taken from behind `layers` when `new` came, which it may be itself.
    /// Tells whether the fragment of `new` left anything.
    fn evict<P: Probe, const N: usize>(
        layering: &Layering<N>,
        layers: &mut [Layer],
        new: &Layer,
        evicted: Layer,
        probe: &mut P,
    ) -> bool;

    /// The same of sixteen pixels.
    fn evict_lanes<S: Simd, P: Probe>(
        design: &BoundedInLanes<Self>,
        simd: S,
        lanes: EvictedLanes<'_, S>,
        told: &mut Told<S, P>,
    ) -> mask32x16<S>;
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct Bounded<E, const N: usize> {
    pub(super) layering: Layering<N>,
    eviction: PhantomData<E>,
}

impl<E: Eviction, const N: usize> Bounded<E, N> {
    /// As the parameters of [`Layering::of`] and [`over_opaque::PARAM`] say.
    pub fn over_opaque(values: &Values, frame: &Frame) -> OverOpaque<Self, N> {
        let inner = Bounded { layering: Layering::of(values, frame), eviction: PhantomData };
        OverOpaque::new(values, frame, over_opaque::of(values), inner)
    }
}

impl<E: Eviction, const N: usize> Transparent<N> for Bounded<E, N> {
    /// The layers from near to far.
    type Pixel = Vec<Layer>;

    fn layout(&self) -> Layout {
        self.layering.layout()
    }

    fn clear(&self, _site: Site) -> Vec<Layer> {
        Vec::new()
    }

    fn draw<P: Probe>(
        &self,
        _pass: u32,
        _site: Site,
        layers: &mut Vec<Layer>,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let layer = self.layering.columns.layer(fragment);
        probe.multiplied(Columns::<N>::LAYERED);
        let written = match self.layering.insert(layers, layer, probe) {
            Some(evicted) => E::evict(&self.layering, layers, &layer, evicted, probe),
            None => true,
        };
        if written {
            probe.written(fragment.coverage);
        }
    }

    fn resolve(&self, _site: Site, layers: &Vec<Layer>, behind: &[[f32; 3]; N]) -> [f64; 3] {
        self.layering.resolve(layers, behind)
    }

    fn contents(&self, layers: &Vec<Layer>) -> Contents {
        contents(layers)
    }

    fn visibility(&self, layers: &Vec<Layer>, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let passes = |nearer: &[Layer], column: usize| composite(nearer, column).1;
        Some(self.layering.columns.passing_nearer(layers, at, passes))
    }
}

impl<E: Eviction, const N: usize> OnDevice<Vec<Layer>> for Bounded<E, N> {
    fn declare(&self, to: &mut Declaration) {
        self.layering.declare(to);
    }

    fn read(&self, site: Site, from: &PixelWords<'_>) -> Vec<Layer> {
        self.layering.read(site, from)
    }
}

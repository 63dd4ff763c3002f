//! Adaptive transparency (Salvi, Montgomery, Lefohn, HPG 2011): a first pass builds
//! each pixel's visibility over depth as a staircase of few nodes, removing the
//! node whose removal changes the area under it least; a second pass adds up
//! `Σ α c vis(z)` in whatever order fragments come.
//!
//! As in the authors' public shader: a removed node's step is taken by the node
//! before it, so that visibility is underestimated in between and total
//! transmittance is kept; the first and the last node are never removed; what lies
//! at equal depths does not hide each other.
//!
//! Where nodes cover different samples, the area is that under the pixel's mean
//! visibility, and a removed node's samples are joined to those of the node before
//! it, over which their transmittance is averaged.

mod lanes;

use fearless_simd::Level;
use screendoor_rop::fast::{Count, Width};
use screendoor_rop::in_lanes;
use screendoor_rop::layers::{
    COVERAGE, Columns, DEPTH_BITS, LAYERS, Layer, composite, contents, insert, nearer, room,
};
use screendoor_rop::{
    Blueprint, Contents, Family, Frame, Info, Layout, OpaquePromise, OrderPromise, OverOpaque,
    Probe, Promises, Site, TiledDesign, Transparent, colour, over_opaque,
};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::{Fragment, Unorm32};

/// The design's entry in the registry.
pub struct Adaptive;

impl Blueprint for Adaptive {
    const INFO: Info = Info {
        name: "adaptive",
        family: Family::Layered,
        summary: "visibility over depth in few nodes, then a sum of all fragments by it",
        citation: "Salvi, Montgomery, Lefohn: Adaptive Transparency, HPG 2011",
        params: &[over_opaque::PARAM.param, LAYERS.param, COVERAGE.param, colour::PARAM.param],
        combinations: &[],
    };

    type At<const N: usize> = OverOpaque<AdaptiveAt<N>, N>;

    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>> {
        let inner = AdaptiveAt { columns: Columns::of(values, frame), nodes: room(values) };
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

    fn promises(values: &Values) -> Promises {
        Promises {
            // Which nodes are removed depends on what has come so far.
            order: OrderPromise::Dependent,
            exact_opaque: over_opaque::exactness(values, OpaquePromise::Never),
            seeded: false,
            ..Promises::NONE
        }
    }
}

/// The design for pixels of `N` samples.
#[derive(Clone, Debug)]
pub struct AdaptiveAt<const N: usize> {
    columns: Columns<N>,
    nodes: usize,
}

/// A pixel.
#[derive(Clone, Debug, Default)]
pub struct AdaptivePixel {
    /// The nodes from near to far: layers without colour.
    nodes: Vec<Layer>,
    /// `Σ α c vis(z)` over fragments and the columns that they cover.
    colour: [f32; 3],
}

impl<const N: usize> AdaptiveAt<N> {
    /// What a node holds. Its transmittance stands beside no colour, and is of single
    /// precision whatever colours are.
    fn node(&self) -> [(u32, &'static str); 3] {
        [(DEPTH_BITS, "depth"), (self.columns.mask_bits(), "coverage"), (32, "transmittance")]
    }

    fn node_bits(&self) -> u32 {
        self.node().iter().map(|(bits, _)| bits).sum()
    }

    /// Removes the node whose removal changes the area least. Areas are compared as
    /// integers.
    fn remove_least<P: Probe>(&self, nodes: &mut Vec<Layer>, probe: &mut P) {
        // All but the first and the last; of two nodes, the second.
        let end = (nodes.len() - 1).max(2);
        let mut passes = [1.0_f32; N];
        let mut visibility = |node: &Layer| {
            node.coverage.iter().for_each(|s| passes[s] *= node.transmittance);
            let columns = &passes[..self.columns.count()];
            let mean = columns.iter().sum::<f32>() / columns.len() as f32;
            (f64::from(mean) * 4_294_967_296.0) as u64
        };
        let mut before = visibility(&nodes[0]);
        let mut least = (u128::MAX, 1);
        // The least of the areas of all nodes from the second to before the end.
        probe.compared(end as u32 - 2);
        for i in 1..end {
            let after = visibility(&nodes[i]);
            let step = u128::from(before.saturating_sub(after));
            let area = u128::from(nodes[i].depth.0 - nodes[i - 1].depth.0) * step;
            if area < least.0 {
                least = (area, i);
            }
            before = after;
        }
        let removed = nodes.remove(least.1);
        nodes[least.1 - 1] = nodes[least.1 - 1].merged(&removed);
    }
}

impl<const N: usize> Transparent<N> for AdaptiveAt<N> {
    type Pixel = AdaptivePixel;

    fn passes(&self) -> u32 {
        2
    }

    fn layout(&self) -> Layout {
        // The sum of the pixel's columns.
        let sum = [(self.columns.store.colour_bits(), "colour")];
        Layout::of(self.nodes as u32, &self.node()).and(1, &sum)
    }

    fn clear(&self, _site: Site) -> AdaptivePixel {
        AdaptivePixel::default()
    }

    fn draw<P: Probe>(
        &self,
        pass: u32,
        _site: Site,
        pixel: &mut AdaptivePixel,
        fragment: &Fragment,
        probe: &mut P,
    ) {
        let (coverage, alpha) = self.columns.place(fragment);
        probe.written(fragment.coverage);
        if pass == 0 {
            let node = Layer {
                depth: fragment.depth.z,
                coverage,
                colour: [0.0; 3],
                transmittance: 1.0 - alpha,
            };
            insert(&mut pixel.nodes, self.nodes + 1, node, self.node_bits(), probe);
            if pixel.nodes.len() > self.nodes {
                self.remove_least(&mut pixel.nodes, probe);
                // All are read; those from the removed one on move back.
                let bits = self.node_bits() * self.nodes as u32;
                probe.state(bits, bits);
            }
            return;
        }
        let nearer = &pixel.nodes[..nearer(&pixel.nodes, fragment.depth.z, probe)];
        let visible: f64 = coverage.iter().map(|s| composite(nearer, s).1).sum();
        let store = self.columns.store;
        for (sum, c) in pixel.colour.iter_mut().zip(fragment.colour) {
            *sum = store.channel(*sum + c * alpha * visible as f32);
        }
        let unread = self.node_bits() - DEPTH_BITS;
        let read = unread * pixel.nodes.len() as u32 + store.colour_bits();
        probe.state(read, store.colour_bits());
    }

    fn resolve(&self, _site: Site, pixel: &AdaptivePixel, behind: &[[f32; 3]; N]) -> [f64; 3] {
        let count = self.columns.count() as f64;
        let behind = self.columns.over(behind, |column| composite(&pixel.nodes, column));
        std::array::from_fn(|i| f64::from(pixel.colour[i]) / count + behind[i])
    }

    fn visibility(&self, pixel: &AdaptivePixel, at: &[Unorm32; N]) -> Option<[f64; N]> {
        let passes = |nearer: &[Layer], column: usize| composite(nearer, column).1;
        Some(self.columns.passing_nearer(&pixel.nodes, at, passes))
    }

    fn contents(&self, pixel: &AdaptivePixel) -> Contents {
        let mut contents = contents(&pixel.nodes);
        contents.fields[0].0 = "nodes";
        let colour = pixel.colour.map(|c| format!("{c:.3}")).join(" ");
        contents.fields.push(("sum", colour));
        contents
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configure;
    use screendoor_rop::NoProbe;
    use screendoor_trace::tile::TileGrid;
    use screendoor_trace::trace::{SampleMask, Unorm32};

    #[test]
    fn the_least_area_goes_and_the_node_before_takes_its_step() {
        let design = configure("adaptive", &[]).unwrap();
        let frame = Frame {
            grid: TileGrid::new(1, 1),
            positions: [[0, 0]].into(),
            background: [0.0; 3],
            space: Default::default(),
            seed: 0,
            colour_bits: 96,
            view: None,
            opaque: true,
            primitive_depths: None,
            columns: Default::default(),
        };
        let design = AdaptiveAt::<1> { columns: Columns::of(design.values(), &frame), nodes: 3 };
        let node = |depth, transmittance| Layer {
            depth: Unorm32(depth),
            coverage: SampleMask(1),
            colour: [0.0; 3],
            transmittance,
        };
        // Steps from visibility 0.5 on: 0.25 over 100, 0.125 over 100; the last stays.
        let mut nodes = vec![node(0, 0.5), node(100, 0.5), node(200, 0.5), node(201, 0.9)];
        design.remove_least(&mut nodes, &mut NoProbe);
        assert_eq!(nodes, [node(0, 0.5), node(100, 0.25), node(201, 0.9)]);
        // 0.25 over 10 is less than 0.125 over 90.
        let mut nodes = vec![node(0, 0.5), node(10, 0.5), node(100, 0.5), node(201, 0.9)];
        design.remove_least(&mut nodes, &mut NoProbe);
        assert_eq!(nodes, [node(0, 0.25), node(100, 0.5), node(201, 0.9)]);
        let mut nodes = vec![node(0, 0.5), node(10, 0.5)];
        design.remove_least(&mut nodes, &mut NoProbe);
        assert_eq!(nodes, [node(0, 0.25)]);
    }
}

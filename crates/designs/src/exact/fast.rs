//! The exact answer faster: a pixel's layers are sorted once instead of at every
//! sample, and composited at eight samples at once. Samples at which that order
//! proves wrong are sorted on their own.

use fearless_simd::{Level, Simd, dispatch};

use crate::exact::lanes::{Composite, Depths, LANES, Offsets, Row, covers, depth_at, row};
use crate::exact::order::{CHUNK, insert_in_order, keep, rank, shorten};
use crate::exact::tell;
use screendoor_rop::{
    Contents, Frame, Layout as StateLayout, Listener, Probe, TileState, TiledDesign,
};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, SampleMask};

/// The engine. It is compiled once for all sample counts: it works in blocks of
/// eight samples.
pub(super) struct Fast {
    frame: Frame,
    /// Is asked for what the engine says of the design.
    reference: Box<dyn TiledDesign>,
    level: Level,
}

/// The colours of a tile's pixels.
type Pixels = [[f64; 3]; TILE_PIXELS];

/// What is kept of a fragment; a tile keeps all its pixels' in one list.
#[derive(Clone, Copy)]
struct Layer {
    coverage: SampleMask,
    depth: DepthPlane,
    colour: [f32; 3],
    alpha: f32,
    within: u8,
}

impl Fast {
    /// The engine beside `reference`, on the instructions of `level`.
    pub(super) fn new(frame: &Frame, reference: Box<dyn TiledDesign>, level: Level) -> Self {
        Fast { frame: frame.clone(), reference, level }
    }
}

impl TiledDesign for Fast {
    fn passes(&self) -> u32 {
        self.reference.passes()
    }

    fn layout(&self) -> StateLayout {
        self.reference.layout()
    }

    fn bytes_per_fragment(&self) -> Option<usize> {
        // A growing list can be half empty; while a tile is resolved there are two
        // lists of keys.
        Some(2 * size_of::<Layer>() + 2 * size_of::<u64>())
    }

    fn clear(&self, _grid: TileGrid, _tile: TileId) -> TileState {
        Box::new(Vec::<Layer>::with_capacity(TILE_PIXELS))
    }

    fn draw(&self, _pass: u32, state: &mut TileState, fragments: &Block, listener: Listener<'_>) {
        match listener {
            Listener::Nobody => {}
            Listener::Counts(counts) => tell_all(&self.frame, fragments, counts),
            Listener::Record(record) => tell_all(&self.frame, fragments, record),
        }
        let layers = state.downcast_mut::<Vec<Layer>>().expect("the state is the engine's own");
        layers.extend(fragments.iter().map(|f| Layer {
            coverage: f.coverage,
            depth: f.depth,
            colour: f.colour,
            alpha: f.alpha,
            within: TileGrid::within(f.x, f.y) as u8,
        }));
    }

    fn end_pass(&self, _: u32, _: TileGrid, _: TileId, _: &mut TileState, _: Listener<'_>) {}

    fn resolve(&self, _grid: TileGrid, _tile: TileId, state: &TileState) -> Box<Pixels> {
        let layers = state.downcast_ref::<Vec<Layer>>().expect("the state is the engine's own");
        dispatch!(self.level, simd => resolve(simd, &self.frame, layers))
    }

    fn contents(&self, state: &TileState, within: usize) -> Contents {
        let layers = state.downcast_ref::<Vec<Layer>>().expect("the state is the engine's own");
        let count = layers.iter().filter(|l| usize::from(l.within) == within).count();
        Contents { samples: Vec::new(), fields: vec![("fragments", count.to_string())] }
    }
}

fn tell_all<P: Probe>(frame: &Frame, fragments: &Block, probe: &mut P) {
    for fragment in fragments.iter() {
        probe.fragment(fragment.coverage);
        tell(frame, &fragment, probe);
    }
}

#[inline(always)]
fn resolve<S: Simd>(simd: S, frame: &Frame, layers: &[Layer]) -> Box<Pixels> {
    let mut result = Box::new([[0.0; 3]; TILE_PIXELS]);
    let background = frame.background.map(f64::from);
    let mut keys = vec![0; layers.len()];
    let mut scratch = Scratch {
        rows: [[0.0; LANES]; CHUNK],
        depths: [[0.0; LANES]; CHUNK],
        short: [0; CHUNK],
        sorted: [0; CHUNK],
        order: Vec::new(),
    };
    // Most pixels of a tile at an object's edge hold no layers: what such a pixel sums
    // up is found once.
    let mut bare = [true; TILE_PIXELS];
    let mut bare_sum = [0.0; 3];
    for (block, positions) in frame.positions.chunks(LANES).enumerate() {
        let offsets = Offsets::new(positions);
        let block = Octet { layers, first: block * LANES, positions, offsets, background };
        let ends = block.keys_by_pixel(&mut keys);
        let (empty, _) = Composite::new(simd, &block.offsets).over(background);
        add_samples(&mut bare_sum, &empty, positions.len());
        let mut start = 0;
        for ((out, bare), end) in result.iter_mut().zip(&mut bare).zip(ends) {
            let keys = &mut keys[start..end as usize];
            start = end as usize;
            *bare &= keys.is_empty();
            if *bare {
                *out = bare_sum;
            } else if keys.is_empty() {
                add_samples(out, &empty, positions.len());
            } else {
                add_samples(out, &block.colours(simd, keys, &mut scratch), positions.len());
            }
        }
    }
    for pixel in result.iter_mut() {
        *pixel = pixel.map(|sum| sum / frame.positions.len() as f64);
    }
    result
}

/// Adds the first `count` samples' colours in the order in which the plain text adds
/// them.
#[inline(always)]
fn add_samples(sum: &mut [f64; 3], colours: &[[f64; LANES]; 3], count: usize) {
    for (sum, colours) in sum.iter_mut().zip(colours) {
        colours[..count].iter().for_each(|c| *sum += c);
    }
}

/// Room that all pixels use in turn.
struct Scratch {
    rows: [Row; CHUNK],
    depths: [Depths; CHUNK],
    short: [i32; CHUNK],
    sorted: [u64; CHUNK],
    order: Vec<u64>,
}

/// Up to eight samples of a tile's pixels.
struct Octet<'a> {
    layers: &'a [Layer],
    /// The number of its first sample.
    first: usize,
    positions: &'a [[i8; 2]],
    offsets: Offsets,
    background: [f64; 3],
}

impl Octet<'_> {
    #[inline(always)]
    fn covered(&self, layer: &Layer) -> u8 {
        (layer.coverage.0 >> self.first) as u8
    }

    #[inline(always)]
    fn layer(&self, key: u64) -> &Layer {
        &self.layers[!(key as u32) as usize]
    }

    /// A layer's key at a lane's sample: near layers have small ones, and of equal
    /// depths later layers.
    #[inline(always)]
    fn key(&self, i: u32, lane: usize) -> u64 {
        let depth = self.layers[i as usize].depth.at(self.positions[lane]);
        u64::from(depth.0) << 32 | u64::from(!i)
    }

    /// Writes the keys of the layers that cover any of the samples into `keys`,
    /// pixel after pixel; returns where each pixel's end. The key is that at the
    /// first covered sample: depths at the pixel's centre, where small triangles
    /// are not, order them wrongly twice as often.
    #[inline(always)]
    fn keys_by_pixel(&self, keys: &mut [u64]) -> [u32; TILE_PIXELS] {
        let mut cursors = [0_u32; TILE_PIXELS];
        for layer in self.layers {
            cursors[usize::from(layer.within)] += u32::from(self.covered(layer) != 0);
        }
        let mut sum = 0;
        for cursor in &mut cursors {
            sum += std::mem::replace(cursor, sum);
        }
        for (i, layer) in self.layers.iter().enumerate() {
            let covered = self.covered(layer);
            if covered != 0 {
                let cursor = &mut cursors[usize::from(layer.within)];
                keys[*cursor as usize] = self.key(i as u32, covered.trailing_zeros() as usize);
                *cursor += 1;
            }
        }
        cursors
    }

    /// The samples' colours in a pixel, from its layers' keys in API order.
    #[inline(always)]
    fn colours<S: Simd>(
        &self,
        simd: S,
        keys: &mut [u64],
        Scratch { rows, depths, short, sorted, order }: &mut Scratch,
    ) -> [[f64; LANES]; 3] {
        let mut composite = Composite::new(simd, &self.offsets);
        let count = keys.len();
        if count <= CHUNK {
            let short = shorten(keys, short);
            for (key, short_key) in keys.iter().zip(short) {
                let rank = rank(simd, *short_key, short) % CHUNK;
                sorted[rank] = *key;
                rows[rank] = self.row(*key);
            }
            composite.add(&rows[..count], depths);
        } else {
            keys.sort_unstable();
            for keys in keys.chunks(CHUNK) {
                for (row, key) in rows.iter_mut().zip(keys) {
                    *row = self.row(*key);
                }
                composite.add(&rows[..keys.len()], depths);
            }
        }
        let (mut colours, broken) = composite.over(self.background);
        for lane in SampleMask(broken).iter() {
            order.clear();
            order.resize(count, 0);
            if count <= CHUNK {
                let layers = rows[..count].iter().zip(depths.iter().zip(sorted.iter()));
                let keys = layers.map(|(row, (depths, key))| {
                    let depth = depth_at(depths, lane);
                    (u64::from(depth) << 32 | key & u64::from(u32::MAX), covers(row, lane))
                });
                keep(keys, order);
                insert_in_order(order);
            } else {
                let covered = |key| self.covered(self.layer(key)) >> lane & 1 == 1;
                keep(keys.iter().map(|k| (self.key(!(*k as u32), lane), covered(*k))), order);
                order.sort_unstable();
            }
            for (all, c) in colours.iter_mut().zip(self.sample(order)) {
                all[lane] = c;
            }
        }
        colours
    }

    #[inline(always)]
    fn row(&self, key: u64) -> Row {
        let layer = self.layer(key);
        row(self.covered(layer), layer.depth, layer.colour, layer.alpha)
    }

    /// A sample's colour as the plain text finds it, from its layers' keys in order.
    #[inline(never)]
    fn sample(&self, order: &[u64]) -> [f64; 3] {
        let mut colour = [0.0; 3];
        let mut transmittance = 1.0;
        for key in order {
            let layer = self.layer(*key);
            let alpha = f64::from(layer.alpha);
            for (c, l) in colour.iter_mut().zip(layer.colour) {
                *c += transmittance * alpha * f64::from(l);
            }
            transmittance *= 1.0 - alpha;
        }
        std::array::from_fn(|i| colour[i] + transmittance * self.background[i])
    }
}

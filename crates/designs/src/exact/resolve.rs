//! A tile's pixels from all their layers, eight samples at a time.

use fearless_simd::Simd;

use crate::exact::lanes::{Composite, LANES, Offsets, Waiting};
use crate::exact::layer::Layer;
use crate::exact::order::{CHUNK, keep, rank_all, sort_nearly_sorted};
use screendoor_rop::Frame;
use screendoor_trace::picture::TilePixels;
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::SampleMask;

/// What is the same for all tiles of a frame.
pub(super) struct Octets {
    octets: Vec<Octet>,
    samples: usize,
    background: [f64; 3],
}

/// Up to eight samples.
struct Octet {
    /// The number of its first sample.
    first: usize,
    positions: Vec<[i8; 2]>,
    offsets: Offsets,
    /// The middle of each set of them: layers are sorted by depths at the middle of what they
    /// cover. Depths at the pixel's centre, where small triangles are not, order them wrongly
    /// twice as often.
    middles: [[i32; 2]; 1 << LANES],
}

/// Room that all pixels and tiles use in turn.
#[derive(Default)]
pub(super) struct Room {
    keys: Vec<u64>,
    order: Vec<u32>,
    sample: Vec<u64>,
}

impl Octets {
    pub(super) fn of(frame: &Frame) -> Self {
        let octet = |(block, positions): (usize, &[[i8; 2]])| Octet {
            first: block * LANES,
            positions: positions.to_vec(),
            offsets: Offsets::new(positions),
            middles: middles(positions),
        };
        Octets {
            octets: frame.positions.chunks(LANES).enumerate().map(octet).collect(),
            samples: frame.positions.len(),
            background: frame.background.map(f64::from),
        }
    }

    /// A tile's colours.
    #[inline(always)]
    pub(super) fn resolve<S: Simd>(
        &self,
        simd: S,
        layers: &[Layer],
        room: &mut Room,
    ) -> TilePixels {
        let mut result = Box::new([[0.0; 3]; TILE_PIXELS]);
        // Most pixels of a tile at an object's edge hold no layers: what such a pixel sums
        // up is found once.
        let mut bare = [true; TILE_PIXELS];
        let mut bare_sum = [0.0; 3];
        for octet in &self.octets {
            let samples = octet.positions.len();
            let ends = octet.keys_by_pixel(layers, &mut room.keys);
            let (empty, _) = Composite::new(simd, &octet.offsets).over(self.background);
            add_samples(&mut bare_sum, &empty, samples);
            for within in by_length(&ends) {
                let within = usize::from(within);
                let start = if within == 0 { 0 } else { ends[within - 1] };
                let own = &mut room.keys[start as usize..ends[within] as usize];
                let (out, bare) = (&mut result[within], &mut bare[within]);
                *bare &= own.is_empty();
                if *bare {
                    *out = bare_sum;
                } else if own.is_empty() {
                    add_samples(out, &empty, samples);
                } else {
                    let pixel = Pixel { octet, layers, background: self.background };
                    let colours = pixel.colours(simd, own, &mut room.order, &mut room.sample);
                    add_samples(out, &colours, samples);
                }
            }
        }
        for pixel in result.iter_mut() {
            *pixel = pixel.map(|sum| sum / self.samples as f64);
        }
        result
    }
}

/// Pixels with short lists first, so that the processor can guess where a loop over a list ends.
#[inline(always)]
fn by_length(ends: &[u32; TILE_PIXELS]) -> [u8; TILE_PIXELS] {
    let mut lengths = [0_u8; TILE_PIXELS];
    let mut start = 0;
    for (length, end) in lengths.iter_mut().zip(ends) {
        *length = (end - start).min(255) as u8;
        start = *end;
    }
    let mut cursors = [0_u32; 256];
    lengths.iter().for_each(|length| cursors[usize::from(*length)] += 1);
    starts(&mut cursors);
    let mut sorted = [0; TILE_PIXELS];
    for (within, length) in lengths.iter().enumerate() {
        let cursor = &mut cursors[usize::from(*length)];
        sorted[*cursor as usize % TILE_PIXELS] = within as u8;
        *cursor += 1;
    }
    sorted
}

/// Where each part begins, of parts of these sizes; returns where the last one ends.
#[inline(always)]
fn starts(sizes: &mut [u32; 256]) -> u32 {
    let mut sum = 0;
    for size in sizes {
        sum += std::mem::replace(size, sum);
    }
    sum
}

fn middles(positions: &[[i8; 2]]) -> [[i32; 2]; 1 << LANES] {
    std::array::from_fn(|set| {
        let of_set = || SampleMask(set as u64).iter().filter_map(|s| positions.get(s));
        let count = of_set().count().max(1) as i32;
        [0, 1].map(|axis| of_set().map(|p| i32::from(p[axis])).sum::<i32>().div_euclid(count))
    })
}

/// Adds the first `count` samples' colours in the order in which the plain text adds
/// them.
#[inline(always)]
fn add_samples(sum: &mut [f64; 3], colours: &[[f64; LANES]; 3], count: usize) {
    for (sum, colours) in sum.iter_mut().zip(colours) {
        colours[..count].iter().for_each(|c| *sum += c);
    }
}

/// Near layers have small keys, and of equal depths later layers.
fn key(depth: u32, layer: u32) -> u64 {
    u64::from(depth) << 32 | u64::from(!layer)
}

/// The number of a key's layer.
fn numbered(key: u64) -> u32 {
    !(key as u32)
}

impl Octet {
    /// Writes the keys of the layers that cover any of the samples into `keys`,
    /// pixel after pixel; returns where each pixel's end.
    #[inline(always)]
    fn keys_by_pixel(&self, layers: &[Layer], keys: &mut Vec<u64>) -> [u32; TILE_PIXELS] {
        let mut cursors = [0_u32; TILE_PIXELS];
        for layer in layers {
            cursors[usize::from(layer.within)] += u32::from(layer.covered(self.first) != 0);
        }
        keys.resize(starts(&mut cursors) as usize, 0);
        for (i, layer) in layers.iter().enumerate() {
            let covered = layer.covered(self.first);
            if covered != 0 {
                let cursor = &mut cursors[usize::from(layer.within)];
                let depth = layer.about(self.middles[usize::from(covered)]);
                keys[*cursor as usize] = key(depth, i as u32);
                *cursor += 1;
            }
        }
        cursors
    }
}

/// Up to eight samples of a pixel.
struct Pixel<'a> {
    octet: &'a Octet,
    /// The tile's.
    layers: &'a [Layer],
    background: [f64; 3],
}

impl Pixel<'_> {
    #[inline(always)]
    fn layer(&self, number: u32) -> &Layer {
        &self.layers[number as usize]
    }

    /// The samples' colours, from the keys of the pixel's layers in API order.
    #[inline(always)]
    fn colours<S: Simd>(
        &self,
        simd: S,
        keys: &mut [u64],
        order: &mut Vec<u32>,
        sample: &mut Vec<u64>,
    ) -> [[f64; LANES]; 3] {
        order.resize(order.len().max(keys.len()).max(CHUNK), 0);
        if keys.len() <= CHUNK {
            let order = &mut order[..CHUNK];
            rank_all(simd, keys, |i, rank| order[rank] = numbered(keys[i]));
        } else {
            keys.sort_unstable();
            order.iter_mut().zip(&*keys).for_each(|(to, key)| *to = numbered(*key));
        }
        let order = &order[..keys.len()];
        let mut composite = Composite::new(simd, &self.octet.offsets);
        for number in order {
            let layer = self.layer(*number);
            composite.add(layer, layer.covered(self.octet.first));
        }
        let (colours, broken) = composite.over(self.background);
        if broken == 0 {
            return colours;
        }
        let mut waiting = Waiting::new(simd, &self.octet.offsets);
        for number in order {
            let layer = self.layer(*number);
            waiting.add(layer, layer.covered(self.octet.first));
        }
        let (mut colours, broken) = waiting.over(self.background);
        for lane in SampleMask(broken).iter() {
            for (all, c) in colours.iter_mut().zip(self.sample(lane, order, sample)) {
                all[lane] = c;
            }
        }
        colours
    }

    /// A sample's colour as the plain text finds it; `order` is nearly its own.
    #[inline(never)]
    fn sample(&self, lane: usize, order: &[u32], keys: &mut Vec<u64>) -> [f64; 3] {
        let position = self.octet.positions[lane];
        let of = |number: &u32| {
            let layer = self.layer(*number);
            let covers = layer.coverage.contains(self.octet.first + lane);
            (key(layer.depth_at(position), *number), covers)
        };
        keep(order.iter().map(of), keys);
        sort_nearly_sorted(keys);
        let mut colour = [0.0; 3];
        let mut transmittance = 1.0;
        for key in keys {
            let layer = self.layer(numbered(*key));
            for (c, l) in colour.iter_mut().zip(layer.colour) {
                *c += transmittance * layer.alpha * l;
            }
            transmittance *= layer.rest;
        }
        std::array::from_fn(|i| colour[i] + transmittance * self.background[i])
    }
}

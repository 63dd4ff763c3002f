//! What thresholds are, and that the engine gives the plain text's bits.

use super::*;
use crate::configure;
use screendoor_rop::{EventCounts, Implementation, Listener};
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Unorm32};

fn threshold(noise: Noise, power: f64) -> HashedThreshold {
    let (each, scale, depth_in_pixels) = (Each::Sample, 1.0, 1.0);
    HashedThreshold { noise, power, each, scale, depth_in_pixels }
}

#[test]
fn alphas_pass_as_often_as_the_power_says() {
    let site = |i: u16| Site { x: i % 64, y: i / 64 };
    for (noise, power) in [
        (Noise::Primitive, 1.0),
        (Noise::StochasticSplats, 1.0),
        (Noise::Nvpro, 1.0),
        (Noise::Spark, 1.0),
        (Noise::Mask, 1.0),
        (Noise::Mask, 2.2),
        (Noise::Primitive, 2.2),
    ] {
        let of = threshold(noise, power);
        let fragment = Fragment { primitive: 7, ..Fragment::default() };
        for alpha in [0.1, 0.3, 0.5] {
            let passed =
                (0..4096).filter(|i| of.threshold(3, site(*i), &fragment, None, 0) < alpha);
            let share = passed.count() as f64 / 4096.0;
            // A mask holds each rank once; of white noise σ is 0.008 at most, and the bound six of them.
            let bound = if noise == Noise::Mask { 3e-4 } else { 0.048 };
            assert!((share - alpha.powf(1.0 / power)).abs() < bound, "{noise:?} {alpha} {share}");
        }
    }
}

#[test]
fn shipped_hashes_are_those_of_their_shaders() {
    // Computed by hand from the shaders' texts, in another language.
    assert_eq!(xxhash32([0, 0, 0]), 0xa5e2b579);
    assert_eq!(xxhash32([1, 2, 3]), 0x0e7ee77e);
    assert_eq!([pcg(0), pcg(1)], [0x07bb2fe2, 0xa8beea3c]);
    let of = |primitive: u32, x: u16, sample: u32| {
        let fragment = Fragment { primitive, ..Fragment::default() };
        threshold(Noise::StochasticSplats, 1.0).threshold(
            9,
            Site { x, y: 5 },
            &fragment,
            None,
            sample,
        )
    };
    // What the sum in front of the hash makes equal, which white noise would not.
    assert_eq!(of(7, 10, 0), of(6, 11, 0));
    assert_eq!(of(7 + 256, 10, 0), of(7, 10, 1));
    assert_ne!(of(7, 10, 0), of(7, 11, 0));
}

#[test]
fn masks_have_32_places_and_most_neighbours_share_theirs() {
    let of = threshold(Noise::Mask, 1.0);
    let row = |primitive: u32| -> Vec<u64> {
        let fragment = Fragment { primitive, ..Fragment::default() };
        let at = |x| of.threshold(1, Site { x, y: 0 }, &fragment, None, 0).to_bits();
        (0..64).map(at).collect()
    };
    let rows: Vec<Vec<u64>> = (0..1000).map(row).collect();
    let places: std::collections::HashSet<&Vec<u64>> = rows.iter().collect();
    assert_eq!(places.len(), 32);
    let shared = rows.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!((570..600).contains(&shared), "{shared}");
}

/// A fragment of a few pixels, at depths, slopes and alphas of all sizes.
fn fragment(random: &mut Stream, samples: u32) -> Fragment {
    let words = u64::from(random.word()) << 32 | u64::from(random.word());
    let some = SampleMask(words) & SampleMask::first(samples);
    let whole = some.is_empty() || random.below(3) == 0;
    let mut slope = || (random.word() as i32) >> (3 + random.below(28));
    let (dzdx, dzdy) = (slope(), slope());
    // As half-precision numbers hold it: traces store no others.
    let mut channel = || random.below(9) as f32 / 8.0;
    let colour = [channel(), channel(), channel()];
    Fragment {
        x: random.below(3) as u16,
        y: random.below(2) as u16,
        coverage: if whole { SampleMask::first(samples) } else { some },
        depth: DepthPlane { z: Unorm32(random.word()), dzdx, dzdy },
        colour,
        alpha: [0.0, 1.0, 1e-9, random.unit()][random.below(4) as usize],
        object: random.below(3),
        primitive: random.below(9),
        ..Fragment::default()
    }
}

#[test]
fn the_engine_gives_the_bits_of_the_plain_text() {
    let tile = TileId(0);
    for (i, settings) in [
        &[][..],
        &[("scale", "0.1")],
        &[("scale", "16"), ("depth-bits", "16")],
        // What has no twin.
        &[("threshold", "pixel")],
        &[("noise", "mask"), ("power", "2.2")],
    ]
    .into_iter()
    .enumerate()
    {
        let owned = settings.iter().map(|(name, value)| (name.to_string(), value.to_string()));
        let design = configure("hashed-alpha", &owned.collect::<Vec<_>>()).unwrap();
        for samples in [1, 2, 4, 8, 16, 32, 64] {
            let mut random = Stream::new([3, samples, i as u32]);
            let mut offset = || random.below(16) as i8 - 8;
            let frame = Frame {
                grid: TileGrid::new(700, 16),
                positions: (0..samples).map(|_| [offset(), offset()]).collect(),
                background: [0.25, -3.0, 1e30],
                space: Default::default(),
                seed: samples,
                colour_bits: 48,
                view: None,
                opaque: false,
                primitive_depths: None,
                columns: Default::default(),
            };
            let fragments: Vec<_> = (0..300).map(|_| fragment(&mut random, samples)).collect();
            let drawn = |which| {
                let engine = design.build(&frame, which).unwrap();
                let mut state = engine.clear(frame.grid, tile);
                let mut counts = EventCounts::default();
                for block in Block::all_of(&fragments) {
                    engine.draw(0, &mut state, &block, Listener::Counts(&mut counts));
                }
                let held: Vec<_> = [0, 1, 2, 16, 17, 18, 255]
                    .into_iter()
                    .map(|within| engine.contents(&state, within))
                    .collect();
                let pixels = engine.resolve(frame.grid, tile, &state);
                (held, counts, pixels.map(|colour| colour.map(f64::to_bits)))
            };
            let expected = drawn(Implementation::Reference);
            assert_eq!(drawn(Implementation::Fast), expected, "{settings:?}, {samples} samples");
        }
    }
}

//! The fast engine and the plain text give the same bits.

use crate::exact::fast::Fast;
use crate::{REFERENCE, configure};
use screendoor_rop::fast::levels;
use screendoor_rop::{
    BlockList, EventCounts, Frame, Implementation, Listener, TileState, TiledDesign,
};
use screendoor_trace::picture::TilePixels;
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

const SAMPLES: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
const TILE: TileId = TileId(0);

fn frame(samples: u32, random: &mut Stream) -> Frame {
    let mut offset = || random.below(16) as i8 - 8;
    Frame {
        grid: TileGrid::new(16, 16),
        positions: (0..samples).map(|_| [offset(), offset()]).collect(),
        background: [0.25, -3.0, 1e30],
        space: Default::default(),
        seed: 0,
        colour_bits: 48,
        view: None,
        opaque: true,
        primitive_depths: None,
        columns: Default::default(),
    }
}

fn pick<T: Copy>(random: &mut Stream, from: &[T]) -> T {
    from[random.below(from.len() as u32) as usize]
}

/// How depths are drawn at random.
#[derive(Clone, Copy, Debug)]
enum Depths {
    /// All over the range, nearly flat.
    Flat,
    /// Few and equal ones, with slopes that make others equal at some samples only.
    Tied,
    /// Layers that cross within the pixel.
    Crossing,
    /// Steep ones, most beyond the range's ends at some samples.
    Clamped,
}

fn depth(random: &mut Stream, depths: Depths) -> DepthPlane {
    let slope = |random: &mut Stream, size: u32| random.below(2 * size + 1) as i32 - size as i32;
    match depths {
        Depths::Flat => DepthPlane {
            z: Unorm32(random.word()),
            dzdx: slope(random, 1000),
            dzdy: slope(random, 1000),
        },
        Depths::Tied => DepthPlane {
            z: Unorm32((1 << 20) + random.below(4)),
            dzdx: 4 * slope(random, 2),
            dzdy: 4 * slope(random, 2),
        },
        Depths::Crossing => DepthPlane {
            z: Unorm32((1 << 30) + random.below(1 << 20)),
            dzdx: slope(random, 1 << 20),
            dzdy: slope(random, 1 << 20),
        },
        Depths::Clamped => DepthPlane {
            z: Unorm32(pick(random, &[0, 1, 1 << 20, 1 << 31, u32::MAX - 5, u32::MAX])),
            dzdx: pick(random, &[i32::MIN, -7, 0, 1, 1 << 28, i32::MAX]),
            dzdy: pick(random, &[i32::MIN, -(1 << 28), -1, 0, 9, i32::MAX]),
        },
    }
}

fn fragment(random: &mut Stream, samples: u32, depths: Depths) -> Fragment {
    let mut coverage = SampleMask::NONE;
    coverage.insert(random.below(samples) as usize);
    let words = u64::from(random.word()) << 32 | u64::from(random.word());
    match random.below(4) {
        0 => {}
        1 => coverage = SampleMask::first(samples),
        _ => coverage |= SampleMask(words) & SampleMask::first(samples),
    }
    let colours = [0.0, -0.0, 1.0, -0.7, 3e-39, f32::MAX, f32::MIN];
    let colour = std::array::from_fn(|_| match random.below(3) {
        0 => pick(random, &colours),
        _ => random.unit(),
    });
    let alpha = match random.below(12) {
        0 => 0.0,
        1 => 1.0,
        _ => random.unit(),
    };
    let depth = depth(random, depths);
    Fragment {
        x: 0,
        y: 0,
        coverage,
        depth,
        colour,
        alpha,
        primitive: 0,
        object: 0,
        ..Fragment::default()
    }
}

/// Fragments of a tile: none in most pixels, few in some, in one `deepest` of them.
fn fragments(random: &mut Stream, samples: u32, depths: Depths, deepest: u32) -> Vec<Fragment> {
    let mut all = Vec::new();
    let first = random.below(TILE_PIXELS as u32);
    for (pixel, count) in [deepest, 1, 2, 7, 16, 17, 40].into_iter().enumerate() {
        let within = (first as usize + 37 * pixel) % TILE_PIXELS;
        for _ in 0..count {
            let (x, y) = ((within % 16) as u16, (within / 16) as u16);
            all.push(Fragment { x, y, ..fragment(random, samples, depths) });
        }
    }
    random.shuffle(&mut all);
    all
}

fn reference(frame: &Frame) -> Box<dyn TiledDesign> {
    configure(REFERENCE, &[]).unwrap().build(frame, Implementation::Reference).unwrap()
}

/// The tile's state after `fragments`, in uneven parts, and what was counted.
fn drawn(
    engine: &dyn TiledDesign,
    frame: &Frame,
    fragments: &[Fragment],
) -> (TileState, EventCounts) {
    let mut state = engine.clear(frame.grid, TILE);
    let mut counts = EventCounts::default();
    let (first, rest) = fragments.split_at(fragments.len() / 3);
    for part in std::iter::once(first).chain(rest.chunks(64)).flat_map(Block::all_of) {
        engine.draw(0, &mut state, &part, Listener::Counts(&mut counts));
    }
    engine.end_pass(0, frame.grid, TILE, &mut state, Listener::Nobody);
    (state, counts)
}

fn assert_same(frame: &Frame, fragments: &[Fragment], what: &str) {
    let reference_engine = reference(frame);
    let (state, counts) = drawn(&*reference_engine, frame, fragments);
    let expected = reference_engine.resolve(frame.grid, TILE, &state);
    for (_, level) in levels() {
        let fast = Fast::new(frame, reference(frame), level);
        let (fast_state, fast_counts) = drawn(&fast, frame, fragments);
        assert_eq!(fast_counts, counts, "{what}");
        let picture = fast.resolve(frame.grid, TILE, &fast_state);
        for within in 0..TILE_PIXELS {
            let [a, b] = [&expected, &picture].map(|p| p[within].map(f64::to_bits));
            assert_eq!(a, b, "{what}, {} samples, {level:?}, pixel {within}", frame.samples());
            let [a, b] = [(&*reference_engine, &state), (&fast as &dyn TiledDesign, &fast_state)]
                .map(|(engine, state)| engine.contents(state, within));
            assert_eq!(a, b, "{what}");
        }
        let mut counted = EventCounts::default();
        let blocks = Block::all_of(fragments);
        let told = Listener::Counts(&mut counted);
        let at_once = fast.picture(frame.grid, TILE, &mut BlockList::new(&blocks), told);
        let bits = |p: TilePixels| p.map(|colour| colour.map(f64::to_bits));
        assert_eq!(bits(at_once.expect("it has one")), bits(picture), "{what}, at once");
        assert_eq!(counted, counts, "{what}, at once");
        assert_eq!(fast.state_bits(), reference_engine.state_bits());
        assert_eq!(fast.passes(), reference_engine.passes());
    }
}

#[test]
fn random_layers() {
    for samples in SAMPLES {
        for depths in [Depths::Flat, Depths::Tied, Depths::Crossing, Depths::Clamped] {
            for round in 0..20 {
                let mut random = Stream::new([samples, depths as u32, round]);
                let frame = frame(samples, &mut random);
                let deepest = pick(&mut random, &[31, 127, 128, 129, 400]);
                let fragments = fragments(&mut random, samples, depths, deepest);
                assert_same(&frame, &fragments, &format!("{depths:?}, round {round}"));
            }
        }
    }
}

#[test]
fn an_empty_tile_shows_the_background() {
    for samples in SAMPLES {
        assert_same(&frame(samples, &mut Stream::new([samples])), &[], "empty");
    }
}

/// What the lanes do not sort rightly is found out even behind what is opaque.
#[test]
fn a_layer_that_comes_through_an_opaque_one() {
    let mut random = Stream::new([1]);
    let mut frame = frame(8, &mut random);
    frame.positions = [[0, 0], [-8, 0], [7, 0], [0, -8], [0, 7], [4, 4], [-4, 4], [4, -4]].into();
    let flat = |z, alpha, red| Fragment {
        x: 3,
        y: 5,
        coverage: SampleMask::first(8),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour: [red, 0.5, 0.25],
        alpha,
        primitive: 0,
        object: 0,
        ..Fragment::default()
    };
    let mut through = flat(1 << 21, 0.5, 9.0);
    through.depth.dzdx = -(1 << 24);
    let fragments = [flat(1 << 20, 1.0, 1.0), through, flat(1 << 20, 0.75, 2.0)];
    assert_same(&frame, &fragments, "through");
}

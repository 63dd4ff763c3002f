//! What a defect in a single lane does to a pixel is seen.

use screendoor_trace::param::{Param, Values};
use screendoor_trace::random::Stream;
use screendoor_trace::tile::{TileGrid, TileId};
use screendoor_trace::trace::{Block, DepthPlane, Fragment, SampleMask, Unorm32};

use crate::contract::contents::Contents;
use crate::contract::frame::Frame;
use crate::contract::tiled::{Listener, TiledDesign};
use crate::fast::{Count, FastEngine, FastTracked, Flaw, Published, PublishedHash, Width, levels};
use crate::stochastic::single_pass;
use crate::tracked::{
    COMPACT, Hashed, PIXEL_ORDER, PREHASH, REFERENCE, SORT, SURFACES, TRACK, TrackedSampler,
};
use crate::{colour, depth_bits};

pub(super) const PARAMS: &[Param] = &[
    SORT.param,
    COMPACT.param,
    SURFACES.param,
    TRACK.param,
    PIXEL_ORDER.param,
    REFERENCE.param,
    PREHASH.param,
    depth_bits::PARAM.param,
    colour::PARAM.param,
];

const PIXELS: u16 = 4;

fn fragments(samples: u32) -> Vec<Fragment> {
    let mut random = Stream::new([0xde7ec7, samples]);
    let mut mask = || {
        let bits = u64::from(random.word()) << 32 | u64::from(random.word());
        SampleMask(bits | 1 << random.below(samples)) & SampleMask::first(samples)
    };
    let masks: Vec<SampleMask> = (0..300).map(|_| mask()).collect();
    let fragment = |coverage| Fragment {
        x: random.below(PIXELS.into()) as u16,
        y: 0,
        coverage,
        depth: DepthPlane { z: Unorm32((1 << 30) + random.below(1 << 16)), dzdx: 9, dzdy: -40 },
        colour: [random.unit(); 3],
        alpha: random.unit(),
        primitive: 0,
        object: 0,
        ..Fragment::default()
    };
    masks.into_iter().map(fragment).collect()
}

/// What the pixels hold after every few fragments.
fn held(engine: &dyn TiledDesign, samples: u32) -> Vec<Contents> {
    let (grid, tile) = (TileGrid::new(16, 16), TileId(0));
    let mut state = engine.clear(grid, tile);
    let mut list = Vec::new();
    for part in fragments(samples).chunks(20).flat_map(Block::all_of) {
        engine.draw(0, &mut state, &part, Listener::Nobody);
        list.extend((0..usize::from(PIXELS)).map(|within| engine.contents(&state, within)));
    }
    list
}

/// A frame of a tile, its samples in rows.
pub(super) fn frame<const N: usize>() -> Frame {
    Frame {
        grid: TileGrid::new(16, 16),
        positions: (0..N as i32).map(|s| [(s % 8 * 2 - 8) as i8, (s / 8 * 2 - 8) as i8]).collect(),
        background: [0.5; 3],
        space: Default::default(),
        seed: 3,
        colour_bits: 96,
        view: None,
        opaque: true,
        primitive_depths: None,
        columns: Default::default(),
    }
}

/// A wrong bit in any lane, of a depth or of a choice, is told from the plain text.
fn check<const N: usize>()
where
    Count<N>: Width,
{
    let frame = frame::<N>();
    // As `lk` has it.
    let values = Values::resolve("lk", PARAMS, &[]).unwrap();
    let plain = || {
        let references = Hashed(values.get(REFERENCE));
        single_pass(&values, &frame, TrackedSampler::new(&values, &frame, references))
    };
    let expected = held(&plain(), N as u32);
    for (name, level) in levels() {
        let fast = || {
            let sampler = FastTracked::<_, _, N>::new(&values, Published, PublishedHash);
            FastEngine::new(plain(), sampler, level)
        };
        assert_eq!(held(&fast(), N as u32), expected, "{name}");
        for flaw in (0..N).flat_map(|lane| [Flaw::Depth(lane), Flaw::Choice(lane)]) {
            let found = held(&fast().with_flaw(flaw), N as u32);
            assert_ne!(found, expected, "{name}, {N} samples: {flaw:?} stays hidden");
        }
    }
}

#[test]
fn a_defect_in_any_lane_is_found() {
    check::<1>();
    check::<2>();
    check::<4>();
    check::<8>();
    check::<16>();
    check::<32>();
    check::<64>();
}

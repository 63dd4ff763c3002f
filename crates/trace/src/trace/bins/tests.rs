//! Bins against the batches that they are made of.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::*;
use crate::error::Result;
use crate::random::Stream;
use crate::tile::TILE_SIDE;
use crate::trace::fragment::SampleMask;
use crate::trace::{
    BLOCK, Block, ColourFormat, ColumnId, ColumnSet, DepthPlane, Fragment, Header, SamplePattern,
    Scalar, TraceWriter, Unorm32, WriteOptions,
};

const ROWS: usize = 5000;

/// What a trace is like: masks for so many samples, colours in either precision, two columns
/// constant or none, and an optional column or not.
#[derive(Clone, Copy, Debug)]
struct Kind {
    samples: u32,
    colour: ColourFormat,
    constants: bool,
    optional: bool,
}

const PLAIN: Kind =
    Kind { samples: 8, colour: ColourFormat::F16, constants: false, optional: false };

/// Random fragments in runs of all lengths within a tile: some tiles have many, others few.
fn file(kind: Kind) -> Vec<u8> {
    let Kind { samples, colour, constants, optional } = kind;
    let mut random = Stream::new([3, samples]);
    let mut header = Header { width: 100, height: 70, colour, ..Header::default() };
    let positions = vec![[0, 0]; samples as usize];
    header.pattern = SamplePattern { name: "p".into(), positions, nested: false };
    if constants {
        header.constants.insert(ColumnId::X, Scalar::Unsigned(7));
        header.constants.insert(ColumnId::Alpha, Scalar::Real(0.25));
    }
    if optional {
        header.optional.insert(ColumnId::Probe);
    }
    let options = WriteOptions { batch_rows: 700, ..WriteOptions::default() };
    let mut writer = TraceWriter::new(Vec::new(), "t", header, options).unwrap();
    let (mut corner, mut left) = ([0, 0], 0);
    for _ in 0..ROWS {
        if left == 0 {
            left = 1 + random.below(40).min(random.below(40)).min(random.below(80));
            let side = TILE_SIDE as u32;
            corner = [random.below(7).min(random.below(7)) * side, random.below(5) * side];
        }
        left -= 1;
        let [x, y] = corner.map(|start| start + random.below(TILE_SIDE as u32));
        let bits = u64::from(random.word()) << 32 | u64::from(random.word());
        let mut fragment = Fragment {
            x: if constants { 7 } else { x.min(99) as u16 },
            y: y.min(69) as u16,
            coverage: SampleMask(bits | 1) & SampleMask::first(samples),
            depth: DepthPlane {
                z: Unorm32(random.word()),
                dzdx: random.word() as i32,
                dzdy: random.word() as i32,
            },
            colour: [random.unit(), -random.unit(), random.unit() * 1000.0],
            alpha: if constants { 0.25 } else { random.unit() },
            primitive: random.word(),
            object: random.word(),
            ..Fragment::default()
        };
        // Half of the samples are covered by half of the fragments.
        if random.below(2) == 0 && samples > 1 {
            fragment.coverage = SampleMask(1 << (samples - 1));
        }
        if optional {
            fragment.optional.probe = random.unit();
        }
        writer.push(&fragment).unwrap();
    }
    writer.finish().unwrap().0
}

fn open(kind: Kind) -> Trace {
    Trace::from_bytes(file(kind), "t").unwrap()
}

type ByTile = BTreeMap<u32, Vec<Fragment>>;

fn cut(fragment: Fragment, wanted: Wanted) -> Fragment {
    let coverage = fragment.coverage & wanted.samples;
    Fragment { coverage, optional: fragment.optional.only(wanted.columns), ..fragment }
}

/// The batches' fragments of each tile.
fn expected(trace: &Trace, wanted: Wanted) -> ByTile {
    let grid = TileGrid::new(trace.header().width, trace.header().height);
    let mut tiles = ByTile::new();
    for batch in trace.batches() {
        for f in batch.unwrap().iter() {
            tiles.entry(grid.tile(f.x, f.y).0).or_default().push(cut(f, wanted));
        }
    }
    tiles
}

/// Adds what bins hold.
fn add(tiles: &mut ByTile, bins: &Bins, wanted: Wanted) {
    let mut block = Block::default();
    for (tile, count) in bins.tiles() {
        let mut rows = bins.rows(*tile, wanted);
        assert_eq!(rows.left(), *count);
        while rows.left() > 0 {
            rows.read(&mut block);
            assert!(block.rows() == BLOCK || rows.left() == 0);
            let list = tiles.entry(tile.0).or_default();
            list.extend((0..block.rows()).map(|i| block.fragment(i)));
        }
        rows.read(&mut block);
        assert_eq!(block.rows(), 0);
    }
}

/// Fills bins again and again to the trace's end; tells how often.
fn windows(
    trace: &Trace,
    bins: &mut Bins,
    rows: u64,
    tiles: &Tiles,
    wanted: Wanted,
) -> (ByTile, usize) {
    let (mut found, mut next, mut count, mut all) = (ByTile::new(), RowPlace::default(), 0, 0);
    while !next.is_end(trace) {
        let (end, through) = bins.fill(trace, next, rows, tiles).unwrap();
        assert!((1..=rows).contains(&through));
        add(&mut found, bins, wanted);
        (next, count, all) = (end, count + 1, all + through);
    }
    assert_eq!(all, trace.rows());
    (found, count)
}

fn wanted(samples: u32, columns: ColumnSet) -> Wanted {
    Wanted { samples: SampleMask::first(samples), columns }
}

const PLENTY: u64 = 1 << 24;

/// Columns of all types; chunks of all sizes, slabs that end within a tile, several parts.
#[test]
fn rows_come_back_whole_and_in_order() {
    for samples in [1, 8, 16, 32, 64] {
        for colour in [ColourFormat::F16, ColourFormat::F32] {
            for (constants, optional) in [(false, false), (true, true), (false, true)] {
                let trace = open(Kind { samples, colour, constants, optional });
                for (parts, slab_rows, columns) in
                    [(1, 512, ColumnSet::NONE), (3, 1024, ColumnSet::ALL), (9, 512, ColumnSet::ALL)]
                {
                    let wanted = wanted(samples.div_ceil(2), columns);
                    let mut bins = Bins::of_parts(&trace, parts, slab_rows, PLENTY);
                    for _ in 0..2 {
                        let (found, count) =
                            windows(&trace, &mut bins, u64::MAX, &Tiles::All, wanted);
                        assert_eq!(count, 1);
                        assert!(found == expected(&trace, wanted), "{samples} {parts}");
                    }
                    bins.level = Level::fallback();
                    let (found, _) = windows(&trace, &mut bins, u64::MAX, &Tiles::All, wanted);
                    assert!(found == expected(&trace, wanted), "{samples} {parts}");
                }
            }
        }
    }
}

/// What a row is said to take is what it takes.
#[test]
fn bytes_are_counted() {
    for (constants, optional) in [(false, false), (true, true)] {
        let trace = open(Kind { constants, optional, ..PLAIN });
        let mut bins = Bins::new(&trace, u64::MAX, PLENTY);
        bins.fill(&trace, RowPlace::default(), u64::MAX, &Tiles::All).unwrap();
        let row = Bins::bytes_per_row(&trace);
        assert!(bins.bytes() >= row * ROWS as u64 && bins.bytes() < 2 * row * ROWS as u64);
        assert_eq!(bins.parts[0].bytes_per_row() as u64, row);
    }
}

/// Windows that memory forces, within a batch too, and windows of few rows.
#[test]
fn windows_hold_what_fits() {
    let trace = open(PLAIN);
    let wanted = wanted(8, ColumnSet::NONE);
    let all = expected(&trace, wanted);
    for (parts, bytes, rows, least) in [
        (1, 1, u64::MAX, 8),
        (1, 100_000, u64::MAX, 3),
        (3, 1, u64::MAX, 6),
        (3, 100_000, 1000, 5),
        (1, PLENTY, 97, 52),
        (2, PLENTY, 1, ROWS),
    ] {
        let mut bins = Bins::of_parts(&trace, parts, 512, bytes);
        let (found, count) = windows(&trace, &mut bins, rows, &Tiles::All, wanted);
        assert!(found == all && count >= least, "{parts} parts, {bytes} bytes: {count}");
        let slabs = 512 * Bins::bytes_per_row(&trace);
        assert!(bins.bytes() < bytes.max(parts as u64 * slabs) + (1 << 16));
    }
    assert_eq!(Bins::new(&trace, u64::MAX, PLENTY).parts.len(), 1);
}

#[test]
fn only_the_tiles_that_are_asked_for_are_there() {
    let trace = open(PLAIN);
    let wanted = wanted(8, ColumnSet::NONE);
    let all = expected(&trace, wanted);
    let mut bins = Bins::of_parts(&trace, 2, 512, PLENTY);
    let (found, _) = windows(&trace, &mut bins, 3000, &Tiles::Range(2..9), wanted);
    assert!(found.iter().eq(all.range(2..9)));
    let tiles = Tiles::Part(TileId(8), 40..100);
    let (found, _) = windows(&trace, &mut bins, 3000, &tiles, wanted);
    let held = |f: &&Fragment| (40..100).contains(&TileGrid::within(f.x, f.y));
    let list: Vec<Fragment> = all[&8].iter().filter(held).copied().collect();
    assert!(!list.is_empty() && found == ByTile::from([(8, list)]));
}

/// The error is the first in the trace's order, as if batches were read one by one.
#[test]
fn damage_is_told_as_reading_tells_it() {
    let good = open(PLAIN);
    let mut bytes = file(PLAIN);
    let middle = |i: usize| bytes.len() * (2 * i + 1) / (2 * good.batch_count());
    for at in [middle(2), middle(5)] {
        bytes[at] ^= 0x10;
    }
    let trace = Trace::from_bytes(bytes, "t").unwrap();
    let expected = trace.batches().find_map(Result::err).unwrap().to_string();
    assert!(expected.contains("batch 2"), "{expected}");
    for parts in [1, 3, 8] {
        let mut bins = Bins::of_parts(&trace, parts, 512, PLENTY);
        let error = bins.fill(&trace, RowPlace::default(), u64::MAX, &Tiles::All).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn kept_bins_are_the_last_traces_own_and_go_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.arrow");
    std::fs::write(&path, file(PLAIN)).unwrap();
    let (stored, other) = (Trace::open(&path).unwrap(), open(PLAIN));
    let bins = || Arc::new(Bins::new(&stored, u64::MAX, PLENTY));
    assert!(stored.kept_bins().unwrap().is_none());
    let kept = bins();
    stored.keep_bins(Arc::clone(&kept));
    assert!(Arc::ptr_eq(&stored.clone().kept_bins().unwrap().unwrap(), &kept));
    other.keep_bins(bins());
    assert!(stored.kept_bins().unwrap().is_none() && other.kept_bins().unwrap().is_some());
    stored.keep_bins(bins());
    assert!(other.kept_bins().unwrap().is_none());
    Trace::forget_bins();
    assert!(stored.kept_bins().unwrap().is_none());
    let kept = bins();
    other.keep_bins(Arc::clone(&kept));
    drop(other);
    assert_eq!(Arc::strong_count(&kept), 1);

    let (mark, another) = (stored.mark(), open(PLAIN));
    assert!(stored.clone().is_marked(&mark).unwrap() && !another.is_marked(&mark).unwrap());

    // What was sorted is not drawn once the file is another.
    stored.keep_bins(bins());
    std::fs::write(&path, [0; 100]).unwrap();
    let error = stored.kept_bins().unwrap_err().to_string();
    assert!(error.contains("another program has changed or cut it"), "{error}");
    assert!(stored.is_marked(&mark).is_err() && !another.is_marked(&mark).unwrap());
}

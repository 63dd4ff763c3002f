//! How two traces differ.

use serde::Serialize;

use crate::edit::Progress;
use crate::error::Result;
use crate::param::Options;
use crate::trace::{ColourFormat, ColumnId, ColumnKind, Fragment, Header, Scalar, Trace, View};

/// What two traces have in common: as little as the worst of their pixels.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kept {
    /// The same fragments in the same order.
    Rows,
    /// In each pixel the same fragments in the same order; only pixels are interleaved
    /// otherwise. Every replay gives the same picture, bit for bit.
    Pixels,
    /// In each pixel the same fragments, in some in another order.
    Fragments,
    /// Not even these.
    Nothing,
}

/// The first fragment that differs: of the first pixel, by rows from the top and columns
/// from the left, in which any does.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FirstDifference {
    /// The pixel: column and row.
    pub pixel: [u16; 2],
    /// Which of its fragments, from 0 on.
    pub fragment: u64,
    /// In which row each trace has it; `None` where the pixel has no more fragments.
    pub rows: [Option<u64>; 2],
    /// What each trace has there.
    pub fragments: [Option<Fragment>; 2],
    /// The columns that differ, where both have one.
    pub columns: Vec<&'static str>,
}

/// How far a column differs.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct ColumnDifference {
    /// The column.
    pub column: &'static str,
    /// In how many fragments.
    pub fragments: u64,
    /// By how much at most, in the column's unit; of masks by how many samples.
    pub most: f64,
}

/// How the fragments of two traces differ.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Difference {
    /// What they have in common.
    pub same: Kept,
    /// How many fragments each has.
    pub fragments: [u64; 2],
    /// The pixels whose fragments differ, or their order.
    pub pixels: u64,
    /// Those of them that have the same fragments in another order.
    pub reordered: u64,
    /// Those of them that have not as many fragments in one trace as in the other.
    pub counts: u64,
    /// The first row that differs, where any does.
    pub row: Option<u64>,
    /// The first fragment of a pixel that differs.
    pub first: Option<FirstDifference>,
    /// The columns that differ, over the fragments that stand in the same place of their
    /// pixel, in the pixels that have the same number of them in both.
    pub columns: Vec<ColumnDifference>,
    /// In how many pixels columns were compared: of those that differ and have as many fragments
    /// in both, the first that fit into memory.
    pub compared: u64,
}

/// An entry of two headers that differs.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct HeaderDifference {
    /// Which one.
    pub entry: &'static str,
    /// What each header has.
    pub values: [String; 2],
    /// Whether any replay depends on it, and not only what people read.
    pub matters: bool,
}

/// The entries of two headers that differ.
pub fn header_differences(a: &Header, b: &Header) -> Vec<HeaderDifference> {
    let list = |header: &Header| {
        let pattern = &header.pattern;
        let positions: Vec<String> =
            pattern.positions.iter().map(|[x, y]| format!("{x},{y}")).collect();
        let optional: Vec<&str> = header.optional.iter().map(|id| id.name()).collect();
        let colours = match header.colour {
            ColourFormat::F16 => "half precision",
            ColourFormat::F32 => "single precision",
        };
        let view = View::KEYS.map(|key| {
            let said = header
                .view
                .and_then(|view| view.to_metadata().into_iter().find(|(own, _)| *own == key));
            let name = key.trim_start_matches("screendoor.");
            (name, said.map_or("none".to_string(), |(_, text)| text), true)
        });
        let others = [
            ("frame", format!("{}x{}", header.width, header.height), true),
            ("samples", format!("{} at {}", pattern.samples(), positions.join(" ")), true),
            ("nested", pattern.nested.to_string(), true),
            ("pattern", pattern.name.clone(), false),
            ("background", header.background.map(|c| c.to_string()).join(" "), true),
            ("space", header.space.name().to_string(), true),
            // Designs store colours as wide as the trace has them, where nothing else is said.
            ("colours", colours.to_string(), true),
            ("source", header.source.clone(), false),
            ("camera", header.camera.clone(), false),
            ("optional columns", optional.join(" "), false),
        ];
        others.into_iter().chain(view)
    };
    let pairs = list(a).zip(list(b)).filter(|(a, b)| a.1 != b.1);
    pairs
        .map(|((entry, a, matters), (_, b, _))| HeaderDifference { entry, values: [a, b], matters })
        .collect()
}

/// What is known of a pixel of one trace after a pass.
#[derive(Clone, Copy, Default)]
struct Seen {
    fragments: u64,
    /// Of the sequence of fragments.
    ordered: u64,
    /// Of the set of them.
    sum: u64,
}

/// What a pixel takes.
const PIXEL: u64 = 2 * size_of::<Seen>() as u64;
/// What a fragment takes while it is held: with its pixel's place, and what sorting takes.
const HELD: u64 = size_of::<(usize, Fragment)>() as u64 * 3 / 2;
/// What a pixel takes that is looked at.
const PLACE: u64 = size_of::<u64>() as u64;

/// Compares the fragments of two traces whose frames are of one size, pixel by pixel: in a
/// trace only the order within a pixel means anything. Values are compared to the bit,
/// whatever the types in which they are stored.
///
/// Pixels are told apart by hashes of 64 bits. `memory` is how many bytes pixels may take,
/// and fragments that are looked at one by one; less makes more passes over both traces.
///
/// # Errors
/// Those of reading the traces.
///
/// # Panics
/// Where the frames are not of one size.
pub fn difference(traces: [&Trace; 2], memory: u64, progress: Progress<'_>) -> Result<Difference> {
    let [a, b] = traces.map(Trace::header);
    assert_eq!((a.width, a.height), (b.width, b.height), "frames of one size");
    let width = u64::from(a.width);
    let each = (memory / (width * PIXEL)).clamp(1, a.height.into()) as u32;
    let bands: Vec<(u32, u32)> =
        (0..a.height).step_by(each as usize).map(|y| (y, a.height.min(y + each))).collect();
    let mut found = Difference {
        same: Kept::Rows,
        fragments: traces.map(Trace::rows),
        pixels: 0,
        reordered: 0,
        counts: 0,
        row: None,
        first: None,
        columns: Vec::new(),
        compared: 0,
    };
    let mut chosen: Vec<u64> = Vec::new();
    let mut first = None;
    let (mut held, mut fragments) = (0_u64, 0);
    for (i, (top, bottom)) in bands.iter().copied().enumerate() {
        let mut seen = vec![[Seen::default(); 2]; (u64::from(bottom - top) * width) as usize];
        found.row = note(traces, (top, bottom), width, &mut seen)?;
        // Then no pixel differs either, in whatever part of the frame.
        if found.row.is_none() {
            return Ok(found);
        }
        found.same = found.same.max(Kept::Pixels);
        for (pixel, [a, b]) in seen.iter().enumerate() {
            if (a.fragments, a.ordered) == (b.fragments, b.ordered) {
                continue;
            }
            found.pixels += 1;
            found.counts += u64::from(a.fragments != b.fragments);
            let reordered = (a.fragments, a.sum) == (b.fragments, b.sum);
            found.reordered += u64::from(reordered);
            found.same = found.same.max(if reordered { Kept::Fragments } else { Kept::Nothing });
            let pixel = u64::from(top) * width + pixel as u64;
            first.get_or_insert(pixel);
            // Columns are compared where the fragments of both stand beside each other.
            let needs = a.fragments.saturating_mul(2 * HELD).saturating_add(PLACE);
            if a.fragments == b.fragments && needs <= memory - held {
                held += needs;
                fragments += a.fragments as usize;
                chosen.push(pixel);
            }
        }
        progress(i as u64 + 1, bands.len() as u64);
    }
    found.first = first.map(|pixel| first_of(traces, pixel, width)).transpose()?;
    look(traces, &chosen, fragments, width, &mut found)?;
    Ok(found)
}

/// All fragments of a trace.
fn rows(trace: &Trace) -> impl Iterator<Item = Result<Fragment>> + '_ {
    trace.batches().flat_map(|batch| {
        let (batch, error) = match batch {
            Ok(batch) => (Some(batch), None),
            Err(error) => (None, Some(Err(error))),
        };
        let fragments = batch
            .into_iter()
            .flat_map(|batch| (0..batch.len()).map(move |i| Ok(batch.fragment(i))));
        fragments.chain(error)
    })
}

fn same(a: &Fragment, b: &Fragment) -> bool {
    ColumnId::ALL.into_iter().all(|id| a.value(id).is(b.value(id)))
}

/// Takes down the fragments in rows of pixels from `top` to before `bottom`. Tells the first row
/// of the traces that differs, or which one of them lacks.
fn note(
    traces: [&Trace; 2],
    (top, bottom): (u32, u32),
    width: u64,
    seen: &mut [[Seen; 2]],
) -> Result<Option<u64>> {
    let [mut a, mut b] = traces.map(rows);
    let mut first = None;
    for row in 0.. {
        let sides = [a.next().transpose()?, b.next().transpose()?];
        let known = first.is_some();
        match &sides {
            [None, None] => break,
            [Some(a), Some(b)] if known || same(a, b) => {}
            _ => first = first.or(Some(row)),
        }
        for (side, fragment) in sides.iter().enumerate() {
            let Some(fragment) = fragment else { continue };
            let y = u32::from(fragment.y);
            if !(top..bottom).contains(&y) {
                continue;
            }
            let pixel = (u64::from(y - top) * width) as usize + usize::from(fragment.x);
            let pixel = &mut seen[pixel][side];
            pixel.fragments += 1;
            // What both begin with tells nothing apart.
            if first.is_some() {
                let hash = hash(fragment);
                pixel.ordered = scramble(pixel.ordered ^ hash);
                pixel.sum = pixel.sum.wrapping_add(hash);
            }
        }
    }
    Ok(first)
}

fn hash(fragment: &Fragment) -> u64 {
    ColumnId::ALL.into_iter().fold(0, |hash, id| scramble(hash ^ fragment.value(id).bits()))
}

/// A bijection of 64-bit words (`splitmix64`'s, Steele et al. 2014), after a step that keeps
/// 0 from staying 0.
fn scramble(word: u64) -> u64 {
    let mut x = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// Looks at the fragments of some pixels that differ, which are in ascending order and have
/// `count` fragments together, in each trace as many.
fn look(
    traces: [&Trace; 2],
    pixels: &[u64],
    count: usize,
    width: u64,
    found: &mut Difference,
) -> Result<()> {
    let mut sides = [(); 2].map(|()| Vec::new());
    for (side, trace) in sides.iter_mut().zip(traces) {
        side.reserve_exact(count);
        for fragment in rows(trace) {
            let fragment = fragment?;
            if let Ok(i) = pixels.binary_search(&place(&fragment, width)) {
                side.push((i, fragment));
            }
        }
        // Stably: the order within a pixel stays.
        side.sort_by_key(|(i, _)| *i);
    }
    let mut columns =
        ColumnId::ALL.map(|id| ColumnDifference { column: id.name(), fragments: 0, most: 0.0 });
    let [a, b] = sides;
    for ((_, a), (_, b)) in a.iter().zip(&b) {
        for (id, column) in ColumnId::ALL.into_iter().zip(&mut columns) {
            let [a, b] = [a, b].map(|fragment| fragment.value(id));
            if !a.is(b) {
                column.fragments += 1;
                column.most = column.most.max(apart(id, a, b));
            }
        }
    }
    found.compared = pixels.len() as u64;
    found.columns = columns.into_iter().filter(|column| column.fragments > 0).collect();
    Ok(())
}

/// Where the fragments of a pixel begin to differ, which they do. Nothing is held meanwhile,
/// however many there are.
fn first_of(traces: [&Trace; 2], pixel: u64, width: u64) -> Result<FirstDifference> {
    let of_pixel = |trace| {
        let all = rows(trace).enumerate().map(|(row, fragment)| Ok((row as u64, fragment?)));
        all.filter(move |found: &Result<(u64, Fragment)>| match found {
            Ok((_, fragment)) => place(fragment, width) == pixel,
            Err(_) => true,
        })
    };
    let [mut a, mut b] = traces.map(of_pixel);
    let mut fragment = 0;
    let sides = loop {
        match [a.next().transpose()?, b.next().transpose()?] {
            [Some((_, a)), Some((_, b))] if same(&a, &b) => fragment += 1,
            sides => break sides,
        }
    };
    let columns = match sides {
        [Some((_, a)), Some((_, b))] => {
            let differ = |id: &ColumnId| !a.value(*id).is(b.value(*id));
            ColumnId::ALL.into_iter().filter(differ).map(ColumnId::name).collect()
        }
        _ => Vec::new(),
    };
    Ok(FirstDifference {
        pixel: [pixel % width, pixel / width].map(|at| at as u16),
        fragment,
        rows: sides.map(|side| side.map(|(row, _)| row)),
        fragments: sides.map(|side| side.map(|(_, fragment)| fragment)),
        columns,
    })
}

/// The place of a fragment's pixel in the frame.
fn place(fragment: &Fragment, width: u64) -> u64 {
    u64::from(fragment.y) * width + u64::from(fragment.x)
}

/// How far two values lie apart.
fn apart(id: ColumnId, a: Scalar, b: Scalar) -> f64 {
    match (id.kind(), a, b) {
        (ColumnKind::Mask, Scalar::Unsigned(a), Scalar::Unsigned(b)) => {
            f64::from((a ^ b).count_ones())
        }
        _ => (a.number() - b.number()).abs(),
    }
}

//! Orders of fragments that mislead the tracking of surfaces.
//!
//! Laine and Karras (section 2) take fragments for one surface until one meets a sample
//! that the surface holds. Each case here stands beside the same fragments in the order
//! that this expects.

use crate::study::stress::case::{Case, Group, hue, layer, over};
use screendoor_trace::trace::Fragment;

/// Halves and quarters of eight samples.
const HALVES: [u64; 2] = [0x0f, 0xf0];
const QUARTERS: [u64; 4] = [0x03, 0x0c, 0x30, 0xc0];

/// Surface `i` in pieces, which are fragments of its own primitives and one object.
fn pieces(i: u32, masks: &[u64], alpha: f32) -> Vec<Fragment> {
    let piece = |(k, mask): (usize, &u64)| Fragment {
        primitive: i * 8 + k as u32,
        ..over(*mask, layer(i, hue(i), alpha))
    };
    masks.iter().enumerate().map(piece).collect()
}

/// One surface after the other.
fn grouped(surfaces: &[Vec<Fragment>]) -> Vec<Fragment> {
    surfaces.concat()
}

/// The first pieces of all, then the second ones.
fn interleaved(surfaces: &[Vec<Fragment>]) -> Vec<Fragment> {
    let most = surfaces.iter().map(Vec::len).max().unwrap_or(0);
    (0..most).flat_map(|k| surfaces.iter().filter_map(move |s| s.get(k).copied())).collect()
}

pub(super) fn cases() -> Vec<Case> {
    let new = |name: &str, what: &str| Case::new(Group::Order, name, what);
    let two: Vec<_> = (0..2).map(|i| pieces(i, &HALVES, 0.5)).collect();
    let four: Vec<_> = (0..4).map(|i| pieces(i, &QUARTERS, 0.5)).collect();
    // Surface 1 has its pieces the other way round.
    let mut crossed = four.clone();
    crossed.iter_mut().skip(1).step_by(2).for_each(|s| s.reverse());
    // Two surfaces that share no sample, drawn alternately: taken for one.
    let apart: Vec<_> = vec![pieces(0, &QUARTERS[..2], 0.2), pieces(1, &QUARTERS[2..], 0.8)];
    // Whole layers with pieces of another surface between them.
    let whole: Vec<Fragment> = (0..4).map(|i| layer(i, hue(i), 0.5)).collect();
    let sliver = |i: u32| over(1, layer(100 + i, hue(i), 0.5));
    let split: Vec<Fragment> = (0..4)
        .flat_map(|i| pieces(i, &HALVES, 0.5).into_iter().zip([sliver(i), sliver(i + 4)]))
        .flat_map(|(piece, sliver)| [piece, sliver])
        .collect();
    let joined: Vec<Fragment> =
        grouped(&(0..4).map(|i| pieces(i, &HALVES, 0.5)).collect::<Vec<_>>())
            .into_iter()
            .chain((0..8).map(sliver))
            .collect();
    vec![
        new("two in halves", "two surfaces in halves, one after the other").kind(grouped(&two)),
        Case {
            against: Some("two in halves"),
            ..new("halves interleaved", "the same, half by half in turn").kind(interleaved(&two))
        },
        new("four in quarters", "four surfaces in quarters, one after the other")
            .kind(grouped(&four)),
        Case {
            against: Some("four in quarters"),
            ..new("quarters interleaved", "the same, quarter by quarter in turn")
                .kind(interleaved(&four))
        },
        Case {
            against: Some("four in quarters"),
            ..new("quarters crossed", "the same in turn, every other surface from its end")
                .kind(interleaved(&crossed))
        },
        new("side by side", "two surfaces that share no sample, one after the other")
            .kind(grouped(&apart)),
        Case {
            against: Some("side by side"),
            ..new("taken for one", "the same in turn: no sample says that they are two")
                .kind(interleaved(&apart))
        },
        new("slivers last", "four surfaces in halves, then eight slivers of one sample")
            .kind(joined),
        Case {
            against: Some("slivers last"),
            ..new("slivers between", "the same, a sliver after every half: each ends a surface")
                .kind(split)
        },
        new("whole", "four whole layers, for comparison with their pieces").kind(whole),
    ]
}

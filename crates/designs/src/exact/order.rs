//! Short lists of keys put in order.

use fearless_simd::{Simd, i32x8, prelude::*};

/// Keys that are ranked, at most: more are sorted.
pub(super) const CHUNK: usize = 128;

/// Keys that are compared at a time: in halves, of which machines with AVX-512, too, compare
/// more at a time.
const RANKED: usize = 16;

/// Tells of up to [`CHUNK`] keys, which stand in API order, how many of the others are
/// smaller: the place of each when they are sorted, but that of depths that differ in their
/// last bits only the later one comes first; whether the order is right is found out when the
/// layers are composited. This takes more comparisons than a sort, but sixteen at a time, and
/// none to be guessed.
#[inline(always)]
pub(super) fn rank_all<S: Simd>(simd: S, keys: &[u64], mut place: impl FnMut(usize, usize)) {
    let mut short = [i32::MAX; CHUNK];
    for (i, (short, key)) in short.iter_mut().zip(keys).enumerate() {
        let depth = (key >> 32) as u32 / CHUNK as u32;
        let key = depth * CHUNK as u32 + (CHUNK - 1 - i) as u32;
        // Signed, which all instruction sets compare.
        *short = (key ^ 1 << 31) as i32;
    }
    for (chunk, own) in short[..keys.len().next_multiple_of(RANKED)].chunks(RANKED).enumerate() {
        let own = [0, 8].map(|i| i32x8::from_slice(simd, &own[i..][..8]));
        let mut ranks = [i32x8::splat(simd, 0); 2];
        for other in &short[..keys.len()] {
            let other = i32x8::splat(simd, *other);
            for (ranks, own) in ranks.iter_mut().zip(own) {
                // A mask's ones are −1.
                *ranks -= own.simd_gt(other).to_vector();
            }
        }
        let first = chunk * RANKED;
        let mut list = [0; RANKED];
        for (list, ranks) in list.chunks_mut(8).zip(ranks) {
            ranks.store_slice(list);
        }
        for (i, rank) in list[..RANKED.min(keys.len() - first)].iter().enumerate() {
            place(first + i, *rank as usize % CHUNK);
        }
    }
}

/// Keeps the keys that are marked, without a branch that would be taken at random.
#[inline(always)]
pub(super) fn keep(keys: impl ExactSizeIterator<Item = (u64, bool)>, kept: &mut Vec<u64>) {
    kept.clear();
    kept.resize(keys.len(), 0);
    let mut count = 0;
    for (key, keep) in keys {
        kept[count] = key;
        count += usize::from(keep);
    }
    kept.truncate(count);
}

/// Sorts keys of which few are out of place, at best.
pub(super) fn sort_nearly_sorted(keys: &mut [u64]) {
    if keys.len() > CHUNK {
        keys.sort_unstable();
        return;
    }
    for end in 1..keys.len() {
        let key = keys[end];
        let mut place = end;
        while place > 0 && keys[place - 1] > key {
            keys[place] = keys[place - 1];
            place -= 1;
        }
        keys[place] = key;
    }
}

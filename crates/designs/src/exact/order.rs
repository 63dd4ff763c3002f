//! Short lists of keys put in order.

use fearless_simd::{Simd, i32x16, prelude::*};

/// Layers that are ranked and composited at a time.
pub(super) const CHUNK: usize = 128;

/// Up to [`CHUNK`] keys, which stand in API order, cut to 32 bits in `short`; padded
/// with large ones.
#[inline(always)]
pub(super) fn shorten<'a>(keys: &[u64], short: &'a mut [i32; CHUNK]) -> &'a [i32] {
    let padded = &mut short[..keys.len().next_multiple_of(RANKED)];
    for (i, (short, key)) in padded.iter_mut().zip(keys).enumerate() {
        let depth = (key >> 32) as u32 / CHUNK as u32;
        let key = depth * CHUNK as u32 + (CHUNK - 1 - i) as u32;
        // Signed, which all instruction sets compare.
        *short = (key ^ 1 << 31) as i32;
    }
    padded[keys.len()..].fill(i32::MAX);
    padded
}

/// Keys that are compared at a time.
const RANKED: usize = 16;

/// How many of the keys are smaller: the place of this one when they are sorted, but
/// that of depths that differ in their last bits only the later one comes first;
/// whether the order is right is found out when the layers are composited. This takes
/// more comparisons than a sort, but sixteen at a time, and none to be guessed.
#[inline(always)]
pub(super) fn rank<S: Simd>(simd: S, key: i32, short: &[i32]) -> usize {
    let key = i32x16::splat(simd, key);
    let mut rank = 0;
    for keys in short.chunks_exact(RANKED) {
        rank += i32x16::from_slice(simd, keys).simd_lt(key).to_bitmask().count_ones();
    }
    rank as usize
}

/// Keeps the keys that are marked, without a branch that would be taken at random.
#[inline(always)]
pub(super) fn keep(keys: impl Iterator<Item = (u64, bool)>, kept: &mut Vec<u64>) {
    let mut count = 0;
    for (key, keep) in keys {
        kept[count] = key;
        count += usize::from(keep);
    }
    kept.truncate(count);
}

/// Sorts keys of which few are out of place.
pub(super) fn insert_in_order(keys: &mut [u64]) {
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

//! Numbering a fragment's samples in the order of their stored depths.

use fearless_simd::Simd;

use crate::lanes::Lanes;

/// The number that a lane would have if it came last: ranks are counted down from
/// here, so that they are shifts that bring a bit to the front.
const LAST: i32 = 31;

/// For each lane of `among`, 31 minus how many others of `among` come before it: those
/// whose key is smaller, and of equal keys the earlier lanes. Modulo 2^32; the other
/// lanes hold anything.
///
/// Keys of `among` must exceed `i32::MIN`: one less than they are is compared.
#[inline(always)]
pub fn ranks<S: Simd, L: Lanes<S>>(simd: S, keys: L, words: &[i32], among: u64) -> L {
    if L::LEN <= 8 { of_all(simd, keys, among) } else { one_by_one(simd, keys, words, among) }
}

/// Every lane against every other one, without a branch.
#[inline(always)]
fn of_all<S: Simd, L: Lanes<S>>(simd: S, keys: L, among: u64) -> L {
    let less = keys.sub(L::splat(simd, 1));
    // What is not among them comes before nobody.
    let others = L::select(L::mask(simd, among), less, L::splat(simd, i32::MAX));
    let mut ranks = L::splat(simd, LAST);
    let mut words = [0; 8];
    others.store(&mut words[..L::LEN]);
    for (j, word) in words[..L::LEN].iter().enumerate() {
        // Lanes behind lane `j` come after it where keys are equal, too.
        let behind = L::mask(simd, !0 << j << 1);
        let mine = L::select(behind, keys, less);
        ranks = ranks.less_one_where_greater(mine, L::splat(simd, *word));
    }
    ranks
}

/// Every lane against those of `among`, one after the other.
#[inline(always)]
fn one_by_one<S: Simd, L: Lanes<S>>(simd: S, keys: L, words: &[i32], among: u64) -> L {
    // A window of as many words over this list: one in the lanes behind lane `j`.
    const LATER: [i32; 128] = {
        let mut list = [0; 128];
        let mut i = 64;
        while i < 128 {
            list[i] = 1;
            i += 1;
        }
        list
    };
    let mut ranks = L::splat(simd, LAST);
    let mut left = among;
    while left != 0 {
        let j = left.trailing_zeros() as usize % L::LEN;
        left &= left - 1;
        let later = L::load(simd, &LATER[63 - j..][..L::LEN]);
        let other = L::splat(simd, words[j]).sub(later);
        ranks = ranks.less_one_where_greater(keys, other);
    }
    ranks
}

/// [`ranks`] of keys of which no two are equal.
#[inline(always)]
pub fn ranks_of_distinct<S: Simd, L: Lanes<S>>(simd: S, keys: L, words: &[i32], among: u64) -> L {
    let mut ranks = L::splat(simd, LAST);
    let mut left = among;
    while left != 0 {
        let j = left.trailing_zeros() as usize % L::LEN;
        left &= left - 1;
        ranks = ranks.less_one_where_greater(keys, L::splat(simd, words[j]));
    }
    ranks
}

/// [`ranks`] of any keys whatever.
#[inline(always)]
pub fn ranks_of_any<S: Simd, L: Lanes<S>>(simd: S, keys: L, words: &[i32], among: u64) -> L {
    let mut ranks = L::splat(simd, LAST);
    let one = L::splat(simd, 1);
    let mut left = among;
    while left != 0 {
        let j = left.trailing_zeros() as usize % L::LEN;
        left &= left - 1;
        let other = L::splat(simd, words[j]);
        let beyond = L::bits(keys.greater(other));
        let equal_and_later = !L::bits(other.greater(keys)) & (!0 << j << 1);
        ranks = L::select(L::mask(simd, beyond | equal_and_later), ranks.sub(one), ranks);
    }
    ranks
}

/// [`ranks`] in the order of the lanes.
#[inline(always)]
pub fn in_sample_order<S: Simd, L: Lanes<S>>(simd: S, among: u64) -> L {
    L::splat(simd, LAST).sub(L::numbered(simd, among))
}

/// The lanes of `among` whose bit in `hits` is set, the bit of the one that comes
/// first the lowest.
#[inline(always)]
pub fn picked<S: Simd, L: Lanes<S>>(simd: S, hits: u64, ranks: L, among: L::Mask) -> L::Mask {
    let mut bits = L::splat(simd, hits as u32 as i32);
    if L::LEN > 32 {
        // Counted down from 31, the numbers from 32 on are negative.
        let upper = L::splat(simd, (hits >> 32) as u32 as i32);
        bits = L::select(ranks.negative(simd), upper, bits);
    }
    // Nothing to shift, rather than a mask at the end: that would be waited for.
    let bits = L::select(among, bits, L::splat(simd, 0));
    bits.shift_left_by(ranks).negative(simd)
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::*;
    use crate::lanes::{Count, Width, levels};
    use screendoor_trace::random::Stream;

    #[derive(Clone, Copy, PartialEq, Debug)]
    enum Order {
        Sorted,
        SortedAny,
        Lanes,
    }

    struct Case {
        keys: Vec<i32>,
        among: u64,
        hits: u64,
        order: Order,
    }

    #[inline(always)]
    fn by_vectors<S: Simd, L: Lanes<S>>(simd: S, case: &Case) -> u64 {
        let keys = L::load(simd, &case.keys);
        let ranks = match case.order {
            Order::Sorted => ranks(simd, keys, &case.keys, case.among),
            Order::SortedAny => ranks_of_any(simd, keys, &case.keys, case.among),
            Order::Lanes => in_sample_order(simd, case.among),
        };
        L::bits(picked(simd, case.hits, ranks, L::mask(simd, case.among)))
    }

    fn by_level<W: Width>(level: Level, case: &Case) -> u64 {
        crate::for_level!(level, simd => by_vectors::<_, W::Lanes<_>>(simd, case))
    }

    fn by_sorting(case: &Case) -> u64 {
        let mut lanes: Vec<usize> = (0..64).filter(|i| case.among >> i & 1 == 1).collect();
        if case.order != Order::Lanes {
            lanes.sort_by_key(|i| (case.keys[*i], *i));
        }
        let chosen = lanes.iter().enumerate().filter(|(n, _)| case.hits >> n & 1 == 1);
        chosen.fold(0, |mask, (_, i)| mask | 1 << i)
    }

    fn check<const N: usize>()
    where
        Count<N>: Width,
    {
        let mut random = Stream::new([N as u32]);
        let lanes = N.max(4);
        for round in 0..400 {
            // From all equal to all different, and the ends of the range.
            let kinds = 1 + random.below(1 << (round % 9));
            let least = i32::MIN + random.below(3) as i32;
            let mut key = || match random.below(kinds) {
                0 => i32::MAX,
                1 => least,
                other => (other as i32).wrapping_mul(0x1234_5677) | 1 << 8,
            };
            let keys: Vec<i32> = (0..lanes).map(|_| key()).collect();
            let mut word = || u64::from(random.word()) << 32 | u64::from(random.word());
            let all = u64::MAX >> (64 - N);
            let (among, hits) = ([all, word() & all, 1 << (word() % N as u64), 0], word());
            for order in [Order::Sorted, Order::SortedAny, Order::Lanes] {
                if order == Order::Sorted && least < i32::MIN + 1 {
                    continue;
                }
                for among in among {
                    let case = Case { keys: keys.clone(), among, hits, order };
                    for (_, level) in levels() {
                        let found = by_level::<Count<N>>(level, &case);
                        let Case { keys, .. } = &case;
                        let place = format!("{level:?} {order:?} {keys:?} {among:#x} {hits:#x}");
                        assert_eq!(found, by_sorting(&case), "{place}");
                    }
                }
            }
        }
    }

    #[test]
    fn ranks_are_those_of_sorting_at_every_count_and_level() {
        check::<1>();
        check::<2>();
        check::<4>();
        check::<8>();
        check::<16>();
        check::<32>();
        check::<64>();
    }
}

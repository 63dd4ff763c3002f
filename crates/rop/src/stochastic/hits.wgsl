// Twin of crates/rop/src/stochastic/fast/abreast/hits.rs, which has the proof: which numbers of a
// surface pass the opacity test, of all values of a pixel one hash.
// uses: opacity reference_value round

const HITS_ROUNDS: u32 = select(select(select(select(
    0u,
    1u, REFERENCE_LK2011_1),
    2u, REFERENCE_LK2011_2),
    3u, REFERENCE_LK2011_3),
    4u, REFERENCE_LK2011);
// The strata of up to 8 numbers take four bits each of one word.
const HITS_NESTED: bool = HITS_ROUNDS > 0u && SAMPLES > 1u && SAMPLES <= 8u;

// The lowest bit of each four.
const STRATA_ONES: u32 = 0x11111111u;
const STRATA_BITS: u32 = (min(SAMPLES, 8u) - 1u) * STRATA_ONES;
// The strata where numbers are added: their bits in reverse.
const STRATA_NUMBERS: u32 =
    select(select(0x00000010u, 0x00003120u, SAMPLES == 4u), 0x73516240u, SAMPLES == 8u);
// Where a value's stratum begins.
const STRATUM_AT: u32 = (32u - SAMPLES_LOG2) & 31u;
const BELOW_STRATUM: u32 = 0xffffffffu >> (SAMPLES_LOG2 & 31u);

// The strata of all numbers, and the bits that their values share.
struct Nested {
    strata: u32,
    lower: u32,
}

// A round of figure 4. Factors are even: a stratum is multiplied by the lowest three bits.
fn nested_round(n: Nested, factor: u32) -> Nested {
    let y = n.lower * factor;
    let twice = select(0u, (n.strata & (3u * STRATA_ONES)) << 1u, (factor & 2u) == 2u);
    let four_times = select(0u, (n.strata & STRATA_ONES) << 2u, (factor & 4u) == 4u);
    let product = (twice + four_times) & STRATA_BITS;
    let added = product + (y >> STRATUM_AT) * STRATA_ONES;
    return Nested(n.strata ^ (added & STRATA_BITS), (n.lower ^ y) & BELOW_STRATUM);
}

// Of each number the upper bit of four, set where it does not pass. `x` is the first number's value
// before it is hashed.
fn nested(x: u32, threshold: Threshold) -> u32 {
    let strata = (x >> STRATUM_AT) * STRATA_ONES + STRATA_NUMBERS;
    var n = nested_round(Nested(strata & STRATA_BITS, x & BELOW_STRATUM), 0x6c50b47cu);
    if HITS_ROUNDS > 1u {
        n = nested_round(n, 0xb82f1e52u);
    }
    if HITS_ROUNDS > 2u {
        n = nested_round(n, 0xc7afe638u);
    }
    if HITS_ROUNDS > 3u {
        n = nested_round(n, 0x8d22f6e6u);
    }
    // How many strata pass.
    let part = select(0u, 1u, n.lower < (threshold.low & BELOW_STRATUM));
    let passing = select((threshold.low >> STRATUM_AT) + part, SAMPLES, threshold.one);
    return n.strata + (8u - passing) * STRATA_ONES;
}

fn misses_number(misses: u32, number: u32) -> bool {
    return ((misses >> ((4u * number) & 31u)) & 8u) == 8u;
}

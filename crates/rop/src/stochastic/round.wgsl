// Rounds and methods of crates/rop/src/stochastic/methods.rs.
// uses: bindings random

struct Round {
    index: u32,
    // How many are stratified together, as a power of two.
    count_log2: u32,
    seed: u32,
}

const CORRECTED: bool = METHOD_ALPHA_CORRECTION || METHOD_DEPTH_CORRECTION;
const DEPTH_BASED: bool = METHOD_DEPTH || METHOD_DEPTH_CORRECTION;
const SAMPLES_LOG2: u32 = firstTrailingBit(SAMPLES);

// Methods::round.
fn round_of(number: u32) -> Round {
    if STRATA_ALL {
        return Round(number, ROUNDS_LOG2, params.seed);
    }
    return Round(0u, 0u, select(hash2(params.seed, number), params.seed, number == 0u));
}

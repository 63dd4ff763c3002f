// Twin of crates/rop/src/stochastic/comb.rs: reference values that are the teeth of a comb.
// uses: opacity random

fn comb(xi: u32, n: u32, threshold: Threshold) -> u32 {
    return xi + threshold.low * (n + 1u);
}

fn exchanges(xi: u32) -> u32 {
    return mix(xi & 0xffffu);
}

fn among(bits: u32, count: u32) -> u32 {
    return bits & ~((count & 1u) << ((count >> 1u) & 31u));
}

fn exchanged(n: u32, bits: u32) -> u32 {
    return n ^ ((bits >> (n >> 1u)) & 1u);
}

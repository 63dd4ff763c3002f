// Twin of crates/trace/src/random.rs: randomness as a pure function of its inputs.

fn mix(word: u32) -> u32 {
    var x = word;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

const GOLDEN: u32 = 0x9e3779b9u;

// One more word of a hash; a hash begins with GOLDEN.
fn hash_on(h: u32, word: u32) -> u32 {
    return mix((h ^ word) + GOLDEN);
}

fn hash2(a: u32, b: u32) -> u32 {
    return hash_on(hash_on(GOLDEN, a), b);
}

fn hash3(a: u32, b: u32, c: u32) -> u32 {
    return hash_on(hash2(a, b), c);
}

fn hash4(a: u32, b: u32, c: u32, d: u32) -> u32 {
    return hash_on(hash3(a, b, c), d);
}

fn scatter(seed: u32) -> u32 {
    return select(mix(seed ^ 0xe6fe3bebu), 0u, seed == 0u);
}

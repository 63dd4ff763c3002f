// Twin of crates/rop/src/stochastic/subset.rs: how likely random subsets of coverage bits are to be seen.

// 1 − (s)_t / (b)_t for t ≤ s, and 1 for t > s.
fn visible_stratified(b: u32, s: u32, t: u32) -> f32 {
    if t > s {
        return 1.0;
    }
    var hidden = 1.0;
    for (var i = 0u; i < t; i++) {
        hidden *= f32(s - i) / f32(b - i);
    }
    return 1.0 - hidden;
}

// 1 − ((b − t)/b)^(b − s).
fn visible_independent(b: u32, s: u32, t: u32) -> f32 {
    var hidden = 1.0;
    for (var i = 0u; i < b - s; i++) {
        hidden *= f32(b - t) / f32(b);
    }
    return 1.0 - hidden;
}

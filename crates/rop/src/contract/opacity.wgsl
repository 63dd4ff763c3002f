// Twin of crates/rop/src/contract/opacity.rs: the opacity test in integers.
// uses: arithmetic

// T = ⌈α·2^32⌉: its lower word, and whether it is 2^32.
struct Threshold {
    low: u32,
    one: bool,
}

fn threshold_of(alpha: f32) -> Threshold {
    let bits = bitcast<u32>(alpha);
    let exponent = (bits >> 23u) & 0xffu;
    let mantissa = (bits & 0x7fffffu) | (select(0u, 1u, exponent > 0u) << 23u);
    let up = max(exponent, 118u) - 118u;
    let down = min(118u - min(exponent, 118u), 31u);
    let whole = (mantissa + ((1u << down) - 1u)) >> down;
    return Threshold(whole << up, exponent >= 127u);
}

fn passes(threshold: Threshold, x: u32) -> bool {
    return threshold.one || x < threshold.low;
}

// Threshold::of_many: ⌊α·count + ξ⌋ for ξ = x/2^32.
fn of_many(threshold: Threshold, count: u32, x: u32) -> u32 {
    if threshold.one {
        return count;
    }
    let low = threshold.low * count;
    return multiply_high(threshold.low, count) + select(0u, 1u, low + x < low);
}

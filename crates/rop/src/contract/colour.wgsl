// Twin of crates/rop/src/contract/colour.rs: colours as they are stored. In integers, as drivers round
// to half precision as they like. CHANNEL_BITS is the width of a channel.
// uses: arithmetic

// ColourStore::channel.
fn stored(x: f32) -> f32 {
    if CHANNEL_BITS == 8u {
        let whole = floor(rounded(clamp(x, 0.0, 1.0) * 255.0) + 0.5);
        // A 255th of it, rounded once: devices may divide less exactly. The first product
        // is exact.
        let share = whole * bitcast<f32>(0x3b808000u);
        return share + rounded(whole * bitcast<f32>(0x33808081u));
    }
    if CHANNEL_BITS == 16u {
        return half_of(x);
    }
    return x;
}

fn stored3(x: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(stored(x.x), stored(x.y), stored(x.z));
}

// The nearest value of half precision, of two the even one; what is greater than all is
// the greatest.
fn half_of(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let sign = bits & 0x80000000u;
    let magnitude = min(bits & 0x7fffffffu, 0x477fe000u);
    // Above the least normal number the last 13 bits go; below, all that is less than
    // 2^-24, of which a number has as many as its exponent lies below 2^-14.
    let exponent = magnitude >> 23u;
    if exponent < 102u {
        // Less than half of the least number.
        return bitcast<f32>(sign);
    }
    let dropped = 13u + select(0u, 113u - exponent, exponent < 113u);
    if dropped > 23u {
        // From half of the least number to it; half itself goes to 0, which is even.
        let least = select(0x33800000u, 0u, magnitude == 0x33000000u);
        return bitcast<f32>(sign | least);
    }
    let last = (magnitude >> dropped) & 1u;
    let up = magnitude + ((1u << (dropped - 1u)) - 1u) + last;
    let kept = (up >> dropped) << dropped;
    return bitcast<f32>(sign | kept);
}

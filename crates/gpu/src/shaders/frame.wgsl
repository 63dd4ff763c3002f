// Twin of crates/rop/src/contract/frame.rs: where samples lie, and depths there.
// uses: fragment

// The samples' places, and what else the design asked for.
@group(0) @binding(2) var<storage, read> tables: array<u32>;

// Where sample s lies, in 1/16 pixel from the pixel's centre.
fn sample_position(s: u32) -> vec2<i32> {
    let word = bitcast<i32>(tables[s]);
    return vec2<i32>((word << 16u) >> 16u, word >> 16u);
}

// Frame::depths, of one sample.
fn sample_depth(f: Fragment, s: u32, bits: u32) -> u32 {
    return narrowed(depth_at(f, sample_position(s)), bits);
}

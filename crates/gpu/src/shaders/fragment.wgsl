// Twin of crates/trace/src/trace/fragment.rs and of what crates/trace/src/trace/batch.rs makes of columns.
// uses: bindings mask

struct Fragment {
    coverage: Mask,
    z: u32,
    dzdx: i32,
    dzdy: i32,
    colour: vec3<f32>,
    alpha: f32,
    primitive: u32,
    object: u32,
}

fn fragment(row: u32) -> Fragment {
    return Fragment(
        coverage(row),
        column_word(params.z, Z_BYTES, row),
        bitcast<i32>(column_word(params.dzdx, DZDX_BYTES, row)),
        bitcast<i32>(column_word(params.dzdy, DZDY_BYTES, row)),
        colour(row),
        bitcast<f32>(column_word(params.alpha, ALPHA_BYTES, row)),
        column_word(params.primitive, PRIMITIVE_BYTES, row),
        column_word(params.object, OBJECT_BYTES, row),
    );
}

fn colour(row: u32) -> vec3<f32> {
    return vec3<f32>(
        channel(params.r, R_BYTES, row),
        channel(params.g, G_BYTES, row),
        channel(params.b, B_BYTES, row),
    );
}

// The samples of the frame that a fragment covers.
fn coverage(row: u32) -> Mask {
    let low = column_word(params.coverage, COVERAGE_BYTES, row);
    var high = 0u;
    if COVERAGE_BYTES == 8u {
        high = column_high(params.coverage, row);
    } else if COVERAGE_BYTES == 0u {
        high = params.coverage.high;
    }
    return mask_of(low, high) & mask_of(params.samples_low, params.samples_high);
}

// A value of up to four bytes, or the lower word of eight. Where a column has no bytes its
// value is the same in every row.
fn column_word(column: Column, bytes: u32, row: u32) -> u32 {
    switch bytes {
        case 0u: { return column.low; }
        case 1u: { return (columns[column.at + (row >> 2u)] >> ((row & 3u) * 8u)) & 0xffu; }
        case 2u: { return (columns[column.at + (row >> 1u)] >> ((row & 1u) * 16u)) & 0xffffu; }
        case 4u: { return columns[column.at + row]; }
        default: { return columns[column.at + row * 2u]; }
    }
}

fn column_high(column: Column, row: u32) -> u32 {
    return columns[column.at + row * 2u + 1u];
}

// A colour's channel. Constants are kept in single precision.
fn channel(column: Column, bytes: u32, row: u32) -> f32 {
    let word = column_word(column, bytes, row);
    if bytes == 2u {
        return widen(word);
    }
    return bitcast<f32>(word);
}

// A finite half-precision value in single precision, exactly: without an operation on
// denormal numbers, which a device may take for 0.
fn widen(bits: u32) -> f32 {
    let sign = (bits & 0x8000u) << 16u;
    let magnitude = bits & 0x7fffu;
    if magnitude < 0x400u {
        let small = f32(magnitude) * 5.9604644775390625e-8;
        return bitcast<f32>(bitcast<u32>(small) | sign);
    }
    return bitcast<f32>(((magnitude << 13u) + 0x38000000u) | sign);
}

// DepthPlane::at: z + ⌊(dzdx·x + dzdy·y) / 16⌋, clamped to the depth range. Slopes are cut
// into multiples of 16 and what is left, so that all but the sum fits into a word.
fn depth_at(f: Fragment, offset: vec2<i32>) -> u32 {
    let left = (f.dzdx & 15) * offset.x + (f.dzdy & 15) * offset.y;
    let a = (f.dzdx >> 4u) * offset.x;
    let b = (f.dzdy >> 4u) * offset.y + (left >> 4u);
    // z + a + b in two words.
    let first = f.z + bitcast<u32>(a);
    let sum = first + bitcast<u32>(b);
    let high = (a >> 31u) + (b >> 31u) + i32(first < f.z) + i32(sum < first);
    return select(select(sum, 0xffffffffu, high > 0), 0u, high < 0);
}

// Unorm32::narrowed, for stored depths of `bits` bits.
fn narrowed(z: u32, bits: u32) -> u32 {
    return z | ((1u << ((32u - bits) & 31u)) - 1u);
}

// Where sample s lies, in 1/16 pixel from the pixel's centre.
fn sample_position(s: u32) -> vec2<i32> {
    let word = bitcast<i32>(tables[s]);
    return vec2<i32>((word << 16u) >> 16u, word >> 16u);
}

// Frame::depths, of one sample.
fn sample_depth(f: Fragment, s: u32, bits: u32) -> u32 {
    return narrowed(depth_at(f, sample_position(s)), bits);
}

// TileGrid::tile, of a row's pixel.
fn tile_at(row: u32) -> u32 {
    let x = column_word(params.x, X_BYTES, row);
    let y = column_word(params.y, Y_BYTES, row);
    return (y >> 4u) * params.tile_columns + (x >> 4u);
}

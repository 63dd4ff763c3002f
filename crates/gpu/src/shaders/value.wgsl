// Values of columns, as the loaders of each column ask for them: twin of
// crates/trace/src/trace/cells.rs.
// uses: bindings

// A value of up to four bytes, or the lower word of eight. Where a column has no bytes its
// value is the same in every row.
fn load_word(column: Column, bytes: u32, row: u32) -> u32 {
    switch bytes {
        case 0u: { return column.low; }
        case 1u: { return (columns[column.at + (row >> 2u)] >> ((row & 3u) * 8u)) & 0xffu; }
        case 2u: { return (columns[column.at + (row >> 1u)] >> ((row & 1u) * 16u)) & 0xffffu; }
        case 4u: { return columns[column.at + row]; }
        default: { return columns[column.at + row * 2u]; }
    }
}

// A mask of up to eight bytes, the lower word first.
fn load_mask(column: Column, bytes: u32, row: u32) -> vec2<u32> {
    var high = 0u;
    if bytes == 8u {
        high = columns[column.at + row * 2u + 1u];
    } else if bytes == 0u {
        high = column.high;
    }
    return vec2<u32>(load_word(column, bytes, row), high);
}

// A real number. Constants are kept in single precision.
fn load_real(column: Column, bytes: u32, row: u32) -> f32 {
    let word = load_word(column, bytes, row);
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

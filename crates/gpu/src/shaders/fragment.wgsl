// Twin of crates/trace/src/trace/fragment.rs.
// uses: bindings loaders mask

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
        column_z(row),
        column_dzdx(row),
        column_dzdy(row),
        colour(row),
        column_alpha(row),
        column_primitive(row),
        column_object(row),
    );
}

fn colour(row: u32) -> vec3<f32> {
    return vec3<f32>(column_r(row), column_g(row), column_b(row));
}

// The samples of the frame that a fragment covers.
fn coverage(row: u32) -> Mask {
    let mask = column_coverage(row);
    return mask_of(mask.x, mask.y) & mask_of(params.samples_low, params.samples_high);
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

// TileGrid::tile, of a row's pixel.
fn tile_at(row: u32) -> u32 {
    let x = column_x(row);
    let y = column_y(row);
    return (y >> 4u) * params.tile_columns + (x >> 4u);
}

// Twin of crates/rop/src/stochastic/pixel_order.rs: numbering the pixels of a frame.
// uses: bindings

fn pixel_index(x: u32, y: u32) -> u32 {
    if PIXEL_ORDER_MORTON {
        return spread(x) | (spread(y) << 1u);
    }
    if PIXEL_ORDER_SCANLINE {
        return (y << min(params.side_bits, 16u)) + x;
    }
    return hilbert(x, y, params.side_bits);
}

fn hilbert(column: u32, row: u32, bits: u32) -> u32 {
    var x = column;
    var y = row;
    var distance = 0u;
    for (var bit = bits; bit > 0u; bit--) {
        let right = (x >> (bit - 1u)) & 1u;
        let down = (y >> (bit - 1u)) & 1u;
        if down == 0u {
            if right == 1u {
                x = ~x;
                y = ~y;
            }
            let swapped = x;
            x = y;
            y = swapped;
        }
        distance = (distance << 2u) | ((3u * right) ^ down);
    }
    return distance;
}

fn spread(v: u32) -> u32 {
    let a = (v | (v << 8u)) & 0x00ff00ffu;
    let b = (a | (a << 4u)) & 0x0f0f0f0fu;
    let c = (b | (b << 2u)) & 0x33333333u;
    return (c | (c << 1u)) & 0x55555555u;
}

// Twin of crates/rop/src/stochastic/reference_value.rs: opacity reference values.
// uses: random

struct ReferenceKey {
    pixel: u32,
    surface: u32,
    seed: u32,
}

// The reference value of sample number n of a pixel with 2^samples_log2 samples, by the
// method that the parameter names.
fn reference_value(n: u32, samples_log2: u32, key: ReferenceKey) -> u32 {
    if REFERENCE_WHITE {
        return hash4(key.seed, key.pixel, key.surface, n);
    }
    let placed = place(n, samples_log2, key);
    return scramble(placed.x, placed.y);
}

fn scramble(x: u32, s: u32) -> u32 {
    if REFERENCE_VEGDAHL_V2 {
        return scramble_vegdahl_v2(x, s);
    }
    if REFERENCE_VEGDAHL {
        return scramble_vegdahl(x, s);
    }
    if REFERENCE_OWEN {
        return scramble_owen(x, s);
    }
    if REFERENCE_SOBOL {
        return scramble_sobol(x + s);
    }
    if REFERENCE_RADICAL_INVERSE {
        return x + s;
    }
    return scramble_lk2011(x + s);
}

fn prehashed(key: ReferenceKey) -> ReferenceKey {
    return ReferenceKey(key.pixel, prehash(key.surface + scatter(key.seed)), 0u);
}

fn prehash(n: u32) -> u32 {
    return mix(n ^ 0xe6fe3bebu);
}

// The reversed bits of the place in the sequence, and the seed. Samples are a power of two
// and n is less, so that the index needs no carry.
fn place(n: u32, samples_log2: u32, key: ReferenceKey) -> vec2<u32> {
    let low = (key.pixel << samples_log2) | n;
    let high = select(0u, key.pixel >> ((32u - samples_log2) & 31u), samples_log2 > 0u);
    return vec2<u32>(reverseBits(low), key.surface + scatter(key.seed) + scatter(high));
}

fn scramble_lk2011(seeded: u32) -> u32 {
    var x = seeded;
    x ^= x * 0x6c50b47cu;
    if REFERENCE_LK2011_1 {
        return x;
    }
    x ^= x * 0xb82f1e52u;
    if REFERENCE_LK2011_2 {
        return x;
    }
    x ^= x * 0xc7afe638u;
    if REFERENCE_LK2011_3 {
        return x;
    }
    return x ^ (x * 0x8d22f6e6u);
}

fn scramble_vegdahl_v2(index: u32, s: u32) -> u32 {
    var x = index + s;
    x ^= 0xdc967795u;
    x *= 0x97b754b7u;
    x ^= 0x866350b1u;
    return x * 0x9e3779cdu;
}

fn scramble_vegdahl(index: u32, s: u32) -> u32 {
    var x = index;
    x ^= x * 0x3d20adeau;
    x += s;
    x *= (s >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ (x * 0x53a22864u);
}

fn scramble_owen(x: u32, s: u32) -> u32 {
    var scrambled = x;
    for (var b = 0u; b < 32u; b++) {
        let below = x & ((1u << b) - 1u);
        scrambled ^= (hash3(s, b, below) & 1u) << b;
    }
    return scrambled;
}

fn scramble_sobol(x: u32) -> u32 {
    var direction = 0x80000000u;
    var result = 0u;
    for (var bit = 32u; bit > 0u; bit--) {
        if ((x >> (bit - 1u)) & 1u) == 1u {
            result ^= direction;
        }
        direction ^= direction >> 1u;
    }
    return result;
}

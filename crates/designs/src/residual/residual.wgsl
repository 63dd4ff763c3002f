// Twin of crates/designs/src/residual/mod.rs and errors.rs: samples less the error that chance
// makes of them.
// uses: comb dither opacity over_opaque pixel_order random replay resolve stochastic

const POINT: u32 = 20u;
const MASS: u32 = 15u;
const PARTS: u32 = select(1u, SAMPLES, PER_SAMPLE);
const ROOM: u32 = LAYERS + 1u;
const SAMPLES_OF_PART_LOG2: u32 = firstTrailingBit(SAMPLES / PARTS);
// Binary digits below a stored sum's last, and the greatest that is stored.
const BELOW: u32 = select(
    select(POINT - 6u + SAMPLES_OF_PART_LOG2, POINT - 12u + SAMPLES_OF_PART_LOG2, ERRORS_16),
    0u,
    ERRORS_32,
);
const GREATEST: i32 = select(127, 32767, ERRORS_16);
const ROUNDING: u32 = 0x0d174e12u;
// Colours less the background's are cut there.
const MOST: f32 = f32((1u << 29u) / SAMPLES);

var<private> pixel_id: u32;
var<private> fragments: u32;
// From near to far.
var<private> entries: u32;
var<private> entry_z: array<u32, ROOM>;
var<private> entry_mass: array<u32, ROOM>;
var<private> sums: array<vec4<i32>, ROOM * PARTS>;

fn sampler_clear() {
    state_put(AT_FRAGMENTS, 0u);
    state_put(AT_ENTRIES, 0u);
}

fn sampler_load() {
    pixel_id = pixel_index(site.x, site.y);
    fragments = state_word(AT_FRAGMENTS);
    entries = state_word(AT_ENTRIES);
    for (var i = 0u; i < entries; i++) {
        entry_z[i] = state_word(AT_ERROR_DEPTH + i);
        entry_mass[i] = state_word(AT_ERROR_MASS + i);
    }
    for (var i = 0u; i < entries * PARTS; i++) {
        for (var j = 0u; j < 4u; j++) {
            sums[i][j] = bitcast<i32>(state_word(AT_ERROR_SUMS + 4u * i + j));
        }
    }
}

fn sampler_store() {
    state_put(AT_FRAGMENTS, fragments);
    state_put(AT_ENTRIES, entries);
    for (var i = 0u; i < entries; i++) {
        state_put(AT_ERROR_DEPTH + i, entry_z[i]);
        state_put(AT_ERROR_MASS + i, entry_mass[i]);
    }
    for (var i = 0u; i < entries * PARTS; i++) {
        for (var j = 0u; j < 4u; j++) {
            state_put(AT_ERROR_SUMS + 4u * i + j, bitcast<u32>(sums[i][j]));
        }
    }
}

// errors::share: a threshold's product, to nearest, halves upwards.
fn share(threshold: Threshold, x: i32) -> i32 {
    if threshold.one {
        return x;
    }
    let word = bitcast<u32>(x);
    let high = multiply_high(threshold.low, word) - select(0u, threshold.low, x < 0);
    return bitcast<i32>(high + ((threshold.low * word) >> 31u));
}

fn share4(threshold: Threshold, x: vec4<i32>) -> vec4<i32> {
    return vec4<i32>(
        share(threshold, x.x),
        share(threshold, x.y),
        share(threshold, x.z),
        share(threshold, x.w),
    );
}

// errors::shown: a coverage times a colour, as long as a word holds it.
fn shown(coverage: i32, colour: i32) -> i32 {
    let a = bitcast<u32>(coverage);
    let b = bitcast<u32>(colour);
    let high = multiply_high(a, b) - select(0u, b, coverage < 0) - select(0u, a, colour < 0);
    let product = a * b;
    let low = product + (1u << (POINT - 1u));
    let upper = bitcast<i32>(high + select(0u, 1u, low < product));
    let most = 1 << (POINT - 1u);
    if upper >= most {
        return 0x7fffffff;
    }
    if upper < -most {
        return bitcast<i32>(0x80000000u);
    }
    return bitcast<i32>((bitcast<u32>(upper) << (32u - POINT)) | (low >> POINT));
}

fn saturating_add(a: i32, b: i32) -> i32 {
    let sum = a + b;
    if ((a ^ sum) & (b ^ sum)) < 0 {
        return select(0x7fffffff, bitcast<i32>(0x80000000u), a < 0);
    }
    return sum;
}

fn saturating_add4(a: vec4<i32>, b: vec4<i32>) -> vec4<i32> {
    return vec4<i32>(
        saturating_add(a.x, b.x),
        saturating_add(a.y, b.y),
        saturating_add(a.z, b.z),
        saturating_add(a.w, b.w),
    );
}

fn saturating_negative(x: i32) -> i32 {
    return select(-x, 0x7fffffff, x == bitcast<i32>(0x80000000u));
}

// errors::of_pixel: the threshold times the share of the pixel that is covered.
fn of_pixel(threshold: Threshold, covered: u32) -> Threshold {
    if covered == SAMPLES {
        return threshold;
    }
    let up = (32u - SAMPLES_LOG2) & 31u;
    if threshold.one {
        return Threshold(covered << up, false);
    }
    let high = multiply_high(threshold.low, covered);
    return Threshold((high << up) | ((threshold.low * covered) >> SAMPLES_LOG2), false);
}

fn mass_of(threshold: Threshold) -> u32 {
    return select(threshold.low >> (32u - MASS), 1u << MASS, threshold.one);
}

// ResidualSampler::fixed.
fn fixed(colour: vec3<f32>) -> vec4<i32> {
    let scaled = (colour - params.background) * f32(1u << POINT);
    let whole = vec3<i32>(clamp(scaled, vec3<f32>(-MOST), vec3<f32>(MOST)));
    return vec4<i32>(whole, 1 << POINT);
}

// What a sample holds.
fn held(s: u32) -> vec3<f32> {
    if winner[s] == NO_ROW {
        return state_colour(AT_COLOUR + 3u * s);
    }
    return stored3(colour(winner[s]));
}

fn copy_entry(place: u32, source: u32) {
    entry_z[place] = entry_z[source];
    entry_mass[place] = entry_mass[source];
    for (var part = 0u; part < PARTS; part++) {
        sums[place * PARTS + part] = sums[source * PARTS + part];
    }
}

// Store::attenuate: the place of the fragment's own entry.
fn attenuate(z: u32, coverage: Mask, threshold: Threshold, x: vec4<i32>) -> u32 {
    var place = 0u;
    while place < entries && entry_z[place] < z {
        place += 1u;
    }
    for (var i = entries; i > place; i--) {
        copy_entry(i, i - 1u);
    }
    entries += 1u;
    let whole = of_pixel(threshold, mask_count(coverage));
    let mass = mass_of(whole);
    for (var i = place + 1u; i < entries; i++) {
        entry_mass[i] -= (entry_mass[i] * mass) >> MASS;
    }
    entry_z[place] = z;
    entry_mass[place] = mass;
    for (var part = 0u; part < PARTS; part++) {
        var of_part = whole;
        if PER_SAMPLE {
            of_part = threshold;
            if !mask_contains(coverage, part) {
                of_part = Threshold(0u, false);
            }
        }
        var front = 0;
        for (var i = 0u; i < place; i++) {
            front = saturating_add(front, sums[i * PARTS + part].w);
        }
        let hidden = share(of_part, front);
        sums[place * PARTS + part] = vec4<i32>(
            saturating_negative(shown(hidden, x.x)),
            saturating_negative(shown(hidden, x.y)),
            saturating_negative(shown(hidden, x.z)),
            saturating_negative(shown(hidden, x.w)),
        );
        for (var i = place + 1u; i < entries; i++) {
            let at = i * PARTS + part;
            sums[at] -= share4(of_part, sums[at]);
        }
    }
    return place;
}

// Store::make_room: the place of what was at `own`.
fn make_room(own: u32) -> u32 {
    if entries <= LAYERS {
        return own;
    }
    var least = 0u;
    var least_cost = 0xffffffffu;
    for (var i = 0u; i + 1u < entries; i++) {
        let near = entry_mass[i];
        let far = entry_mass[i + 1u];
        let reduced = near * far / max(near + far, 1u);
        let gap = entry_z[i + 1u] - entry_z[i];
        let cost = reduced * (gap >> 16u) + ((reduced * (gap & 0xffffu)) >> 16u);
        if cost < least_cost {
            least = i;
            least_cost = cost;
        }
    }
    // errors::centre.
    let both = entry_mass[least] + entry_mass[least + 1u];
    let odds = (entry_mass[least + 1u] << MASS) / max(both, 1u);
    let gap = entry_z[least + 1u] - entry_z[least];
    entry_z[least] += (gap >> MASS) * odds + (((gap & ((1u << MASS) - 1u)) * odds) >> MASS);
    entry_mass[least] = min(both, 0xffffu);
    for (var part = 0u; part < PARTS; part++) {
        let at = least * PARTS + part;
        sums[at] = saturating_add4(sums[at], sums[at + PARTS]);
    }
    entries -= 1u;
    for (var i = least + 1u; i < entries; i++) {
        copy_entry(i, i + 1u);
    }
    return select(own, own - 1u, own > least);
}

// Store::nearest: the entry nearest to a stored depth.
fn nearest(z: u32) -> u32 {
    var best = 0u;
    var least = 0xffffffffu;
    for (var i = 0u; i < entries; i++) {
        let distance = max(entry_z[i], z) - min(entry_z[i], z);
        if i == 0u || distance < least {
            best = i;
            least = distance;
        }
    }
    return best;
}

// Store::round.
fn round_sums(xi: u32) {
    let first = hash2(xi, ROUNDING);
    for (var i = 0u; i < entries * PARTS; i++) {
        for (var j = 0u; j < 4u; j++) {
            var dither = 1u << ((BELOW - 1u) & 31u);
            if ERRORS_8 {
                dither = (first + GOLDEN * (4u * i + j)) >> ((32u - BELOW) & 31u);
            }
            let whole = saturating_add(sums[i][j], bitcast<i32>(dither)) >> (BELOW & 31u);
            sums[i][j] = clamp(whole, -GREATEST, GREATEST) << (BELOW & 31u);
        }
    }
}

// Sampler::choose.
fn choose(round: Round, passed: Mask, f: Fragment) -> Mask {
    let threshold = threshold_of(f.alpha);
    let key = ReferenceKey(pixel_id, fragments, round.seed);
    fragments += 1u;
    let xi = dither_in_round(site.x, site.y, key, round.index, round.count_log2);
    // choice::Pairs.
    let pairs = exchanges(xi);
    places_begin(passed, SORT);
    var written = MASK_NONE;
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(passed, s) {
            let place = place_among(passed, s, SORT);
            var value = comb(xi, exchanged(place, pairs), threshold);
            if DRAWN_HASHED {
                value = reference_value(place, SAMPLES_LOG2, key);
            }
            if passes(threshold, value) {
                written |= mask_bit(s);
            }
        }
    }

    // The depth at the lowest sample that is covered.
    var lowest = 0u;
    while lowest + 1u < SAMPLES && !mask_contains(f.coverage, lowest) {
        lowest += 1u;
    }
    let x = fixed(stored3(f.colour));
    let z = sample_depth(f, lowest, DEPTH_BUFFER_BITS);
    let own = make_room(attenuate(z, f.coverage, threshold, x));

    // What comes, less what goes, if all that passed were written, and what is.
    for (var part = 0u; part < PARTS; part++) {
        for (var i = 0u; i < entries; i++) {
            var all = vec4<i32>(0);
            var some = vec4<i32>(0);
            let first = select(0u, part, PER_SAMPLE);
            let last = select(SAMPLES, part + 1u, PER_SAMPLE);
            for (var s = first; s < last; s++) {
                if !mask_contains(passed, s) {
                    continue;
                }
                var change = vec4<i32>(0);
                if i == own {
                    change += x;
                }
                if depth[s] != FAR && i == nearest(depth[s]) {
                    change -= fixed(held(s));
                }
                all += change;
                if mask_contains(written, s) {
                    some += change;
                }
            }
            let at = i * PARTS + part;
            sums[at] = saturating_add4(sums[at], some - share4(threshold, all));
        }
    }
    if BELOW > 0u {
        round_sums(xi);
    }
    return written;
}

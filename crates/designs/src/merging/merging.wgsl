// Twin of crates/designs/src/merging/mod.rs and sheet.rs: layers with masks and depth planes; of one too many, the
// two neighbours become one whose merging changes the picture least.
// uses: colour frame over_opaque random replay

struct Sheet {
    plane: vec3<u32>,
    // The plane's depth at the middle of the samples that are covered.
    depth: u32,
    coverage: Mask,
    colour: vec3<f32>,
    alpha: f32,
}

struct Shown {
    near: f32,
    far: f32,
    covered: u32,
    spread: f32,
}

const ROOM: u32 = LAYERS + 1u;

var<private> sheet_count: u32;
var<private> sheets: array<Sheet, ROOM>;

fn inner_clear() {
    state_put(AT_SHEET_COUNT, 0u);
}

fn inner_load() {
    sheet_count = state_word(AT_SHEET_COUNT);
    for (var i = 0u; i < sheet_count; i++) {
        let at = AT_SHEET_PLANE + 3u * i;
        sheets[i] = Sheet(
            vec3<u32>(state_word(at), state_word(at + 1u), state_word(at + 2u)),
            state_word(AT_SHEET_DEPTH + i),
            state_mask(AT_SHEET_MASK + MASK_WORDS * i),
            state_colour(AT_SHEET_COLOUR + 3u * i),
            state_real(AT_SHEET_ALPHA + i),
        );
    }
}

fn inner_store() {
    state_put(AT_SHEET_COUNT, sheet_count);
    for (var i = 0u; i < sheet_count; i++) {
        for (var c = 0u; c < 3u; c++) {
            state_put(AT_SHEET_PLANE + 3u * i + c, sheets[i].plane[c]);
        }
        state_put(AT_SHEET_DEPTH + i, sheets[i].depth);
        state_put_mask(AT_SHEET_MASK + MASK_WORDS * i, sheets[i].coverage);
        state_put_colour(AT_SHEET_COLOUR + 3u * i, sheets[i].colour);
        state_put_real(AT_SHEET_ALPHA + i, sheets[i].alpha);
    }
}

fn inner_end_pass(number: u32) {}

// merging::slope.
fn slope(v: i32) -> i32 {
    let size = select(bitcast<u32>(v), 0u - bitcast<u32>(v), v < 0);
    let bits = 32u - countLeadingZeros(size);
    let shift = max(bits, 10u) - 10u;
    let half = (1u << shift) >> 1u;
    var sum = size + half;
    if sum < size {
        sum = 0xffffffffu;
    }
    let kept = min((sum >> shift) << shift, 0x7fffffffu);
    return select(bitcast<i32>(kept), -bitcast<i32>(kept), v < 0);
}

// merging::SHARES: compilers divide these to nearest, devices need not.
const SHARES: array<f32, 65> = array<f32, 65>(
    0.0, 1.0 / 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0, 1.0 / 8.0,
    1.0 / 9.0, 1.0 / 10.0, 1.0 / 11.0, 1.0 / 12.0, 1.0 / 13.0, 1.0 / 14.0, 1.0 / 15.0,
    1.0 / 16.0, 1.0 / 17.0, 1.0 / 18.0, 1.0 / 19.0, 1.0 / 20.0, 1.0 / 21.0, 1.0 / 22.0,
    1.0 / 23.0, 1.0 / 24.0, 1.0 / 25.0, 1.0 / 26.0, 1.0 / 27.0, 1.0 / 28.0, 1.0 / 29.0,
    1.0 / 30.0, 1.0 / 31.0, 1.0 / 32.0, 1.0 / 33.0, 1.0 / 34.0, 1.0 / 35.0, 1.0 / 36.0,
    1.0 / 37.0, 1.0 / 38.0, 1.0 / 39.0, 1.0 / 40.0, 1.0 / 41.0, 1.0 / 42.0, 1.0 / 43.0,
    1.0 / 44.0, 1.0 / 45.0, 1.0 / 46.0, 1.0 / 47.0, 1.0 / 48.0, 1.0 / 49.0, 1.0 / 50.0,
    1.0 / 51.0, 1.0 / 52.0, 1.0 / 53.0, 1.0 / 54.0, 1.0 / 55.0, 1.0 / 56.0, 1.0 / 57.0,
    1.0 / 58.0, 1.0 / 59.0, 1.0 / 60.0, 1.0 / 61.0, 1.0 / 62.0, 1.0 / 63.0, 1.0 / 64.0,
);

fn share_of(n: u32) -> f32 {
    return SHARES[n];
}

fn depth_in_middle(plane: vec3<u32>, coverage: Mask) -> u32 {
    var sum = vec2<i32>(0);
    for (var s = 0u; s < SAMPLES; s++) {
        if mask_contains(coverage, s) {
            sum += sample_position(s);
        }
    }
    var f: Fragment;
    f.z = plane.x;
    f.dzdx = bitcast<i32>(plane.y);
    f.dzdy = bitcast<i32>(plane.z);
    return depth_at(f, sum / i32(max(mask_count(coverage), 1u)));
}

fn sheet_of(f: Fragment) -> Sheet {
    var plane = vec3<u32>(f.z, bitcast<u32>(slope(f.dzdx)), bitcast<u32>(slope(f.dzdy)));
    let depth = depth_in_middle(plane, f.coverage);
    if !SLOPES {
        plane = vec3<u32>(depth, 0u, 0u);
    }
    return Sheet(plane, depth, f.coverage, stored3(f.colour), stored(f.alpha));
}

// Shown::of: of the samples that either covers, those that show the near one and those that
// show the far one through it, and by how much opacity varies.
fn shown_by(a: Sheet, b: Sheet) -> Shown {
    let both = f32(mask_count(a.coverage & b.coverage));
    let first = f32(mask_count(a.coverage)) - both;
    let second = f32(mask_count(b.coverage)) - both;
    let behind = rounded((1.0 - a.alpha) * b.alpha);
    let near = rounded(a.alpha * (first + both));
    let far = rounded(b.alpha * second) + rounded(behind * both);
    let covered = mask_count(a.coverage | b.coverage);
    let mean = rounded((near + far) * share_of(covered));
    let of_first = a.alpha - mean;
    let of_second = b.alpha - mean;
    let of_both = (a.alpha + behind) - mean;
    let spread = rounded(rounded(of_first * of_first) * first)
        + rounded(rounded(of_second * of_second) * second);
    return Shown(near, far, covered, rounded(spread) + rounded(rounded(of_both * of_both) * both));
}

fn merged_sheet(a: Sheet, b: Sheet, word: u32) -> Sheet {
    let shown = shown_by(a, b);
    let sum = shown.near + shown.far;
    var first = shown.near >= shown.far;
    if PLACE_RANDOM {
        first = rounded(f32(word >> 8u) * (1.0 / 16777216.0)) * sum < shown.near;
    }
    var plane = b.plane;
    if first {
        plane = a.plane;
    }
    let coverage = a.coverage | b.coverage;
    var colour = a.colour;
    if sum > 0.0 {
        colour = (rounded3(a.colour * shown.near) + rounded3(b.colour * shown.far)) / sum;
    }
    let alpha = min(rounded(sum * share_of(shown.covered)), 1.0);
    return Sheet(plane, depth_in_middle(plane, coverage), coverage, stored3(colour), stored(alpha));
}

fn cheapest() -> u32 {
    let range = f32(max(sheets[sheet_count - 1u].depth - sheets[0].depth, 1u));
    var best = 0u;
    var least = 0.0;
    var through = 1.0;
    for (var i = 0u; i + 1u < sheet_count; i++) {
        let shown = shown_by(sheets[i], sheets[i + 1u]);
        let gap = f32(sheets[i + 1u].depth - sheets[i].depth);
        let apart = rounded(rounded(rounded(shown.near * shown.far) * gap) * 6.0);
        let uneven = rounded(rounded(f32(shown.covered) * shown.spread) * range);
        let cost = rounded((apart + uneven) * rounded(through * through));
        if i == 0u || cost < least {
            best = i;
            least = cost;
        }
        let share = f32(mask_count(sheets[i].coverage)) * (1.0 / f32(SAMPLES));
        through = rounded(through * (1.0 - rounded(sheets[i].alpha * share)));
    }
    return best;
}

// How many lie strictly before a depth.
fn sheets_nearer(depth: u32) -> u32 {
    var count = 0u;
    while count < sheet_count && sheets[count].depth < depth {
        count += 1u;
    }
    return count;
}

fn put_sheet(sheet: Sheet) {
    let place = sheets_nearer(sheet.depth);
    for (var i = sheet_count; i > place; i--) {
        sheets[i] = sheets[i - 1u];
    }
    sheets[place] = sheet;
    sheet_count += 1u;
}

fn inner_draw(number: u32, f: Fragment, row: u32) {
    let sheet = sheet_of(f);
    put_sheet(sheet);
    if sheet_count <= LAYERS {
        return;
    }
    let word = hash4(params.seed, site.x | (site.y << 16u), f.primitive, sheet.depth);
    let i = cheapest();
    let one = merged_sheet(sheets[i], sheets[i + 1u], word);
    sheet_count -= 2u;
    for (var j = i; j < sheet_count; j++) {
        sheets[j] = sheets[j + 2u];
    }
    put_sheet(one);
}

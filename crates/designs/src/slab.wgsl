// Twin of crates/designs/src/slab.rs: a k-buffer that fragments enter as likely as stochastic
// transparency would show them; visibilities in single precision.
// uses: layers opacity over_opaque random replay subset wide

// One more may come between, before hidden ones are removed.
const LAYER_ROOM: u32 = LAYERS + 1u;
const DISCRETE: bool = OPACITY_DISCRETE && BITS > 0u;
const BY_ALPHA: bool = NORMALISE_ALPHA || NORMALISE_BOTH;
const BY_DEPTH: bool = NORMALISE_DEPTH || NORMALISE_BOTH;

// The layers' random bits.
var<private> layer_bits: array<Wide, LAYER_ROOM>;
var<private> sum_colour: vec3<f32>;
var<private> sum_alpha: f32;
var<private> column_passes: array<f32, COLUMNS>;
var<private> summed: bool;

fn inner_clear() {
    layers_clear();
    if !NORMALISE_NONE {
        state_put(AT_SUMMED, 0u);
        state_put_colour(AT_SUM, vec3<f32>(0.0));
        state_put_real(AT_SUM + 3u, 0.0);
        for (var s = 0u; s < COLUMNS; s++) {
            state_put_real(AT_PASSES + s, 1.0);
        }
    }
}

fn inner_load() {
    layers_load();
    if DISCRETE {
        for (var i = 0u; i < layer_count; i++) {
            layer_bits[i] = vec2<u32>(state_word(AT_BITS + 2u * i), state_word(AT_BITS + 2u * i + 1u));
        }
    }
    if !NORMALISE_NONE {
        summed = state_word(AT_SUMMED) == 1u;
        sum_colour = state_colour(AT_SUM);
        sum_alpha = state_real(AT_SUM + 3u);
        for (var s = 0u; s < COLUMNS; s++) {
            column_passes[s] = state_real(AT_PASSES + s);
        }
    }
}

fn inner_store() {
    layers_store();
    if DISCRETE {
        for (var i = 0u; i < layer_count; i++) {
            state_put(AT_BITS + 2u * i, layer_bits[i].x);
            state_put(AT_BITS + 2u * i + 1u, layer_bits[i].y);
        }
    }
    if !NORMALISE_NONE {
        state_put(AT_SUMMED, select(0u, 1u, summed));
        state_put_colour(AT_SUM, sum_colour);
        state_put_real(AT_SUM + 3u, sum_alpha);
        for (var s = 0u; s < COLUMNS; s++) {
            state_put_real(AT_PASSES + s, column_passes[s]);
        }
    }
}

fn inner_end_pass(number: u32) {}

fn word_of(f: Fragment, place: u32) -> u32 {
    return hash4(params.seed, (site.y << 16u) | site.x, f.primitive, place);
}

// SlabAt::free: the bits that the first `count` layers leave free in a column.
fn free_bits(count: u32, column: u32) -> Wide {
    var free = wide_first(BITS);
    for (var i = 0u; i < count; i++) {
        if mask_contains(layers[i].coverage, column) {
            free &= ~layer_bits[i];
        }
    }
    return free;
}

// How much passes the first `count` layers in a column: the second part of SlabAt::through.
fn through(count: u32, column: u32) -> f32 {
    if DISCRETE {
        return f32(wide_count(free_bits(count, column))) / f32(BITS);
    }
    return passing(count, column);
}

// SlabAt::probability.
fn probability(let_through: f32, alpha: f32) -> f32 {
    let b = f32(BITS);
    let x = clamp(1.0 - let_through, 0.0, 1.0) * b;
    let y = alpha * b;
    let s = min(u32(x), BITS);
    let t = min(u32(y), BITS);
    var mean = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let s_end = s + (i & 1u);
        let t_end = t + (i >> 1u);
        let of_s = select(1.0 - (x - f32(s)), x - f32(s), (i & 1u) == 1u);
        let of_t = select(1.0 - (y - f32(t)), y - f32(t), (i >> 1u) == 1u);
        if s_end <= BITS && t_end <= BITS && of_s > 0.0 && of_t > 0.0 {
            var visible = 0.0;
            if INSERTION_STRATIFIED {
                visible = visible_stratified(BITS, s_end, t_end);
            } else {
                visible = visible_independent(BITS, s_end, t_end);
            }
            mean += of_s * of_t * visible;
        }
    }
    if WEIGH {
        return max(mean, alpha);
    }
    return mean;
}

// SlabAt::random_bits.
fn random_bits(f: Fragment, alpha: f32) -> Wide {
    let threshold = threshold_of(alpha);
    var chosen = WIDE_NONE;
    if INSERTION_INDEPENDENT {
        for (var i = 0u; i < BITS; i++) {
            if passes(threshold, word_of(f, i)) {
                chosen |= wide_bit(i);
            }
        }
        return chosen;
    }
    let count = of_many(threshold, BITS, word_of(f, BITS));
    for (var i = 0u; i < BITS; i++) {
        let own = word_of(f, i);
        var before = 0u;
        for (var other = 0u; other < BITS; other++) {
            let theirs = word_of(f, other);
            before += select(0u, 1u, theirs < own || (theirs == own && other < i));
        }
        if before < count {
            chosen |= wide_bit(i);
        }
    }
    return chosen;
}

// Whether anything of these bits is seen behind the first `count` layers.
fn is_seen(count: u32, coverage: Mask, bits: Wide) -> bool {
    for (var s = 0u; s < COLUMNS; s++) {
        if mask_contains(coverage, s) && !wide_is_empty(free_bits(count, s) & bits) {
            return true;
        }
    }
    return false;
}

fn put_layer(place: u32, layer: Layer, bits: Wide) {
    for (var i = min(layer_count, LAYER_ROOM - 1u); i > place; i--) {
        layer_bits[i] = layer_bits[i - 1u];
    }
    layer_bits[place] = bits;
    insert_layer(place, layer, LAYER_ROOM);
}

// SlabAt::enter, with SlabAt::layer.
fn enter(f: Fragment) {
    let place = nearer(f.z);
    if place == LAYERS {
        return;
    }
    let placed = place_in_columns(f);
    if DISCRETE {
        let bits = random_bits(f, placed.alpha);
        if !is_seen(place, placed.coverage, bits) {
            return;
        }
        put_layer(place, Layer(f.z, placed.coverage, stored3(f.colour), 0.0), bits);
        if HIDDEN_REMOVED {
            remove_hidden();
        }
    } else {
        var layer = layer_of(f);
        if BITS > 0u {
            var most = 0.0;
            for (var s = 0u; s < COLUMNS; s++) {
                if mask_contains(placed.coverage, s) {
                    most = max(most, through(place, s));
                }
            }
            let p = probability(most, placed.alpha);
            if !passes(threshold_of(p), word_of(f, 0u)) {
                return;
            }
            if WEIGH {
                let alpha = placed.alpha / p;
                layer.colour = f.colour * alpha;
                layer.transmittance = 1.0 - alpha;
                layer = stored_layer(layer);
            }
        }
        put_layer(place, layer, WIDE_NONE);
    }
    layer_count = min(layer_count, LAYERS);
}

// SlabAt::remove_hidden.
fn remove_hidden() {
    var kept = 0u;
    let count = layer_count;
    for (var i = 0u; i < count; i++) {
        if is_seen(kept, layers[i].coverage, layer_bits[i]) {
            layers[kept] = layers[i];
            layer_bits[kept] = layer_bits[i];
            kept += 1u;
        }
    }
    layer_count = kept;
}

fn inner_draw(number: u32, f: Fragment, row: u32) {
    if number == 0u {
        enter(f);
        return;
    }
    let placed = place_in_columns(f);
    let before = nearer(f.z);
    var visible = 0.0;
    summed = true;
    for (var s = 0u; s < COLUMNS; s++) {
        if mask_contains(placed.coverage, s) {
            if BY_DEPTH {
                visible += through(before, s);
            }
            if BY_ALPHA {
                column_passes[s] = stored(column_passes[s] * (1.0 - placed.alpha));
            }
        }
    }
    let weight = visible * placed.alpha;
    sum_colour = stored3(sum_colour + rounded3(weight * f.colour));
    sum_alpha = stored(sum_alpha + weight);
}

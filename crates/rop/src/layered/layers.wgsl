// Twin of crates/rop/src/layered/layers.rs: layers of a pixel in the order of their depths. `LAYER_ROOM` is
// the most that are ever held.
// uses: arithmetic colour fragment state

struct Layer {
    depth: u32,
    // The columns that it covers.
    coverage: Mask,
    // Multiplied by alpha.
    colour: vec3<f32>,
    transmittance: f32,
}

// The columns that a fragment covers, and its alpha there.
struct Placed {
    coverage: Mask,
    alpha: f32,
}

const COLUMNS: u32 = select(1u, SAMPLES, COVERAGE_MASK);

var<private> layer_count: u32;
var<private> layers: array<Layer, LAYER_ROOM>;

fn layers_clear() {
    state_put(AT_LAYER_COUNT, 0u);
}

fn layers_load() {
    layer_count = state_word(AT_LAYER_COUNT);
    for (var i = 0u; i < layer_count; i++) {
        layers[i] = Layer(
            state_word(AT_LAYER_DEPTH + i),
            state_mask(AT_LAYER_MASK + MASK_WORDS * i),
            state_colour(AT_LAYER_COLOUR + 3u * i),
            state_real(AT_LAYER_THROUGH + i),
        );
    }
}

fn layers_store() {
    state_put(AT_LAYER_COUNT, layer_count);
    for (var i = 0u; i < layer_count; i++) {
        state_put(AT_LAYER_DEPTH + i, layers[i].depth);
        state_put_mask(AT_LAYER_MASK + MASK_WORDS * i, layers[i].coverage);
        state_put_colour(AT_LAYER_COLOUR + 3u * i, layers[i].colour);
        state_put_real(AT_LAYER_THROUGH + i, layers[i].transmittance);
    }
}

// Columns::place. Samples are a power of two: the share is exact.
fn place_in_columns(f: Fragment) -> Placed {
    if COVERAGE_MASK {
        return Placed(f.coverage, f.alpha);
    }
    let share = f32(mask_count(f.coverage)) * (1.0 / f32(SAMPLES));
    return Placed(mask_bit(0u), rounded(f.alpha * share));
}

// Columns::layer.
fn layer_of(f: Fragment) -> Layer {
    let placed = place_in_columns(f);
    let colour = rounded3(f.colour * placed.alpha);
    return stored_layer(Layer(f.z, placed.coverage, colour, 1.0 - placed.alpha));
}

// Columns::stored.
fn stored_layer(layer: Layer) -> Layer {
    let through = stored(layer.transmittance);
    return Layer(layer.depth, layer.coverage, stored3(layer.colour), through);
}

// Layer::merged.
fn merged(s: Layer, d: Layer) -> Layer {
    let either = s.coverage | d.coverage;
    var mine = 0.0;
    var both = 1.0;
    var theirs = 0.0;
    if !mask_is_empty(s.coverage ^ d.coverage) {
        let n = f32(mask_count(either));
        let overlap = f32(mask_count(s.coverage & d.coverage));
        mine = (f32(mask_count(s.coverage)) - overlap) / n;
        both = overlap / n;
        theirs = (f32(mask_count(d.coverage)) - overlap) / n;
    }
    let seen = theirs + rounded(both * s.transmittance);
    let through = mine + rounded(both * d.transmittance);
    return Layer(
        s.depth,
        either,
        rounded3(s.colour * (mine + both)) + rounded3(d.colour * seen),
        rounded(s.transmittance * through) + rounded(theirs * d.transmittance),
    );
}

// How many layers lie strictly before a depth.
fn nearer(depth: u32) -> u32 {
    var count = 0u;
    while count < layer_count && layers[count].depth < depth {
        count += 1u;
    }
    return count;
}

// Puts a layer in at a place, where there is room for `room`. The furthest, if there is
// one too many, is `evicted`; whether there is.
var<private> evicted: Layer;

fn insert_layer(place: u32, layer: Layer, room: u32) -> bool {
    let full = layer_count >= room;
    evicted = layer;
    if full && place < room {
        evicted = layers[room - 1u];
    }
    if place >= room {
        return full;
    }
    for (var i = min(layer_count, room - 1u); i > place; i--) {
        layers[i] = layers[i - 1u];
    }
    layers[place] = layer;
    layer_count = min(layer_count + 1u, room);
    return full;
}

// composite: how much passes the first `count` layers in a column.
fn passing(count: u32, column: u32) -> f32 {
    var transmittance = 1.0;
    for (var i = 0u; i < count; i++) {
        if mask_contains(layers[i].coverage, column) {
            transmittance *= layers[i].transmittance;
        }
    }
    return transmittance;
}

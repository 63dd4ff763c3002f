// Twin of src/design/mlab.rs: layers sorted as they come; of one too many the last two are
// merged.
// uses: layers over_opaque replay

const LAYER_ROOM: u32 = LAYERS;

fn inner_clear() {
    layers_clear();
}

fn inner_load() {
    layers_load();
}

fn inner_store() {
    layers_store();
}

fn inner_draw(number: u32, f: Fragment, row: u32) {
    if insert_layer(nearer(f.z), layer_of(f), LAYER_ROOM) {
        layers[LAYER_ROOM - 1u] = merged(layers[LAYER_ROOM - 1u], evicted);
    }
}

fn inner_end_pass(number: u32) {}

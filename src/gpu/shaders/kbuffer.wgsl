// Twin of src/design/kbuffer.rs: the nearest layers, sorted; what lies behind is dropped.
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
    insert_layer(nearer(f.z), layer_of(f), LAYER_ROOM);
}

fn inner_end_pass(number: u32) {}

// What kbuffer.wgsl and mlab.wgsl have in common: a bounded list of layers, and nothing else.
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

fn inner_end_pass(number: u32) {}

// Twin of crates/designs/src/mlab.rs: layers sorted as they come; of one too many the last two are
// merged.
// uses: layered

fn inner_draw(number: u32, f: Fragment, row: u32) {
    if insert_layer(nearer(f.z), layer_of(f), LAYER_ROOM) {
        layers[LAYER_ROOM - 1u] =
            stored_layer(merged(layers[LAYER_ROOM - 1u], evicted));
    }
}

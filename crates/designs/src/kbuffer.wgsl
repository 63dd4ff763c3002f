// Twin of crates/designs/src/kbuffer.rs: the nearest layers, sorted; what lies behind is dropped.
// uses: layered

fn inner_draw(number: u32, f: Fragment, row: u32) {
    insert_layer(nearer(f.z), layer_of(f), LAYER_ROOM);
}

// Finds the tiles that hold a fragment.
// uses: bindings fragment

@group(0) @binding(3) var<storage, read_write> touched: array<atomic<u32>>;

@compute @workgroup_size(256)
fn touch(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let row = (group.y * groups.x + group.x) * 256u + thread;
    if row >= params.rows || mask_is_empty(coverage(row)) {
        return;
    }
    let tile = tile_at(row);
    let bit = 1u << (tile & 31u);
    // Most tiles have long been found.
    if (atomicLoad(&touched[tile >> 5u]) & bit) == 0u {
        atomicOr(&touched[tile >> 5u], bit);
    }
}

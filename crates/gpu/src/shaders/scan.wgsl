// Sums before each of a list of numbers. A block is summed by a group; the blocks' sums are
// a list again, and its sums are added to the blocks.

struct Params {
    // How many numbers there are.
    length: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@group(0) @binding(2) var<storage, read_write> sums: array<u32>;

const GROUP: u32 = 64u;
const EACH: u32 = 16u;

var<workgroup> partial: array<u32, GROUP>;

@compute @workgroup_size(GROUP)
fn scan(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    let first = (block * GROUP + thread) * EACH;
    let end = min(first + EACH, params.length);
    var sum = 0u;
    for (var i = first; i < end; i++) {
        sum += values[i];
    }
    partial[thread] = sum;
    workgroupBarrier();
    // Sums of 1, 2, 4 … threads before.
    for (var step = 1u; step < GROUP; step *= 2u) {
        var before = 0u;
        if thread >= step {
            before = partial[thread - step];
        }
        workgroupBarrier();
        partial[thread] += before;
        workgroupBarrier();
    }
    var running = partial[thread] - sum;
    for (var i = first; i < end; i++) {
        let value = values[i];
        values[i] = running;
        running += value;
    }
    if thread == GROUP - 1u && block * GROUP * EACH < params.length {
        sums[block] = partial[thread];
    }
}

@compute @workgroup_size(GROUP)
fn add(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    let first = (block * GROUP + thread) * EACH;
    for (var i = first; i < min(first + EACH, params.length); i++) {
        values[i] += sums[block];
    }
}

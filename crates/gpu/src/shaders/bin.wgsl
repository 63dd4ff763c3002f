// Sorts a chunk's rows by pixel: a radix sort, digit after digit, stable. Each digit is
// counted block by block, the counts are summed (scan.wgsl), and the keys are scattered.
// The first digit is that of keys made from the columns; rows that cover none of the
// frame's samples are left out there.
// uses: bindings fragment

// A tile's place among the touched ones.
@group(0) @binding(3) var<storage, read> slots: array<u32>;
// Keys and their rows; behind the last row's place, the number of keys.
@group(0) @binding(4) var<storage, read> keys_from: array<u32>;
@group(0) @binding(5) var<storage, read> rows_from: array<u32>;
@group(0) @binding(6) var<storage, read_write> keys_to: array<u32>;
@group(0) @binding(7) var<storage, read_write> rows_to: array<u32>;
// For each digit, the blocks' counts, and at the end the number of all keys.
@group(0) @binding(8) var<storage, read_write> counts: array<u32>;
@group(0) @binding(9) var<storage, read_write> ends: array<vec2<u32>>;

const GROUP: u32 = 64u;
const KEYS_EACH: u32 = 16u;
const DIGITS: u32 = 64u;

// For two digits in a word, how many keys of either each thread has; then, how many come
// before its first.
var<workgroup> tally: array<u32, DIGITS / 2u * GROUP>;

// Its keys are one run, so that what is stable within threads is stable.
fn first_key(block: u32, thread: u32) -> u32 {
    return (block * GROUP + thread) * KEYS_EACH;
}

fn digit_of(key: u32) -> u32 {
    return (key >> params.digit_at) & (DIGITS - 1u);
}

fn tally_at(digit: u32, thread: u32) -> u32 {
    return (digit >> 1u) * GROUP + thread;
}

fn tally_shift(digit: u32) -> u32 {
    return (digit & 1u) * 16u;
}

fn tally_clear(thread: u32) {
    for (var i = 0u; i < DIGITS / 2u; i++) {
        tally[i * GROUP + thread] = 0u;
    }
}

fn tally_key(key: u32, thread: u32) {
    let digit = digit_of(key);
    tally[tally_at(digit, thread)] += 1u << tally_shift(digit);
}

// Adds up what the threads have of two digits.
fn tally_sum(pair: u32) -> u32 {
    var sum = 0u;
    for (var i = 0u; i < GROUP; i++) {
        let held = tally[pair * GROUP + i];
        tally[pair * GROUP + i] = sum;
        sum += held;
    }
    return sum;
}

// The key of a row: its tile's place and its own within the tile.
fn key_of(row: u32) -> u32 {
    let x = column_x(row);
    let y = column_y(row);
    return (slots[tile_at(row)] << 8u) | ((y & 15u) << 4u) | (x & 15u);
}

fn held(row: u32) -> bool {
    return row < params.rows && !mask_is_empty(coverage(row));
}

fn put_counts(block: u32, thread: u32) {
    // There may be more groups than blocks.
    if thread < DIGITS / 2u && block < params.blocks {
        let sum = tally_sum(thread);
        counts[2u * thread * params.blocks + block] = sum & 0xffffu;
        counts[(2u * thread + 1u) * params.blocks + block] = sum >> 16u;
    }
}

// Where the next of a thread's keys with this digit goes.
fn next_place(digit: u32, block: u32, thread: u32) -> u32 {
    let at = tally_at(digit, thread);
    let shift = tally_shift(digit);
    let place = (tally[at] >> shift) & 0xffffu;
    tally[at] += 1u << shift;
    return counts[digit * params.blocks + block] + place;
}

// Counts a thread's keys: of rows, or of `total` keys.
fn tally_rows(first: u32, thread: u32) {
    tally_clear(thread);
    for (var row = first; row < first + KEYS_EACH; row++) {
        if held(row) {
            tally_key(key_of(row), thread);
        }
    }
}

fn tally_keys(first: u32, total: u32, thread: u32) {
    tally_clear(thread);
    for (var i = first; i < min(first + KEYS_EACH, total); i++) {
        tally_key(keys_from[i], thread);
    }
}

// When all threads have counted: what come before each of theirs.
fn tally_before(thread: u32) {
    workgroupBarrier();
    if thread < DIGITS / 2u {
        let ignored = tally_sum(thread);
    }
    workgroupBarrier();
}

fn put_key(key: u32, row: u32, block: u32, thread: u32) {
    let place = next_place(digit_of(key), block, thread);
    keys_to[place] = key;
    rows_to[place] = row;
}

@compute @workgroup_size(GROUP)
fn count_rows(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    tally_rows(first_key(block, thread), thread);
    workgroupBarrier();
    put_counts(block, thread);
}

@compute @workgroup_size(GROUP)
fn scatter_rows(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    let first = first_key(block, thread);
    tally_rows(first, thread);
    tally_before(thread);
    for (var row = first; row < first + KEYS_EACH; row++) {
        if held(row) {
            put_key(key_of(row), row, block, thread);
        }
    }
    if block == 0u && thread == 0u {
        keys_to[params.rows] = counts[DIGITS * params.blocks];
    }
}

@compute @workgroup_size(GROUP)
fn count_keys(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    tally_keys(first_key(block, thread), keys_from[params.rows], thread);
    workgroupBarrier();
    put_counts(block, thread);
}

@compute @workgroup_size(GROUP)
fn scatter_keys(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let block = group.y * groups.x + group.x;
    let first = first_key(block, thread);
    let total = keys_from[params.rows];
    tally_keys(first, total, thread);
    tally_before(thread);
    for (var i = first; i < min(first + KEYS_EACH, total); i++) {
        put_key(keys_from[i], rows_from[i], block, thread);
    }
    if block == 0u && thread == 0u {
        keys_to[params.rows] = total;
    }
}

// Finds where each pixel's rows begin and end.
@compute @workgroup_size(256)
fn bound(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let i = (group.y * groups.x + group.x) * 256u + thread;
    let total = keys_from[params.rows];
    if i >= total {
        return;
    }
    let key = keys_from[i];
    if i == 0u || keys_from[max(i, 1u) - 1u] != key {
        ends[key].x = i;
    }
    if i + 1u == total || keys_from[min(i + 1u, total - 1u)] != key {
        ends[key].y = i + 1u;
    }
}

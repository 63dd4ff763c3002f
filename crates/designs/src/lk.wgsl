// Twin of crates/designs/src/lk.rs: reference values of figure 4, a hash for each sample.
// uses: hits over_opaque replay resolve stochastic tracked

fn references_clear() {}
fn references_load() {}
fn references_store() {}
fn references_start() {}
fn references_begin(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, count: u32) {}

fn reference_of(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, place: u32) -> u32 {
    return reference_value(round.index * SAMPLES + number + place, SAMPLES_LOG2 + round.count_log2, key);
}

// Where one hash serves all values: the numbers that miss.
var<private> misses: u32;

fn hits_begin(round: Round, key: ReferenceKey, opacity: Threshold) {
    if HITS_NESTED {
        let first = place(round.index * SAMPLES, SAMPLES_LOG2 + round.count_log2, key);
        misses = nested(first.x + first.y, opacity);
    }
}

fn hit(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, place: u32) -> bool {
    if HITS_NESTED {
        return !misses_number(misses, number + place);
    }
    return passes(opacity, reference_of(round, key, opacity, number, place));
}

// Twin of crates/designs/src/lk.rs: reference values of figure 4, a hash for each sample.
// uses: over_opaque replay resolve stochastic tracked

fn references_clear() {}
fn references_load() {}
fn references_store() {}
fn references_start() {}
fn references_begin(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, count: u32) {}

fn reference_of(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, place: u32) -> u32 {
    return reference_value(round.index * SAMPLES + number + place, SAMPLES_LOG2 + round.count_log2, key);
}

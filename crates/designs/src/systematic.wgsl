// Twin of crates/designs/src/systematic.rs: evenly spaced reference values.
// uses: comb dither over_opaque random replay resolve stochastic tracked

// The last phase of the surface, and whether it has one. Where places are counted, ξ.
var<private> phase: u32;
var<private> begun: bool;
// Where the fragment's samples start, and which of its pairs exchange their places.
var<private> start: u32;
var<private> pairs: u32;

fn references_clear() {
    if PHASE_SUM {
        state_put(AT_PHASE, 0u);
        state_put(AT_PHASE + 1u, 0u);
    }
}

fn references_load() {
    if PHASE_SUM {
        phase = state_word(AT_PHASE);
        begun = state_word(AT_PHASE + 1u) == 1u;
    }
}

fn references_store() {
    if PHASE_SUM {
        state_put(AT_PHASE, phase);
        state_put(AT_PHASE + 1u, select(0u, 1u, begun));
    }
}

fn references_start() {
    phase = 0u;
    begun = false;
}

// Exchange::holds.
fn exchanges_pairs(opacity: Threshold, count: u32) -> bool {
    let away = select(0x80000000u - opacity.low, opacity.low - 0x80000000u, opacity.low > 0x80000000u);
    let near = count > 16u && away <= 0x80000000u / count;
    return EXCHANGE_ALWAYS || (EXCHANGE_HALF && near);
}

// Modulo 2^32: an opaque fragment's threshold, 2^32, leaves the phase as it is.
fn references_begin(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, count: u32) {
    if count == 0u {
        return;
    }
    if PHASE_SUM {
        if !begun {
            phase = dither_in_round(site.x, site.y, key, round.index, round.count_log2);
        }
        start = phase;
        phase += opacity.low * count;
        begun = true;
    } else {
        let xi = dither_in_round(site.x, site.y, key, round.index, round.count_log2);
        start = xi + opacity.low * number;
    }
    pairs = 0u;
    if exchanges_pairs(opacity, count) {
        let word = hash_on(hash4(key.seed, key.pixel, key.surface, round.index), 0x0badcab5u);
        pairs = among(word, count);
    }
}

fn reference_of(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, place: u32) -> u32 {
    return comb(start, exchanged(place, pairs), opacity);
}

fn hits_begin(round: Round, key: ReferenceKey, opacity: Threshold) {}

fn hit(round: Round, key: ReferenceKey, opacity: Threshold, number: u32, place: u32) -> bool {
    return passes(opacity, reference_of(round, key, opacity, number, place));
}

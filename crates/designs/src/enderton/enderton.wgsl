// Twin of crates/designs/src/enderton/mod.rs: each fragment writes a random share of its samples.
// uses: arithmetic dither opacity over_opaque pixel_order replay resolve round stochastic

// What the design has no parameters for.
const PIXEL_ORDER_MORTON: bool = false;
const PIXEL_ORDER_SCANLINE: bool = false;
const REFERENCE_WHITE: bool = false;
const REFERENCE_LK2011_1: bool = false;
const REFERENCE_LK2011_2: bool = false;
const REFERENCE_LK2011_3: bool = false;
const REFERENCE_VEGDAHL_V2: bool = false;
const REFERENCE_VEGDAHL: bool = false;
const REFERENCE_OWEN: bool = false;
const REFERENCE_SOBOL: bool = false;
const REFERENCE_RADICAL_INVERSE: bool = false;

// Samples of all rounds that are stratified together.
const SLOTS: u32 = SAMPLES << select(0u, ROUNDS_LOG2, STRATA_ALL);

struct Words {
    seed: u32,
    pixel: u32,
    source: u32,
}

// The slots' random words, where they are compared with each other.
var<private> slot_words: array<u32, SLOTS>;

fn sampler_clear() {}
fn sampler_load() {}
fn sampler_store() {}

fn word_of(words: Words, place: u32) -> u32 {
    return hash4(words.seed, words.pixel, words.source, place);
}

fn words_of(round: Round, f: Fragment) -> Words {
    var source = f.primitive;
    if SEED_BY_Z {
        source = f.z;
    } else if SEED_BY_OBJECT {
        source = f.object;
    }
    return Words(round.seed, (site.y << 16u) | site.x, source);
}

fn xi(round: Round, words: Words) -> u32 {
    if DITHER_WHITE {
        return word_of(words, SAMPLES << round.count_log2);
    }
    let key = ReferenceKey(pixel_index(site.x, site.y), words.source, words.seed);
    return dither_value(site.x, site.y, key);
}

// ξ of the fragment in one of several rounds that are stratified together.
fn xi_of_round(round: Round, words: Words) -> u32 {
    if !DITHER_WHITE {
        let key = ReferenceKey(pixel_index(site.x, site.y), words.source, words.seed);
        return dither_in_round(site.x, site.y, key, round.index, round.count_log2);
    }
    let all = xi(round, words);
    if round.count_log2 == 0u {
        return all;
    }
    let first = (SAMPLES << round.count_log2) + 1u;
    let own = word_of(words, first + round.index);
    var before = 0u;
    for (var r = 0u; r < (1u << round.count_log2); r++) {
        let word = word_of(words, first + r);
        before += select(0u, 1u, word < own || (word == own && r < round.index));
    }
    return (before << (32u - round.count_log2)) | (all >> round.count_log2);
}

// EndertonSampler::subset: the `count` of the slots with the smallest words; of them those
// from `own` on, as samples. A slot is chosen if fewer than `count` come before it.
fn subset(candidates: Mask, count: u32, own: u32, slots: u32) -> Mask {
    var chosen = MASK_NONE;
    for (var s = 0u; s < SAMPLES; s++) {
        if !mask_contains(candidates, s) {
            continue;
        }
        let slot = own + s;
        var before = 0u;
        for (var other = 0u; other < slots; other++) {
            let smaller = slot_words[other] < slot_words[slot]
                || (slot_words[other] == slot_words[slot] && other < slot);
            before += select(0u, 1u, mask_contains(candidates, other % SAMPLES) && smaller);
        }
        if before < count {
            chosen |= mask_bit(s);
        }
    }
    return chosen;
}

fn choose(round: Round, passed: Mask, f: Fragment) -> Mask {
    if mask_is_empty(passed) {
        return MASK_NONE;
    }
    let words = words_of(round, f);
    var candidates = f.coverage;
    if AMONG_PASSED {
        candidates = passed;
    }
    let opacity = threshold_of(f.alpha);
    var chosen = MASK_NONE;
    if MASK_NAIVE {
        for (var s = 0u; s < SAMPLES; s++) {
            if mask_contains(candidates, s) && passes(opacity, word_of(words, round.index * SAMPLES + s)) {
                chosen |= mask_bit(s);
            }
        }
    } else if MASK_STRATIFIED && AMONG_PASSED {
        let count = of_many(opacity, mask_count(candidates), xi_of_round(round, words));
        for (var s = 0u; s < SAMPLES; s++) {
            slot_words[s] = word_of(words, round.index * SAMPLES + s);
        }
        chosen = subset(candidates, count, 0u, SAMPLES);
    } else if MASK_STRATIFIED {
        let slots = mask_count(candidates) << round.count_log2;
        let count = of_many(opacity, slots, xi(round, words));
        for (var slot = 0u; slot < SLOTS; slot++) {
            if mask_contains(candidates, slot % SAMPLES) {
                slot_words[slot] = word_of(words, slot);
            }
        }
        chosen = subset(candidates, count, round.index * SAMPLES, SAMPLES << round.count_log2);
    } else {
        chosen = look_up(round, f.alpha, words);
    }
    return chosen & passed;
}

// A mask of the table, computed when it is read.
fn look_up(round: Round, alpha: f32, words: Words) -> Mask {
    let levels = (1u << ALPHA_BITS) - 1u;
    let scaled = rounded(alpha * f32(levels));
    // Halves are rounded up, as in Rust.
    let row = u32(scaled) + select(0u, 1u, scaled - floor(scaled) >= 0.5);
    let column = multiply_high(word_of(words, SAMPLES), TABLE_WIDTH);
    let slots = SAMPLES << round.count_log2;
    // (2 column + 1) levels / (2 width), in two steps: the product may exceed a word.
    let a = 2u * column + 1u;
    let b = 2u * TABLE_WIDTH;
    let high = a * (levels >> 8u);
    let shift = (high / b) * 256u + ((high % b) * 256u + a * (levels & 255u)) / b;
    let count = (row * slots + shift) / levels;
    for (var slot = 0u; slot < SLOTS; slot++) {
        slot_words[slot] = hash4(words.seed, row, column, slot);
    }
    let all = mask_of(params.samples_low, params.samples_high);
    return subset(all, count, round.index * SAMPLES, slots);
}

// Twin of crates/rop/src/stochastic/methods.rs: what is made of the chosen samples. `sampler_clear`,
// `sampler_load`, `sampler_store` and `choose` are the sampler's.
// uses: arithmetic colour round samples

const SUMS: bool = !METHOD_BASIC || ROUNDS_LOG2 > 0u;
const ROUNDS: u32 = 1u << ROUNDS_LOG2;

const PASS_TOTAL_ALPHA: u32 = 0u;
const PASS_SAMPLE: u32 = 1u;
const PASS_ACCUMULATE: u32 = 2u;

struct Pass {
    kind: u32,
    round: u32,
}

var<private> transmittance: array<f32, SAMPLES>;
var<private> occupied: Mask;
var<private> sum_colour: vec3<f32>;
var<private> sum_weight: f32;

fn pass_of(number: u32) -> Pass {
    if CORRECTED && number == 0u {
        return Pass(PASS_TOTAL_ALPHA, 0u);
    }
    let rest = number - select(0u, 1u, CORRECTED);
    if DEPTH_BASED {
        return Pass(select(PASS_SAMPLE, PASS_ACCUMULATE, (rest & 1u) == 1u), rest / 2u);
    }
    return Pass(PASS_SAMPLE, rest);
}

fn inner_clear() {
    samples_clear();
    sampler_clear();
    if SUMS {
        for (var s = 0u; s < SAMPLES; s++) {
            state_put_real(AT_TRANSMITTANCE + s, select(0.0, 1.0, CORRECTED));
        }
        state_put_mask(AT_OCCUPIED, MASK_NONE);
        state_put_colour(AT_SUM, vec3<f32>(0.0));
        state_put_real(AT_SUM + 3u, 0.0);
    }
}

fn sums_load() {
    for (var s = 0u; s < SAMPLES; s++) {
        transmittance[s] = state_real(AT_TRANSMITTANCE + s);
    }
    occupied = state_mask(AT_OCCUPIED);
    sum_colour = state_colour(AT_SUM);
    sum_weight = state_real(AT_SUM + 3u);
}

fn sums_store() {
    for (var s = 0u; s < SAMPLES; s++) {
        state_put_real(AT_TRANSMITTANCE + s, transmittance[s]);
    }
    state_put_mask(AT_OCCUPIED, occupied);
    state_put_colour(AT_SUM, sum_colour);
    state_put_real(AT_SUM + 3u, sum_weight);
}

fn inner_load() {
    samples_load();
    sampler_load();
    if SUMS {
        sums_load();
    }
}

fn inner_store() {
    samples_store();
    sampler_store();
    if SUMS {
        sums_store();
    }
}

// Adds a colour `share` times, which counts as `weight`.
fn sums_add(colour: vec3<f32>, share: f32, weight: f32) {
    sum_colour = stored3(sum_colour + rounded3(colour * share));
    sum_weight = stored(sum_weight + weight);
}

fn inner_draw(number: u32, f: Fragment, row: u32) {
    let pass_kind = pass_of(number);
    if CORRECTED && pass_kind.kind == PASS_TOTAL_ALPHA {
        for (var s = 0u; s < SAMPLES; s++) {
            if mask_contains(f.coverage, s) {
                transmittance[s] = stored(transmittance[s] * (1.0 - f.alpha));
            }
        }
        return;
    }
    let passed = depth_test(f, DEPTH_BUFFER_BITS);
    if DEPTH_BASED && pass_kind.kind == PASS_ACCUMULATE {
        let share = rounded(f.alpha * f32(mask_count(passed)));
        sums_add(f.colour, share, share);
        return;
    }
    let written = choose(round_of(pass_kind.round), passed, f);
    samples_write(row, written);
    occupied |= written;
}

// Adds a finished round to the sums; the whole state is in memory.
fn inner_end_pass(number: u32) {
    if !SUMS {
        return;
    }
    let pass_kind = pass_of(number);
    if pass_kind.kind != select(PASS_SAMPLE, PASS_ACCUMULATE, DEPTH_BASED) {
        return;
    }
    sums_load();
    for (var s = 0u; s < SAMPLES; s++) {
        let holds = mask_contains(occupied, s);
        if METHOD_BASIC || (METHOD_ALPHA_CORRECTION && holds) {
            sums_add(state_colour(AT_COLOUR + 3u * s), 1.0, select(0.0, 1.0, holds));
        }
        if METHOD_DEPTH && !holds {
            transmittance[s] += 1.0 / f32(ROUNDS);
        }
    }
    if pass_kind.round + 1u < ROUNDS {
        samples_clear();
        sampler_clear();
        occupied = MASK_NONE;
    }
    sums_store();
}

// box_filter of crates/rop/src/resolve.rs. Samples are a power of two: products with their share
// are exact.
fn resolve_pixel() -> vec3<f32> {
    let share = 1.0 / f32(SAMPLES);
    var sum = vec3<f32>(0.0);
    var differ = 0u;
    for (var s = 0u; s < SAMPLES; s++) {
        sum += state_colour(AT_COLOUR + 3u * s);
        for (var c = 0u; c < 3u; c++) {
            differ |= state_word(AT_COLOUR + 3u * s + c) ^ state_word(AT_COLOUR + c);
        }
    }
    if differ == 0u {
        return state_colour(AT_COLOUR);
    }
    // All bits of the exponent: it has overflowed. Compilers take floats for finite.
    let overflowed = (bitcast<vec3<u32>>(sum) & vec3<u32>(0x7f800000u)) == vec3<u32>(0x7f800000u);
    if !any(overflowed) {
        return sum * share;
    }
    // A driver may otherwise take the share out of the sum again.
    var shares = vec3<f32>(0.0);
    for (var s = 0u; s < SAMPLES; s++) {
        shares += rounded3(state_colour(AT_COLOUR + 3u * s) * share);
    }
    return select(sum * share, shares, overflowed);
}

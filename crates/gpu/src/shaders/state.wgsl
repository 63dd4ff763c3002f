// The state of a page's pixels: word by word, of each all pixels'.

@group(0) @binding(3) var<storage, read_write> state: array<u32>;

// The pixel whose turn it is: its place in the page, and where it lies in the frame.
var<private> pixel: u32;
var<private> site: vec2<u32>;

fn state_word(at: u32) -> u32 {
    return state[at * params.pixels + pixel];
}

fn state_put(at: u32, word: u32) {
    state[at * params.pixels + pixel] = word;
}

fn state_real(at: u32) -> f32 {
    return bitcast<f32>(state_word(at));
}

fn state_put_real(at: u32, value: f32) {
    state_put(at, bitcast<u32>(value));
}

fn state_colour(at: u32) -> vec3<f32> {
    return vec3<f32>(state_real(at), state_real(at + 1u), state_real(at + 2u));
}

fn state_put_colour(at: u32, value: vec3<f32>) {
    state_put_real(at, value.x);
    state_put_real(at + 1u, value.y);
    state_put_real(at + 2u, value.z);
}

fn state_mask(at: u32) -> Mask {
    if MASK_WORDS == 1u {
        return mask_of(state_word(at), 0u);
    }
    return mask_of(state_word(at), state_word(at + 1u));
}

fn state_put_mask(at: u32, mask: Mask) {
    state_put(at, mask_word(mask, 0u));
    if MASK_WORDS == 2u {
        state_put(at + 1u, mask_word(mask, 1u));
    }
}

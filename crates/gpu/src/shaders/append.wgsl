// Records the fragments that a fragment shader is run for. To be put before a shader's own
// text; `gpu::FragmentBuffer` holds the binding and reads what was recorded.

// What one primitive leaves in one pixel. Eleven words, in the order of `RawFragment`.
struct CapturedFragment {
    // The pixel's column, and its row times 65536.
    pixel: u32,
    primitive: u32,
    object: u32,
    coverage: u32,
    // The depth at the pixel's centre, and its change per pixel to the right and downwards.
    z: f32,
    dzdx: f32,
    dzdy: f32,
    red: f32,
    green: f32,
    blue: f32,
    alpha: f32,
}

struct CapturedFragments {
    // How many there were: those for which there was no room are counted too.
    count: atomic<u32>,
    list: array<CapturedFragment>,
}

@group(0) @binding(0) var<storage, read_write> captured: CapturedFragments;

// The depth plane at `@builtin(position)`: call it where all fragments of the shader pass,
// before any branch that not all take, for it compares neighbours.
fn captured_depth(position: vec4<f32>) -> vec3<f32> {
    return vec3<f32>(position.z, dpdx(position.z), dpdy(position.z));
}

// Records a fragment. `coverage` is `@builtin(sample_mask)`; `primitive` rises in the order
// of drawing, and no two primitives share one; `colour` is linear, not multiplied by alpha.
fn append_fragment(
    position: vec4<f32>,
    depth: vec3<f32>,
    coverage: u32,
    primitive: u32,
    object: u32,
    colour: vec4<f32>,
) {
    // The count must not wrap.
    if atomicLoad(&captured.count) >= 0xf0000000u {
        return;
    }
    let place = atomicAdd(&captured.count, 1u);
    if place < arrayLength(&captured.list) {
        let pixel = vec2<u32>(position.xy);
        captured.list[place] = CapturedFragment(
            pixel.x | pixel.y << 16u, primitive, object, coverage,
            depth.x, depth.y, depth.z,
            colour.r, colour.g, colour.b, colour.a,
        );
    }
}

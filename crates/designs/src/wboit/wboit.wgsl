// Twin of crates/designs/src/wboit.rs: the fragments' mean, weighted by depth and alpha, in single
// precision.
// uses: arithmetic colour fragment over_opaque replay state view_depth

const COUNT: u32 = select(1u, SAMPLES, COVERAGE_SAMPLE);

// Whether the pixel has sums yet.
fn inner_clear() {
    state_put(AT_TOUCHED, 0u);
    for (var s = 0u; s < COUNT; s++) {
        state_put_colour(AT_SUM_COLOUR + 3u * s, vec3<f32>(0.0));
        state_put_real(AT_SUM_WEIGHT + s, 0.0);
        state_put_real(AT_SUM_THROUGH + s, 1.0);
    }
}

// Sums are added to where they are.
fn inner_load() {}
fn inner_store() {}
fn inner_end_pass(number: u32) {}

// Weight::of.
fn weight_of(z: u32, alpha: f32) -> f32 {
    if WEIGHT_ONE {
        return 1.0;
    }
    let depth = view_depth(z);
    let far = raised6(depth / 200.0);
    var by_depth = 0.0;
    if WEIGHT_EQ7 {
        by_depth = falling(10.0, depth / 5.0 * (depth / 5.0) + far);
    } else if WEIGHT_EQ8 {
        by_depth = falling(10.0, depth / 10.0 * (depth / 10.0) * (depth / 10.0) + far);
    } else if WEIGHT_EQ9 {
        let near = depth / 200.0 * (depth / 200.0);
        by_depth = falling(0.03, near * near);
    } else {
        let d = before_far(z);
        by_depth = max(3e3 * d * d * d, 1e-2);
    }
    return alpha * by_depth;
}

fn falling(scale: f32, sum: f32) -> f32 {
    return clamp(scale / (1e-5 + sum), 1e-2, 3e3);
}

fn raised6(x: f32) -> f32 {
    return x * x * x * x * x * x;
}

fn inner_draw(number: u32, f: Fragment, row: u32) {
    var alpha = f.alpha;
    var touched = f.coverage;
    if COVERAGE_SHARE {
        alpha *= f32(mask_count(f.coverage)) * (1.0 / f32(SAMPLES));
        touched = mask_bit(0u);
    }
    let weighted = weight_of(f.z, alpha) * alpha;
    state_put(AT_TOUCHED, 1u);
    for (var s = 0u; s < COUNT; s++) {
        if mask_contains(touched, s) {
            let colour = state_colour(AT_SUM_COLOUR + 3u * s);
            let sum = stored3(colour + rounded3(weighted * f.colour));
            let through = stored(state_real(AT_SUM_THROUGH + s) * (1.0 - alpha));
            state_put_colour(AT_SUM_COLOUR + 3u * s, sum);
            state_put_real(AT_SUM_WEIGHT + s, stored(state_real(AT_SUM_WEIGHT + s) + weighted));
            state_put_real(AT_SUM_THROUGH + s, through);
        }
    }
}

// Twin of crates/rop/src/blended/view_depth.rs, in single precision.

// ViewDepth::at.
fn view_depth(z: u32) -> f32 {
    return NEAR + beyond_near(z);
}

fn beyond_near(z: u32) -> f32 {
    let d = fraction(z);
    if LENS_PARALLEL {
        return d * RANGE;
    }
    let far = NEAR + RANGE;
    return d * RANGE * NEAR / (far * before_far(z) + NEAR * d);
}

// A stored depth as a fraction of the range.
fn fraction(z: u32) -> f32 {
    return f32(z) / 4294967295.0;
}

// One minus it, as exact where little is left.
fn before_far(z: u32) -> f32 {
    return f32(0xffffffffu - z) / 4294967295.0;
}

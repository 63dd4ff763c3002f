// Twin of crates/rop/src/blended/view_depth.rs, in single precision.

// ViewDepth::at.
fn view_depth(z: u32) -> f32 {
    return VIEW_NEAR + beyond_near(z);
}

fn beyond_near(z: u32) -> f32 {
    let d = fraction(z);
    if VIEW_PARALLEL {
        return d * VIEW_RANGE;
    }
    let far = VIEW_NEAR + VIEW_RANGE;
    return d * VIEW_RANGE * VIEW_NEAR / (far * before_far(z) + VIEW_NEAR * d);
}

// A stored depth as a fraction of the range.
fn fraction(z: u32) -> f32 {
    return f32(z) / 4294967295.0;
}

// One minus it, as exact where little is left.
fn before_far(z: u32) -> f32 {
    return f32(0xffffffffu - z) / 4294967295.0;
}

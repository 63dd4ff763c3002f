//! antimatter15's `.splat`: no header, 32 bytes a splat, all of it drawn as it is: scales are
//! standard deviations, colours and opacities 8 bits, no harmonics but the constant.

use super::{Cloud, Stored, constant};
use crate::scene::bytes::Bytes;
use screendoor_trace::error::Result;

/// Bytes of a splat.
const LENGTH: usize = 32;

/// The splats of a file.
pub(super) fn cloud(mut bytes: Bytes<'_>) -> Result<Cloud> {
    let length = bytes.left();
    if !length.is_multiple_of(LENGTH) {
        let what = format_args!("it has {length} bytes, and splats of {LENGTH} each");
        return Err(bytes.bad(what));
    }
    let mut cloud = Cloud::new(bytes.place(), 0, length / LENGTH);
    while bytes.left() > 0 {
        let mut reals = [0.0; 6];
        for value in &mut reals {
            *value = f64::from(bytes.f32()?);
        }
        let [x, y, z, scale @ ..] = reals;
        let mut parts = [0.0; 8];
        for value in &mut parts {
            *value = f64::from(bytes.u8()?);
        }
        let [r, g, b, opacity, rotation @ ..] = parts;
        let splat = Stored {
            mean: [x, y, z],
            scale,
            rotation: rotation.map(|v| (v - 128.0) / 128.0),
            opacity: opacity / 255.0,
        };
        cloud.push(&splat, &[[r, g, b].map(|c| constant(c / 255.0))]);
    }
    Ok(cloud)
}

//! Round textures for particles.

use glam::{Vec2, Vec4};

use crate::scene::{Texture, Wrap};

/// Texels on a side: a sprite's edge is soft, and needs no more.
const SIDE: u32 = 64;

/// A white texture with the alpha that `alpha` gives at a distance from its middle,
/// in [0, 1); from 1 on, where the square's sides are, there is nothing.
pub(super) fn round(alpha: impl Fn(f32) -> f32) -> Texture {
    Texture::from_fn(SIDE, SIDE, |x, y| {
        let p = (Vec2::new(x as f32, y as f32) + 0.5) / (SIDE as f32 * 0.5) - 1.0;
        let distance = p.length();
        let alpha = if distance < 1.0 { alpha(distance) } else { 0.0 };
        Vec4::new(1.0, 1.0, 1.0, alpha)
    })
    .wrapped([Wrap::Clamp; 2])
}

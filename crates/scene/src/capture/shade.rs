//! Colour and alpha of a fragment.

use glam::{Vec2, Vec3, Vec4};

use crate::capture::CaptureOptions;
use crate::capture::camera::Camera;
use crate::capture::geometry::Triangle;
use crate::capture::light::turned;
use crate::capture::opacity::Opacity;
use crate::capture::raster::Weights;
use crate::scene::{AlphaMode, Material, Scene, TextureUse};
use screendoor_trace::picture::Space;
use screendoor_trace::trace::Fragment;

/// Light: a directional one that moves with the camera, a weaker one from the
/// other side, and a little from everywhere.
pub(super) const KEY: [f32; 3] = [0.45, 0.65, 0.61];
pub(super) const KEY_STRENGTH: f32 = 0.75;
const FILL: [f32; 3] = [-0.75, 0.10, 0.65];
pub(super) const FILL_STRENGTH: f32 = 0.15;
pub(super) const AMBIENT: f32 = 0.10;

/// What is less opaque than half a step of a 16-bit texture is the tail of a
/// filter, not a surface: it is not recorded.
pub(super) const LEAST_ALPHA: f32 = 0.5 / 65535.0;
/// The greatest colour: beyond half precision there is no need to go.
pub(super) const MOST_COLOUR: f32 = 65504.0;

/// What shading makes of a fragment.
pub(super) struct Shaded {
    pub(super) colour: [f32; 3],
    pub(super) alpha: f32,
    /// What of the colour comes from the key light, where that is asked for; else nothing.
    pub(super) direct: [f32; 3],
}

impl Shaded {
    /// Puts it into a fragment.
    pub(super) fn put(self, fragment: &mut Fragment) {
        fragment.colour = self.colour;
        fragment.alpha = self.alpha;
        let optional = &mut fragment.optional;
        [optional.direct_r, optional.direct_g, optional.direct_b] = self.direct;
    }
}

/// Shades fragments of a scene.
pub(crate) struct Shader<'a> {
    pub(super) scene: &'a Scene,
    pub(super) camera: &'a Camera,
    /// Unit vectors towards the lights, in the scene's space.
    pub(super) key: Vec3,
    pub(super) fill: Vec3,
    /// Whether the key light's part of colours is asked for.
    pub(super) apart: bool,
    pub(super) alpha: Option<f32>,
    /// How it changes with the angle.
    pub(super) opacity: Opacity,
    /// Whether a screen door leaves nothing that lets light through.
    cut: bool,
    /// What the trace's colours stand for.
    pub(super) space: Space,
}

impl<'a> Shader<'a> {
    /// An alpha that is given replaces the materials' own; texture alphas still
    /// multiply it. A light that is given is the key light.
    pub(super) fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        options: &CaptureOptions,
        space: Space,
    ) -> Self {
        let CaptureOptions { alpha, light, opacity, .. } = *options;
        let key = turned(camera, KEY);
        let key = light.map_or(key, |light| light.towards(key)).as_vec3();
        let fill = turned(camera, FILL).as_vec3();
        let (apart, cut) = (light.is_some(), options.screen_door.is_some());
        Shader { scene, camera, key, fill, apart, alpha, opacity, cut, space }
    }

    /// Material `index`.
    pub(super) fn material(&self, index: usize) -> &Material {
        &self.scene.materials[index]
    }

    /// Whether any fragment of this material may have an alpha below 1.
    pub(super) fn may_let_through(&self, index: usize) -> bool {
        let material = self.material(index);
        let own = match self.alpha {
            Some(alpha) => alpha < 1.0,
            None => material.transmission > 0.0,
        };
        own || self.opacity.varies() || material.alpha_mode == AlphaMode::Blend
    }

    /// The one alpha that every fragment of the scene has, if there is one.
    pub(super) fn constant_alpha(&self) -> Option<f32> {
        if self.cut {
            return Some(1.0);
        }
        if self.opacity.varies() {
            return None;
        }
        let mut common = None;
        for shape in &self.scene.shapes {
            let material = self.material(shape.material());
            let vertex_alpha = match shape {
                crate::scene::Shape::Splats(_) => return None,
                crate::scene::Shape::Mesh(m) => &m.colours,
                crate::scene::Shape::Strands(s) => &s.colours,
                crate::scene::Shape::Particles(p) => &p.colours,
            };
            let uniform = vertex_alpha.iter().all(|c| c.w == 1.0);
            let textured = material.alpha_texture.is_some()
                || material
                    .base_texture
                    .is_some_and(|t| self.scene.textures[t.texture].has_alpha());
            let alpha = match (self.alpha, material.alpha_mode) {
                (None, AlphaMode::Opaque) if material.transmission == 0.0 => 1.0,
                (None, AlphaMode::Mask { .. }) if material.transmission == 0.0 => 1.0,
                (Some(alpha), AlphaMode::Opaque | AlphaMode::Mask { .. }) => alpha,
                (Some(alpha), AlphaMode::Blend) if uniform && !textured => alpha,
                (None, AlphaMode::Blend)
                    if uniform && !textured && material.transmission == 0.0 =>
                {
                    material.base.w.clamp(0.0, 1.0)
                }
                _ => return None,
            };
            if *common.get_or_insert(alpha) != alpha {
                return None;
            }
        }
        common
    }

    /// Colour and alpha of a fragment of `triangle` where its vertices
    /// have these weights; `None` where there is nothing: an alpha of 0 or next to
    /// it, or cut out by a mask. The plain text of what [`Batch`](crate::capture::batch::Batch)
    /// does with several at a time.
    pub(super) fn shade(&self, triangle: &Triangle, weights: &Weights) -> Option<Shaded> {
        let material = self.material(triangle.material);
        let [a, b, c] = &triangle.vertices;
        // From the first vertex on, so that what is equal at all three stays exactly that.
        let [_, w1, w2] = weights.at.map(|w| w as f32);
        let colour = a.colour + (b.colour - a.colour) * w1 + (c.colour - a.colour) * w2;
        let mut base = material.base * colour;
        let texel = |t: TextureUse| {
            let [a, b, c] = triangle.vertices.each_ref().map(|v| v.uvs[t.set]);
            // The weights' changes add up to 0.
            let turned = |w: &[f64; 3]| (b - a) * w[1] as f32 + (c - a) * w[2] as f32;
            let turn = |v: Vec2| t.transform.matrix2 * v;
            let at = t.transform.transform_point2(a + turned(&weights.at));
            let (dx, dy) = (turn(turned(&weights.dx)), turn(turned(&weights.dy)));
            self.scene.textures[t.texture].sample(at, dx, dy)
        };
        let base_texel = material.base_texture.map_or(Vec4::ONE, texel);
        // What the textures and the vertices say; the material's own factor is what
        // `--alpha` replaces.
        let detail_alpha =
            colour.w * base_texel.w * material.alpha_texture.map_or(1.0, |t| texel(t).x);
        base *= base_texel;

        let own = self.alpha.unwrap_or(material.base.w);
        let mut alpha = match material.alpha_mode {
            AlphaMode::Opaque => self.alpha.unwrap_or(1.0),
            AlphaMode::Mask { cutoff } => {
                if material.base.w * detail_alpha < cutoff {
                    return None;
                }
                self.alpha.unwrap_or(1.0)
            }
            AlphaMode::Blend => own * detail_alpha,
        };
        if self.alpha.is_none() && material.transmission > 0.0 {
            let tint = (base.x + base.y + base.z) / 3.0;
            let share = material.transmission_texture.map_or(1.0, |t| texel(t).x);
            let through = material.transmission.clamp(0.0, 1.0) * share;
            alpha *= 1.0 - through * tint.clamp(0.0, 1.0);
        }
        let mut alpha = alpha.clamp(0.0, 1.0);
        let seen = (self.opacity.varies() || !material.unlit).then(|| self.seen(triangle, weights));
        if let Some((_, facing)) = seen.filter(|_| self.opacity.varies()) {
            alpha = self.opacity.alpha(alpha, facing);
        }
        if alpha.is_nan() || alpha < LEAST_ALPHA {
            return None;
        }

        let mut colour = base.truncate();
        let mut direct = [0.0; 3];
        if let Some((normal, _)) = seen.filter(|_| !material.unlit) {
            let [light, key] = self.light(normal);
            if self.apart {
                let part = (colour * key).clamp(Vec3::ZERO, Vec3::splat(MOST_COLOUR));
                direct = part.to_array();
            }
            colour *= light;
        }
        let glow = material.emissive_texture.map_or(Vec3::ONE, |t| texel(t).truncate());
        colour += material.emissive * glow;
        // Negative light is no colour.
        let colour = colour.clamp(Vec3::ZERO, Vec3::splat(MOST_COLOUR)).to_array();
        let colour = match self.space {
            Space::Linear => colour,
            space => colour.map(|c| space.of_linear(f64::from(c)) as f32),
        };
        Some(Shaded { colour, alpha, direct })
    }

    /// The normal on the side that the camera sees, and its cosine with the way there.
    fn seen(&self, triangle: &Triangle, weights: &Weights) -> (Vec3, f32) {
        let [a, b, c] = &triangle.vertices;
        let w = weights.at;
        let normal = a.normal * w[0] as f32 + b.normal * w[1] as f32 + c.normal * w[2] as f32;
        let point = a.position * w[0] + b.position * w[1] + c.position * w[2];
        let towards = self.camera.towards(point).as_vec3();
        let normal = normal.normalize_or(towards);
        let facing = normal.dot(towards);
        if facing < 0.0 { (-normal, -facing) } else { (normal, facing) }
    }

    /// The light that a diffuse surface with this normal reflects towards the camera, per unit of
    /// its colour. Beside it the key light's part.
    fn light(&self, normal: Vec3) -> [f32; 2] {
        let key = KEY_STRENGTH * normal.dot(self.key).max(0.0);
        [AMBIENT + key + FILL_STRENGTH * normal.dot(self.fill).max(0.0), key]
    }
}

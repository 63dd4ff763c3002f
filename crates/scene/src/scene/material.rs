//! What surfaces are made of.

use glam::{Affine2, Vec3, Vec4};

/// A texture as a material shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Which of the scene's textures.
    pub texture: usize,
    /// From the mesh's texture coordinates to the texture's.
    pub transform: Affine2,
    /// Which of the mesh's two sets of texture coordinates: 0 or 1.
    pub set: usize,
}

impl TextureUse {
    /// The texture with the mesh's first coordinates as they are.
    pub fn plain(texture: usize) -> Self {
        TextureUse { texture, transform: Affine2::IDENTITY, set: 0 }
    }
}

/// What becomes of a material's alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// It is ignored: the surface is opaque.
    Opaque,
    /// At or above the cutoff the surface is opaque, below it is not there.
    Mask {
        /// The least alpha that is there.
        cutoff: f32,
    },
    /// It is the surface's alpha.
    Blend,
}

/// A diffuse material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name, for people.
    pub name: String,
    /// Linear colour and alpha.
    pub base: Vec4,
    /// Multiplied into `base`.
    pub base_texture: Option<TextureUse>,
    /// A texture whose red channel is multiplied into the alpha.
    pub alpha_texture: Option<TextureUse>,
    /// What becomes of the alpha.
    pub alpha_mode: AlphaMode,
    /// The share of light let through where the surface is, in [0, 1]: a
    /// transmissive surface of base colour `b` has its alpha lowered by
    /// `transmission · mean(b)`, so that clear glass nearly vanishes and tinted
    /// glass keeps what its tint absorbs.
    pub transmission: f32,
    /// A texture whose red channel is multiplied into `transmission`.
    pub transmission_texture: Option<TextureUse>,
    /// Whether its back is drawn too.
    pub double_sided: bool,
    /// Light of its own, linear.
    pub emissive: Vec3,
    /// Multiplied into `emissive`.
    pub emissive_texture: Option<TextureUse>,
    /// Whether it shows its colour as it is, without light and shade.
    pub unlit: bool,
}

impl Default for Material {
    /// White, opaque, diffuse, seen from both sides.
    fn default() -> Self {
        Material {
            name: String::new(),
            base: Vec4::ONE,
            base_texture: None,
            alpha_texture: None,
            alpha_mode: AlphaMode::Opaque,
            transmission: 0.0,
            transmission_texture: None,
            double_sided: true,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            unlit: false,
        }
    }
}

impl Material {
    /// A diffuse material of a linear colour and alpha.
    pub fn diffuse(name: &str, colour: [f32; 3], alpha: f32) -> Self {
        let [r, g, b] = colour;
        Material {
            name: name.to_string(),
            base: Vec4::new(r, g, b, alpha),
            alpha_mode: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        }
    }
}

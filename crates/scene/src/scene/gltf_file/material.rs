//! The materials of glTF files.

use glam::{Affine2, Vec2, Vec3, Vec4};

use super::Loader;
use super::document::shortened;
use super::json::{self, TextureInfo};
use super::warnings::Matter;
use crate::scene::texture::Encoding;
use crate::scene::{AlphaMode, Material, TextureUse};
use screendoor_trace::error::{Result, one_line};

/// How many sets of texture coordinates a material can use.
pub(super) const SETS: usize = 2;

/// A material of the file, as the scene has it.
#[derive(Clone, Debug)]
pub(super) struct Made {
    /// Which of the scene's materials.
    pub material: usize,
    /// The sets of texture coordinates that it uses, by the file's numbers; the first one
    /// where it has no texture, for one that may be put on it.
    pub sets: Vec<u32>,
    /// Whether it has a texture.
    pub textured: bool,
    /// What of it is not drawn.
    pub matters: Vec<Matter>,
}

/// What a material's textures need while they are gathered.
#[derive(Default)]
struct Gathered {
    sets: Vec<u32>,
    matters: Vec<Matter>,
}

impl Loader<'_> {
    /// The material of that number; the default one where a primitive names none.
    pub(super) fn material(&mut self, index: Option<usize>, namer: &str) -> Result<Made> {
        if let Some(made) = self.materials.get(&index) {
            return Ok(made.clone());
        }
        let default = json::Material::default();
        let (said, part) = match index {
            None => (&default, "the default material".to_string()),
            Some(i) => match self.root.materials.get(i) {
                Some(said) => (said, format!("material {i}")),
                None => {
                    let what = format!("it names material {i}, which is not there");
                    return Err(self.bad(namer, what, "export the file again"));
                }
            },
        };
        let made = self.make(said, &part)?;
        self.materials.insert(index, made.clone());
        Ok(made)
    }

    fn make(&mut self, said: &json::Material, part: &str) -> Result<Made> {
        let cutoff = said.alpha_cutoff.unwrap_or(0.5);
        let alpha_mode = match said.alpha_mode.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask { cutoff },
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => {
                let what =
                    format!("its alphaMode '{}' is not one that glTF allows", shortened(other));
                return Err(self.bad(part, what, "export the file again"));
            }
        };
        let extensions = &said.extensions;
        let transmission: Option<json::Transmission> =
            self.said(extensions, "KHR_materials_transmission", part)?;
        let strength: Option<json::EmissiveStrength> =
            self.said(extensions, "KHR_materials_emissive_strength", part)?;
        let specular: Option<json::SpecularGlossiness> =
            self.said(extensions, "KHR_materials_pbrSpecularGlossiness", part)?;
        let unlit = extensions.has("KHR_materials_unlit");

        let mut gathered =
            Gathered { matters: self.warnings.extensions(extensions.names()), sets: Vec::new() };
        self.tell_unread(said, &mut gathered);
        // The older extension says in its own way what is in the core now.
        let pbr = &said.pbr_metallic_roughness;
        let (factor, base_info) = match &specular {
            Some(specular) => (specular.diffuse_factor, &specular.diffuse_texture),
            None => (pbr.base_color_factor, &pbr.base_color_texture),
        };
        // An opaque surface's texture has no alpha, also where it is filtered.
        let encoding = match alpha_mode {
            AlphaMode::Opaque => Encoding::OpaqueSrgb,
            AlphaMode::Mask { .. } | AlphaMode::Blend => Encoding::Srgb,
        };
        let base_texture = self.texture_use(base_info.as_ref(), encoding, &mut gathered, part)?;
        let transmission_info = transmission.as_ref().and_then(|t| t.transmission_texture.as_ref());
        let transmission_texture =
            self.texture_use(transmission_info, Encoding::OpaqueLinear, &mut gathered, part)?;
        // What is unlit shows its colour alone.
        let emissive_info = said.emissive_texture.as_ref().filter(|_| !unlit);
        let emissive_texture =
            self.texture_use(emissive_info, Encoding::OpaqueSrgb, &mut gathered, part)?;
        let emissive = if unlit || emissive_info.is_some() && emissive_texture.is_none() {
            // The factor alone would flood the surface with the light that the
            // missing texture was to confine.
            Vec3::ZERO
        } else {
            let strength = strength.and_then(|s| s.emissive_strength).unwrap_or(1.0);
            Vec3::from(said.emissive_factor) * strength
        };
        self.scene.materials.push(Material {
            name: one_line(said.name.as_deref().unwrap_or("")),
            base: Vec4::from(factor.unwrap_or([1.0; 4])),
            base_texture,
            alpha_texture: None,
            alpha_mode,
            transmission: transmission.map_or(0.0, |t| t.transmission_factor),
            transmission_texture,
            double_sided: said.double_sided,
            emissive,
            emissive_texture,
            unlit,
        });
        let Gathered { mut sets, matters } = gathered;
        let textured = !sets.is_empty();
        if !textured {
            sets.push(0);
        }
        Ok(Made { material: self.scene.materials.len() - 1, sets, textured, matters })
    }

    /// Tells of the textures that a diffuse surface has no use for.
    fn tell_unread(&mut self, said: &json::Material, gathered: &mut Gathered) {
        let unread = [
            (&said.normal_texture, "normal", "surfaces are shaded by their vertices' normals"),
            (&said.occlusion_texture, "occlusion", "nothing is darkened by what is near"),
            (
                &said.pbr_metallic_roughness.metallic_roughness_texture,
                "metallicRoughness",
                "surfaces are diffuse",
            ),
        ];
        for (_, name, instead) in unread.iter().filter(|(info, ..)| info.is_some()) {
            let what = format_args!("{name} textures are not read: {instead}");
            gathered.matters.push(self.warnings.matter(what));
        }
    }

    fn texture_use(
        &mut self,
        info: Option<&TextureInfo>,
        encoding: Encoding,
        gathered: &mut Gathered,
        part: &str,
    ) -> Result<Option<TextureUse>> {
        let Some(info) = info else { return Ok(None) };
        gathered.matters.extend(self.warnings.extensions(info.extensions.names()));
        let transform: Option<json::TextureTransform> =
            self.said(&info.extensions, "KHR_texture_transform", part)?;
        let set = transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        let transform = transform.map_or(Affine2::IDENTITY, |t| {
            // The extension's own order: scale, then rotate, then move. Its
            // rotation is counter-clockwise with v upwards, ours downwards.
            Affine2::from_scale_angle_translation(
                Vec2::from(t.scale.unwrap_or([1.0; 2])),
                -t.rotation,
                Vec2::from(t.offset),
            )
        });
        let (texture, matters) = self.texture(info.index, encoding, part)?;
        gathered.matters.extend(matters);
        let Some(texture) = texture else { return Ok(None) };
        let sets = &mut gathered.sets;
        let set = match sets.iter().position(|known| *known == set) {
            Some(known) => known,
            None if sets.len() < SETS => {
                sets.push(set);
                sets.len() - 1
            }
            None => {
                let what = format_args!(
                    "materials that use more than {SETS} sets of texture coordinates are drawn \
                     with the first {SETS}"
                );
                gathered.matters.push(self.warnings.matter(what));
                0
            }
        };
        Ok(Some(TextureUse { texture, transform, set }))
    }
}

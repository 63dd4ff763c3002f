//! The materials and textures of glTF files.

use std::borrow::Cow;

use glam::{Affine2, Vec2, Vec3, Vec4};

use super::Loader;
use crate::error::{Result, one_line};
use crate::scene::{AlphaMode, Material, Texture, TextureUse, Wrap};

impl Loader<'_> {
    pub(super) fn material(&mut self, material: &gltf::Material<'_>) -> Result<usize> {
        if let Some(index) = self.materials.get(&material.index()) {
            return Ok(*index);
        }
        let pbr = material.pbr_metallic_roughness();
        let mut texture_use = |info: Option<gltf::texture::Info<'_>>| {
            info.map(|info| self.texture_use(&info)).transpose().map(Option::flatten)
        };
        let base_texture = texture_use(pbr.base_color_texture())?;
        let emissive_texture = texture_use(material.emissive_texture())?;
        if let [Some(base), Some(emissive)] = texture_sets(material)
            && base != emissive
        {
            let name = one_line(material.name().unwrap_or(""));
            self.scene.warnings.push(format!(
                "{}, material '{name}': its emissive texture wants texture coordinates \
                 {emissive}, and is drawn with its base texture's, {base}",
                self.place
            ));
        }
        let emissive = if material.emissive_texture().is_some() && emissive_texture.is_none() {
            // The factor alone would flood the surface with the light that the
            // missing texture was to confine.
            Vec3::ZERO
        } else {
            Vec3::from(material.emissive_factor())
        };
        let made = Material {
            name: one_line(material.name().unwrap_or("")),
            base: Vec4::from(pbr.base_color_factor()),
            base_texture,
            alpha_texture: None,
            alpha_mode: match material.alpha_mode() {
                gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                gltf::material::AlphaMode::Mask => {
                    AlphaMode::Mask { cutoff: material.alpha_cutoff().unwrap_or(0.5) }
                }
                gltf::material::AlphaMode::Blend => AlphaMode::Blend,
            },
            transmission: material.transmission().map_or(0.0, |t| t.transmission_factor()),
            double_sided: material.double_sided(),
            emissive,
            emissive_texture,
            unlit: material.unlit(),
        };
        self.scene.materials.push(made);
        let index = self.scene.materials.len() - 1;
        self.materials.insert(material.index(), index);
        Ok(index)
    }

    fn texture_use(&mut self, info: &gltf::texture::Info<'_>) -> Result<Option<TextureUse>> {
        let transform = info.texture_transform().map_or(Affine2::IDENTITY, |t| {
            // The extension's own order: scale, then rotate, then move. Its
            // rotation is counter-clockwise with v upwards, ours downwards.
            Affine2::from_scale_angle_translation(
                Vec2::from(t.scale()),
                -t.rotation(),
                Vec2::from(t.offset()),
            )
        });
        let texture = self.texture(&info.texture())?;
        Ok(texture.map(|texture| TextureUse { texture, transform }))
    }

    /// The scene's texture for a glTF texture; `None`, with a warning, where its
    /// image is missing.
    fn texture(&mut self, texture: &gltf::Texture<'_>) -> Result<Option<usize>> {
        let wrap = |mode| match mode {
            gltf::texture::WrappingMode::Repeat => Wrap::Repeat,
            gltf::texture::WrappingMode::MirroredRepeat => Wrap::Mirror,
            gltf::texture::WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let wrap = [wrap(texture.sampler().wrap_s()), wrap(texture.sampler().wrap_t())];
        let image = texture.source();
        let key = (image.index(), wrap);
        if let Some(index) = self.textures.get(&key) {
            return Ok(*index);
        }
        let part = format!("image {}", image.index());
        let bytes = self.image(image.index(), &part);
        let place = format!("{}, {part}", self.place);
        let index = match bytes
            .and_then(|bytes| Texture::decode(&bytes, &place))
            .and_then(|texture| self.scene.add_texture(texture.wrapped(wrap)))
        {
            Ok(index) => Some(index),
            Err(e) => {
                self.scene.warnings.push(e.to_string());
                None
            }
        };
        self.textures.insert(key, index);
        Ok(index)
    }

    /// The bytes of an image. The library's own way to them panics where the file
    /// says neither a URI nor a view, or a view without the format, which the bytes
    /// themselves tell.
    fn image(&self, index: usize, part: &str) -> Result<Cow<'_, [u8]>> {
        let bad = |what: &str| Err(self.bad(part, what, "export the file again"));
        let Some(image) = self.document.as_json().images.get(index) else {
            return bad("it is not there");
        };
        let view = image.buffer_view.and_then(|view| self.document.views().nth(view.value()));
        match (view, &image.uri) {
            (Some(view), _) => {
                let buffer = self.buffers.get(view.buffer().index());
                let range = view.offset()..view.offset().saturating_add(view.length());
                match buffer.and_then(|b| b.get(range)) {
                    Some(bytes) => Ok(Cow::Borrowed(bytes)),
                    None => bad("it reaches beyond its buffer"),
                }
            }
            (None, Some(uri)) => self.resolve(uri, part).map(Cow::Owned),
            (None, None) => bad("it names neither a file nor a buffer view"),
        }
    }
}

/// The sets of texture coordinates that a material's base texture and emissive
/// texture want.
pub(super) fn texture_sets(material: &gltf::Material<'_>) -> [Option<u32>; 2] {
    let set = |info: gltf::texture::Info<'_>| {
        info.texture_transform().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord())
    };
    let base = material.pbr_metallic_roughness().base_color_texture();
    [base.map(set), material.emissive_texture().map(set)]
}

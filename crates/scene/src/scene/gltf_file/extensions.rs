//! The extensions of glTF: which are read, and what becomes of the others.

use serde::Deserialize;

use super::json::Said;

/// What a part of a document says beyond the core of glTF: by the names of extensions.
#[derive(Deserialize, Default)]
#[serde(transparent)]
pub(super) struct Extensions(Said);

impl Extensions {
    /// What it says by the extension of that name.
    ///
    /// # Errors
    /// Why it cannot be understood.
    pub(super) fn get<'a, T: Deserialize<'a>>(&'a self, name: &str) -> Result<Option<T>, String> {
        let said = self.0.get(name).filter(|said| !said.is_null());
        said.map(T::deserialize).transpose().map_err(|e| format!("its {name}: {e}"))
    }

    /// Whether it has the extension of that name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// The names of its extensions.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}

/// What becomes of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Treatment {
    /// It is read.
    Read,
    /// It says nothing that a picture could show.
    Passed,
    /// It is not read, and what is drawn is not what it asks for: in which way.
    Warned(&'static str),
    /// It packs data, and is not read: what has no other data is not drawn, and a file
    /// that requires it is refused. How to unpack it.
    Packed(&'static str),
    /// It may mean anything: a file that requires it is refused.
    Unknown(&'static str),
}

impl Treatment {
    /// What to do with a file of which this keeps something from being read.
    pub(super) fn hint(self) -> &'static str {
        match self {
            Treatment::Packed(unpack) => unpack,
            _ => EXPORT,
        }
    }
}

const EXPORT: &str = "export the file without the extension";

/// What becomes of the extension of that name.
pub(super) fn treatment(name: &str) -> Treatment {
    let known = EXTENSIONS.iter().find(|(known, _)| *known == name);
    known.map_or(Treatment::Unknown("it is not known here"), |(_, treatment)| *treatment)
}

/// The extensions that are known: those that Khronos has ratified, and others that are
/// often met.
const EXTENSIONS: &[(&str, Treatment)] = {
    use Treatment::{Packed, Passed, Read, Warned};
    const DIFFUSE: &str = "its materials are drawn as diffuse ones";
    const LIGHTS: &str = "the scene is lit by the capture's own lights";
    const IMAGE: &str = "its images cannot be decoded";
    const KTX: &str =
        "its images cannot be decoded; 'gltf-transform ktxdecompress in.glb out.glb' unpacks them";
    const UNPACK: &str = "unpack it: gltf-transform copy in.glb out.glb";
    &[
        ("EXT_instance_features", Passed),
        ("EXT_lights_ies", Warned(LIGHTS)),
        ("EXT_lights_image_based", Warned(LIGHTS)),
        ("EXT_mesh_features", Passed),
        ("EXT_mesh_gpu_instancing", Read),
        ("EXT_mesh_manifold", Passed),
        ("EXT_meshopt_compression", Packed(UNPACK)),
        ("EXT_structural_metadata", Passed),
        ("EXT_texture_avif", Warned(IMAGE)),
        ("EXT_texture_webp", Read),
        ("KHR_animation_pointer", Warned("animations are not played")),
        ("KHR_draco_mesh_compression", Packed(UNPACK)),
        ("KHR_gaussian_splatting", Read),
        ("KHR_gaussian_splatting_compression_spz_2", Read),
        ("KHR_lights_punctual", Warned(LIGHTS)),
        ("KHR_materials_anisotropy", Warned(DIFFUSE)),
        ("KHR_materials_clearcoat", Warned(DIFFUSE)),
        ("KHR_materials_diffuse_transmission", Warned("no light shines through its materials")),
        ("KHR_materials_dispersion", Warned("light is not refracted")),
        ("KHR_materials_emissive_strength", Read),
        ("KHR_materials_ior", Warned("light is not refracted")),
        ("KHR_materials_iridescence", Warned(DIFFUSE)),
        ("KHR_materials_pbrSpecularGlossiness", Read),
        ("KHR_materials_sheen", Warned(DIFFUSE)),
        ("KHR_materials_specular", Warned(DIFFUSE)),
        ("KHR_materials_transmission", Read),
        ("KHR_materials_unlit", Read),
        ("KHR_materials_variants", Warned("its meshes are drawn with their default materials")),
        ("KHR_materials_volume", Warned("its attenuation is not applied")),
        ("KHR_materials_volume_scatter", Warned("its scattering is not applied")),
        ("KHR_mesh_quantization", Read),
        ("KHR_meshopt_compression", Packed(EXPORT)),
        ("KHR_node_hoverability", Passed),
        ("KHR_node_selectability", Passed),
        ("KHR_node_visibility", Read),
        ("KHR_spz_gaussian_splats_compression", Packed(EXPORT)),
        ("KHR_texture_basisu", Warned(KTX)),
        ("KHR_texture_transform", Read),
        ("KHR_xmp", Passed),
        ("KHR_xmp_json_ld", Passed),
        ("MSFT_lod", Warned("everything is drawn at its finest level")),
        ("MSFT_texture_dds", Warned(IMAGE)),
    ]
};

/// The extensions that name a texture's image, none of which is read but the first.
pub(super) const TEXTURE_SOURCES: [&str; 4] =
    ["EXT_texture_webp", "KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_extension_is_listed_once_and_found() {
        assert!(EXTENSIONS.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(treatment("KHR_xmp"), Treatment::Passed);
        assert!(matches!(treatment("ACME_glow"), Treatment::Unknown(_)));
        assert!(TEXTURE_SOURCES.iter().all(|name| EXTENSIONS.iter().any(|(n, _)| n == name)));
    }
}

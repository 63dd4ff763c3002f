//! The kits' shaders.

use crate::contract::shader::Shader;
use crate::shader;

/// What the shaders of designs may use beside the device's own, each the twin of the Rust
/// file of the same name.
pub const SHADERS: &[Shader] = &[
    shader!("contract/", "colour"),
    shader!("stochastic/", "comb"),
    shader!("stochastic/", "dither"),
    shader!("stochastic/", "hits"),
    shader!("layered/", "layered"),
    shader!("layered/", "layers"),
    shader!("contract/", "opacity"),
    shader!("contract/", "over_opaque"),
    shader!("stochastic/", "pixel_order"),
    shader!("stochastic/", "reference_value"),
    shader!("stochastic/", "round"),
    shader!("contract/", "samples"),
    shader!("stochastic/", "stochastic"),
    shader!("stochastic/", "subset"),
    shader!("stochastic/", "surface"),
    shader!("stochastic/", "tracked"),
    shader!("blended/", "view_depth"),
];

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn every_shader_is_listed() {
        let kits = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let mut found = Vec::new();
        for folder in ["blended", "contract", "layered", "stochastic"] {
            for file in std::fs::read_dir(kits.join(folder)).unwrap() {
                let path = file.unwrap().path();
                if path.extension().is_some_and(|e| e == "wgsl") {
                    found.push(path.file_stem().unwrap().to_string_lossy().into_owned());
                }
            }
        }
        found.sort();
        assert_eq!(found, SHADERS.iter().map(|s| s.name).collect::<Vec<_>>());
    }
}

//! The compiled shaders, by the names of their sources.

use ash::vk;

use crate::failure::Result;
use crate::gpu::Gpu;

#[derive(Clone, Copy)]
pub(crate) struct Shader {
    pub(crate) kind: vk::ShaderStageFlags,
    pub(crate) code: &'static [u8],
}

macro_rules! shaders {
    ($($name:ident: $kind:ident $file:literal,)*) => {$(
        pub(crate) const $name: Shader = Shader {
            kind: vk::ShaderStageFlags::$kind,
            code: include_bytes!(concat!("shaders/", $file, ".spv")),
        };
    )*};
}

shaders! {
    SHAPE: VERTEX "shape.vert",
    PUSH_VERTEX: VERTEX "push.vert",
    VIEW: VERTEX "view.vert",
    DRAW_ID: VERTEX "draw-id.vert",
    INDEXED: VERTEX "indexed.vert",
    CONTROL: TESSELLATION_CONTROL "tessellation.tesc",
    EVALUATION: TESSELLATION_EVALUATION "tessellation.tese",
    GEOMETRY: GEOMETRY "geometry.geom",
    LAYERED: GEOMETRY "layered.geom",
    MESH: MESH_EXT "mesh.mesh",
    COLOUR: FRAGMENT "colour.frag",
    PREMULTIPLIED: FRAGMENT "premultiplied.frag",
    DISCARD: FRAGMENT "discard.frag",
    DEPTH_OUTPUT: FRAGMENT "depth-output.frag",
    MASK_OUTPUT: FRAGMENT "mask-output.frag",
    PER_SAMPLE: FRAGMENT "per-sample.frag",
    EARLY_TESTS: FRAGMENT "early-tests.frag",
    PUSH: FRAGMENT "push.frag",
    ONE_SET: FRAGMENT "sets-1.frag",
    TWO_SETS: FRAGMENT "sets-2.frag",
    FOUR_SETS: FRAGMENT "sets-4.frag",
    SEVEN_SETS: FRAGMENT "sets-7.frag",
    EIGHT_SETS: FRAGMENT "sets-8.frag",
    DUAL_SOURCE: FRAGMENT "dual-source.frag",
    TWO_TARGETS: FRAGMENT "two-targets.frag",
    INTEGER: FRAGMENT "integer.frag",
    INPUT: FRAGMENT "input.frag",
}

impl Shader {
    pub(crate) fn words(self) -> Vec<u32> {
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, &b| word << 8 | u32::from(b));
        self.code.chunks(4).map(word).collect()
    }

    pub(crate) fn module(self, gpu: &Gpu) -> Result<vk::ShaderModule> {
        let words = self.words();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a compiler's.
        unsafe {
            let module = gpu.device.create_shader_module(&info, None)?;
            gpu.at_end(move |d| d.destroy_shader_module(module, None));
            Ok(module)
        }
    }

    pub(crate) fn stage(self, gpu: &Gpu) -> Result<vk::PipelineShaderStageCreateInfo<'static>> {
        let module = self.module(gpu)?;
        Ok(vk::PipelineShaderStageCreateInfo::default()
            .stage(self.kind)
            .module(module)
            .name(c"main"))
    }
}

//! The shaders of pipelines: how their stages are given, and rewritten.

use std::ffi::CStr;
use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::device::{Device, SETTINGS};
use crate::objects::Objects;
use crate::pipelines::words;
use crate::spirv::{self, Facts, Output};

/// A stage of a pipeline that is made.
pub(crate) struct Stage {
    pub stage: vk::ShaderStageFlags,
    pub entry: String,
    pub code: Option<Arc<[u32]>>,
}

impl Stage {
    fn code(&self) -> Result<&[u32], String> {
        self.code.as_deref().ok_or_else(|| "its text is not given".into())
    }
}

/// The stages of a pipeline.
///
/// # Safety
/// As the program gave it.
pub(crate) unsafe fn stages(
    objects: &Objects,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
) -> Vec<Stage> {
    let all = unsafe { slice(info.p_stages, info.stage_count) };
    let s_type = vk::StructureType::SHADER_MODULE_CREATE_INFO;
    all.iter()
        .map(|stage| unsafe {
            let given = find::<vk::ShaderModuleCreateInfo<'_>>(stage.p_next, s_type);
            let code = match (stage.module.is_null(), given) {
                (false, _) => objects.shaders.get(&stage.module.as_raw()).cloned(),
                (true, given) => given.map(|given| Arc::from(words(&*given))),
            };
            let entry = CStr::from_ptr(stage.p_name).to_string_lossy().into_owned();
            Stage { stage: stage.stage, entry, code }
        })
        .collect()
}

/// A pipeline's shaders as we have them: by stage's place, the rewritten words.
#[derive(Default)]
pub(crate) struct Rewritten {
    pub shaders: Vec<(usize, Vec<u32>)>,
    /// Of the fragment shader.
    pub facts: Option<Facts>,
    pub refused: String,
    pub draw_index: bool,
}

/// Stages other than of vertices and fragments.
fn other_stage(stage: vk::ShaderStageFlags) -> Option<&'static str> {
    use vk::ShaderStageFlags as S;
    [
        (S::GEOMETRY, "a geometry shader"),
        (S::TESSELLATION_CONTROL, "tessellation"),
        (S::TESSELLATION_EVALUATION, "tessellation"),
        (S::MESH_EXT, "a mesh shader"),
        (S::TASK_EXT, "a task shader"),
    ]
    .into_iter()
    .find(|(s, _)| stage.contains(*s))
    .map(|(_, name)| name)
}

/// `BuiltIn DrawIndex` as SPIR-V decorates with it.
const DRAW_INDEX: [u32; 2] = [11, 4426];

/// Rewrites a pipeline's shaders. The vertex shader is rewritten wherever it can be, so that all
/// pipelines with it put the vertices at the same place; the fragment shader where nothing is
/// `refused`.
pub(crate) fn rewrite(d: &Device, stages: &[Stage], library: bool, refused: &str) -> Rewritten {
    let mut made = Rewritten { refused: refused.into(), ..Rewritten::default() };
    let place = |s: vk::ShaderStageFlags| stages.iter().position(|stage| stage.stage == s);
    let codes = || stages.iter().filter_map(|stage| stage.code.as_ref());
    made.draw_index = codes().any(|code| code.windows(2).any(|pair| pair == DRAW_INDEX));
    if let Some(other) = stages.iter().find_map(|stage| other_stage(stage.stage)) {
        made.refused = format!("it has {other}");
        return made;
    }
    // A library sees one side only: both use one location that programs hardly reach.
    let mut instance = library.then(|| d.locations.saturating_sub(2));
    let fragment = place(vk::ShaderStageFlags::FRAGMENT);
    if let Some(at) = place(vk::ShaderStageFlags::VERTEX) {
        match vertex(d, &stages[at], fragment.map(|at| &stages[at]), instance) {
            Ok((location, words)) => {
                instance = Some(location);
                made.shaders.push((at, words));
            }
            Err(why) => {
                made.refused = format!("its vertex shader: {why}");
                return made;
            }
        }
    }
    let Some(at) = fragment.filter(|_| made.refused.is_empty()) else { return made };
    let options = spirv::Options {
        set: d.set_index,
        location: SETTINGS.location,
        primitive_id: d.primitive_id,
        address: d.resources.address(),
        instance,
    };
    let rewritten = stages[at].code().and_then(|c| spirv::fragment(c, &stages[at].entry, &options));
    match rewritten {
        Ok((_, facts)) if facts.output == Output::Integer => {
            made.refused = "its output is an integer".into();
            made.facts = Some(facts);
        }
        Ok((words, facts)) => {
            made.shaders.push((at, words));
            made.facts = Some(facts);
        }
        Err(why) => made.refused = format!("its fragment shader: {why}"),
    }
    made
}

/// Rewrites a vertex shader, which hands down the instance's number at a location: `fixed`, or the
/// first that neither it nor the fragment shader has.
fn vertex(
    d: &Device,
    stage: &Stage,
    fragment: Option<&Stage>,
    fixed: Option<u32>,
) -> Result<(u32, Vec<u32>), String> {
    let code = stage.code()?;
    let location = match fixed {
        Some(location) => location,
        None => {
            let own = spirv::outputs(code, &stage.entry)?;
            let read = fragment.and_then(|f| spirv::inputs(f.code().ok()?, &f.entry).ok());
            own.max(read.unwrap_or(0))
        }
    };
    if location >= d.locations {
        return Err("no location is free".into());
    }
    Ok((location, spirv::vertex(code, &stage.entry, location)?))
}

//! Our own pipeline beside one of the program's: the same, of rewritten shaders and libraries.

use std::ffi::c_void;
use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::abi::{chain, slice};
use crate::device::Device;
use crate::pipelines::Pipeline;
use crate::table::next;

/// A pipeline as the program's, of rewritten shaders and libraries.
///
/// # Safety
/// As the program gave it.
pub(crate) unsafe fn create(
    d: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    shaders: &[(usize, Vec<u32>)],
    libraries: &[Arc<Pipeline>],
    recorded: bool,
) -> Result<vk::Pipeline, String> {
    let mut stages = unsafe { slice(info.p_stages, info.stage_count).to_vec() };
    let mut modules = Vec::new();
    let mut replaced = Ok(());
    for (at, words) in shaders {
        match unsafe { replace(d, &mut stages[*at], words) } {
            Ok(module) => modules.push(module),
            Err(why) => replaced = Err(why),
        }
    }
    let mut ours = *info;
    ours.p_stages = stages.as_ptr();
    ours.flags &= !NOT_OURS;
    let made = replaced.and_then(|()| {
        let chain = unsafe { Chain::copy(info.p_next, libraries, recorded) }?;
        ours.p_next = chain.first;
        let (none, null) = (vk::PipelineCache::null(), std::ptr::null());
        let mut made = vk::Pipeline::null();
        let result: vk::Result =
            next!(d.table.create_pipelines, d.handle, none, 1, &ours, null, &mut made);
        match result {
            vk::Result::SUCCESS => Ok(made),
            result => Err(format!("the driver does not make it, rewritten: {result}")),
        }
    });
    for module in modules {
        let () = next!(d.table.destroy_shader_module, d.handle, module, std::ptr::null());
    }
    made
}

/// Structures of a chain that are as the program gave them wherever they stand.
const KEPT: [(vk::StructureType, usize); 8] = {
    use vk::StructureType as S;
    [
        (S::PIPELINE_RENDERING_CREATE_INFO, size_of::<vk::PipelineRenderingCreateInfo<'_>>()),
        (
            S::GRAPHICS_PIPELINE_LIBRARY_CREATE_INFO_EXT,
            size_of::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(),
        ),
        (
            S::PIPELINE_ROBUSTNESS_CREATE_INFO_EXT,
            size_of::<vk::PipelineRobustnessCreateInfoEXT<'_>>(),
        ),
        (
            S::PIPELINE_DISCARD_RECTANGLE_STATE_CREATE_INFO_EXT,
            size_of::<vk::PipelineDiscardRectangleStateCreateInfoEXT<'_>>(),
        ),
        (
            S::PIPELINE_FRAGMENT_SHADING_RATE_STATE_CREATE_INFO_KHR,
            size_of::<vk::PipelineFragmentShadingRateStateCreateInfoKHR<'_>>(),
        ),
        (
            S::RENDERING_INPUT_ATTACHMENT_INDEX_INFO_KHR,
            size_of::<vk::RenderingInputAttachmentIndexInfoKHR<'_>>(),
        ),
        (S::PIPELINE_LIBRARY_CREATE_INFO_KHR, size_of::<vk::PipelineLibraryCreateInfoKHR<'_>>()),
        (
            S::PIPELINE_CREATE_FLAGS_2_CREATE_INFO_KHR,
            size_of::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(),
        ),
    ]
};

/// Where the program says what is not ours to do: other libraries, what is told of the making of a
/// pipeline, what it is not to be made for.
const CHANGED: [vk::StructureType; 3] = [
    vk::StructureType::PIPELINE_LIBRARY_CREATE_INFO_KHR,
    vk::StructureType::PIPELINE_CREATION_FEEDBACK_CREATE_INFO,
    vk::StructureType::PIPELINE_CREATE_FLAGS_2_CREATE_INFO_KHR,
];

/// A copy of a chain as far as it is changed; the program's own, which another thread may be reading,
/// follows.
struct Chain {
    first: *const c_void,
    /// What the copies point at lives as long as they.
    _copies: Vec<Box<[u64]>>,
    _libraries: Box<[vk::Pipeline]>,
}

impl Chain {
    /// # Safety
    /// As [`chain`].
    unsafe fn copy(
        first: *const c_void,
        libraries: &[Arc<Pipeline>],
        recorded: bool,
    ) -> Result<Self, String> {
        let all: Vec<_> = unsafe { chain(first) }.collect();
        let s_type = |s: &*mut vk::BaseOutStructure<'_>| unsafe { (**s).s_type };
        let Some(last) = all.iter().rposition(|s| CHANGED.contains(&s_type(s))) else {
            return Ok(Self { first, _copies: Vec::new(), _libraries: Box::new([]) });
        };
        let (mut copies, mut ours) = (Vec::new(), Vec::new());
        for structure in &all[..=last] {
            let kind = s_type(structure);
            if kind == vk::StructureType::PIPELINE_CREATION_FEEDBACK_CREATE_INFO {
                continue;
            }
            let size = KEPT.iter().find(|(s, _)| *s == kind).map(|(_, size)| *size);
            let size =
                size.ok_or_else(|| format!("its structure {} is not known", kind.as_raw()))?;
            let mut copy = vec![0_u64; size.div_ceil(8)].into_boxed_slice();
            let to = copy.as_mut_ptr().cast::<u8>();
            unsafe { std::ptr::copy_nonoverlapping(structure.cast::<u8>(), to, size) };
            match kind {
                vk::StructureType::PIPELINE_LIBRARY_CREATE_INFO_KHR => unsafe {
                    let named = &mut *to.cast::<vk::PipelineLibraryCreateInfoKHR<'_>>();
                    let theirs = slice(named.p_libraries, named.library_count);
                    if theirs.len() != libraries.len() {
                        return Err("one of its libraries is not known".into());
                    }
                    // Fragment shaders need what our vertex shaders hand down.
                    let twin = |l: &Pipeline| !l.ours.is_null() && (recorded || !l.parts.fragment);
                    let own = |l: &Arc<Pipeline>| if twin(l) { l.ours } else { l.theirs };
                    ours = libraries.iter().map(own).collect();
                },
                vk::StructureType::PIPELINE_CREATE_FLAGS_2_CREATE_INFO_KHR => unsafe {
                    let flags = &mut *to.cast::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>();
                    flags.flags &= !vk::PipelineCreateFlags2KHR::from_raw(NOT_OURS.as_raw().into());
                },
                _ => {}
            }
            copies.push(copy);
        }
        let libraries = ours.into_boxed_slice();
        let mut next = unsafe { (*all[last]).p_next }.cast_const().cast::<c_void>();
        for copy in copies.iter_mut().rev() {
            let at = copy.as_mut_ptr().cast::<vk::BaseOutStructure<'_>>();
            unsafe {
                (*at).p_next = next.cast_mut().cast();
                if (*at).s_type == vk::StructureType::PIPELINE_LIBRARY_CREATE_INFO_KHR {
                    let named = at.cast::<vk::PipelineLibraryCreateInfoKHR<'_>>();
                    (*named).p_libraries = libraries.as_ptr();
                }
            }
            next = at.cast_const().cast();
        }
        Ok(Self { first: next, _copies: copies, _libraries: libraries })
    }
}

/// What it is to be derived from, or not to be compiled for, is the program's affair.
const NOT_OURS: vk::PipelineCreateFlags = vk::PipelineCreateFlags::from_raw(
    vk::PipelineCreateFlags::DERIVATIVE.as_raw()
        | vk::PipelineCreateFlags::FAIL_ON_PIPELINE_COMPILE_REQUIRED.as_raw()
        | vk::PipelineCreateFlags::EARLY_RETURN_ON_FAILURE.as_raw(),
);

/// Has a stage run other words.
///
/// # Safety
/// As the program gave it.
unsafe fn replace(
    d: &Device,
    stage: &mut vk::PipelineShaderStageCreateInfo<'_>,
    words: &[u32],
) -> Result<vk::ShaderModule, String> {
    let given = vk::StructureType::SHADER_MODULE_CREATE_INFO;
    // A module given with the stage goes; where it stands behind another structure, that is the
    // program's and stays as it is.
    let first = stage.p_next.cast::<vk::BaseInStructure<'_>>();
    if !first.is_null() && unsafe { (*first).s_type } == given {
        stage.p_next = unsafe { (*first).p_next.cast() };
    } else if unsafe { chain(stage.p_next).any(|s| (*s).s_type == given) } {
        return Err("its shader's text stands behind another structure".into());
    }
    let info = vk::ShaderModuleCreateInfo::default().code(words);
    let mut module = vk::ShaderModule::null();
    let null = std::ptr::null();
    let result: vk::Result =
        next!(d.table.create_shader_module, d.handle, &info, null, &mut module);
    result.result().map_err(|e| format!("the driver refuses its shader, rewritten: {e}"))?;
    stage.module = module;
    Ok(module)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abi::find;

    #[test]
    fn a_chain_is_copied_as_far_as_it_is_changed() {
        use vk::StructureType as S;
        let mut tail = vk::PipelineRobustnessCreateInfoEXT::default();
        let mut flags = vk::PipelineCreateFlags2CreateInfoKHR::default().flags(
            vk::PipelineCreateFlags2KHR::DERIVATIVE
                | vk::PipelineCreateFlags2KHR::DISABLE_OPTIMIZATION,
        );
        let mut feedback = vk::PipelineCreationFeedbackCreateInfo::default();
        let formats = [vk::Format::R8G8B8A8_UNORM];
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        flags.p_next = (&raw mut tail).cast();
        feedback.p_next = (&raw mut flags).cast();
        rendering.p_next = (&raw mut feedback).cast();
        let first = (&raw const rendering).cast();
        unsafe {
            let copy = Chain::copy(first, &[], true).unwrap();
            let kinds: Vec<_> = chain(copy.first).map(|s| (*s).s_type).collect();
            let tail = S::PIPELINE_ROBUSTNESS_CREATE_INFO_EXT;
            let kept = S::PIPELINE_CREATE_FLAGS_2_CREATE_INFO_KHR;
            assert!(kinds == [S::PIPELINE_RENDERING_CREATE_INFO, kept, tail]);
            let ours = find::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(copy.first, kept).unwrap();
            assert!((*ours).flags == vk::PipelineCreateFlags2KHR::DISABLE_OPTIMIZATION);
            assert!(flags.flags != (*ours).flags);
            // The program's own tail, and nothing copied where nothing is changed.
            let theirs = find::<c_void>(first, tail).unwrap();
            assert!(find::<c_void>(copy.first, tail) == Some(theirs));
            assert!(Chain::copy(theirs, &[], true).unwrap().first == theirs.cast_const());
        }
    }

    #[test]
    fn what_is_not_known_is_not_copied() {
        let mut flags = vk::PipelineCreateFlags2CreateInfoKHR::default();
        let unknown =
            vk::SubmitInfo { p_next: (&raw mut flags).cast(), ..vk::SubmitInfo::default() };
        let why = unsafe { Chain::copy((&raw const unknown).cast(), &[], true) };
        assert!(why.err().unwrap().contains("is not known"));
    }
}

//! What of a pipeline's state decides what becomes of fragments, and which of it may be looked at.

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::device::SETTINGS;
use crate::dynamic::Static;
use crate::objects::Objects;

/// Which parts of a pipeline there are.
#[derive(Clone, Copy, Default)]
pub(crate) struct Parts {
    pub before: bool,
    pub fragment: bool,
    pub output: bool,
}

/// What the pass of a pipeline has. A pointer to state that the pass has no use for may point
/// anywhere.
#[derive(Clone, Copy, Default)]
struct Uses {
    depth: bool,
    colour: bool,
}

/// # Safety
/// As the program gave it.
unsafe fn uses(
    objects: &Objects,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    parts: Parts,
) -> Result<Uses, String> {
    if !info.render_pass.is_null() {
        let pass = objects.passes.get(&info.render_pass.as_raw());
        let subpass = pass.and_then(|p| p.subpasses.get(info.subpass as usize));
        let subpass = subpass.ok_or("its render pass is not known")?;
        return Ok(Uses { depth: subpass.depth.is_some(), colour: !subpass.colours.is_empty() });
    }
    let s_type = vk::StructureType::PIPELINE_RENDERING_CREATE_INFO;
    let given = unsafe { find::<vk::PipelineRenderingCreateInfo<'_>>(info.p_next, s_type) };
    let none = vk::Format::UNDEFINED;
    let (depth, colour) = given.map_or((false, false), |given| unsafe {
        let formats = [(*given).depth_attachment_format, (*given).stencil_attachment_format];
        (formats.iter().any(|f| *f != none), (*given).color_attachment_count > 0)
    });
    // A part that does not know what it draws into has to be given all.
    Ok(Uses { depth: depth || !parts.output, colour })
}

/// What a pipeline's state says.
#[derive(Default)]
pub(crate) struct Fixed {
    pub all: Static,
    pub samples: u32,
    /// It draws nothing, by a state that is not dynamic.
    pub discards: bool,
    /// Why its fragments cannot be told; empty where they can.
    pub refused: String,
}

/// # Safety
/// As the program gave it.
pub(crate) unsafe fn fixed(
    objects: &Objects,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    parts: Parts,
) -> Fixed {
    let mut fixed = Fixed { samples: 1, ..Fixed::default() };
    let all = &mut fixed.all;
    let is = |flag: vk::Bool32| flag == vk::TRUE;
    unsafe {
        if let Some(dynamic) = info.p_dynamic_state.as_ref() {
            all.dynamic = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count).to_vec();
        }
        let set = |which| all.dynamic.contains(&which);
        let discards = parts.before
            && !set(vk::DynamicState::RASTERIZER_DISCARD_ENABLE)
            && info.p_rasterization_state.as_ref().is_some_and(|r| is(r.rasterizer_discard_enable));
        if discards {
            // Nothing else is looked at by anybody.
            fixed.discards = true;
            return fixed;
        }
        fixed.refused = refused(info, &all.dynamic).into();
        let uses = match uses(objects, info, parts) {
            Ok(uses) => uses,
            Err(why) => {
                if parts.fragment || parts.output {
                    fixed.refused = why;
                }
                return fixed;
            }
        };
        let stated = |there: bool| there.then_some(());
        if let Some(m) =
            stated(parts.fragment || parts.output).and(info.p_multisample_state.as_ref())
        {
            fixed.samples = m.rasterization_samples.as_raw().max(1);
            all.state.alpha_to_coverage = is(m.alpha_to_coverage_enable);
            if is(m.alpha_to_one_enable) {
                fixed.refused = "its alpha becomes one".into();
            }
        }
        if let Some(t) =
            stated(parts.fragment && uses.depth).and(info.p_depth_stencil_state.as_ref())
        {
            all.state.depth_test = is(t.depth_test_enable);
            all.state.depth_write = is(t.depth_write_enable);
            all.state.depth_op = t.depth_compare_op.as_raw();
            all.bounds = is(t.depth_bounds_test_enable);
            all.stencil_test = is(t.stencil_test_enable);
            let always = vk::CompareOp::ALWAYS;
            all.stencil_fails = [t.front, t.back].iter().any(|face| face.compare_op != always);
        }
        if let Some(c) = stated(parts.output && uses.colour).and(info.p_color_blend_state.as_ref())
        {
            blend(all, c);
        }
    }
    fixed
}

/// Of blending, for the attachment asked for.
///
/// # Safety
/// As the program gave it.
unsafe fn blend(all: &mut Static, c: &vk::PipelineColorBlendStateCreateInfo<'_>) {
    let is = |flag: vk::Bool32| flag == vk::TRUE;
    all.state.logic_op = is(c.logic_op_enable);
    all.state.constants = c.blend_constants;
    use vk::DynamicState as D;
    let ignored = [D::COLOR_BLEND_ENABLE_EXT, D::COLOR_BLEND_EQUATION_EXT, D::COLOR_WRITE_MASK_EXT];
    if ignored.iter().all(|which| all.dynamic.contains(which)) {
        all.state.mask = vk::ColorComponentFlags::RGBA.as_raw();
        return;
    }
    let attachments = unsafe { slice(c.p_attachments, c.attachment_count) };
    if let Some(b) = attachments.get(SETTINGS.location as usize) {
        all.state.blend = is(b.blend_enable);
        all.state.source = b.src_color_blend_factor.as_raw();
        all.state.destination = b.dst_color_blend_factor.as_raw();
        all.state.op = b.color_blend_op.as_raw();
        all.state.source_alpha = b.src_alpha_blend_factor.as_raw();
        all.state.destination_alpha = b.dst_alpha_blend_factor.as_raw();
        all.state.op_alpha = b.alpha_blend_op.as_raw();
        all.state.mask = b.color_write_mask.as_raw();
    }
}

/// Why a pipeline's fragments cannot be told, whatever its shaders; empty where they can.
///
/// # Safety
/// As the program gave it.
unsafe fn refused(
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    dynamic: &[vk::DynamicState],
) -> &'static str {
    use vk::{DynamicState as D, StructureType as S};
    let (one, keep) =
        (vk::Extent2D { width: 1, height: 1 }, vk::FragmentShadingRateCombinerOpKHR::KEEP);
    let rate = unsafe {
        find::<vk::PipelineFragmentShadingRateStateCreateInfoKHR<'_>>(
            info.p_next,
            S::PIPELINE_FRAGMENT_SHADING_RATE_STATE_CREATE_INFO_KHR,
        )
    };
    let rated = rate.is_some_and(|r| unsafe {
        (*r).fragment_size != one || (*r).combiner_ops.iter().any(|op| *op != keep)
    });
    let locations = S::RENDERING_ATTACHMENT_LOCATION_INFO_KHR;
    let set = |which: &[D]| which.iter().any(|which| dynamic.contains(which));
    match () {
        () if rated
            || set(&[
                D::FRAGMENT_SHADING_RATE_KHR,
                D::VIEWPORT_SHADING_RATE_PALETTE_NV,
                D::VIEWPORT_COARSE_SAMPLE_ORDER_NV,
                D::SHADING_RATE_IMAGE_ENABLE_NV,
            ]) =>
        {
            crate::passes::RATED
        }
        () if unsafe { find::<std::ffi::c_void>(info.p_next, locations) }.is_some() => {
            "its outputs go to other attachments"
        }
        () => "",
    }
}

/// Which parts of a pipeline a create info has.
///
/// # Safety
/// As the program gave it.
pub(crate) unsafe fn parts(info: &vk::GraphicsPipelineCreateInfo<'_>, linked: bool) -> Parts {
    use vk::GraphicsPipelineLibraryFlagsEXT as F;
    let s_type = vk::StructureType::GRAPHICS_PIPELINE_LIBRARY_CREATE_INFO_EXT;
    let flags = unsafe {
        find::<vk::GraphicsPipelineLibraryCreateInfoEXT<'_>>(info.p_next, s_type)
            .map(|l| (*l).flags)
    };
    let all = if linked { F::empty() } else { F::from_raw(!0) };
    let flags = flags.unwrap_or(all);
    Parts {
        before: flags.contains(F::PRE_RASTERIZATION_SHADERS),
        fragment: flags.contains(F::FRAGMENT_SHADER),
        output: flags.contains(F::FRAGMENT_OUTPUT_INTERFACE),
    }
}

/// Whether a create info makes a library.
///
/// # Safety
/// As the program gave it.
pub(crate) unsafe fn is_library(info: &vk::GraphicsPipelineCreateInfo<'_>) -> bool {
    let s_type = vk::StructureType::PIPELINE_CREATE_FLAGS_2_CREATE_INFO_KHR;
    let flags2 = unsafe { find::<vk::PipelineCreateFlags2CreateInfoKHR<'_>>(info.p_next, s_type) };
    let library = vk::PipelineCreateFlags::LIBRARY_KHR;
    match flags2 {
        Some(flags2) => unsafe { (*flags2).flags.contains(vk::PipelineCreateFlags2KHR::LIBRARY) },
        None => info.flags.contains(library),
    }
}

//! Render passes and framebuffers, as they are made.

use std::ffi::c_void;
use std::sync::Arc;

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::device::{SETTINGS, device};
use crate::guard;
use crate::objects::{AttachmentInfo, Framebuffer, RenderPass, Subpass};
use crate::table::next;

/// Why nothing is told of a pass of which one fragment may be several pixels.
pub(crate) const RATED: &str = "its fragments may be larger than pixels";

/// Whether a chain of a pass says how large fragments are.
pub(crate) unsafe fn rated(chain: *const c_void) -> bool {
    use vk::StructureType as S;
    unsafe {
        let rate = find::<vk::FragmentShadingRateAttachmentInfoKHR<'_>>(
            chain,
            S::FRAGMENT_SHADING_RATE_ATTACHMENT_INFO_KHR,
        );
        let rate = rate.and_then(|r| (*r).p_fragment_shading_rate_attachment.as_ref());
        let rendering = find::<vk::RenderingFragmentShadingRateAttachmentInfoKHR<'_>>(
            chain,
            S::RENDERING_FRAGMENT_SHADING_RATE_ATTACHMENT_INFO_KHR,
        );
        let map = find::<vk::RenderingFragmentDensityMapAttachmentInfoEXT<'_>>(
            chain,
            S::RENDERING_FRAGMENT_DENSITY_MAP_ATTACHMENT_INFO_EXT,
        );
        rate.is_some_and(|r| r.attachment != vk::ATTACHMENT_UNUSED)
            || rendering.is_some_and(|r| !(*r).image_view.is_null())
            || map.is_some_and(|m| !(*m).image_view.is_null())
            || find::<c_void>(chain, S::RENDER_PASS_FRAGMENT_DENSITY_MAP_CREATE_INFO_EXT).is_some()
    }
}

/// The hooks of both versions of a render pass: their structures have fields of one name.
macro_rules! create_pass {
    ($hook:ident, $next:ident, $info:ty, $reference:ty, |$subpass:ident, $all:ident, $n:ident| $views:expr, $rated:expr) => {
        pub(crate) unsafe extern "system" fn $hook(
            handle: vk::Device,
            info: *const $info,
            allocator: *const vk::AllocationCallbacks<'_>,
            out: *mut vk::RenderPass,
        ) -> vk::Result {
            let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
            let result = next!(d.table.$next, handle, info, allocator, out);
            if result != vk::Result::SUCCESS {
                return result;
            }
            guard(|| unsafe {
                let $all = &*info;
                let attachments = slice($all.p_attachments, $all.attachment_count)
                    .iter()
                    .map(|a| AttachmentInfo { load: a.load_op, after: a.final_layout })
                    .collect();
                let used = |r: Option<&$reference>| {
                    r.map(|r| r.attachment).filter(|&a| a != vk::ATTACHMENT_UNUSED)
                };
                let at = SETTINGS.location as usize;
                let subpasses = slice($all.p_subpasses, $all.subpass_count)
                    .iter()
                    .enumerate()
                    .map(|($n, $subpass)| {
                        let n = $subpass.color_attachment_count;
                        let colours = slice($subpass.p_color_attachments, n);
                        let resolves = slice($subpass.p_resolve_attachments, n);
                        Subpass {
                            colour: used(colours.get(at)),
                            resolve: used(resolves.get(at)),
                            depth: used($subpass.p_depth_stencil_attachment.as_ref()),
                            colours: colours.iter().filter_map(|r| used(Some(r))).collect(),
                            views: $views,
                        }
                    })
                    .collect();
                let refused = if rated($all.p_next) || $rated { RATED } else { "" };
                let pass = RenderPass { attachments, subpasses, refused };
                d.objects().passes.insert((*out).as_raw(), Arc::new(pass));
            });
            result
        }
    };
}

create_pass!(
    create_render_pass,
    create_render_pass,
    vk::RenderPassCreateInfo<'_>,
    vk::AttachmentReference,
    |subpass, all, n| {
        let s_type = vk::StructureType::RENDER_PASS_MULTIVIEW_CREATE_INFO;
        let masks = find::<vk::RenderPassMultiviewCreateInfo<'_>>(all.p_next, s_type);
        let masks = masks.map_or(&[][..], |m| slice((*m).p_view_masks, (*m).subpass_count));
        masks.get(n).map_or(0, |mask| mask.count_ones())
    },
    false
);

create_pass!(
    create_render_pass2,
    create_render_pass2,
    vk::RenderPassCreateInfo2<'_>,
    vk::AttachmentReference2<'_>,
    |subpass, all, n| {
        let _ = n;
        subpass.view_mask.count_ones()
    },
    slice(all.p_subpasses, all.subpass_count).iter().any(|subpass| rated(subpass.p_next))
);

pub(crate) unsafe extern "system" fn destroy_render_pass(
    handle: vk::Device,
    pass: vk::RenderPass,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().passes.remove(&pass.as_raw()));
    next!(d.table.destroy_render_pass, handle, pass, allocator)
}

pub(crate) unsafe extern "system" fn create_framebuffer(
    handle: vk::Device,
    info: *const vk::FramebufferCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Framebuffer,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_framebuffer, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            let info = &*info;
            let imageless = info.flags.contains(vk::FramebufferCreateFlags::IMAGELESS);
            let views = if imageless {
                Vec::new()
            } else {
                slice(info.p_attachments, info.attachment_count)
                    .iter()
                    .map(|v| v.as_raw())
                    .collect()
            };
            let framebuffer = Framebuffer { views, layers: info.layers };
            d.objects().framebuffers.insert((*out).as_raw(), Arc::new(framebuffer));
        });
    }
    result
}

pub(crate) unsafe extern "system" fn destroy_framebuffer(
    handle: vk::Device,
    framebuffer: vk::Framebuffer,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().framebuffers.remove(&framebuffer.as_raw()));
    next!(d.table.destroy_framebuffer, handle, framebuffer, allocator)
}

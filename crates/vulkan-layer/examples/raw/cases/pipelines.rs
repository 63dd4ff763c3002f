//! Pipelines of which parts are ignored or go early, and very many draws.

use std::alloc::{Layout, alloc, dealloc};
use std::ffi::c_void;
use std::time::Instant;

use ash::vk;

use super::one_pass;
use crate::Call;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::{Plan, SHAPE, STAGES, pipeline};
use crate::record::Recorder;
use crate::scene::{Shape, shapes};
use crate::target::{Target, TargetPlan};

/// One pipeline draws nothing: the state of fragments is ignored, wherever it points.
pub(super) fn discarded() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let seen = plan.create(&gpu)?;
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .line_width(1.0)
        .rasterizer_discard_enable(true);
    let unseen = plan.describe(&gpu, |info| {
        let info = vk::GraphicsPipelineCreateInfo {
            stage_count: 1,
            p_rasterization_state: &raster,
            p_multisample_state: std::ptr::dangling(),
            p_depth_stencil_state: std::ptr::dangling(),
            p_color_blend_state: std::ptr::dangling(),
            ..*info
        };
        pipeline(&gpu, &info)
    })?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(seen);
        recorder.shapes(plan.layout, &shapes()[..4]);
        recorder.bind(unseen);
        recorder.shapes(plan.layout, &shapes()[4..]);
    })
}

/// Bytes before each allocation, which hold its size.
const ROOM: usize = 64;

fn layout(size: usize) -> Option<Layout> {
    Layout::from_size_align(size + ROOM, ROOM).ok()
}

unsafe extern "system" fn allocate(
    _: *mut c_void,
    size: usize,
    align: usize,
    _: vk::SystemAllocationScope,
) -> *mut c_void {
    let Some(layout) = layout(size).filter(|_| align <= ROOM) else {
        return std::ptr::null_mut();
    };
    // SAFETY: the size is not 0; there is room for it in front.
    unsafe {
        let at = alloc(layout);
        if at.is_null() {
            return at.cast();
        }
        at.cast::<usize>().write(size);
        at.add(ROOM).cast()
    }
}

unsafe extern "system" fn free(_: *mut c_void, at: *mut c_void) {
    if at.is_null() {
        return;
    }
    // SAFETY: it was allocated above.
    unsafe {
        let start = at.cast::<u8>().sub(ROOM);
        if let Some(layout) = layout(start.cast::<usize>().read()) {
            dealloc(start, layout);
        }
    }
}

unsafe extern "system" fn reallocate(
    user: *mut c_void,
    at: *mut c_void,
    size: usize,
    align: usize,
    scope: vk::SystemAllocationScope,
) -> *mut c_void {
    // SAFETY: as Vulkan calls it; what there was fits into what is copied.
    unsafe {
        let to = allocate(user, size, align, scope);
        if !at.is_null() && !to.is_null() {
            let before = at.cast::<u8>().sub(ROOM).cast::<usize>().read();
            to.cast::<u8>().copy_from_nonoverlapping(at.cast(), before.min(size));
        }
        free(user, at);
        to
    }
}

/// A pipeline layout of an allocator of the program's own goes before its pipeline.
pub(super) fn allocator() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let callbacks = vk::AllocationCallbacks::default()
        .pfn_allocation(Some(allocate))
        .pfn_reallocation(Some(reallocate))
        .pfn_free(Some(free));
    let ranges = [vk::PushConstantRange { stage_flags: STAGES, offset: 0, size: SHAPE }];
    let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
    let plan = Plan::new(&gpu, &target)?;
    // SAFETY: the layout goes with the allocator that it was made with.
    let pipeline = unsafe {
        let layout = gpu.device.create_pipeline_layout(&info, Some(&callbacks))?;
        let pipeline = Plan { layout, ..plan.clone() }.create(&gpu);
        gpu.device.destroy_pipeline_layout(layout, Some(&callbacks));
        pipeline?
    };
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}

/// A submission without command buffers, which may point anywhere, before the picture.
pub(super) fn nothing_submitted() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    gpu.submit_info(&vk::SubmitInfo {
        p_command_buffers: std::ptr::dangling(),
        p_wait_semaphores: std::ptr::dangling(),
        ..vk::SubmitInfo::default()
    })?;
    super::drawn(&gpu, TargetPlan::default(), |plan| plan)
}

const TINY: Shape =
    Shape { vertices: 3, instances: 1, place: [0.0, 0.0, 0.05, 0.5], colour: [0.9, 0.2, 0.1, 0.4] };

/// More draws than a layer may have numbers for.
pub(super) fn very_many_draws() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.push(plan.layout, &TINY.constants());
        (0..(1 << 17) + 10).for_each(|_| recorder.draw(3, 1));
    })
}

/// What a draw costs to record, in nanoseconds, the least of NUMBER (20) times; OUT is the usual
/// picture.
pub(super) fn cost(call: &Call) -> Result<()> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let mut least = f64::MAX;
    const DRAWS: u32 = 50_000;
    for _ in 0..call.number.unwrap_or(20) {
        let recorder = Recorder::once(&gpu)?;
        recorder.pass(&target);
        recorder.bind(pipeline);
        recorder.push(plan.layout, &TINY.constants());
        let start = Instant::now();
        (0..DRAWS).for_each(|_| recorder.draw(3, 1));
        least = least.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(DRAWS));
        recorder.end_pass();
        let buffer = recorder.end()?;
        // SAFETY: it was not submitted.
        unsafe { gpu.device.free_command_buffers(gpu.pool, &[buffer]) }
    }
    println!("{least:.0} ns a draw");
    Ok(std::fs::write(&call.out, super::drawn(&gpu, TargetPlan::default(), |plan| plan)?)?)
}

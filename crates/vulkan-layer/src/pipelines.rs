//! Graphics pipelines: what is known of each, and ours beside it.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk::{self, Handle};

use crate::abi::{find, slice};
use crate::device::{Device, device};
use crate::dynamic::Static;
use crate::guard;
use crate::layouts;
use crate::log;
use crate::recorder::Recorder;
use crate::rewrite::{Stage, rewrite, stages};
use crate::spirv::Facts;
use crate::state::{Parts, fixed, is_library, parts};
use crate::table::next;
use crate::twins::create;

/// A pipeline, or a part of one (`VK_KHR_pipeline_library`).
pub(crate) struct Pipeline {
    pub number: u64,
    pub theirs: vk::Pipeline,
    /// What is bound in its place; null where there is none.
    pub ours: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    name: Mutex<String>,
    /// Why its draws leave no records; empty where they do.
    pub refused: String,
    pub fixed: Static,
    /// Its shaders ask which draw of a multi-draw they are in.
    pub draw_index: bool,
    /// It draws nothing, whatever comes.
    pub discards: bool,
    facts: Option<Facts>,
    samples: u32,
    pub parts: Parts,
}

impl Pipeline {
    pub(crate) fn rename(&self, name: String) {
        *self.name.lock().unwrap_or_else(PoisonError::into_inner) = name;
    }

    /// Tells why its draws are not captured, where that is anything to warn of.
    pub(crate) fn warn(&self, recorder: &mut Recorder) {
        if self.refused != DEPTH_ONLY {
            let why = &self.refused;
            recorder.note(&format!("some draws are not captured: of their pipeline, {why}"));
        }
    }

    pub(crate) fn log(&self) -> log::Pipeline {
        let is = |what: fn(&Facts) -> bool| self.facts.as_ref().is_some_and(what);
        log::Pipeline {
            number: self.number,
            name: self.name.lock().unwrap_or_else(PoisonError::into_inner).clone(),
            refused: self.refused.clone(),
            early_tests: is(|f| f.early_tests),
            per_sample: is(|f| f.per_sample),
            writes_depth: is(|f| f.writes_depth),
            samples: self.samples,
        }
    }
}

pub(crate) unsafe extern "system" fn create_shader_module(
    handle: vk::Device,
    info: *const vk::ShaderModuleCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::ShaderModule,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    let result = next!(d.table.create_shader_module, handle, info, allocator, out);
    if result == vk::Result::SUCCESS {
        guard(|| unsafe {
            let code = Arc::from(words(&*info));
            d.objects().shaders.insert((*out).as_raw(), code);
        });
    }
    result
}

pub(crate) unsafe fn words<'a>(info: &vk::ShaderModuleCreateInfo<'_>) -> &'a [u32] {
    unsafe { slice(info.p_code, (info.code_size / 4) as u32) }
}

pub(crate) unsafe extern "system" fn destroy_shader_module(
    handle: vk::Device,
    module: vk::ShaderModule,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| d.objects().shaders.remove(&module.as_raw()));
    next!(d.table.destroy_shader_module, handle, module, allocator)
}

pub(crate) unsafe extern "system" fn destroy_pipeline(
    handle: vk::Device,
    pipeline: vk::Pipeline,
    allocator: *const vk::AllocationCallbacks<'_>,
) {
    let Some(d) = (unsafe { device(handle) }) else { return };
    guard(|| {
        let mut objects = d.objects();
        let known = objects.pipelines.remove(&pipeline.as_raw());
        if let Some(ours) = known.as_ref().map(|known| known.ours) {
            let () = next!(d.table.destroy_pipeline, handle, ours, std::ptr::null());
        }
        if let Some(layout) = known.map(|known| known.layout) {
            let owed = objects.layouts.release(layout);
            (0..owed).for_each(|_| layouts::destroy(&d, layout));
        }
    });
    next!(d.table.destroy_pipeline, handle, pipeline, allocator)
}

/// Of a pipeline that draws depth alone, which is nothing to warn of.
const DEPTH_ONLY: &str = "it has no fragment shader";

/// What a pipeline is that the program has made, with one of ours beside it.
///
/// # Safety
/// As the program gave it.
unsafe fn pipeline(d: &Device, info: &vk::GraphicsPipelineCreateInfo<'_>) -> Pipeline {
    let s_type = vk::StructureType::PIPELINE_LIBRARY_CREATE_INFO_KHR;
    let libraries = unsafe {
        find::<vk::PipelineLibraryCreateInfoKHR<'_>>(info.p_next, s_type)
            .map_or(&[][..], |l| slice((*l).p_libraries, (*l).library_count))
    };
    let parts = unsafe { parts(info, !libraries.is_empty()) };
    let library = unsafe { is_library(info) };
    let (stages, libraries, layout, state, number) = {
        let mut objects = d.objects();
        // What belongs to a part that is not there may point anywhere.
        let shaded = parts.before || parts.fragment;
        let mut stages = if shaded { unsafe { stages(&objects, info) } } else { Vec::new() };
        let state = unsafe { fixed(&objects, info, parts) };
        if state.discards {
            stages.clear();
        }
        let libraries: Vec<_> = libraries
            .iter()
            .filter_map(|library| objects.pipelines.get(&library.as_raw()).cloned())
            .collect();
        let layout = objects.layouts.pipeline(info.layout).map(|layout| layout.refused);
        (stages, libraries, layout, state, objects.number())
    };
    let is = |s| move |stage: &Stage| stage.stage == s;
    let fragment = stages.iter().any(is(vk::ShaderStageFlags::FRAGMENT));
    let refused = match layout {
        _ if !state.refused.is_empty() => &state.refused,
        _ if parts.fragment && !fragment && !state.discards => DEPTH_ONLY,
        None if fragment => "its layout is not known",
        Some(why) if fragment => why,
        _ => "",
    };
    let linked = library || !libraries.is_empty();
    let mut made = rewrite(d, &stages, linked, refused);
    let (mut fixed, mut samples) = (state.all, state.samples);
    let mut discards = state.discards;
    let mut facts = made.facts;
    let mut all = parts;
    for library in &libraries {
        let (theirs, part) = (&library.fixed, library.parts);
        all.before |= part.before;
        discards |= library.discards;
        if part.fragment {
            all.fragment = true;
            facts = library.facts;
            fixed.state.depth_test = theirs.state.depth_test;
            fixed.state.depth_write = theirs.state.depth_write;
            fixed.state.depth_op = theirs.state.depth_op;
            (fixed.bounds, fixed.stencil_test) = (theirs.bounds, theirs.stencil_test);
            fixed.stencil_fails = theirs.stencil_fails;
        }
        if part.output {
            all.output = true;
            let depth = (fixed.state.depth_test, fixed.state.depth_write, fixed.state.depth_op);
            fixed.state = theirs.state.clone();
            (fixed.state.depth_test, fixed.state.depth_write, fixed.state.depth_op) = depth;
            samples = library.samples;
        }
        fixed.dynamic.extend(&theirs.dynamic);
        made.draw_index |= library.draw_index;
        if made.refused.is_empty() {
            made.refused.clone_from(&library.refused);
        }
    }
    let mut ours = vk::Pipeline::null();
    let twins = libraries.iter().any(|library| !library.ours.is_null());
    if twins || !made.shaders.is_empty() {
        match unsafe { create(d, info, &made.shaders, &libraries, made.refused.is_empty()) } {
            Ok(created) => ours = created,
            Err(why) if made.refused.is_empty() => made.refused = why,
            Err(_) => {}
        }
    }
    Pipeline {
        number,
        theirs: vk::Pipeline::null(),
        ours,
        layout: info.layout,
        name: Mutex::default(),
        refused: made.refused,
        fixed,
        draw_index: made.draw_index,
        discards,
        facts,
        samples,
        parts: all,
    }
}

pub(crate) unsafe extern "system" fn create_pipelines(
    handle: vk::Device,
    cache: vk::PipelineCache,
    n: u32,
    infos: *const vk::GraphicsPipelineCreateInfo<'_>,
    allocator: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::Pipeline,
) -> vk::Result {
    let Some(d) = (unsafe { device(handle) }) else { return vk::Result::ERROR_DEVICE_LOST };
    // The program's own are made as it wants them; ours stand beside.
    let result = next!(d.table.create_pipelines, handle, cache, n, infos, allocator, out);
    if d.over() {
        return result;
    }
    guard(|| {
        let (infos, made) = unsafe { (slice(infos, n), slice(out, n)) };
        for (info, handle) in infos.iter().zip(made).filter(|(_, handle)| !handle.is_null()) {
            let pipeline = Pipeline { theirs: *handle, ..unsafe { pipeline(&d, info) } };
            let mut objects = d.objects();
            objects.layouts.retain(pipeline.layout);
            objects.pipelines.insert(handle.as_raw(), Arc::new(pipeline));
        }
    });
    result
}

//! Graphics pipelines: their shaders rewritten, and what of their state is known.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk::{self, Handle};

use crate::abi::{chain, find, slice};
use crate::device::{Device, SETTINGS, device};
use crate::dynamic::Static;
use crate::guard;
use crate::log;
use crate::memory::writable;
use crate::objects::Objects;
use crate::spirv::{self, Facts, Output};
use crate::table::next;

/// A pipeline, or a part of one (`VK_KHR_pipeline_library`).
pub(crate) struct Pipeline {
    pub number: u64,
    /// What is bound in its place where draws are recorded; null where they are not.
    pub ours: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    name: Mutex<String>,
    /// Why its draws leave no records; empty where they do.
    pub refused: String,
    pub fixed: Static,
    /// Its shaders ask which draw of a multi-draw they are in.
    pub draw_index: bool,
    facts: Option<Facts>,
    samples: u32,
    parts: Parts,
}

/// Which parts of a pipeline there are.
#[derive(Clone, Copy, Default)]
struct Parts {
    before: bool,
    fragment: bool,
    output: bool,
}

impl Pipeline {
    pub(crate) fn rename(&self, name: String) {
        *self.name.lock().unwrap_or_else(PoisonError::into_inner) = name;
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

unsafe fn words<'a>(info: &vk::ShaderModuleCreateInfo<'_>) -> &'a [u32] {
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
        if let Some(layout) = known.map(|known| known.layout)
            && objects.layouts.release(layout)
        {
            let null = std::ptr::null();
            let () = next!(d.table.destroy_pipeline_layout, handle, layout, null);
        }
    });
    next!(d.table.destroy_pipeline, handle, pipeline, allocator)
}

/// A stage of a pipeline that is made.
struct Stage {
    stage: vk::ShaderStageFlags,
    entry: String,
    code: Option<Arc<[u32]>>,
}

/// The stages of a pipeline.
///
/// # Safety
/// As the program gave it.
unsafe fn stages(objects: &Objects, info: &vk::GraphicsPipelineCreateInfo<'_>) -> Vec<Stage> {
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
struct Rewritten {
    shaders: Vec<(usize, Vec<u32>)>,
    /// Of the fragment shader.
    facts: Option<Facts>,
    refused: String,
    draw_index: bool,
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

fn rewrite(d: &Device, stages: &[Stage], library: bool, ours: bool) -> Rewritten {
    let mut made = Rewritten::default();
    let place = |s: vk::ShaderStageFlags| stages.iter().position(|stage| stage.stage == s);
    let vertex = place(vk::ShaderStageFlags::VERTEX);
    let fragment = place(vk::ShaderStageFlags::FRAGMENT);
    let codes = || stages.iter().filter_map(|stage| stage.code.as_ref());
    made.draw_index = codes().any(|code| code.windows(2).any(|pair| pair == DRAW_INDEX));
    if let Some(other) = stages.iter().find_map(|stage| other_stage(stage.stage)) {
        made.refused = format!("it has {other}");
        return made;
    }
    if !ours {
        made.refused = format!("its layout uses all {} descriptor sets", d.set_index + 1);
        return made;
    }
    // A library sees one side only: both use one location that programs hardly reach.
    let fixed = library.then(|| d.locations.saturating_sub(2));
    let mut instance = fixed;
    if let Some(at) = vertex {
        let Some(code) = &stages[at].code else {
            made.refused = "its vertex shader's text is not given".into();
            return made;
        };
        let free = || {
            let mut free = spirv::outputs(code, &stages[at].entry)?;
            if let Some(fragment) = fragment.map(|at| &stages[at])
                && let Some(code) = &fragment.code
            {
                free = free.max(spirv::inputs(code, &fragment.entry)?);
            }
            Ok::<_, String>(free)
        };
        let location = fixed.map_or_else(free, Ok);
        let rewritten = location
            .and_then(|at| (at < d.locations).then_some(at).ok_or("no location is free".into()))
            .and_then(|l| Ok((l, spirv::vertex(code, &stages[at].entry, l)?)));
        match rewritten {
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
    let Some(at) = fragment else { return made };
    let Some(code) = &stages[at].code else {
        made.refused = "its fragment shader's text is not given".into();
        return made;
    };
    let options = spirv::Options {
        set: d.set_index,
        location: SETTINGS.location,
        primitive_id: d.primitive_id,
        address: d.resources.address(),
        instance,
    };
    match spirv::fragment(code, &stages[at].entry, &options) {
        Ok((words, facts)) => {
            if facts.output == Output::Integer {
                made.refused = "its output is an integer".into();
            }
            made.shaders.push((at, words));
            made.facts = Some(facts);
        }
        Err(why) => {
            made.refused = format!("its fragment shader: {why}");
            made.shaders.clear();
        }
    }
    made
}

/// What a pipeline's state says.
///
/// # Safety
/// As the program gave it.
unsafe fn fixed(info: &vk::GraphicsPipelineCreateInfo<'_>, parts: Parts) -> (Static, u32) {
    let mut all = Static::default();
    let mut samples = 1;
    let is = |flag: vk::Bool32| flag == vk::TRUE;
    unsafe {
        let stated = |there: bool| there.then_some(());
        // What belongs to a part that is not there may point anywhere.
        if let Some(m) =
            stated(parts.fragment || parts.output).and(info.p_multisample_state.as_ref())
        {
            samples = m.rasterization_samples.as_raw().max(1);
            all.state.alpha_to_coverage = is(m.alpha_to_coverage_enable);
        }
        if let Some(t) = stated(parts.fragment).and(info.p_depth_stencil_state.as_ref()) {
            all.state.depth_test = is(t.depth_test_enable);
            all.state.depth_write = is(t.depth_write_enable);
            all.state.depth_op = t.depth_compare_op.as_raw();
            all.bounds = is(t.depth_bounds_test_enable);
            all.stencil_test = is(t.stencil_test_enable);
            let always = vk::CompareOp::ALWAYS;
            all.stencil_fails = [t.front, t.back].iter().any(|face| face.compare_op != always);
        }
        if let Some(c) = stated(parts.output).and(info.p_color_blend_state.as_ref()) {
            all.state.logic_op = is(c.logic_op_enable);
            all.state.constants = c.blend_constants;
            if let Some(b) =
                slice(c.p_attachments, c.attachment_count).get(SETTINGS.location as usize)
            {
                all.state.blend = is(b.blend_enable);
                all.state.source = b.src_color_blend_factor.as_raw();
                all.state.destination = b.dst_color_blend_factor.as_raw();
                all.state.op = b.color_blend_op.as_raw();
                all.state.source_alpha = b.src_alpha_blend_factor.as_raw();
                all.state.destination_alpha = b.dst_alpha_blend_factor.as_raw();
                all.state.op_alpha = b.alpha_blend_op.as_raw();
                all.state.mask = b.color_write_mask.as_raw();
            } else if !c.p_attachments.is_null() || c.attachment_count > 0 {
                all.state.mask = 0;
            } else {
                // All of it dynamic.
                all.state.mask = vk::ColorComponentFlags::RGBA.as_raw();
            }
        }
        if let Some(dynamic) = info.p_dynamic_state.as_ref() {
            all.dynamic = slice(dynamic.p_dynamic_states, dynamic.dynamic_state_count).to_vec();
        }
    }
    (all, samples)
}

/// Which parts of a pipeline a create info has.
///
/// # Safety
/// As the program gave it.
unsafe fn parts(info: &vk::GraphicsPipelineCreateInfo<'_>, linked: bool) -> Parts {
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
unsafe fn is_library(info: &vk::GraphicsPipelineCreateInfo<'_>) -> bool {
    // `VkPipelineCreateFlags2CreateInfoKHR`, which ash does not know yet.
    #[repr(C)]
    struct Flags2 {
        s_type: vk::StructureType,
        next: *const c_void,
        flags: u64,
    }
    const FLAGS2: i32 = 1_000_470_005;
    let library = vk::PipelineCreateFlags::LIBRARY_KHR;
    let flags2 = unsafe { find::<Flags2>(info.p_next, vk::StructureType::from_raw(FLAGS2)) };
    match flags2 {
        Some(flags2) => unsafe { (*flags2).flags & u64::from(library.as_raw()) != 0 },
        None => info.flags.contains(library),
    }
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
    let (stages, libraries, ours, number) = {
        let mut objects = d.objects();
        let stages = unsafe { stages(&objects, info) };
        let libraries: Vec<_> = libraries
            .iter()
            .filter_map(|library| objects.pipelines.get(&library.as_raw()).cloned())
            .collect();
        // A part without shaders has no layout.
        let ours = objects.layouts.pipeline(info.layout).is_none_or(|layout| layout.ours);
        (stages, libraries, ours, objects.number())
    };
    let mut made = Rewritten::default();
    if !stages.is_empty() {
        made = rewrite(d, &stages, library || !libraries.is_empty(), ours);
    }
    let discards = unsafe { info.p_rasterization_state.as_ref() }
        .is_some_and(|r| parts.before && r.rasterizer_discard_enable == vk::TRUE);
    let has_fragment = stages.iter().any(|s| s.stage == vk::ShaderStageFlags::FRAGMENT);
    if parts.fragment && !has_fragment && !discards && made.refused.is_empty() {
        made.refused = DEPTH_ONLY.into();
    }

    let (mut fixed, mut samples) = unsafe { fixed(info, parts) };
    let mut facts = made.facts;
    let mut all = parts;
    for library in &libraries {
        let (theirs, part) = (&library.fixed, library.parts);
        all.before |= part.before;
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
    let linked = libraries.iter().any(|library| !library.ours.is_null());
    if made.refused.is_empty() && (linked || !made.shaders.is_empty()) {
        match unsafe { create(d, info, &made.shaders, &libraries) } {
            Ok(created) => ours = created,
            Err(why) => made.refused = why,
        }
    }
    Pipeline {
        number,
        ours,
        layout: info.layout,
        name: Mutex::default(),
        refused: made.refused,
        fixed,
        draw_index: made.draw_index,
        facts,
        samples,
        parts: all,
    }
}

/// A pipeline as the program's, of rewritten shaders and libraries.
///
/// # Safety
/// As the program gave it.
unsafe fn create(
    d: &Device,
    info: &vk::GraphicsPipelineCreateInfo<'_>,
    shaders: &[(usize, Vec<u32>)],
    libraries: &[Arc<Pipeline>],
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
    // What it is to be derived from, or not to be compiled for, is the program's affair.
    ours.flags &= !(vk::PipelineCreateFlags::DERIVATIVE
        | vk::PipelineCreateFlags::FAIL_ON_PIPELINE_COMPILE_REQUIRED
        | vk::PipelineCreateFlags::EARLY_RETURN_ON_FAILURE);
    let made = replaced.and_then(|()| {
        let create = || {
            let (none, null) = (vk::PipelineCache::null(), std::ptr::null());
            let mut made = vk::Pipeline::null();
            let result: vk::Result =
                next!(d.table.create_pipelines, d.handle, none, 1, &ours, null, &mut made);
            match result {
                vk::Result::SUCCESS => Ok(made),
                result => Err(format!("the driver does not make it, rewritten: {result}")),
            }
        };
        unsafe { with_libraries(info.p_next, libraries, create) }
    });
    for module in modules {
        let () = next!(d.table.destroy_shader_module, d.handle, module, std::ptr::null());
    }
    made
}

/// Does something while a chain names our libraries in place of the program's.
///
/// # Safety
/// As [`find`].
unsafe fn with_libraries<T>(
    chain: *const c_void,
    libraries: &[Arc<Pipeline>],
    what: impl FnOnce() -> Result<T, String>,
) -> Result<T, String> {
    let s_type = vk::StructureType::PIPELINE_LIBRARY_CREATE_INFO_KHR;
    let Some(named) = (unsafe { find::<vk::PipelineLibraryCreateInfoKHR<'_>>(chain, s_type) })
    else {
        return what();
    };
    if !writable(named.cast(), size_of::<vk::PipelineLibraryCreateInfoKHR<'_>>()) {
        return Err("its libraries are named where nothing can be written".into());
    }
    unsafe {
        let theirs = slice((*named).p_libraries, (*named).library_count);
        if theirs.len() != libraries.len() {
            return Err("one of its libraries is not known".into());
        }
        let pairs = theirs.iter().zip(libraries);
        let ours: Vec<vk::Pipeline> = pairs
            .map(|(theirs, library)| if library.ours.is_null() { *theirs } else { library.ours })
            .collect();
        (*named).p_libraries = ours.as_ptr();
        let result = what();
        (*named).p_libraries = theirs.as_ptr();
        result
    }
}

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
    if !d.resources.usable() {
        return result;
    }
    guard(|| {
        let (infos, made) = unsafe { (slice(infos, n), slice(out, n)) };
        for (info, handle) in infos.iter().zip(made).filter(|(_, handle)| !handle.is_null()) {
            let pipeline = unsafe { pipeline(&d, info) };
            let why = &pipeline.refused;
            if !why.is_empty() && why != DEPTH_ONLY && pipeline.parts.output {
                let note = format!("some draws are not captured: of their pipeline, {why}");
                d.recorder().note(&note);
            }
            let mut objects = d.objects();
            objects.layouts.retain(pipeline.layout);
            objects.pipelines.insert(handle.as_raw(), Arc::new(pipeline));
        }
    });
    result
}

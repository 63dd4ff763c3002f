//! Descriptor sets, as many as there are, and those that stay bound.

use ash::vk;
use vk::DescriptorType as Kind;

use super::one_pass;
use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
use crate::memory::Buffer;
use crate::pass::Subpass;
use crate::pipeline::{Plan, SHAPE, layout};
use crate::record::Recorder;
use crate::scene::shapes;
use crate::shader::{self, Shader};
use crate::target::{Target, TargetPlan};

/// Bytes between two tints; every device can have an offset of this.
const STRIDE: u32 = 256;

/// Parts of a tint that differ.
pub(super) const PARTS: [[f32; 4]; 4] =
    [[0.7, 0.2, 0.5, 0.5], [0.2, 0.7, 0.4, 0.5], [0.1, 0.5, 0.9, 0.4], [0.9, 0.1, 0.2, 0.6]];

/// Parts for `count` sets. The first `read` make the same tint together, however many they are, so
/// that a layer that takes a set away does not change the picture. Sums of such numbers are exact.
fn parts(read: u32, count: u32) -> Vec<[f32; 4]> {
    let part = |k: u32| [1.0, -2.0, 3.0, 1.0].map(|way| way * k as f32 / 128.0);
    let mut all: Vec<_> = (0..count).map(part).collect();
    let sum = |i: usize| all[1..read as usize].iter().map(|part| part[i]).sum::<f32>();
    let first = [0.75, 0.875, 1.0, 1.0];
    all[0] = std::array::from_fn(|i| first[i] - sum(i));
    all
}

/// A descriptor set for each of some tints.
pub(super) struct Tints {
    pub(super) layouts: Vec<vk::DescriptorSetLayout>,
    pub(super) sets: Vec<vk::DescriptorSet>,
    buffer: Buffer,
}

/// Where a tint lies.
fn tint(buffer: &Buffer, k: u32) -> vk::DescriptorBufferInfo {
    let (buffer, offset) = (buffer.handle, u64::from(k * STRIDE));
    vk::DescriptorBufferInfo { buffer, offset, range: 16 }
}

pub(super) fn tints(gpu: &Gpu, tints: &[[f32; 4]], kind: Kind) -> Result<Tints> {
    let values = tints.iter().flat_map(|tint| {
        let mut words = [0; STRIDE as usize / 4];
        words[..4].copy_from_slice(&tint.map(f32::to_bits));
        words
    });
    let values: Vec<u32> = values.collect();
    let buffer = Buffer::of(gpu, &values, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
    let set_layout = set_layout(gpu, kind, vk::DescriptorSetLayoutCreateFlags::empty())?;
    let layouts = vec![set_layout; tints.len()];
    let sets = allocate(gpu, kind, &layouts)?;
    for (&set, k) in sets.iter().zip(0..) {
        // A dynamic offset says where instead.
        let at = [tint(&buffer, if kind == Kind::UNIFORM_BUFFER_DYNAMIC { 0 } else { k })];
        let write =
            vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(kind).buffer_info(&at);
        // SAFETY: nothing uses the set yet.
        unsafe { gpu.device.update_descriptor_sets(&[write], &[]) }
    }
    Ok(Tints { layouts, sets, buffer })
}

/// Sets of one descriptor each.
fn allocate(
    gpu: &Gpu,
    kind: Kind,
    layouts: &[vk::DescriptorSetLayout],
) -> Result<Vec<vk::DescriptorSet>> {
    let count = layouts.len() as u32;
    let sizes = [vk::DescriptorPoolSize { ty: kind, descriptor_count: count }];
    let pool = vk::DescriptorPoolCreateInfo::default().max_sets(count).pool_sizes(&sizes);
    // SAFETY: what the structures point at lives until the end of the block.
    unsafe {
        let pool = gpu.device.create_descriptor_pool(&pool, None)?;
        gpu.at_end(move |d| d.destroy_descriptor_pool(pool, None));
        let info =
            vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(layouts);
        Ok(gpu.device.allocate_descriptor_sets(&info)?)
    }
}

fn set_layout(
    gpu: &Gpu,
    kind: Kind,
    flags: vk::DescriptorSetLayoutCreateFlags,
) -> Result<vk::DescriptorSetLayout> {
    set_layout_of(gpu, kind, flags, vk::ShaderStageFlags::FRAGMENT)
}

fn set_layout_of(
    gpu: &Gpu,
    kind: Kind,
    flags: vk::DescriptorSetLayoutCreateFlags,
    stages: vk::ShaderStageFlags,
) -> Result<vk::DescriptorSetLayout> {
    let binding = [vk::DescriptorSetLayoutBinding::default()
        .descriptor_type(kind)
        .descriptor_count(1)
        .stage_flags(stages)];
    let info = vk::DescriptorSetLayoutCreateInfo::default().flags(flags).bindings(&binding);
    // SAFETY: what the structure points at lives until the end of the block.
    unsafe {
        let layout = gpu.device.create_descriptor_set_layout(&info, None)?;
        gpu.at_end(move |d| d.destroy_descriptor_set_layout(layout, None));
        Ok(layout)
    }
}

pub(super) fn bind(
    recorder: &Recorder<'_>,
    layout: vk::PipelineLayout,
    first: u32,
    sets: &[vk::DescriptorSet],
    offsets: &[u32],
) {
    let (at, point) = (recorder.buffer, vk::PipelineBindPoint::GRAPHICS);
    // SAFETY: the layout has these sets.
    unsafe {
        recorder.gpu.device.cmd_bind_descriptor_sets(at, point, layout, first, sets, offsets);
    }
}

/// Every set that the device has, each read by the shader, up to eight.
pub(super) fn sets() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    match gpu.host.limits.max_bound_descriptor_sets {
        0..4 => Err(Failure::unsupported("fewer than four sets")),
        4..7 => with_sets(&gpu, &parts(4, 4), shader::FOUR_SETS),
        7 => with_sets(&gpu, &parts(7, 7), shader::SEVEN_SETS),
        8.. => with_sets(&gpu, &parts(8, 8), shader::EIGHT_SETS),
    }
}

/// Every set that the device has, two of them read.
pub(super) fn all_sets() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let limits = &gpu.host.limits;
    let most = limits.max_per_stage_descriptor_uniform_buffers;
    let count = limits.max_bound_descriptor_sets.min(most);
    with_sets(&gpu, &parts(2, count), shader::TWO_SETS)
}

/// As a program does that was never told otherwise.
pub(super) fn sets_unasked() -> Result<Vec<u8>> {
    with_sets(&Gpu::plain()?, &parts(8, 8), shader::EIGHT_SETS)
}

fn with_sets(gpu: &Gpu, parts: &[[f32; 4]], shader: Shader) -> Result<Vec<u8>> {
    let target = Target::new(gpu, TargetPlan::default())?;
    let tints = tints(gpu, parts, Kind::UNIFORM_BUFFER)?;
    let layout = layout(gpu, &tints.layouts, SHAPE)?;
    let plan = Plan { layout, ..Plan::new(gpu, &target)? }.fragment(shader);
    let pipeline = plan.create(gpu)?;
    one_pass(gpu, &target, |recorder| {
        // Before the pipeline, which is as good.
        bind(recorder, layout, 0, &tints.sets, &[]);
        recorder.bind(pipeline);
        recorder.shapes(layout, &shapes());
    })
}

pub(super) fn set_above() -> Result<Vec<u8>> {
    kept(Kind::UNIFORM_BUFFER, false)
}

pub(super) fn set_above_dynamic() -> Result<Vec<u8>> {
    kept(Kind::UNIFORM_BUFFER_DYNAMIC, false)
}

pub(super) fn set_below() -> Result<Vec<u8>> {
    kept(Kind::UNIFORM_BUFFER, true)
}

/// A pipeline with two sets, one whose layout has the first alone, the first pipeline again:
/// the second set is still bound. `below` binds another first set in between.
fn kept(kind: Kind, below: bool) -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let tints = tints(&gpu, &PARTS, kind)?;
    let both = layout(&gpu, &tints.layouts[..2], SHAPE)?;
    let one = layout(&gpu, &tints.layouts[..1], SHAPE)?;
    let plan = Plan::new(&gpu, &target)?;
    let first = Plan { layout: both, ..plan.clone() }.fragment(shader::TWO_SETS).create(&gpu)?;
    let other = Plan { layout: one, ..plan.clone() }.fragment(shader::ONE_SET).create(&gpu)?;
    let offsets: &[u32] =
        if kind == Kind::UNIFORM_BUFFER_DYNAMIC { &[STRIDE, 3 * STRIDE] } else { &[] };
    one_pass(&gpu, &target, |recorder| {
        let all = shapes();
        recorder.bind(first);
        bind(recorder, both, 0, &tints.sets[..2], offsets);
        recorder.shapes(both, &all[..2]);
        recorder.bind(other);
        if below {
            bind(recorder, one, 0, &tints.sets[2..3], &[]);
        }
        recorder.shapes(one, &all[2..4]);
        recorder.bind(first);
        recorder.shapes(both, &all[4..]);
    })
}

/// Descriptors are pushed for computing while others are bound for drawing.
pub(super) fn push_compute() -> Result<Vec<u8>> {
    pushed(true)
}

/// A pushed set stays over a pipeline without it.
pub(super) fn push_above() -> Result<Vec<u8>> {
    pushed(false)
}

/// As [`kept`]; the second set is pushed, or another is for computing.
fn pushed(compute: bool) -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.extension(ash::khr::push_descriptor::NAME))?;
    let calls = ash::khr::push_descriptor::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::default())?;
    let kind = if compute { Kind::UNIFORM_BUFFER_DYNAMIC } else { Kind::UNIFORM_BUFFER };
    let tints = tints(&gpu, &PARTS, kind)?;
    let flag = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR;
    let stages =
        if compute { vk::ShaderStageFlags::COMPUTE } else { vk::ShaderStageFlags::FRAGMENT };
    let push = set_layout_of(&gpu, Kind::UNIFORM_BUFFER, flag, stages)?;
    let with_push = layout(&gpu, &[tints.layouts[0], push], SHAPE)?;
    let both = if compute { layout(&gpu, &tints.layouts[..2], SHAPE)? } else { with_push };
    let one = layout(&gpu, &tints.layouts[..1], SHAPE)?;
    let plan = Plan::new(&gpu, &target)?;
    let first = Plan { layout: both, ..plan.clone() }.fragment(shader::TWO_SETS).create(&gpu)?;
    let other = Plan { layout: one, ..plan.clone() }.fragment(shader::ONE_SET).create(&gpu)?;
    let at = [tint(&tints.buffer, 1)];
    let write =
        [vk::WriteDescriptorSet::default().descriptor_type(Kind::UNIFORM_BUFFER).buffer_info(&at)];
    one_pass(&gpu, &target, |recorder| {
        let all = shapes();
        recorder.bind(first);
        let point = if compute {
            bind(recorder, both, 0, &tints.sets[..2], &[STRIDE, 3 * STRIDE]);
            vk::PipelineBindPoint::COMPUTE
        } else {
            bind(recorder, both, 0, &tints.sets[..1], &[]);
            vk::PipelineBindPoint::GRAPHICS
        };
        // SAFETY: the layout's second set is for this.
        unsafe { calls.cmd_push_descriptor_set(recorder.buffer, point, with_push, 1, &write) }
        recorder.shapes(both, &all[..2]);
        recorder.bind(other);
        recorder.shapes(one, &all[2..4]);
        recorder.bind(first);
        recorder.shapes(both, &all[4..]);
    })
}

/// As many descriptors with dynamic offsets as a fragment shader can have, and samplers that nobody
/// looks at.
pub(super) fn most_dynamic() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let limits = &gpu.host.limits;
    let most = [
        limits.max_descriptor_set_uniform_buffers_dynamic,
        limits.max_descriptor_set_uniform_buffers,
        limits.max_per_stage_descriptor_uniform_buffers,
        // The target is one, too.
        limits.max_per_stage_resources - 1,
    ];
    let binding = vk::DescriptorSetLayoutBinding {
        descriptor_type: Kind::UNIFORM_BUFFER_DYNAMIC,
        descriptor_count: most.into_iter().min().unwrap_or(1),
        stage_flags: vk::ShaderStageFlags::FRAGMENT,
        // Of descriptors that are no samplers it is ignored.
        p_immutable_samplers: std::ptr::dangling(),
        ..vk::DescriptorSetLayoutBinding::default()
    };
    let bindings = [binding];
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: what the structure points at lives until the end of the block.
    let sets = unsafe {
        let layout = gpu.device.create_descriptor_set_layout(&info, None)?;
        gpu.at_end(move |d| d.destroy_descriptor_set_layout(layout, None));
        [layout]
    };
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan { layout: layout(&gpu, &sets, SHAPE)?, ..Plan::new(&gpu, &target)? };
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}

/// The second set is written by commands.
pub(super) fn push_descriptors() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.extension(ash::khr::push_descriptor::NAME))?;
    let calls = ash::khr::push_descriptor::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::default())?;
    let tints = tints(&gpu, &PARTS, Kind::UNIFORM_BUFFER)?;
    let pushed = vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR;
    let pushed = set_layout(&gpu, Kind::UNIFORM_BUFFER, pushed)?;
    let layout = layout(&gpu, &[tints.layouts[0], pushed], SHAPE)?;
    let plan = Plan { layout, ..Plan::new(&gpu, &target)? }.fragment(shader::TWO_SETS);
    let pipeline = plan.create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        bind(recorder, layout, 0, &tints.sets[..1], &[]);
        for (shape, k) in shapes().iter().zip(0..) {
            // Every other shape has the one before's.
            if k % 2 == 0 {
                let at = [tint(&tints.buffer, k / 2)];
                let write = vk::WriteDescriptorSet::default()
                    .descriptor_type(Kind::UNIFORM_BUFFER)
                    .buffer_info(&at);
                let (at, point) = (recorder.buffer, vk::PipelineBindPoint::GRAPHICS);
                // SAFETY: the layout's second set is for this.
                unsafe { calls.cmd_push_descriptor_set(at, point, layout, 1, &[write]) }
            }
            recorder.shape(layout, shape);
        }
    })
}

/// The second subpass reads what the first has drawn, and draws to another colour.
pub(super) fn subpasses_input() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let reads = Subpass { colours: vec![1], inputs: vec![0] };
    let subpasses = vec![Subpass::to(&[0]), reads];
    let target = Target::new(&gpu, TargetPlan { subpasses, ..TargetPlan::two() })?;
    let set_layouts =
        [set_layout(&gpu, Kind::INPUT_ATTACHMENT, vk::DescriptorSetLayoutCreateFlags::empty())?];
    let set = allocate(&gpu, Kind::INPUT_ATTACHMENT, &set_layouts)?[0];
    let image = [vk::DescriptorImageInfo::default()
        .image_view(target.images.colours[0].view)
        .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .descriptor_type(Kind::INPUT_ATTACHMENT)
        .image_info(&image);
    // SAFETY: nothing uses the set yet.
    unsafe { gpu.device.update_descriptor_sets(&[write], &[]) }
    let plan = Plan::new(&gpu, &target)?;
    let first = plan.create(&gpu)?;
    let with_set = layout(&gpu, &set_layouts, SHAPE)?;
    let then = Plan { subpass: 1, layout: with_set, ..plan.clone() };
    let then = then.fragment(shader::INPUT).create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(first);
        recorder.shapes(plan.layout, &shapes()[..4]);
        recorder.next_subpass();
        recorder.bind(then);
        bind(recorder, with_set, 0, &[set], &[]);
        recorder.shapes(with_set, &shapes()[4..]);
    })
}

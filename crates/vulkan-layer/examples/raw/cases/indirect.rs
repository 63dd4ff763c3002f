//! Draws whose numbers lie in buffers, and several draws of one command.

use ash::vk;

use super::one_pass;
use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
use crate::host::{Host, Opening};
use crate::memory::Buffer;
use crate::pipeline::Plan;
use crate::record::Recorder;
use crate::scene::shapes;
use crate::shader;
use crate::target::{Target, TargetPlan};

/// Bytes from one draw's numbers to the next.
const STRIDE: u32 = 16;

/// Vertices, instances, first vertex, first instance of each draw.
const DRAWS: [[u32; 4]; 3] = [[6, 1, 0, 0], [3, 2, 6, 1], [6, 1, 12, 2]];

/// One draw a command.
pub(super) fn indirect() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let words: Vec<u32> =
        shapes().iter().flat_map(|shape| [shape.vertices, shape.instances, 0, 0]).collect();
    let numbers = Buffer::of(&gpu, &words, vk::BufferUsageFlags::INDIRECT_BUFFER)?;
    each_shape(
        &gpu,
        |plan| plan,
        |recorder, k| {
            let (at, from) = (recorder.buffer, u64::from(k * STRIDE));
            // SAFETY: the buffer holds as many draws as there are shapes.
            unsafe { gpu.device.cmd_draw_indirect(at, numbers.handle, from, 1, STRIDE) }
        },
    )
}

/// Calls `draw` once for each shape, with its push constants and number.
fn each_shape(
    gpu: &Gpu,
    change: impl FnOnce(Plan) -> Plan,
    draw: impl Fn(&Recorder<'_>, u32),
) -> Result<Vec<u8>> {
    let target = Target::new(gpu, TargetPlan::default())?;
    let plan = change(Plan::new(gpu, &target)?);
    let pipeline = plan.create(gpu)?;
    one_pass(gpu, &target, |recorder| {
        recorder.bind(pipeline);
        for (shape, k) in shapes().iter().zip(0..) {
            recorder.push(plan.layout, &shape.constants());
            draw(recorder, k);
        }
    })
}

fn multi(opening: &mut Opening) -> Result<()> {
    opening.core((|f| &mut f.multi_draw_indirect, "multiDrawIndirect"))?;
    opening.core((|f| &mut f.draw_indirect_first_instance, "drawIndirectFirstInstance"))
}

pub(super) fn multi_indirect() -> Result<Vec<u8>> {
    three(&Gpu::with(multi)?, |plan| plan)
}

/// The shader asks for the draw's number within the command.
pub(super) fn draw_id() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        multi(opening)?;
        opening.features::<vk::PhysicalDeviceShaderDrawParametersFeatures<'_>>(&[(
            |f| &mut f.shader_draw_parameters,
            "shaderDrawParameters",
        )])
    })?;
    three(&gpu, |plan| plan.vertex(shader::DRAW_ID))
}

/// Three draws of each command.
fn three(gpu: &Gpu, change: impl FnOnce(Plan) -> Plan) -> Result<Vec<u8>> {
    let numbers = Buffer::of(gpu, DRAWS.as_flattened(), vk::BufferUsageFlags::INDIRECT_BUFFER)?;
    each_shape(gpu, change, |recorder, _| {
        let (at, count) = (recorder.buffer, DRAWS.len() as u32);
        // SAFETY: the buffer holds as many draws.
        unsafe { gpu.device.cmd_draw_indirect(at, numbers.handle, 0, count, STRIDE) }
    })
}

pub(super) fn indirect_count() -> Result<Vec<u8>> {
    let gpu = Gpu::with(counting)?;
    let calls = ash::khr::draw_indirect_count::Device::new(&gpu.host.instance, &gpu.device);
    counted(&gpu, 2, |at, numbers, count| {
        // SAFETY: the buffer holds as many draws.
        unsafe { calls.cmd_draw_indirect_count(at, numbers, 0, count, 0, 3, STRIDE) }
    })
}

/// At most one, though the buffer says two.
pub(super) fn indirect_count_one() -> Result<Vec<u8>> {
    let gpu = Gpu::with(counting)?;
    let calls = ash::khr::draw_indirect_count::Device::new(&gpu.host.instance, &gpu.device);
    counted(&gpu, 2, |at, numbers, count| {
        // SAFETY: the buffer holds as many draws.
        unsafe { calls.cmd_draw_indirect_count(at, numbers, 0, count, 0, 1, STRIDE) }
    })
}

/// By the name that it has in Vulkan 1.2.
pub(super) fn indirect_count_core() -> Result<Vec<u8>> {
    let gpu = Gpu::on(&Host::with(vk::API_VERSION_1_2, &[])?, |opening| {
        multi(opening)?;
        opening.features::<vk::PhysicalDeviceVulkan12Features<'_>>(&[(
            |f| &mut f.draw_indirect_count,
            "drawIndirectCount",
        )])
    })?;
    counted(&gpu, 2, |at, numbers, count| {
        // SAFETY: the buffer holds as many draws.
        unsafe { gpu.device.cmd_draw_indirect_count(at, numbers, 0, count, 0, 3, STRIDE) }
    })
}

fn counting(opening: &mut Opening) -> Result<()> {
    multi(opening)?;
    opening.extension(ash::khr::draw_indirect_count::NAME)
}

/// How many draws a command makes lies in a buffer.
fn counted(
    gpu: &Gpu,
    count: u32,
    draw: impl Fn(vk::CommandBuffer, vk::Buffer, vk::Buffer),
) -> Result<Vec<u8>> {
    let usage = vk::BufferUsageFlags::INDIRECT_BUFFER;
    let numbers = Buffer::of(gpu, DRAWS.as_flattened(), usage)?;
    let count = Buffer::of(gpu, &[count], usage)?;
    each_shape(gpu, |plan| plan, |recorder, _| draw(recorder.buffer, numbers.handle, count.handle))
}

pub(super) fn multi_draw() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.extension(ash::ext::multi_draw::NAME)?;
        opening.features::<vk::PhysicalDeviceMultiDrawFeaturesEXT<'_>>(&[(
            |f| &mut f.multi_draw,
            "multiDraw",
        )])
    })?;
    let calls = ash::ext::multi_draw::Device::new(&gpu.host.instance, &gpu.device);
    let draws = DRAWS.map(|[vertex_count, _, first_vertex, _]| vk::MultiDrawInfoEXT {
        first_vertex,
        vertex_count,
    });
    let (count, stride) = (draws.len() as u32, size_of::<vk::MultiDrawInfoEXT>() as u32);
    each_shape(
        &gpu,
        |plan| plan,
        |recorder, _| {
            let draw = calls.fp().cmd_draw_multi_ext;
            // SAFETY: there are as many draws.
            unsafe { draw(recorder.buffer, count, draws.as_ptr(), 2, 1, stride) }
        },
    )
}

pub(super) fn indexed() -> Result<Vec<u8>> {
    indexed_with(|gpu, recorder, [count, instances, first_index, offset, first_instance]| {
        let (at, offset) = (recorder.buffer, offset.cast_signed());
        // SAFETY: buffers are bound.
        unsafe {
            let device = &gpu.device;
            device.cmd_draw_indexed(at, count, instances, first_index, offset, first_instance);
        }
        Ok(())
    })
}

pub(super) fn indexed_indirect() -> Result<Vec<u8>> {
    indexed_with(|gpu, recorder, numbers| {
        let numbers = Buffer::of(gpu, &numbers, vk::BufferUsageFlags::INDIRECT_BUFFER)?;
        // SAFETY: buffers are bound.
        unsafe {
            gpu.device.cmd_draw_indexed_indirect(recorder.buffer, numbers.handle, 0, 1, 20);
        }
        Ok(())
    })
}

/// Shapes of vertex, instance and index buffers; `draw` is given a draw's five numbers.
fn indexed_with(draw: impl Fn(&Gpu, &Recorder<'_>, [u32; 5]) -> Result<()>) -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.core((|f| &mut f.draw_indirect_first_instance, "drawIndirectFirstInstance"))
    })?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    // Four corners of a square, then of a lozenge.
    let corners = [0., 0., 1., 0., 0., 1., 1., 1., 0.5, 0., 1., 0.5, 0., 0.5, 0.5, 1.];
    let vertices = Buffer::of(&gpu, &bits(&corners), vk::BufferUsageFlags::VERTEX_BUFFER)?;
    let each: Vec<f32> = shapes().iter().flat_map(|shape| shape.constants()).collect();
    let instances = Buffer::of(&gpu, &bits(&each), vk::BufferUsageFlags::VERTEX_BUFFER)?;
    let order = [0, 1, 2, 1, 3, 2];
    let indices = Buffer::of(&gpu, &order, vk::BufferUsageFlags::INDEX_BUFFER)?;
    let plan = Plan {
        bindings: vec![
            vk::VertexInputBindingDescription::default().stride(8),
            vk::VertexInputBindingDescription::default()
                .binding(1)
                .stride(32)
                .input_rate(vk::VertexInputRate::INSTANCE),
        ],
        attributes: vec![
            vk::VertexInputAttributeDescription::default().format(vk::Format::R32G32_SFLOAT),
            attribute(1, 0),
            attribute(2, 16),
        ],
        ..Plan::new(&gpu, &target)?.vertex(shader::INDEXED)
    };
    let pipeline = plan.create(&gpu)?;
    let mut outcome = Err(Failure::Failed("nothing was drawn".into()));
    let picture = one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        let (at, device) = (recorder.buffer, &gpu.device);
        // SAFETY: the buffers live until the device is idle.
        unsafe {
            device.cmd_bind_vertex_buffers(at, 0, &[vertices.handle, instances.handle], &[0, 0]);
            device.cmd_bind_index_buffer(at, indices.handle, 0, vk::IndexType::UINT32);
        }
        let draws = [[6, 3, 0, 0, 0], [6, 2, 0, 4, 3], [3, 2, 3, 0, 5]];
        outcome = draws.into_iter().try_for_each(|numbers| draw(&gpu, recorder, numbers));
    });
    outcome.and(picture)
}

/// Four floats of each instance.
fn attribute(location: u32, offset: u32) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription {
        location,
        binding: 1,
        format: vk::Format::R32G32B32A32_SFLOAT,
        offset,
    }
}

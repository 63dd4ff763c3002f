//! Draws whose numbers lie in buffers.

use ash::vk;

use super::one_pass;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::memory::Buffer;
use crate::pipeline::Plan;
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

/// Bytes from one draw's numbers to the next.
const STRIDE: u32 = 16;

pub(super) fn indirect() -> Result<Vec<u8>> {
    let gpu = Gpu::plain()?;
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let pipeline = plan.create(&gpu)?;
    let words: Vec<u32> =
        shapes().iter().flat_map(|shape| [shape.vertices, shape.instances, 0, 0]).collect();
    let numbers = Buffer::of(&gpu, &words, vk::BufferUsageFlags::INDIRECT_BUFFER)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        for (shape, k) in shapes().iter().zip(0_u64..) {
            recorder.push(plan.layout, &shape.constants());
            let (at, from) = (recorder.buffer, k * u64::from(STRIDE));
            // SAFETY: the buffer holds as many draws as there are shapes.
            unsafe { gpu.device.cmd_draw_indirect(at, numbers.handle, from, 1, STRIDE) }
        }
    })
}

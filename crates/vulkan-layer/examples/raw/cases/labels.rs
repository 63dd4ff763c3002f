//! Names of things and labels around draws.

use ash::ext::debug_utils;
use ash::vk;

use super::one_pass;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::Host;
use crate::pipeline::Plan;
use crate::scene::shapes;
use crate::shader;
use crate::target::{Target, TargetPlan};

pub(super) fn debug_labels() -> Result<Vec<u8>> {
    let gpu = Gpu::on(&Host::with(vk::API_VERSION_1_1, &[debug_utils::NAME])?, |_| Ok(()))?;
    let calls = debug_utils::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::default())?;
    let plan = Plan::new(&gpu, &target)?;
    let glass = plan.create(&gpu)?;
    let holes = plan.clone().fragment(shader::DISCARD).create(&gpu)?;
    // SAFETY: the handles are the device's.
    unsafe {
        let name = vk::DebugUtilsObjectNameInfoEXT::default();
        let picture = name.object_handle(target.images.colours[0].handle);
        calls.set_debug_utils_object_name(&picture.object_name(c"picture"))?;
        calls.set_debug_utils_object_name(&name.object_handle(glass).object_name(c"glass"))?;
        calls.set_debug_utils_object_name(&name.object_handle(holes).object_name(c"holes"))?;
    }
    one_pass(&gpu, &target, |recorder| {
        let at = recorder.buffer;
        let begin = |name| {
            let label = vk::DebugUtilsLabelEXT::default().label_name(name);
            // SAFETY: each label is ended below.
            unsafe { calls.cmd_begin_debug_utils_label(at, &label) }
        };
        // SAFETY: as many labels were begun.
        let end = || unsafe { calls.cmd_end_debug_utils_label(at) };
        begin(c"all");
        begin(c"panes");
        recorder.bind(glass);
        recorder.shapes(plan.layout, &shapes()[..3]);
        end();
        let mark = vk::DebugUtilsLabelEXT::default().label_name(c"half way");
        // SAFETY: the command buffer is being recorded.
        unsafe { calls.cmd_insert_debug_utils_label(at, &mark) }
        begin(c"nets");
        recorder.bind(holes);
        recorder.shapes(plan.layout, &shapes()[3..]);
        end();
        end();
    })
}

//! Stages between vertices and fragments, and several layers or views.

use ash::vk;

use super::{drawn, one_pass};
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::{Feature, Host};
use crate::pipeline::Plan;
use crate::shader;
use crate::target::{Target, TargetPlan};

const GEOMETRY: Feature<vk::PhysicalDeviceFeatures> =
    (|f| &mut f.geometry_shader, "geometryShader");

pub(super) fn geometry() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.core(GEOMETRY))?;
    drawn(&gpu, TargetPlan::default(), |mut plan| {
        plan.stages.push(shader::GEOMETRY);
        plan
    })
}

pub(super) fn tessellation() -> Result<Vec<u8>> {
    let gpu =
        Gpu::with(|opening| opening.core((|f| &mut f.tessellation_shader, "tessellationShader")))?;
    drawn(&gpu, TargetPlan::default(), |mut plan| {
        plan.topology = vk::PrimitiveTopology::PATCH_LIST;
        plan.stages.extend([shader::CONTROL, shader::EVALUATION]);
        plan
    })
}

pub(super) fn mesh() -> Result<Vec<u8>> {
    let gpu = Gpu::on(&Host::with(vk::API_VERSION_1_2, &[])?, |opening| {
        opening.extension(ash::ext::mesh_shader::NAME)?;
        opening.features::<vk::PhysicalDeviceMeshShaderFeaturesEXT<'_>>(&[(
            |f| &mut f.mesh_shader,
            "meshShader",
        )])
    })?;
    let calls = ash::ext::mesh_shader::Device::new(&gpu.host.instance, &gpu.device);
    let target = Target::new(&gpu, TargetPlan::default())?;
    let pipeline = Plan::new(&gpu, &target)?.vertex(shader::MESH).create(&gpu)?;
    one_pass(&gpu, &target, |recorder| {
        recorder.bind(pipeline);
        // SAFETY: the bound pipeline has a mesh shader.
        unsafe { calls.cmd_draw_mesh_tasks(recorder.buffer, 3, 1, 1) }
    })
}

pub(super) fn multiview() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| {
        opening.features::<vk::PhysicalDeviceMultiviewFeatures<'_>>(&[(
            |f| &mut f.multiview,
            "multiview",
        )])
    })?;
    let target = TargetPlan { layers: 2, multiview: true, ..TargetPlan::default() };
    drawn(&gpu, target, |plan| plan.vertex(shader::VIEW))
}

pub(super) fn layered() -> Result<Vec<u8>> {
    let gpu = Gpu::with(|opening| opening.core(GEOMETRY))?;
    drawn(&gpu, TargetPlan { layers: 2, ..TargetPlan::default() }, |mut plan| {
        plan.stages.push(shader::LAYERED);
        plan
    })
}

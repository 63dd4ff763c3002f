//! Several devices and instances in one process.

use super::drawn;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::host::Host;
use crate::shader;
use crate::target::TargetPlan;

pub(super) fn two_devices() -> Result<Vec<u8>> {
    let host = Host::new()?;
    let first = Gpu::on(&host, |_| Ok(()))?;
    let second = Gpu::on(&host, |_| Ok(()))?;
    drawn(&first, &TargetPlan::default(), |plan| plan.fragment(shader::DISCARD))?;
    drawn(&second, &TargetPlan::default(), |plan| plan)
}

//! The cases.

mod basic;
mod commands;
mod devices;
mod indirect;
mod libraries;
mod passes;

use crate::Call;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::shapes;
use crate::target::{Target, TargetPlan};

pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) says: &'static str,
    pub(crate) way: Way,
}

pub(crate) enum Way {
    /// Gives the bytes to write.
    Picture(fn() -> Result<Vec<u8>>),
    /// Writes them itself, if at all.
    Program(fn(&Call) -> Result<()>),
}

use Way::Picture;

const fn case(name: &'static str, says: &'static str, way: Way) -> Case {
    Case { name, says, way }
}

pub(crate) const CASES: &[Case] = &[
    case("plain", "blended shapes, one pass", Picture(basic::plain)),
    case("msaa4", "4 samples, resolved in the pass", Picture(basic::msaa4)),
    case("depth", "opaque shapes, then blended ones that write no depth", Picture(basic::depth)),
    case("discard", "the shader discards", Picture(basic::discard)),
    case("push", "all 128 bytes of push constants", Picture(basic::push)),
    case("secondaries", "executed in another order than recorded", Picture(commands::secondaries)),
    case("twice", "a primary twice in one submission", Picture(commands::twice)),
    case("libraries", "a pipeline linked of four libraries", Picture(libraries::libraries)),
    case("indirect", "each draw's numbers in a buffer", Picture(indirect::indirect)),
    case("load", "a second submission draws onto the first's picture", Picture(passes::load)),
    case("two-devices", "OUT is the second's", Picture(devices::two_devices)),
];

/// Draws all shapes in one pass with the plan that `change` makes of the usual one.
fn drawn(gpu: &Gpu, target: &TargetPlan, change: impl FnOnce(Plan) -> Plan) -> Result<Vec<u8>> {
    let target = Target::new(gpu, target.clone())?;
    let plan = change(Plan::new(gpu, &target)?);
    let pipeline = plan.create(gpu)?;
    one_pass(gpu, &target, |recorder| {
        recorder.bind(pipeline);
        recorder.shapes(plan.layout, &shapes());
    })
}

/// Submits one pass and reads the picture.
fn one_pass(gpu: &Gpu, target: &Target, draw: impl FnOnce(&Recorder<'_>)) -> Result<Vec<u8>> {
    let recorder = Recorder::once(gpu)?;
    recorder.pass(target);
    draw(&recorder);
    recorder.end_pass();
    recorder.run()?;
    read(gpu, target.images.finished())
}

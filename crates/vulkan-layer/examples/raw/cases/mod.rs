//! The cases.

mod basic;
mod blends;
mod commands;
mod descriptors;
mod devices;
mod dynamic;
mod frames;
mod indirect;
mod labels;
mod libraries;
mod passes;
mod pipelines;
mod process;
mod rendering;
mod stages;
mod sync;

use ash::vk;

use crate::Call;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::Plan;
use crate::record::{Recorder, read};
use crate::scene::{Shape, shapes};
use crate::target::{Target, TargetPlan};

pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) says: &'static str,
    pub(crate) way: Way,
}

#[derive(Clone, Copy)]
pub(crate) enum Way {
    /// Gives the bytes to write.
    Picture(fn() -> Result<Vec<u8>>),
    /// Writes them itself, if at all.
    Program(fn(&Call) -> Result<()>),
}

use Way::{Picture, Program};

const fn case(name: &'static str, says: &'static str, way: Way) -> Case {
    Case { name, says, way }
}

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case("plain", "blended shapes in one pass", Picture(basic::plain)),
    case("msaa4", "4 samples, resolved in the pass", Picture(basic::msaa4)),
    case("depth", "opaque shapes, then blended ones that write no depth", Picture(basic::depth)),
    case("depth-msaa4", "the same with 4 samples", Picture(basic::depth_msaa4)),
    case("reversed", "depth 1 is near, the test greater or equal", Picture(basic::reversed)),
    case("discard", "the shader discards", Picture(basic::discard)),
    case("depth-output", "the shader writes depth", Picture(basic::depth_output)),
    case("mask-output", "the shader writes the sample mask", Picture(basic::mask_output)),
    case("per-sample", "the shader asks which sample it is", Picture(basic::per_sample)),
    case("sample-shading", "the pipeline shades each sample", Picture(basic::sample_shading)),
    case("early-tests", "the shader asks for early tests, and discards", Picture(basic::early_tests)),
    case("no-fragment-output", "depth first with no fragment shader, then equal", Picture(basic::no_fragment_output)),
    case("prepass-discard", "depth first with a shader that discards, then equal", Picture(basic::prepass_discard)),
    case("stencil", "a stencil test that fails for part", Picture(basic::stencil)),
    case("push", "all 128 bytes of push constants", Picture(basic::push)),
    case("many-draws", "5,000 draws", Picture(basic::many_draws)),
    case("grow", "four million fragments", Picture(basic::grow)),
    case("integer-target", "RGBA8 of integers", Picture(basic::integer_target)),
    case("float-target", "RGBA of 16-bit floats; OUT has 8 bytes a texel", Picture(basic::float_target)),
    case("bgra", "BGRA8; OUT is in that order", Picture(basic::bgra)),
    case("srgb", "RGBA8 of sRGB", Picture(basic::srgb)),
    case("premultiplied", "colour times alpha by the shader", Picture(blends::premultiplied)),
    case("one-one", "colours are added", Picture(blends::one_one)),
    case("max", "the greater of both", Picture(blends::max)),
    case("write-mask", "red and blue alone are written", Picture(blends::write_mask)),
    case("constant-blend", "a grey blend constant, fixed and set", Picture(blends::constant_blend)),
    case("constant-colour", "a coloured blend constant, fixed and set", Picture(blends::constant_colour)),
    case("dual-source", "two outputs for one target", Picture(blends::dual_source)),
    case("logic-op", "exclusive or", Picture(blends::logic_op)),
    case("alpha-to-coverage", "alpha becomes samples", Picture(blends::alpha_to_coverage)),
    case("two-targets", "two colours, each blended in its way; OUT has both", Picture(blends::two_targets)),
    case("secondaries", "two secondaries in another order than recorded", Picture(commands::secondaries)),
    case("secondary-twice", "a secondary twice in a primary", Picture(commands::secondary_twice)),
    case("conditional", "draws on conditions that lie in a buffer", Picture(commands::conditional)),
    case("twice", "a primary twice in one submission", Picture(commands::twice)),
    case("again", "a primary in two submissions", Picture(commands::again)),
    case("recorded-again", "a primary thrown away and recorded again", Picture(commands::recorded_again)),
    case("libraries", "a pipeline linked of four libraries", Picture(libraries::libraries)),
    case("libraries-apart", "a pipeline linked of parts with layouts of their own", Picture(libraries::libraries_apart)),
    case("discarded", "one pipeline draws nothing, its state is ignored", Picture(pipelines::discarded)),
    case("allocator", "a layout of the program's memory goes before its pipeline", Picture(pipelines::allocator)),
    case("nothing-submitted", "a submission without command buffers first", Picture(pipelines::nothing_submitted)),
    case("very-many-draws", "131,082 draws", Picture(pipelines::very_many_draws)),
    case("cost", "what a draw costs to record, the least of NUMBER (20) times", Program(pipelines::cost)),
    case("module-in-pnext", "shaders with no modules", Picture(libraries::module_in_pnext)),
    case("sets", "as many descriptor sets as there are, up to 8, all read", Picture(descriptors::sets)),
    case("all-sets", "as many descriptor sets as there are, two read", Picture(descriptors::all_sets)),
    case("sets-unasked", "8 descriptor sets, whatever the limit says", Picture(descriptors::sets_unasked)),
    case("set-above", "a set stays bound over a pipeline without it", Picture(descriptors::set_above)),
    case("set-above-dynamic", "the same with dynamic offsets", Picture(descriptors::set_above_dynamic)),
    case("set-below", "the same while another first set is bound", Picture(descriptors::set_below)),
    case("push-descriptors", "a set written by commands", Picture(descriptors::push_descriptors)),
    case("push-compute", "descriptors pushed for computing in between", Picture(descriptors::push_compute)),
    case("push-above", "a pushed set stays over a pipeline without it", Picture(descriptors::push_above)),
    case("most-dynamic", "all descriptors with dynamic offsets that a stage has", Picture(descriptors::most_dynamic)),
    case("indexed", "vertex, instance and index buffers", Picture(indirect::indexed)),
    case("indexed-indirect", "the same, each draw's numbers in a buffer", Picture(indirect::indexed_indirect)),
    case("indirect", "each draw's numbers in a buffer", Picture(indirect::indirect)),
    case("multi-indirect", "three draws a command", Picture(indirect::multi_indirect)),
    case("draw-id", "the same, and the shader asks which it is", Picture(indirect::draw_id)),
    case("indirect-count", "two draws, said in a buffer, of at most three", Picture(indirect::indirect_count)),
    case("indirect-count-one", "two draws, said in a buffer, of at most one", Picture(indirect::indirect_count_one)),
    case("indirect-count-core", "as indirect-count, by Vulkan 1.2", Picture(indirect::indirect_count_core)),
    case("multi-draw", "three draws a command, of VK_EXT_multi_draw", Picture(indirect::multi_draw)),
    case("dynamic-state", "depth test, blending and write mask set by commands", Picture(dynamic::dynamic_state)),
    case("viewports", "viewport and scissor set by commands, one upside down", Picture(dynamic::viewports)),
    case("load", "a second submission draws onto the first's picture", Picture(passes::load)),
    case("imageless", "a framebuffer without images", Picture(passes::imageless)),
    case("pass-2", "VK_KHR_create_renderpass2", Picture(passes::pass_2)),
    case("dynamic-rendering", "no passes, with depth", Picture(rendering::dynamic)),
    case("dynamic-rendering-core", "the same by Vulkan 1.3, with 4 samples", Picture(rendering::dynamic_core)),
    case("dynamic-rendering-secondary", "the draws are a secondary's", Picture(rendering::secondary)),
    case("subpasses", "two subpasses draw to one colour", Picture(passes::subpasses)),
    case("subpasses-apart", "two subpasses, each with its colour; OUT has both", Picture(passes::subpasses_apart)),
    case("subpasses-input", "the second subpass reads the first's; OUT has both", Picture(descriptors::subpasses_input)),
    case("clear-attachments", "all is cleared between draws", Picture(passes::clear_attachments)),
    case("clear-part", "a part is cleared between draws", Picture(passes::clear_part)),
    case("blit", "OUT is a copy of the target, upside down", Picture(passes::blit)),
    case("overwritten", "the target is copied onto itself between draws", Picture(passes::overwritten)),
    case("resolve-command", "4 samples, resolved after the pass", Picture(passes::resolve_command)),
    case("geometry", "a geometry shader", Picture(stages::geometry)),
    case("tessellation", "tessellation shaders", Picture(stages::tessellation)),
    case("mesh", "a mesh shader", Picture(stages::mesh)),
    case("multiview", "two views; OUT has both", Picture(stages::multiview)),
    case("layered", "two layers by a geometry shader; OUT has both", Picture(stages::layered)),
    case("debug-labels", "labels around draws, names of pipelines and target", Picture(labels::debug_labels)),
    case("two-devices", "two devices draw; OUT is the second's", Picture(devices::two_devices)),
    case("two-instances", "two instances draw; OUT is the second's", Picture(devices::two_instances)),
    case("two-queues", "one queue draws onto another's picture", Picture(devices::two_queues)),
    case("timeline", "submissions wait for the host", Picture(sync::timeline)),
    case("timeline-queue", "a submission waits for one before it", Picture(sync::timeline_queue)),
    case("timeline-two-queues", "a submission waits for a later one of another queue", Picture(sync::timeline_two_queues)),
    case("timeline-twice", "commands twice, each time waiting for the host", Picture(sync::timeline_twice)),
    case("timeline-behind", "a submission behind one that waits for the host", Picture(sync::timeline_behind)),
    case("events", "commands wait for an event that the host sets", Picture(sync::events)),
    case("fork", "a child process draws", Program(process::child)),
    case("forked", "a copy of the process draws", Program(process::forked)),
    case("launcher", "the process becomes another program, which draws", Program(process::launcher)),
    case("exit-without-destroy", "nothing is destroyed", Program(process::exit_without_destroy)),
    case("resubmit-frames", "the same commands for NUMBER (5) frames", Program(frames::resubmit_frames)),
    case("resize", "two frames of one size, three of 160x120; OUT is the last", Picture(frames::resize)),
    case("killed", "ends by SIGKILL in its third frame; OUT is the second", Program(frames::killed)),
    case("forever", "frames until SIGTERM, for 30 s at most; OUT is the first", Program(frames::forever)),
];

/// Draws all shapes in one pass with the plan that `change` makes of the usual one.
fn drawn(gpu: &Gpu, target: TargetPlan, change: impl FnOnce(Plan) -> Plan) -> Result<Vec<u8>> {
    let target = Target::new(gpu, target)?;
    let plan = change(Plan::new(gpu, &target)?);
    recorded(gpu, &target, target.pass, &plan, &shapes())?.run()?;
    read(gpu, target.images.finished())
}

/// A command buffer with one pass that draws shapes.
fn recorded<'a>(
    gpu: &'a Gpu,
    target: &Target,
    pass: vk::RenderPass,
    plan: &Plan,
    shapes: &[Shape],
) -> Result<Recorder<'a>> {
    let pipeline = plan.create(gpu)?;
    let recorder = Recorder::once(gpu)?;
    recorder.pass_of(target, pass, vk::SubpassContents::INLINE);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, shapes);
    recorder.end_pass();
    Ok(recorder)
}

/// A target, and two command buffers: one that clears it and draws half of the shapes, one that
/// draws the others onto them.
fn halves(gpu: &Gpu) -> Result<(Target, vk::CommandBuffer, vk::CommandBuffer)> {
    let target = Target::new(gpu, TargetPlan::default())?;
    let loading = target.plan.pass(gpu, true)?;
    let plan = Plan::new(gpu, &target)?;
    let first = recorded(gpu, &target, target.pass, &plan, &shapes()[..4])?.end()?;
    let then = recorded(gpu, &target, loading, &plan, &shapes()[4..])?.end()?;
    Ok((target, first, then))
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

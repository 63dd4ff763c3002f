//! Programs that draw frame after frame.

use std::time::{Duration, Instant};

use ash::vk;

use super::process;
use crate::Call;
use crate::chain::Chain;
use crate::failure::Result;
use crate::gpu::Gpu;
use crate::pipeline::Plan;
use crate::record::Recorder;
use crate::scene::{Shape, shapes};
use crate::surface::Surface;
use crate::target::EXTENT;

/// What frames need. The surface is the last to go.
struct Show {
    gpu: Gpu,
    surface: Option<Surface>,
}

impl Show {
    fn open() -> Result<Self> {
        let (host, surface) = Surface::open(EXTENT)?;
        let gpu = Gpu::on(&host, |opening| match surface {
            Some(_) => opening.extension(ash::khr::swapchain::NAME),
            None => Ok(()),
        })?;
        eprintln!("frames are {}", if surface.is_some() { "presented" } else { "submitted" });
        Ok(Self { gpu, surface })
    }

    fn chain(&self, extent: vk::Extent2D, old: Option<&Chain>) -> Result<(Chain, Plan)> {
        let chain = Chain::new(&self.gpu, self.surface.as_ref(), extent, old)?;
        let plan = Plan::new(&self.gpu, &chain.targets[0])?;
        Ok((chain, plan))
    }
}

/// Records a frame.
fn frame(
    gpu: &Gpu,
    chain: &Chain,
    image: usize,
    (plan, pipeline): (&Plan, vk::Pipeline),
    shapes: &[Shape],
) -> Result<vk::CommandBuffer> {
    let recorder = Recorder::new(gpu, vk::CommandBufferUsageFlags::empty())?;
    recorder.pass(&chain.targets[image]);
    recorder.bind(pipeline);
    recorder.shapes(plan.layout, shapes);
    recorder.end_pass();
    chain.finish(&recorder, image);
    recorder.end()
}

/// The shapes of a frame, which move.
fn moved(frame: u8) -> Vec<Shape> {
    let mut all = shapes();
    all.iter_mut().for_each(|shape| shape.place[0] += f32::from(frame % 50) * 0.02);
    all
}

/// The same command buffer for each image is submitted frame after frame.
pub(super) fn resubmit_frames(call: &Call) -> Result<()> {
    let show = Show::open()?;
    let (mut chain, plan) = show.chain(EXTENT, None)?;
    let pipeline = plan.create(&show.gpu)?;
    let recorded: Vec<_> = (0..chain.targets.len())
        .map(|image| frame(&show.gpu, &chain, image, (&plan, pipeline), &shapes()))
        .collect::<Result<_>>()?;
    for _ in 0..call.number.unwrap_or(5) {
        chain.frame(&show.gpu, |_, image| Ok(recorded[image]))?;
    }
    Ok(std::fs::write(&call.out, chain.picture.read(&show.gpu)?)?)
}

/// Two frames of one size, three of another.
pub(super) fn resize() -> Result<Vec<u8>> {
    let show = Show::open()?;
    let gpu = &show.gpu;
    let mark = gpu.mark();
    let (mut chain, plan) = show.chain(EXTENT, None)?;
    let pipeline = plan.create(gpu)?;
    for i in 0..2 {
        chain.frame(gpu, |chain, image| frame(gpu, chain, image, (&plan, pipeline), &moved(i)))?;
    }
    let old = gpu.take_since(mark);
    let extent = vk::Extent2D { width: 160, height: 120 };
    if let Some(surface) = &show.surface {
        surface.resize(extent);
    }
    let (mut chain, plan) = show.chain(extent, Some(&chain))?;
    old.into_iter().for_each(|end| end(&gpu.device));
    let pipeline = plan.create(gpu)?;
    for i in 2..5 {
        chain.frame(gpu, |chain, image| frame(gpu, chain, image, (&plan, pipeline), &moved(i)))?;
    }
    chain.picture.read(gpu)
}

/// Ends by a signal in its third frame, of which half was submitted. OUT is the second frame.
pub(super) fn killed(call: &Call) -> Result<()> {
    let show = Show::open()?;
    let gpu = &show.gpu;
    let (mut chain, plan) = show.chain(EXTENT, None)?;
    let pipeline = plan.create(gpu)?;
    for i in 0..2 {
        chain.frame(gpu, |chain, image| frame(gpu, chain, image, (&plan, pipeline), &moved(i)))?;
    }
    std::fs::write(&call.out, chain.picture.read(gpu)?)?;
    chain.frame(gpu, |chain, image| {
        gpu.submit(&[frame(gpu, chain, image, (&plan, pipeline), &moved(2)[..3])?])?;
        process::kill()
    })
}

/// Draws frames until it is ended from outside, or for 30 seconds. OUT is the first frame.
pub(super) fn forever(call: &Call) -> Result<()> {
    let show = Show::open()?;
    let gpu = &show.gpu;
    let (mut chain, plan) = show.chain(EXTENT, None)?;
    let pipeline = plan.create(gpu)?;
    let (start, mut written) = (Instant::now(), false);
    for i in (0..=u8::MAX).cycle() {
        let mut used = None;
        chain.frame(gpu, |chain, image| {
            let buffer = frame(gpu, chain, image, (&plan, pipeline), &moved(i))?;
            used = Some(buffer);
            Ok(buffer)
        })?;
        // SAFETY: the frame is done.
        unsafe { gpu.device.free_command_buffers(gpu.pool, used.as_slice()) }
        if !written {
            std::fs::write(&call.out, chain.picture.read(gpu)?)?;
            written = true;
        }
        if start.elapsed() > Duration::from_secs(30) {
            break;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

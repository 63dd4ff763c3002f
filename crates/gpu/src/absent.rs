//! What a program built without wgpu has instead of GPUs: none, said by [`Gpu::open`], so
//! that nothing else asks how it was built.

use screendoor_designs::Configured;
use screendoor_rop::Replayed;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::Trace;

use crate::options::{Adapter, GpuOptions, GpuSeconds};

/// A GPU; there is none.
#[derive(Debug)]
pub enum Gpu {}

impl Gpu {
    /// The adapters of this machine: none are looked for.
    pub fn adapters() -> Vec<Adapter> {
        Vec::new()
    }

    /// # Errors
    /// Always [`Error::Gpu`].
    pub fn open(_name: Option<&str>) -> Result<Self> {
        Err(Error::gpu(
            "no GPU",
            "this program was built without its GPU port",
            "build it with the feature 'gpu', which is on unless it is left out",
        ))
    }

    /// What the adapter says about itself.
    pub fn adapter(&self) -> &Adapter {
        match *self {}
    }

    /// Loses the device.
    pub fn lose(&self) {
        match *self {}
    }
}

/// Replays `trace` through a design on a GPU.
///
/// # Errors
/// None: there is no GPU to call it with.
pub fn replay(
    gpu: &Gpu,
    _design: &Configured,
    _trace: &Trace,
    _samples: u32,
    _seed: u32,
    _options: &GpuOptions<'_>,
) -> Result<(Replayed, GpuSeconds, u64)> {
    match *gpu {}
}

/// Capture by a GPU.
pub mod capture {
    use std::io::Write;

    use screendoor_scene::capture::{CaptureOptions, Unseen};
    use screendoor_scene::scene::Scene;
    use screendoor_trace::error::Result;
    use screendoor_trace::trace::{Header, SamplePattern, TraceWriter};

    use crate::Gpu;
    pub use crate::differences::{CrossCheck, Difference};

    /// A scene about to be captured by a GPU, of which there is none.
    pub struct GpuCapture<'a>(&'a Gpu);

    impl<'a> GpuCapture<'a> {
        /// # Errors
        /// None: there is no GPU to call it with.
        pub fn new(gpu: &'a Gpu, _scene: &'a Scene, _options: &'a CaptureOptions) -> Result<Self> {
            match *gpu {}
        }

        /// The trace's header.
        pub fn header(&self) -> &Header {
            match *self.0 {}
        }

        /// Draws the scene.
        ///
        /// # Errors
        /// None, as [`GpuCapture::new`].
        pub fn draw<W: Write>(
            &self,
            _writer: &mut TraceWriter<W>,
            _progress: impl FnMut(u64, u64),
        ) -> Result<()> {
            match *self.0 {}
        }

        /// Objects of which nothing was recorded.
        pub fn unseen(&self) -> Vec<Unseen> {
            match *self.0 {}
        }

        /// Holds our rasteriser against the adapter's.
        ///
        /// # Errors
        /// None, as [`GpuCapture::new`].
        pub fn check(
            &self,
            _pattern: &SamplePattern,
            _progress: impl FnMut(u64, u64),
        ) -> Result<CrossCheck> {
            match *self.0 {}
        }
    }
}

//! What is said of a GPU and of a replay there, whether or not there is one.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

/// What an adapter says about itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// Its driver, with its version.
    pub driver: String,
    /// The interface it is reached by: `vulkan`, `metal`, `dx12`.
    pub backend: String,
    /// `discrete GPU`, `integrated GPU`, `virtual GPU`, `CPU` or `other`.
    pub kind: &'static str,
    /// Threads that run in step, at least and at most.
    pub subgroup: [u32; 2],
}

/// `NAME (driver …, vulkan)`.
impl fmt::Display for Adapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {})", self.name, self.driver, self.backend)
    }
}

screendoor_trace::options! {
    /// What a thread is given. Pixels measure faster at every sample count (docs/PERFORMANCE.md).
    pub enum Threads {
        Pixel = "pixel": "a pixel",
        Sample = "sample": "a sample, where the design is for it; those of a pixel work together",
    }
}

/// How to replay on a GPU; none of it changes the picture.
#[derive(Clone, Copy)]
pub struct GpuOptions<'a> {
    /// What a thread is given.
    pub threads: Threads,
    /// Rows of a chunk, at most; fewer where a buffer holds fewer.
    pub rows: u64,
    /// Bytes of chunks that stay on the device for the next pass, or the next replay.
    pub resident: u64,
    /// Whether chunks that an earlier replay of the trace has left on the device are drawn, and
    /// are left for the next where all are `resident`.
    pub keep: bool,
    /// Is told how many fragments have been drawn, of how many.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

impl Default for GpuOptions<'_> {
    fn default() -> Self {
        let threads = Threads::Pixel;
        let progress = &|_, _| ();
        GpuOptions { threads, rows: u64::MAX, resident: 1 << 31, keep: true, progress }
    }
}

/// Where the time of a replay went, in seconds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct GpuSeconds {
    /// The whole, by the clock on the wall.
    pub wall: f64,
    /// Reading the file and bringing it to the device.
    pub upload: f64,
    /// Bringing the picture back, or the state, and resolving it.
    pub back: f64,
    /// By the device's clock, where it has one: `bin`, `draw` and others.
    pub device: Option<BTreeMap<&'static str, f64>>,
}

//! How fast engines replay a trace, side by side.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use statrs::statistics::{Data, OrderStatistics};

use crate::study::engine::{Engine, EngineName};
use screendoor_designs::Configured;
use screendoor_rop::{ReplayOptions, StateBits};
use screendoor_trace::error::Result;
use screendoor_trace::tile::TILE_PIXELS;
use screendoor_trace::trace::{SampleMask, Trace};

/// What to measure.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The designs.
    pub designs: Vec<Configured>,
    /// The sample counts.
    pub samples: Vec<u32>,
    /// How often each is measured; one more replay warms up.
    pub runs: usize,
    /// Bytes that the state of a design may take that grows with the fragments.
    pub memory: u64,
}

/// The median of several measurements, and the quartiles.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Spread {
    /// A quarter lie below.
    pub low: f64,
    /// Half lie below.
    pub median: f64,
    /// A quarter lie above.
    pub high: f64,
}

impl Spread {
    /// What is counted, not measured.
    pub fn exactly(value: f64) -> Self {
        Spread { low: value, median: value, high: value }
    }

    /// Of some measurements; `None` of none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut data = Data::new(values.to_vec());
        (!values.is_empty()).then(|| Spread {
            low: data.lower_quartile(),
            median: data.median(),
            high: data.upper_quartile(),
        })
    }
}

/// One design at one sample count on one engine.
#[derive(Clone, Debug, Serialize)]
pub struct Throughput {
    /// Name and changed parameters.
    pub design: String,
    /// Samples per pixel.
    pub samples: u32,
    /// The engine.
    pub engine: EngineName,
    /// Why there is no figure; `None` where there are.
    pub missing: Option<String>,
    /// Fragments that cover one of the samples.
    pub fragments: u64,
    /// Samples that they cover.
    pub covered: u64,
    /// How many times the trace is read.
    pub passes: u32,
    /// Bytes that must move at least: the stored columns once a pass, and the state of the
    /// touched tiles in and out once a pass.
    pub bytes: u64,
    /// Seconds of a replay to the picture: on a processor from the fragments that the first one
    /// has left sorted by tile, where they fit into memory; else from the file.
    pub whole: Option<Spread>,
    /// Seconds in which a GPU draws, by its own clock.
    pub kernel: Option<Spread>,
    /// Seconds in which it sorts, by its own clock.
    pub bin: Option<Spread>,
    /// Seconds of reading the file and bringing it to the GPU.
    pub upload: Option<Spread>,
    /// Seconds of bringing back what it has drawn.
    pub back: Option<Spread>,
}

/// Fragments and samples that they cover.
#[derive(Clone, Copy, Debug)]
pub(super) struct Work {
    pub fragments: u64,
    pub covered: u64,
}

/// Measures all of `plan` on `engines`, one after the other within each design and count, so
/// that what is compared is measured at about the same time. Tells `progress` what runs, how
/// many runs are done, and of how many.
///
/// # Errors
/// As [`Engine::replay`], but for a design without a port: that is a fact of the result.
pub fn measure(
    trace: &Trace,
    engines: &[(EngineName, Engine)],
    plan: &Plan,
    progress: &dyn Fn(&str, u64, u64),
) -> Result<Vec<Throughput>> {
    let mut list = Vec::new();
    let cases = plan.samples.len() * plan.designs.len() * engines.len();
    let total = (cases * (plan.runs + 1)) as u64;
    let mut done = 0;
    for samples in &plan.samples {
        let work = work(trace, *samples)?;
        for design in &plan.designs {
            let mut cases: Vec<Case> =
                engines.iter().map(|(name, engine)| Case::new(*name, engine)).collect();
            for run in 0..=plan.runs {
                for case in &mut cases {
                    let name = format!("{} at {samples} on {}", design.label(), case.name.name());
                    progress(&name, done, total);
                    case.run(trace, design, *samples, plan.memory, run > 0)?;
                    done += 1;
                }
            }
            list.extend(cases.into_iter().map(|case| case.finish(trace, design, *samples, work)));
        }
    }
    Ok(list)
}

/// A case while it is measured.
struct Case<'a> {
    name: EngineName,
    engine: &'a Engine,
    missing: Option<String>,
    passes: u32,
    state: StateBits,
    tiles: usize,
    whole: Vec<f64>,
    kernel: Vec<f64>,
    bin: Vec<f64>,
    upload: Vec<f64>,
    back: Vec<f64>,
}

impl<'a> Case<'a> {
    fn new(name: EngineName, engine: &'a Engine) -> Self {
        let [whole, kernel, bin, upload, back] = Default::default();
        let state = StateBits::default();
        Case {
            name,
            engine,
            missing: None,
            passes: 1,
            state,
            tiles: 0,
            whole,
            kernel,
            bin,
            upload,
            back,
        }
    }

    fn run(
        &mut self,
        trace: &Trace,
        design: &Configured,
        samples: u32,
        memory: u64,
        counts: bool,
    ) -> Result<()> {
        if matches!(self.engine, Engine::Gpu(..)) && !design.is_ported() {
            self.missing = Some("no port to GPUs".to_string());
            return Ok(());
        }
        let start = Instant::now();
        // Uploading and sorting are a part of what is measured of a GPU.
        let keep = matches!(self.engine, Engine::Cpu(_));
        let options = ReplayOptions { memory, keep, ..ReplayOptions::default() };
        let (replayed, gpu) = self.engine.replay(design, trace, samples, 0, &options)?;
        let whole = start.elapsed().as_secs_f64();
        self.passes = replayed.passes;
        self.state = replayed.state_bits;
        self.tiles = replayed.touched_tiles;
        if !counts {
            return Ok(());
        }
        self.whole.push(whole);
        if let Some(gpu) = gpu {
            self.upload.push(gpu.seconds.upload);
            self.back.push(gpu.seconds.back);
            if let Some(device) = gpu.seconds.device {
                self.kernel.push(device.get("draw").copied().unwrap_or(0.0));
                self.bin.push(device.get("bin").copied().unwrap_or(0.0));
            }
        }
        Ok(())
    }

    fn finish(self, trace: &Trace, design: &Configured, samples: u32, work: Work) -> Throughput {
        let state = u64::from(self.state.total()).div_ceil(8) * (self.tiles * TILE_PIXELS) as u64;
        let columns = trace.rows() * trace.bytes_per_row();
        Throughput {
            design: design.label(),
            samples,
            engine: self.name,
            missing: self.missing,
            fragments: work.fragments,
            covered: work.covered,
            passes: self.passes,
            bytes: u64::from(self.passes) * (columns + 2 * state),
            whole: Spread::of(&self.whole),
            kernel: Spread::of(&self.kernel),
            bin: Spread::of(&self.bin),
            upload: Spread::of(&self.upload),
            back: Spread::of(&self.back),
        }
    }
}

/// Fragments that cover one of the first samples, and how many of these they cover.
pub(super) fn work(trace: &Trace, samples: u32) -> Result<Work> {
    let mask = SampleMask::first(samples);
    let mut work = Work { fragments: 0, covered: 0 };
    for batch in trace.batches() {
        let batch = batch?;
        for i in 0..batch.len() {
            let covered = (batch.coverage(i) & mask).count();
            work.fragments += u64::from(covered > 0);
            work.covered += u64::from(covered);
        }
    }
    Ok(work)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_of_a_few() {
        let spread = Spread::of(&[5.0, 1.0, 3.0, 2.0, 4.0]).unwrap();
        assert_eq!(spread.median, 3.0);
        assert!(spread.low > 1.0 && spread.low < 3.0 && spread.high > 3.0 && spread.high < 5.0);
        assert_eq!(Spread::of(&[]), None);
    }
}

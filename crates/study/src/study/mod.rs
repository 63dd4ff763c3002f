//! From a trace and a plan to measured records: what every report is made of.

pub mod analysis;
pub mod comparison;
pub mod engine;
pub mod explained;
pub mod file;
pub mod machine;
pub mod publications;
pub mod record;
pub mod results;
pub mod run;
pub mod stress;
pub mod throughput;

use std::time::Instant;

use serde::Serialize;
use statrs::statistics::{Data, OrderStatistics};

use crate::metrics::{Ensemble, EnsembleErrors, Estimate, PixelClasses, Region, errors};
use screendoor_designs::{Configured, REFERENCE, configure};
use screendoor_rop::{EventCounts, ReplayOptions, StateBits};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::Trace;

/// What to measure on a trace.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The designs.
    pub designs: Vec<Configured>,
    /// The sample counts.
    pub samples: Vec<u32>,
    /// How many seeds of each, from 0 on.
    pub seeds: u32,
}

/// One design at one sample count on one trace.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Name and changed parameters.
    pub design: String,
    /// Samples per pixel.
    pub samples: u32,
    /// Errors against the exact picture of the same samples: noise and bias, no
    /// difference in antialiasing.
    pub frame: EnsembleErrors,
    /// The same over the pixels with at least one fragment.
    pub covered: EnsembleErrors,
    /// The same over covered pixels that no primitive's edge crosses.
    pub interior: EnsembleErrors,
    /// The same over the other covered pixels.
    pub edges: EnsembleErrors,
    /// Root mean square error over all covered pixels against the exact picture of
    /// all of the trace's samples, on linear values: antialiasing counts.
    pub rmse_fine: Estimate,
    /// The same on sRGB-encoded values.
    pub rmse_fine_srgb: Estimate,
    /// What the design did with the first seed.
    pub events: EventCounts,
    /// State per pixel.
    pub state_bits: StateBits,
    /// Median time of a replay that counts no events, where there is one.
    pub seconds: f64,
}

/// A run with the picture of its first seed.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The figures.
    pub run: Run,
    /// The picture of seed 0.
    pub picture: Picture,
}

/// What all sample counts of a trace share.
#[derive(Debug)]
pub struct Measurements {
    /// The runs, sample count after sample count, designs in the plan's order.
    pub runs: Vec<Measured>,
    /// The exact picture at each of the plan's sample counts.
    pub references: Vec<Picture>,
}

/// Measures `plan` on `trace`. `progress` is told what is done, how many replays
/// are done, and of how many.
///
/// # Errors
/// As [`Configured::replay`].
pub fn measure(
    trace: &Trace,
    plan: &Plan,
    memory: u64,
    mut progress: impl FnMut(&str, u64, u64),
) -> Result<Measurements> {
    let exact = configure(REFERENCE, &[])?;
    let options = ReplayOptions { memory, ..ReplayOptions::default() };
    let all = trace.header().pattern.samples();
    let per_design = u64::from(plan.seeds);
    let total = (plan.designs.len() as u64 * per_design + 1) * plan.samples.len() as u64 + 1;
    let mut done = 0;

    progress(REFERENCE, done, total);
    let fine = exact.replay(trace, all, 0, &options)?.picture;
    let fine_covered = PixelClasses::of(trace, all)?.covered;
    done += 1;
    let mut measurements = Measurements { runs: Vec::new(), references: Vec::new() };
    for samples in &plan.samples {
        progress(REFERENCE, done, total);
        let reference = if *samples == all {
            fine.clone()
        } else {
            exact.replay(trace, *samples, 0, &options)?.picture
        };
        done += 1;
        let classes = PixelClasses::of(trace, *samples)?;
        let frame = Region::frame(reference.grid());
        let regions = [&frame, &classes.covered, &classes.interior, &classes.edges];
        for design in &plan.designs {
            let mut ensemble = Ensemble::new(&reference, &regions);
            let (mut squares, mut squares_srgb) = (Vec::new(), Vec::new());
            let mut seconds = Vec::new();
            let mut first = None;
            for seed in 0..plan.seeds {
                progress(&format!("{} at {samples}", design.label()), done, total);
                let start = Instant::now();
                // Counting costs time: only the first seed's replay counts.
                let options = ReplayOptions { count_events: seed == 0, ..options };
                let replayed = design.replay(trace, *samples, seed, &options)?;
                if plan.seeds == 1 || !options.count_events {
                    seconds.push(start.elapsed().as_secs_f64());
                }
                let ((), against_fine) = rayon::join(
                    || ensemble.add(&replayed.picture),
                    || errors(&replayed.picture, &fine, &fine_covered),
                );
                squares.push(against_fine.rmse * against_fine.rmse);
                squares_srgb.push(against_fine.rmse_srgb * against_fine.rmse_srgb);
                first.get_or_insert(replayed);
                done += 1;
            }
            let Some(first) = first else { continue };
            let [frame, covered, interior, edges] =
                ensemble.finish().try_into().expect("one a region");
            let run = Run {
                design: design.label(),
                samples: *samples,
                frame,
                covered,
                interior,
                edges,
                rmse_fine: Estimate::of(&squares).sqrt(),
                rmse_fine_srgb: Estimate::of(&squares_srgb).sqrt(),
                events: first.events.unwrap_or_default(),
                state_bits: first.state_bits,
                seconds: median(&mut seconds),
            };
            measurements.runs.push(Measured { run, picture: first.picture });
        }
        measurements.references.push(reference);
    }
    progress("done", total, total);
    Ok(measurements)
}

/// The middle of `values`, or the mean of the two in the middle.
fn median(values: &mut [f64]) -> f64 {
    OrderStatistics::median(&mut Data::new(values))
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn medians() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 9.0]), 3.0);
        assert_eq!(median(&mut [5.0]), 5.0);
    }
}

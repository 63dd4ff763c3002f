//! One depth for each primitive over the whole frame: what an application sorts by.

use std::collections::HashMap;

use crate::error::Result;
use crate::trace::Trace;

/// The mean depth of each primitive that a trace holds, over all samples that it
/// covers.
///
/// Depth is linear over the frame, so that the mean over a triangle is the depth at
/// the middle of what shows of it. A fragment counts with its depth at the pixel's
/// centre and with all samples that it covers in the trace, whatever the replay's
/// own number: an application's order does not depend on that. Memory grows with the
/// primitives that there are, whatever their numbers.
#[derive(Clone, Debug, Default)]
pub struct PrimitiveDepths {
    means: HashMap<u32, u64>,
}

/// A sum of depths, and over how many samples.
#[derive(Clone, Copy, Default)]
struct Sum {
    depth: u128,
    samples: u64,
}

impl PrimitiveDepths {
    /// The depths of the primitives of `trace`, in one pass over it.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub fn of(trace: &Trace) -> Result<Self> {
        let mut sums: HashMap<u32, Sum> = HashMap::new();
        for batch in trace.batches() {
            let batch = batch?;
            for fragment in (0..batch.len()).map(|i| batch.fragment(i)) {
                let sum = sums.entry(fragment.primitive).or_default();
                let samples = fragment.coverage.count();
                sum.depth += u128::from(fragment.depth.z.0) * u128::from(samples);
                sum.samples += u64::from(samples);
            }
        }
        let mean = |sum: Sum| ((sum.depth << 32) / u128::from(sum.samples.max(1))) as u64;
        Ok(PrimitiveDepths { means: sums.into_iter().map(|(p, sum)| (p, mean(sum))).collect() })
    }

    /// The mean depth of `primitive`, in 2^-32 of a depth step; the near plane where
    /// the trace does not hold it.
    pub fn mean(&self, primitive: u32) -> u64 {
        self.means.get(&primitive).copied().unwrap_or(0)
    }
}

//! One depth for each primitive over the whole frame: what an application sorts by.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::Trace;

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

/// What a primitive takes while its mean is found: a place in a table that may be less than
/// half full and has just grown out of one half as large, and one in the table of means.
const BYTES_PER_PRIMITIVE: u64 = 4 * (size_of::<(u32, Sum)>() + size_of::<(u32, u64)>()) as u64;

/// Bytes that are always allowed: nobody need read a trace in pieces for them.
const LEAST: u64 = 4 << 20;

/// The error about a trace with more primitives than fit.
///
/// # Errors
/// As [`Trace::batch`].
fn too_many(trace: &Trace, memory: u64) -> Result<Error> {
    // Numbers are given one after the other as a rule: their range says how many there are.
    let (mut first, mut last) = (u32::MAX, 0);
    for batch in trace.batches() {
        let batch = batch?;
        for fragment in (0..batch.len()).map(|i| batch.fragment(i)) {
            (first, last) = (first.min(fragment.primitive), last.max(fragment.primitive));
        }
    }
    let range = u64::from(last.saturating_sub(first)) + 1;
    let needed = range.min(trace.rows()) * BYTES_PER_PRIMITIVE;
    Ok(Error::config(
        format_args!(
            "one depth for each of the trace's primitives takes up to {} MiB, and {} are allowed",
            needed.div_ceil(1 << 20),
            memory >> 20
        ),
        "raise the memory limit (--memory, in a study 'memory'), or take another design",
    ))
}

impl PrimitiveDepths {
    /// The depths of the primitives of `trace`, in one pass over it, in at most `memory`
    /// bytes, or 4 MiB where that is less.
    ///
    /// # Errors
    /// [`Error::Config`] where they take more; as [`Trace::batch`].
    pub fn of(trace: &Trace, memory: u64) -> Result<Self> {
        let memory = memory.max(LEAST);
        let most = memory / BYTES_PER_PRIMITIVE;
        let mut sums: HashMap<u32, Sum> = HashMap::new();
        for batch in trace.batches() {
            let batch = batch?;
            for fragment in (0..batch.len()).map(|i| batch.fragment(i)) {
                let known = sums.len() as u64;
                let sum = match sums.entry(fragment.primitive) {
                    Entry::Occupied(sum) => sum.into_mut(),
                    Entry::Vacant(_) if known >= most => return Err(too_many(trace, memory)?),
                    Entry::Vacant(place) => place.insert(Sum::default()),
                };
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

//! When programs begin and end, by the device's own clock.

use std::collections::BTreeMap;
use std::sync::Mutex;

use crate::device::Gpu;
use crate::program::Program;
use screendoor_trace::error::Result;

/// Passes that are timed, at most; wgpu allows a set twice as many queries.
const MOST: u32 = 2048;

/// Times passes, where the device can.
#[derive(Debug)]
pub(super) struct Timer {
    queries: Option<wgpu::QuerySet>,
    names: Mutex<Vec<&'static str>>,
}

impl Timer {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self> {
        let descriptor = wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MOST,
        };
        let make = || gpu.device.create_query_set(&descriptor);
        let queries = gpu.has_timestamps().then(|| gpu.run("making room for time stamps", make));
        let queries = queries.transpose()?;
        Ok(Timer { queries, names: Mutex::default() })
    }

    /// Starts at least `groups` groups of a program with its bindings, timed as part of
    /// `name`.
    pub(crate) fn run(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        name: &'static str,
        (program, bound): (&Program, &wgpu::BindGroup),
        groups: u64,
    ) {
        let mut pass = self.pass(encoder, name);
        pass.set_pipeline(&program.pipeline);
        pass.set_bind_group(0, bound, &[]);
        let [x, y] = gpu.spread(groups);
        pass.dispatch_workgroups(x, y, 1);
    }

    /// A pass that is timed as part of `name`.
    fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        name: &'static str,
    ) -> wgpu::ComputePass<'e> {
        let mut names = self.names.lock().expect("no thread panicked");
        let index = names.len() as u32;
        let timed = self.queries.as_ref().filter(|_| index < MOST);
        if timed.is_some() {
            names.push(name);
        }
        let timestamp_writes = timed.map(|query_set| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(2 * index),
            end_of_pass_write_index: Some(2 * index + 1),
        });
        let label = Some(name);
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes })
    }

    /// Seconds by name; `None` where the device cannot tell, or where there were too many
    /// passes.
    pub(crate) fn seconds(&self, gpu: &Gpu) -> Result<Option<BTreeMap<&'static str, f64>>> {
        let names = self.names.lock().expect("no thread panicked");
        let count = names.len() as u32;
        let Some(queries) = self.queries.as_ref().filter(|_| (1..MOST).contains(&count)) else {
            return Ok(None);
        };
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let stamps = gpu.buffer("time stamps", 16 * u64::from(count), usage)?;
        gpu.submit("reading the clock", |encoder| {
            encoder.resolve_query_set(queries, 0..2 * count, &stamps, 0);
            Ok(())
        })?;
        let unit = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
        gpu.read(&stamps, "reading the clock", |words| {
            let mut sums = BTreeMap::new();
            for (name, pair) in names.iter().zip(words.chunks_exact(4)) {
                let [begin, end] =
                    [0, 2].map(|i| u64::from(pair[i]) | u64::from(pair[i + 1]) << 32);
                *sums.entry(*name).or_default() += end.saturating_sub(begin) as f64 * unit;
            }
            Some(sums)
        })
    }
}

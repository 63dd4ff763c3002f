//! Tied fragments of one pixel that holds more of them than fit into memory.
//!
//! Each sample of the pixel, and the pixel's centre as that sample sees it, is a list of
//! depths by itself. A list is cut into parts by a hash of the depth, so that equal depths
//! are in one part; as many parts as fit are gathered in one pass over the trace. A full part
//! is sorted, what is tied is marked, and one of each depth stays: depths that are all alike
//! take no room. What stays from the first to the last pass is a bit for each fragment.

use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::trace::fragment::{DepthPlane, Fragment, SampleMask};
use crate::trace::read::Trace;
use crate::trace::ties::mark;

/// A depth and the fragment's number within the pixel.
type Entry = (u32, u32);

/// The most fragments of a pixel that are counted.
const MOST: u64 = (1 << 31) - 2;

/// Fragments that are handed to the parts at a time.
const AT_A_TIME: usize = 1 << 14;

/// A pixel's lists and how they are cut.
pub(super) struct DeepPixel<'a> {
    site: (u32, u32),
    positions: &'a [[i8; 2]],
    /// How many fragments it holds.
    fragments: u64,
    /// Into how many parts a list is cut.
    parts: u64,
    /// How many parts are gathered in a pass, and how many entries each may hold.
    together: u64,
    room: usize,
}

impl<'a> DeepPixel<'a> {
    /// The pixel at `site`, which holds so many fragments, in at most `memory` bytes.
    ///
    /// # Errors
    /// [`Error::Config`] where a bit for each fragment takes more than half of that.
    pub(super) fn new(
        site: (u32, u32),
        fragments: u64,
        positions: &'a [[i8; 2]],
        memory: u64,
    ) -> Result<Self> {
        let (x, y) = site;
        let marks = fragments.div_ceil(8);
        if fragments > MOST {
            let what = format!("pixel {x},{y} alone holds more than {MOST} fragments");
            return Err(Error::config(what, "cut the trace into several"));
        }
        if 2 * marks > memory {
            return Err(Error::config(
                format_args!(
                    "pixel {x},{y} alone holds {fragments} fragments, of which to find those at \
                     one depth takes {} MiB",
                    (2 * marks).div_ceil(1 << 20)
                ),
                "raise the memory limit (--memory)",
            ));
        }
        let entries = ((memory - marks) / size_of::<Entry>() as u64).max(1);
        let lists = 2 * positions.len() as u64;
        let threads = rayon::current_num_threads() as u64;
        let together = (entries / fragments).max(threads).min(lists);
        // Parts are not quite equal.
        let parts = match (fragments * together).div_ceil(entries) {
            1 => 1,
            _ => (fragments * together * 9).div_ceil(entries * 8),
        };
        let room = (entries / together).max(64) as usize;
        Ok(DeepPixel { site, positions, fragments, parts, together, room })
    }

    /// How many times the trace is read.
    pub(super) fn passes(&self) -> u64 {
        (2 * self.positions.len() as u64 * self.parts).div_ceil(self.together)
    }

    /// How many of its fragments share a depth with another one. `read` is told how many
    /// fragments of the trace were read.
    ///
    /// # Errors
    /// As [`Trace::batch`].
    pub(super) fn tied(&self, trace: &Trace, read: &mut dyn FnMut(u64)) -> Result<u64> {
        let marks: Vec<AtomicU64> =
            (0..self.fragments.div_ceil(64)).map(|_| AtomicU64::new(0)).collect();
        // Drawn at random, so that nobody can make a trace whose depths are all in one part.
        let hash = Hash::random();
        let lists = self.positions.iter().enumerate();
        let lists = lists.flat_map(|(s, position)| [(s, *position), (s, [0, 0])]);
        let all: Vec<Part> = lists
            .flat_map(|(sample, at)| (0..self.parts).map(move |part| (sample, at, part)))
            .map(|(sample, at, part)| Part { sample, at, part, list: Vec::new(), room: self.room })
            .collect();
        let mut rest = all.into_iter();
        loop {
            let mut parts: Vec<Part> = rest.by_ref().take(self.together as usize).collect();
            if parts.is_empty() {
                let ones = marks.iter().map(|m| u64::from(m.load(Ordering::Relaxed).count_ones()));
                return Ok(ones.sum());
            }
            let give = |parts: &mut Vec<Part>, some: &[(u32, DepthPlane, SampleMask)]| {
                parts.par_iter_mut().for_each(|part| part.take(some, hash, self.parts, &marks));
            };
            let (mut number, mut some) = (0, Vec::with_capacity(AT_A_TIME));
            for batch in trace.batches() {
                let batch = batch?;
                for i in 0..batch.len() {
                    let (x, y) = batch.pixel(i);
                    if (u32::from(x), u32::from(y)) != self.site {
                        continue;
                    }
                    let Fragment { depth, coverage, .. } = batch.fragment(i);
                    some.push((number, depth, coverage));
                    number += 1;
                    if some.len() == AT_A_TIME {
                        give(&mut parts, &some);
                        some.clear();
                    }
                }
                read(batch.len() as u64);
            }
            give(&mut parts, &some);
            parts.par_iter_mut().for_each(|part| part.mark(&marks));
        }
    }
}

/// One of a family of functions, of which any sends two depths to one part as seldom as
/// chance does (multiply, add, shift).
#[derive(Clone, Copy)]
struct Hash([u64; 2]);

impl Hash {
    fn random() -> Self {
        let state = RandomState::new();
        Hash([state.hash_one(0) | 1, state.hash_one(1)])
    }

    /// Which of `parts` a depth is in.
    fn part(self, depth: u32, parts: u64) -> u64 {
        let Hash([by, more]) = self;
        let mixed = by.wrapping_mul(u64::from(depth)).wrapping_add(more) >> 32;
        (mixed * parts) >> 32
    }
}

/// A part of a list of depths while it is gathered.
struct Part {
    sample: usize,
    at: [i8; 2],
    part: u64,
    list: Vec<Entry>,
    room: usize,
}

impl Part {
    fn take(
        &mut self,
        some: &[(u32, DepthPlane, SampleMask)],
        hash: Hash,
        parts: u64,
        marks: &[AtomicU64],
    ) {
        for (number, plane, coverage) in some {
            let depth = plane.at(self.at).0;
            if !coverage.contains(self.sample) || hash.part(depth, parts) != self.part {
                continue;
            }
            if self.list.len() == self.room {
                self.mark(marks);
                if self.list.len() > self.room / 8 * 7 {
                    // As good as no depth twice, and more of them than chance would have.
                    self.room *= 2;
                }
            }
            if self.list.capacity() == self.list.len() {
                // Not twice as much as is needed.
                let more = (self.list.len() / 4).max(1 << 10).min(self.room - self.list.len());
                self.list.reserve_exact(more);
            }
            self.list.push((depth, *number));
        }
    }

    fn mark(&mut self, marks: &[AtomicU64]) {
        mark(&mut self.list, |i| {
            marks[i as usize / 64].fetch_or(1 << (i % 64), Ordering::Relaxed);
        });
    }
}

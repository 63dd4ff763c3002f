//! The same fragments in another order.

use crate::edit::{Edit, Progress, Push, each_row};
use crate::error::{Error, Result};
use crate::random::{hash, mix};
use crate::tile::TileGrid;
use crate::trace::{Fragment, Header, Trace};

crate::options! {
    /// An order of fragments. Those that it does not tell apart keep their order.
    pub enum Sequence {
        Random = "random": "primitives shuffled, by --seed; each keeps its own fragments' order",
        Fragments = "fragments": "every fragment on its own shuffled, by --seed",
        Reverse = "reverse": "the last one first",
        NearToFar = "near-to-far": "by the depth at the pixel's centre, nearest first",
        FarToNear = "far-to-near": "by the depth at the pixel's centre, furthest first",
        Primitives = "primitives": "by the primitive's number",
        Tiles = "tiles": "tile by tile of 16 x 16 pixels: the order within a pixel stays",
    }
}

/// How fragments are ordered.
#[derive(Clone, Copy, Debug)]
pub struct ShuffleOptions {
    /// The order.
    pub order: Sequence,
    /// Which of the random ones.
    pub seed: u32,
    /// How many bytes the fragments that are held together may take; fewer make more passes
    /// over the trace.
    pub memory: u64,
}

/// The same fragments in another order.
///
/// An order is a key for each fragment. Where not all fragments fit into memory, a pass over
/// the trace counts them by their keys, and each of the passes that follow takes those of a
/// range of keys: nothing is stored in between.
#[derive(Debug)]
pub struct Shuffle<'a> {
    trace: &'a Trace,
    options: ShuffleOptions,
    grid: TileGrid,
    header: Header,
}

/// What a fragment takes while it is held: itself, its key and its number.
const HELD: u64 = size_of::<(u64, u64, Fragment)>() as u64;
/// Into how many ranges keys are counted at a time.
const RANGES: u64 = 1 << 16;

/// Keys from the first to the last, both included.
#[derive(Clone, Copy)]
struct Keys {
    first: u64,
    last: u64,
}

impl<'a> Shuffle<'a> {
    /// Orders the fragments of `trace`.
    ///
    /// # Errors
    /// [`Error::Config`] where the memory holds no fragment.
    pub fn new(trace: &'a Trace, options: ShuffleOptions) -> Result<Self> {
        if options.memory < HELD {
            return Err(Error::config(
                format_args!("{} bytes hold no fragment", options.memory),
                format_args!("give at least {HELD}"),
            ));
        }
        let header = trace.header().clone();
        let grid = TileGrid::new(header.width, header.height);
        Ok(Shuffle { trace, options, grid, header })
    }

    fn key(&self, row: u64, fragment: &Fragment) -> u64 {
        let seed = self.options.seed;
        // Steps that can each be undone: no two numbers share a key.
        let scattered = |word: u32| mix(mix(word ^ hash([seed, 1])) ^ hash([seed, 2]));
        match self.options.order {
            Sequence::Random => scattered(fragment.primitive).into(),
            Sequence::Fragments => {
                let (low, high) = (row as u32, (row >> 32) as u32);
                u64::from(scattered(low ^ mix(high))) << 32 | u64::from(high)
            }
            Sequence::Reverse => self.trace.rows() - 1 - row,
            Sequence::NearToFar => fragment.depth.z.0.into(),
            Sequence::FarToNear => (!fragment.depth.z.0).into(),
            Sequence::Primitives => fragment.primitive.into(),
            Sequence::Tiles => self.grid.tile(fragment.x, fragment.y).0.into(),
        }
    }

    /// All keys that there may be.
    fn keys(&self) -> Keys {
        let last = match self.options.order {
            Sequence::Fragments => u64::MAX,
            Sequence::Reverse => self.trace.rows().saturating_sub(1),
            Sequence::Tiles => self.grid.count() as u64 - 1,
            _ => u32::MAX.into(),
        };
        Keys { first: 0, last }
    }

    /// Calls `each` with the fragments whose keys are among `keys`, in the trace's order.
    fn among(&self, keys: Keys, mut each: impl FnMut(u64, Fragment) -> Result<()>) -> Result<()> {
        each_row(self.trace, (0, 0), &mut |_, _| (), |row, fragment| {
            let key = self.key(row, &fragment);
            if (keys.first..=keys.last).contains(&key) { each(key, fragment) } else { Ok(()) }
        })
    }

    /// Hands on the `count` fragments of these keys in their order.
    fn hand(
        &self,
        keys: Keys,
        count: u64,
        push: &mut dyn FnMut(&Fragment) -> Result<()>,
    ) -> Result<()> {
        if count == 0 {
            return Ok(());
        }
        if keys.first == keys.last {
            return self.among(keys, |_, fragment| push(&fragment));
        }
        let most = self.options.memory / HELD;
        if count <= most {
            // No more than the memory allows, whatever a file claims.
            let mut held: Vec<(u64, u64, Fragment)> = Vec::new();
            held.reserve_exact(count as usize);
            self.among(keys, |key, fragment| {
                held.push((key, held.len() as u64, fragment));
                Ok(())
            })?;
            // In place; what has one key keeps its order by its number.
            held.sort_unstable_by_key(|(key, number, _)| (*key, *number));
            return held.iter().try_for_each(|(_, _, fragment)| push(fragment));
        }
        // As many keys a range as make no more than so many ranges.
        let each = (keys.last - keys.first) / RANGES + 1;
        let mut counts = vec![0_u64; ((keys.last - keys.first) / each + 1) as usize];
        self.among(keys, |key, _| {
            counts[((key - keys.first) / each) as usize] += 1;
            Ok(())
        })?;
        let range = |first: usize, last: usize| Keys {
            first: keys.first + first as u64 * each,
            last: keys.last.min((keys.first + last as u64 * each).saturating_add(each - 1)),
        };
        let (mut first, mut together) = (0, 0);
        for (i, count) in counts.iter().copied().enumerate() {
            if i > first && together + count > most {
                self.hand(range(first, i - 1), together, push)?;
                (first, together) = (i, 0);
            }
            together += count;
        }
        self.hand(range(first, counts.len() - 1), together, push)
    }
}

impl Edit for Shuffle<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        let (rows, mut done) = (self.trace.rows(), 0);
        let mut push = |fragment: &Fragment| {
            push(fragment)?;
            done += 1;
            if done % (1 << 16) == 0 || done == rows {
                progress(done, rows);
            }
            Ok(())
        };
        self.hand(self.keys(), rows, &mut push)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_random_orders_are_all_different() {
        let header = Header { width: 1, height: 1, ..Header::default() };
        let trace = crate::edit::tests::trace(&header, &[]);
        for order in [Sequence::Random, Sequence::Fragments] {
            for seed in [0, 1, u32::MAX] {
                let options = ShuffleOptions { order, seed, memory: 1 << 20 };
                let shuffle = Shuffle::new(&trace, options).unwrap();
                let key = |i: u64| {
                    let fragment = Fragment { primitive: i as u32, ..Fragment::default() };
                    // Rows on both sides of 2^32.
                    shuffle.key(i + ((i % 2) << 32), &fragment)
                };
                let mut keys: Vec<u64> = (0..100_000).map(key).collect();
                assert!(!keys.is_sorted());
                keys.sort_unstable();
                keys.dedup();
                assert_eq!(keys.len(), 100_000);
            }
        }
    }
}

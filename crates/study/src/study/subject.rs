//! What runs are measured on: a trace, and the exact picture at a sample count.

use crate::metrics::{Encoded, Flip, PixelClasses, Region, rmse};
use crate::post::{Guides, PostFilter};
use crate::study::file::Metric;
use crate::study::throughput::work;
use screendoor_designs::{REFERENCE, configure};
use screendoor_rop::ReplayOptions;
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;
use screendoor_trace::trace::{Trace, tied_fragments_within};

/// Side of the square blocks of [`Metric::Blocks`], in pixels.
pub const BLOCK: u32 = 4;

/// A trace that designs are measured on, with what all runs on it share.
pub struct Subject {
    /// The scene's name.
    pub name: String,
    /// The trace.
    pub trace: Trace,
    /// BLAKE3 of the trace's content.
    pub(super) content: String,
    /// Its fragments that share a depth with another one at any sample.
    pub(super) tied_fragments: u64,
    /// The exact picture of all samples.
    pub(super) fine: Picture,
    /// The pixels that fragments cover, of all samples.
    pub(super) fine_covered: Region,
    /// Bytes that the state of a design may take that grows with the fragments.
    memory: u64,
}

impl Subject {
    /// A scene's trace; its content's hash and its tied fragments where they are known.
    ///
    /// # Errors
    /// As [`screendoor_designs::Configured::replay`] and [`Trace::verify`].
    pub fn new(
        name: &str,
        trace: Trace,
        known: Option<(String, u64)>,
        memory: u64,
    ) -> Result<Self> {
        let all = trace.header().pattern.samples();
        let (content, tied_fragments) = match known {
            Some(known) => known,
            None => {
                let content = trace.content().map(ToString::to_string);
                let content = content.map_or_else(|| trace.verify(|_| ()), Ok)?;
                (content, tied_fragments_within(&trace, all, memory)?)
            }
        };
        let fine = exact(&trace, all, memory)?;
        let fine_covered = PixelClasses::of(&trace, all)?.covered;
        let name = name.to_string();
        Ok(Subject { name, trace, content, tied_fragments, fine, fine_covered, memory })
    }

    pub(super) fn options(&self) -> ReplayOptions<'static> {
        ReplayOptions { memory: self.memory, ..ReplayOptions::default() }
    }
}

fn exact(trace: &Trace, samples: u32, memory: u64) -> Result<Picture> {
    let options = ReplayOptions { memory, ..ReplayOptions::default() };
    Ok(configure(REFERENCE, &[])?.replay(trace, samples, 0, &options)?.picture)
}

/// What all runs at one sample count of a subject share.
pub struct Reference {
    /// Samples per pixel.
    pub samples: u32,
    /// The exact picture of the same samples.
    pub picture: Picture,
    /// The same, encoded.
    pub(super) encoded: Encoded,
    pub(super) frame: Region,
    pub(super) classes: PixelClasses,
    /// Fragments that cover one of the samples.
    pub(super) fragments: u64,
    /// Those of them that share a depth with another at one of the samples.
    pub(super) tied_fragments: u64,
    /// Comparison to the picture as a viewer sees it, where it is asked for.
    pub(super) flip: Option<Flip>,
    /// The picture averaged over blocks, and its frame, where it is asked for.
    pub(super) blocks: Option<(Picture, Region)>,
    /// Filters that are tried on every picture, and what guides them, where any are.
    pub(super) post: Option<Post>,
}

/// Filters of finished pictures.
pub(super) struct Post {
    pub guides: Guides,
    /// Each as the study has it, and what it does to the exact picture: RMSE over the covered pixels.
    pub filters: Vec<(String, PostFilter, f64)>,
}

impl Reference {
    /// Makes it, with what `metrics` need.
    ///
    /// # Errors
    /// As [`screendoor_designs::Configured::replay`].
    pub fn of(subject: &Subject, samples: u32, metrics: &[Metric]) -> Result<Self> {
        let trace = &subject.trace;
        trace.header().pattern.prefix(samples)?;
        let is_all = samples == trace.header().pattern.samples();
        let picture = match is_all {
            true => subject.fine.clone(),
            false => exact(trace, samples, subject.memory)?,
        };
        let seen = [Metric::Flip, Metric::FlipHdr].iter().any(|m| metrics.contains(m));
        let blocks = metrics.contains(&Metric::Blocks).then(|| averaged(&picture, BLOCK));
        Ok(Reference {
            samples,
            encoded: Encoded::of(&picture),
            frame: Region::frame(picture.grid()),
            classes: PixelClasses::of(trace, samples)?,
            fragments: work(trace, samples)?.fragments,
            // What no two share at all samples they do not at some.
            tied_fragments: match subject.tied_fragments {
                0 => 0,
                all if is_all => all,
                _ => tied_fragments_within(trace, samples, subject.memory)?,
            },
            flip: seen.then(|| Flip::new(&picture)),
            blocks: blocks.map(|blocks| {
                let frame = Region::frame(blocks.grid());
                (blocks, frame)
            }),
            post: None,
            picture,
        })
    }

    /// The same with filters that are tried on every picture.
    ///
    /// # Errors
    /// As [`Guides::of`] and [`PostFilter::parse`].
    pub fn filtered_by(mut self, subject: &Subject, filters: &[String]) -> Result<Self> {
        if filters.is_empty() {
            return Ok(self);
        }
        let guides = Guides::of(&subject.trace, self.samples, subject.memory)?;
        let tried = |spec: &String| {
            let filter = PostFilter::parse(spec)?;
            let blurred = filter.apply(&self.picture, &guides);
            let blur = rmse(&blurred, &self.picture, &self.classes.covered);
            Ok((spec.clone(), filter, blur))
        };
        let filters = filters.iter().map(tried).collect::<Result<_>>()?;
        self.post = Some(Post { guides, filters });
        Ok(self)
    }
}

/// The picture averaged over blocks of `side` × `side` pixels; what is left of it at the right
/// and at the bottom is no block.
pub fn averaged(picture: &Picture, side: u32) -> Picture {
    let grid = TileGrid::new(picture.width() / side, picture.height() / side);
    let averaged = Picture::from_fn(grid, |x, y| {
        let mut sum = [0.0; 3];
        for (dx, dy) in (0..side).flat_map(|dy| (0..side).map(move |dx| (dx, dy))) {
            let colour = picture.get(x * side + dx, y * side + dy);
            sum.iter_mut().zip(colour).for_each(|(s, c)| *s += c);
        }
        sum.map(|s| s / f64::from(side * side))
    });
    averaged.in_space(picture.space())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_of_their_pixels() {
        let picture = Picture::from_fn(TileGrid::new(9, 8), |x, y| [f64::from(x + 10 * y); 3]);
        let blocks = averaged(&picture, 4);
        assert_eq!((blocks.width(), blocks.height()), (2, 2));
        assert_eq!(blocks.get(0, 0), [16.5; 3]);
        assert_eq!(blocks.get(1, 1), [60.5; 3]);
    }
}

//! Our scenes, drawn by an adapter.

use std::io::Write;
use std::ops::Range;

use rayon::prelude::*;

use crate::capture::fragments::RawFragment;
use crate::capture::positions::sample_positions;
use crate::capture::rasteriser::{Corner, Rasteriser, SAMPLES};
use crate::device::Gpu;
use crate::differences::CrossCheck;
use screendoor_scene::capture::{Capture, CaptureOptions, Drawing, PatternKind, Unseen};
use screendoor_scene::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{
    Fragment, Header, SampleMask, SamplePattern, Trace, TraceWriter, WriteOptions,
};

/// Triangles sent at a time.
const CHUNK: usize = 1 << 14;
/// Fragments that there is room for at a time: 44 MiB.
const CAPACITY: u32 = 1 << 20;

/// A scene about to be captured by a GPU, four samples a pixel.
///
/// Which samples a triangle covers is what the adapter's rasteriser says: it clips,
/// projects, snaps and decides, and which way a triangle faces. Depth planes and shading
/// are those of [`Capture`] for that coverage, so that what differs between the two traces
/// is coverage.
pub struct GpuCapture<'a> {
    gpu: &'a Gpu,
    capture: Capture<'a>,
    options: &'a CaptureOptions,
    capacity: u32,
}

impl<'a> GpuCapture<'a> {
    /// Places the camera, finds where the adapter's samples lie, and makes the trace's
    /// header.
    ///
    /// # Errors
    /// As [`Capture::new`] and [`sample_positions`]; [`Error::Config`] for a sample count or
    /// a pattern that the adapter does not have.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, options: &'a CaptureOptions) -> Result<Self> {
        if options.samples != SAMPLES {
            return Err(Error::config(
                format_args!("a GPU does not capture {} samples a pixel", options.samples),
                format_args!("ask for --samples {SAMPLES}, or capture without --gpu"),
            ));
        }
        if !matches!(options.pattern, PatternKind::Auto | PatternKind::Standard) {
            return Err(Error::config(
                "a GPU captures at its own samples",
                "leave --pattern out, or capture without --gpu",
            ));
        }
        if let Some(door) = options.screen_door {
            return Err(Error::config(
                format_args!("a GPU's rasteriser does not cut the screen door '{}'", door.spec()),
                "capture without --gpu, or without the screen door",
            ));
        }
        let mut capture = Capture::new(scene, options)?;
        capture.drawn_by(&gpu.adapter().name, sample_positions(gpu)?);
        Ok(GpuCapture { gpu, capture, options, capacity: CAPACITY })
    }

    /// Draws only about so many fragments at a time: what does not fit is drawn in parts.
    /// No bit of the trace changes.
    pub fn with_capacity(self, fragments: u32) -> Self {
        GpuCapture { capacity: fragments, ..self }
    }

    /// The header of the trace that the capture makes.
    pub fn header(&self) -> &Header {
        self.capture.header()
    }

    /// Draws the scene into `writer`, which was made with [`GpuCapture::header`].
    /// `progress` is told how many triangles are done, of how many.
    ///
    /// # Errors
    /// As [`TraceWriter::push`]; [`Error::Gpu`] where the adapter fails.
    pub fn draw<W: Write>(
        &self,
        writer: &mut TraceWriter<W>,
        progress: impl FnMut(u64, u64),
    ) -> Result<()> {
        let positions = &self.header().pattern.positions;
        let drawing = self.capture.drawing()?;
        self.each_part(&drawing, progress, |fragments| {
            let triangles: Vec<&[RawFragment]> = by_triangle(&fragments).collect();
            let shade = |raw: &&[RawFragment]| -> Vec<Fragment> {
                let triangle = drawing.set_up(raw[0].primitive as usize, positions);
                let coverage = |f: &RawFragment| SampleMask(f.coverage.into());
                let shade = |f: &RawFragment| triangle.fragment(f.at(), coverage(f), f.depth());
                raw.iter().filter_map(shade).collect()
            };
            let shaded: Vec<Vec<Fragment>> = triangles.par_iter().map(shade).collect();
            shaded.iter().flatten().try_for_each(|fragment| self.capture.write(writer, fragment))
        })
    }

    /// As [`Capture::unseen`].
    pub fn unseen(&self) -> Vec<Unseen> {
        self.capture.unseen()
    }

    /// Draws the scene into a trace in memory.
    ///
    /// # Errors
    /// As [`GpuCapture::draw`].
    pub fn to_memory(&self, progress: impl FnMut(u64, u64)) -> Result<Trace> {
        let source = &self.header().source;
        let options = WriteOptions::default();
        let mut writer = TraceWriter::new(Vec::new(), source, self.header().clone(), options)?;
        self.draw(&mut writer, progress)?;
        Trace::from_bytes(writer.finish()?.0, source)
    }

    /// Holds our own rasteriser, with samples at the places of `pattern`, against the
    /// adapter's. The adapter's own places stand in [`GpuCapture::header`].
    ///
    /// # Errors
    /// [`Error::Config`] for a pattern of another sample count; [`Error::Gpu`] where the
    /// adapter fails.
    pub fn check(
        &self,
        pattern: &SamplePattern,
        progress: impl FnMut(u64, u64),
    ) -> Result<CrossCheck> {
        if pattern.samples() != SAMPLES {
            return Err(Error::config(
                format_args!("{} samples cannot be held against {SAMPLES}", pattern.samples()),
                format_args!("give a pattern of {SAMPLES}"),
            ));
        }
        let drawing = self.capture.drawing()?;
        let mut check = CrossCheck::default();
        let mut compare = |triangles: Range<usize>, fragments: &[RawFragment]| {
            let mut lists = by_triangle(fragments).peekable();
            let mut own = |i| lists.next_if(|raw| raw[0].primitive as usize == i);
            let pairs: Vec<(usize, &[RawFragment])> =
                triangles.map(|i| (i, own(i).unwrap_or(&[]))).collect();
            let one = |(i, raw): &(usize, &[RawFragment])| {
                CrossCheck::of(&drawing.set_up(*i, &pattern.positions), raw)
            };
            let sum = pairs.par_iter().map(one).reduce(CrossCheck::default, CrossCheck::and);
            check = check.and(sum);
        };
        // Of the last triangle of a part more may follow.
        let mut pending: Vec<RawFragment> = Vec::new();
        let mut next = 0;
        self.each_part(&drawing, progress, |fragments| {
            pending.extend(fragments);
            let end = pending.last().map_or(next, |last| last.primitive as usize);
            let whole = pending.partition_point(|f| (f.primitive as usize) < end);
            compare(next..end, &pending[..whole]);
            pending.drain(..whole);
            next = end;
            Ok(())
        })?;
        compare(next..drawing.triangles(), &pending);
        Ok(check)
    }

    /// Has the adapter draw all triangles, and hands over fragments in API order; their
    /// primitive is the triangle's number in the order of drawing.
    fn each_part(
        &self,
        drawing: &Drawing<'_>,
        mut progress: impl FnMut(u64, u64),
        mut each: impl FnMut(Vec<RawFragment>) -> Result<()>,
    ) -> Result<()> {
        let size = [self.options.width, self.options.height];
        let rasteriser = Rasteriser::new(self.gpu, size, self.capacity)?;
        let total = drawing.triangles();
        for start in (0..total).step_by(CHUNK) {
            let end = (start + CHUNK).min(total);
            let corners = |i| {
                let (corners, keep_back) = drawing.corners(i);
                corners.map(|c| Corner {
                    position: c.as_vec4().to_array(),
                    keep_back: u32::from(keep_back),
                })
            };
            let corners: Vec<Corner> =
                (start..end).into_par_iter().flat_map_iter(corners).collect();
            rasteriser.draw(&corners, |mut fragments| {
                fragments.iter_mut().for_each(|f| f.primitive += start as u32);
                each(fragments)
            })?;
            progress(end as u64, total as u64);
        }
        Ok(())
    }
}

/// The fragments of one triangle after the other.
fn by_triangle(fragments: &[RawFragment]) -> impl Iterator<Item = &[RawFragment]> {
    fragments.chunk_by(|a, b| a.primitive == b.primitive)
}

//! Capture: a scene becomes a stream of fragments.
//!
//! A rasteriser by the rules of Direct3D and Vulkan on fixed-point coordinates,
//! with one shading per fragment. Fragments come out in API order (or in the
//! order asked for), the same ones whatever the number of threads, and go
//! straight into a [`TraceWriter`]: memory is bounded by the scene and a few
//! million pixels' worth of work in flight.

mod camera;
mod covered;
mod geometry;
mod order;
mod pattern;
mod raster;
mod setup;
mod shade;
mod unseen;

use std::io::Write;

use rayon::prelude::*;

pub use camera::{Camera, CameraOptions};
pub use covered::{Drawing, SetUp};
pub use order::Order;
pub use pattern::{PatternKind, pattern};
pub use unseen::Unseen;

use crate::capture::geometry::{Geometry, Triangle};
use crate::capture::raster::Raster;
use crate::capture::setup::{STEPS, ScreenTriangle, set_up};
use crate::capture::shade::Shader;
use crate::capture::unseen::Recorded;
use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{
    ColourFormat, ColumnId, Fragment, Header, Scalar, Trace, TraceWriter, WriteOptions,
};

screendoor_trace::options! {
    /// Which sides of surfaces are drawn.
    pub enum Faces {
        Material = "material": "as each material says",
        Both = "both": "fronts and backs of all",
        Front = "front": "only fronts",
    }
}

/// How to capture a scene.
#[derive(Clone, Debug)]
pub struct CaptureOptions {
    /// Frame width in pixels.
    pub width: u32,
    /// Frame height in pixels.
    pub height: u32,
    /// Samples per pixel: 1, 2, 4, 8, 16, 32 or 64.
    pub samples: u32,
    /// Which family of sample patterns.
    pub pattern: PatternKind,
    /// An alpha in place of the materials' own; texture alphas still multiply it.
    pub alpha: Option<f32>,
    /// The order in which triangles are drawn.
    pub order: Order,
    /// Which shuffle a random order takes.
    pub order_seed: u32,
    /// Which sides of surfaces are drawn.
    pub faces: Faces,
    /// Precision of colours in the trace.
    pub colour: ColourFormat,
    /// Linear colour behind the scene, in place of the scene's own.
    pub background: Option<[f32; 3]>,
    /// From where to look.
    pub camera: CameraOptions,
}

impl Default for CaptureOptions {
    fn default() -> Self {
        CaptureOptions {
            width: 800,
            height: 800,
            samples: 64,
            pattern: PatternKind::Auto,
            alpha: None,
            order: Order::Api,
            order_seed: 0,
            faces: Faces::Material,
            colour: ColourFormat::F16,
            background: None,
            camera: CameraOptions::default(),
        }
    }
}

/// A scene about to be captured.
pub struct Capture<'a> {
    scene: &'a Scene,
    options: &'a CaptureOptions,
    camera: Camera,
    header: Header,
    recorded: Recorded,
}

/// Triangles set up at a time.
const CHUNK: usize = 1 << 14;
/// Pixels of bounding boxes that one job rasterises.
const JOB_PIXELS: i64 = 1 << 13;
/// Pixels of bounding boxes that are in flight at a time.
const WAVE_PIXELS: i64 = 1 << 19;

impl<'a> Capture<'a> {
    /// Places the camera and makes the trace's header.
    ///
    /// # Errors
    /// [`Error::Config`] for options out of range.
    pub fn new(scene: &'a Scene, options: &'a CaptureOptions) -> Result<Self> {
        if options.alpha.is_some_and(|a| !(0.0..=1.0).contains(&a)) {
            return Err(Error::config("an alpha lies in [0, 1]", "give --alpha such a number"));
        }
        let camera = Camera::frame(scene, &options.camera, options.width, options.height)?;
        let mut header = Header {
            width: options.width,
            height: options.height,
            pattern: pattern(options.pattern, options.samples)?,
            background: options.background.unwrap_or(scene.view.background),
            colour: options.colour,
            source: scene.source.clone(),
            camera: camera.description().to_string(),
            view: camera.view(),
            ..Header::default()
        };
        header.check()?;
        if let Some(alpha) = options.alpha {
            header.source.push_str(&format!(", alpha {alpha}"));
        }
        match options.order {
            Order::Api => {}
            Order::Random => {
                header.source.push_str(&format!(", random order {}", options.order_seed));
            }
            Order::NearToFar => header.source.push_str(", near to far"),
            Order::FarToNear => header.source.push_str(", far to near"),
        }
        if scene.objects.len() == 1 {
            header.constants.insert(ColumnId::Object, Scalar::Unsigned(0));
        }
        if let Some(alpha) = Shader::new(scene, &camera, options.alpha).constant_alpha() {
            header.constants.insert(ColumnId::Alpha, Scalar::Real(alpha));
        }
        let recorded = Recorded::new(scene.objects.len());
        Ok(Capture { scene, options, camera, header, recorded })
    }

    /// The header of the trace that the capture makes.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Draws the scene into `writer`, which was made with [`Capture::header`].
    /// `progress` is told how many triangles are done, of how many.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn draw<W: Write + Send>(
        &self,
        writer: &mut TraceWriter<W>,
        mut progress: impl FnMut(u64, u64) + Send,
    ) -> Result<()> {
        let geometry = Geometry::new(self.scene, &self.camera);
        let shader = Shader::new(self.scene, &self.camera, self.options.alpha);
        let samples = &self.header.pattern.positions;
        let offsets: Vec<[i64; 2]> =
            samples.iter().map(|p| p.map(|v| i64::from(v) * STEPS / 16)).collect();
        let seed = self.options.order_seed;
        let order = order::drawing_order(self.options.order, seed, &geometry, &self.camera);
        let total = geometry.len() as usize;
        let number = |i: usize| order.as_ref().map_or(i as u32, |order| order[i]);

        let size = [self.options.width, self.options.height];
        // What the previous wave made, written while this one is drawn.
        let mut finished: Vec<Vec<Fragment>> = Vec::new();
        for start in (0..total).step_by(CHUNK) {
            let end = (start + CHUNK).min(total);
            let drawn: Vec<Drawn> = (start..end)
                .into_par_iter()
                .map(|i| self.prepare(geometry.triangle(number(i)), &shader))
                .collect();
            let jobs = cut_into_jobs(&drawn, &offsets, size);
            let mut rest = &jobs[..];
            while !rest.is_empty() {
                let (wave, later) = rest.split_at(wave_length(rest));
                rest = later;
                let mut done = Vec::new();
                let (written, ()) = rayon::join(
                    || self.write_all(writer, std::mem::take(&mut finished)),
                    || {
                        wave.par_iter()
                            .map(|job| job.run(&drawn, &offsets, size, &shader))
                            .collect_into_vec(&mut done);
                    },
                );
                written?;
                finished = done;
            }
            progress(end as u64, total as u64);
        }
        self.write_all(writer, finished)
    }

    /// Draws the scene into a trace in memory.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn to_memory(&self, progress: impl FnMut(u64, u64) + Send) -> Result<Trace> {
        let source = &self.header.source;
        let options = WriteOptions::default();
        let mut writer = TraceWriter::new(Vec::new(), source, self.header.clone(), options)?;
        self.draw(&mut writer, progress)?;
        Trace::from_bytes(writer.finish()?.0, source)
    }

    /// Whether a triangle is drawn where it shows its back.
    fn keeps_back(&self, triangle: &Triangle, shader: &Shader<'_>) -> bool {
        match self.options.faces {
            Faces::Both => true,
            Faces::Front => false,
            Faces::Material => shader.material(triangle.material).double_sided,
        }
    }

    fn write_all<W: Write>(
        &self,
        writer: &mut TraceWriter<W>,
        fragments: Vec<Vec<Fragment>>,
    ) -> Result<()> {
        fragments.iter().flatten().try_for_each(|fragment| self.write(writer, fragment))
    }

    /// Writes a fragment, and notes that its object has one.
    pub fn write<W: Write>(&self, writer: &mut TraceWriter<W>, fragment: &Fragment) -> Result<()> {
        self.recorded.mark(fragment.object);
        writer.push(fragment)
    }

    fn prepare(&self, triangle: Triangle, shader: &Shader<'_>) -> Drawn {
        let keep_back = self.keeps_back(&triangle, shader);
        let mut pieces = Vec::new();
        set_up(&triangle, &self.camera, keep_back, &mut pieces);
        Drawn { triangle, pieces }
    }
}

/// A triangle and what clipping left of it.
struct Drawn {
    triangle: Triangle,
    pieces: Vec<ScreenTriangle>,
}

/// A part of the drawing that one thread does: some rows of one piece after the
/// other.
#[derive(Default)]
struct Job {
    parts: Vec<Part>,
    pixels: i64,
}

/// Rows of a piece of a triangle, by their places in the chunk.
struct Part {
    drawn: usize,
    piece: usize,
    rows: (i64, i64),
}

/// Cuts the drawing of a chunk into jobs of about equal size, in drawing order.
/// The cuts depend on the triangles alone, not on the threads.
fn cut_into_jobs(drawn: &[Drawn], offsets: &[[i64; 2]], size: [u32; 2]) -> Vec<Job> {
    let mut jobs = vec![Job::default()];
    for (i, d) in drawn.iter().enumerate() {
        for (k, piece) in d.pieces.iter().enumerate() {
            let raster = Raster::new(piece, offsets, size);
            let (mut row, last) = raster.rows();
            let columns = raster.columns();
            while row <= last {
                let mut job = jobs.last_mut().expect("never empty");
                if job.pixels >= JOB_PIXELS {
                    jobs.push(Job::default());
                    job = jobs.last_mut().expect("just pushed");
                }
                let room = ((JOB_PIXELS - job.pixels) / columns).max(1);
                let end = (row + room - 1).min(last);
                job.parts.push(Part { drawn: i, piece: k, rows: (row, end) });
                job.pixels += (end - row + 1) * columns;
                row = end + 1;
            }
        }
    }
    jobs
}

/// How many of `jobs` make up a wave.
fn wave_length(jobs: &[Job]) -> usize {
    let mut pixels = 0;
    let full = jobs.iter().position(|job| {
        pixels += job.pixels;
        pixels >= WAVE_PIXELS
    });
    full.map_or(jobs.len(), |last| last + 1)
}

impl Job {
    fn run(
        &self,
        drawn: &[Drawn],
        offsets: &[[i64; 2]],
        size: [u32; 2],
        shader: &Shader<'_>,
    ) -> Vec<Fragment> {
        let mut fragments = Vec::new();
        for part in &self.parts {
            let Drawn { triangle, pieces } = &drawn[part.drawn];
            let raster = Raster::new(&pieces[part.piece], offsets, size);
            for y in part.rows.0..=part.rows.1 {
                raster.row(y, |hit| {
                    let weights = raster.weights(hit.shade_at);
                    let Some((colour, alpha)) = shader.shade(triangle, &weights) else { return };
                    fragments.push(Fragment {
                        x: hit.x,
                        y: hit.y,
                        coverage: hit.coverage,
                        depth: hit.depth,
                        colour,
                        alpha,
                        primitive: triangle.primitive,
                        object: triangle.object,
                        ..Fragment::default()
                    });
                });
            }
        }
        fragments
    }
}

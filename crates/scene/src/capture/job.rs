//! The drawing of a chunk of primitives, cut into jobs that threads do.

use fearless_simd::{Level, Simd, dispatch};

use crate::capture::batch::{Batch, Hits};
use crate::capture::geometry::{Splat, Triangle};
use crate::capture::raster::{Bounds, Raster};
use crate::capture::samples::{MOST, Samples};
use crate::capture::scan::{Changes, Scan};
use crate::capture::screen_door::Door;
use crate::capture::setup::{Pieces, ScreenTriangle};
use crate::capture::shade::Shader;
use crate::capture::splat::{Nothing, OnFrame, Painter, Placed, SplatRules};
use screendoor_trace::trace::Fragment;

/// Pixels of bounding boxes that one job rasterises.
const JOB_PIXELS: i64 = 1 << 13;
/// What setting a triangle up costs, in pixels.
const SET_UP: i64 = 8;
/// Jobs that are in flight at a time, for each thread.
const WAVE: usize = 4;

/// What a capture draws with.
pub(super) struct Tools<'a> {
    pub(super) shader: Shader<'a>,
    pub(super) painter: Painter<'a>,
    /// Each object's place, for its splats.
    pub(super) placed: Vec<Placed>,
    pub(super) rules: &'a SplatRules,
    /// The instructions that there are.
    pub(super) level: Level,
    pub(super) samples: Samples,
    /// The samples' places from the pixel's centre, in pixels.
    pub(super) pixels: Vec<[f64; 2]>,
    /// The frame's, in pixels.
    pub(super) size: [u32; 2],
    /// What cuts holes into that which lets light through.
    pub(super) door: Option<Door>,
}

impl Tools<'_> {
    pub(super) fn project(&self, splat: &Splat<'_>) -> std::result::Result<OnFrame, Nothing> {
        self.painter.project(splat.splats, splat.index, &self.placed[splat.object as usize])
    }

    pub(super) fn raster<'p>(&'p self, piece: &'p ScreenTriangle) -> Raster<'p> {
        Raster::new(piece, &self.samples, self.size)
    }
}

/// A primitive and what is left of it on the frame.
#[expect(clippy::large_enum_variant, reason = "a scene has mostly one kind")]
pub(super) enum Drawn {
    Triangle {
        triangle: Triangle,
        /// What clipping left of it.
        pieces: Pieces,
    },
    Splat {
        on_frame: std::result::Result<OnFrame, Nothing>,
        object: u32,
        primitive: u32,
    },
}

/// What a job works in, made once for all of its triangles.
struct Room {
    changes: Changes,
    hits: Hits,
}

/// The rows that something may touch, empty where they cross, and the pixels of each.
struct Extent {
    rows: (i64, i64),
    columns: i64,
}

impl Drawn {
    /// Tells the extent of each piece.
    fn extents(&self, tools: &Tools<'_>, mut tell: impl FnMut(Extent)) {
        match self {
            Drawn::Triangle { pieces, .. } => pieces.iter().for_each(|piece| {
                let bounds = Bounds::new(piece, tools.size);
                tell(Extent { rows: bounds.rows(), columns: bounds.width() });
            }),
            Drawn::Splat { on_frame: Ok(s), .. } => {
                tell(Extent { rows: s.rows(), columns: s.columns() });
            }
            Drawn::Splat { on_frame: Err(_), .. } => {}
        }
    }

    /// Its fragments in some rows of a piece.
    #[inline(always)]
    fn fragments<S: Simd>(
        &self,
        simd: S,
        part: &Part,
        tools: &Tools<'_>,
        room: &mut Room,
        fragments: &mut Vec<Fragment>,
    ) {
        match self {
            Drawn::Triangle { triangle, pieces } => {
                let raster = tools.raster(pieces.get(part.piece));
                let from = fragments.len();
                let scan = Scan::new(simd, &raster, &mut room.changes);
                let mut batch = Batch::new(&raster, triangle, &tools.shader, &mut room.hits);
                for y in part.rows.0..=part.rows.1 {
                    scan.row(
                        simd,
                        y,
                        #[inline(always)]
                        |covered| batch.add(simd, y, covered, fragments),
                    );
                }
                batch.finish(simd, fragments);
                if let Some(door) = &tools.door {
                    door.cut(triangle, &raster, tools.shader.camera, (fragments, from));
                    if door.place_of_points(pieces, tools) == Some((part.piece, part.rows.0)) {
                        door.add_points((triangle, pieces), tools, fragments);
                    }
                }
            }
            Drawn::Splat { on_frame, object, primitive } => {
                let Ok(splat) = on_frame else { return };
                let (object, primitive) = (*object, *primitive);
                let of = Fragment { object, primitive, ..Fragment::default() };
                for y in part.rows.0..=part.rows.1 {
                    splat.row(y, tools.rules, &tools.pixels, of, fragments);
                }
            }
        }
    }
}

/// A part of the drawing that one thread does: some rows of one piece after the
/// other.
#[derive(Default)]
pub(super) struct Job {
    parts: Vec<Part>,
    pixels: i64,
}

/// Rows of a piece of a primitive, by their places in the chunk.
struct Part {
    drawn: usize,
    piece: usize,
    rows: (i64, i64),
}

/// Cuts the drawing of a chunk into jobs of about equal size, in drawing order.
/// Neither the fragments nor their order depend on where the cuts are.
pub(super) fn cut_into_jobs(drawn: &[Drawn], tools: &Tools<'_>) -> Vec<Job> {
    let mut jobs = vec![Job::default()];
    for (i, d) in drawn.iter().enumerate() {
        let mut piece = 0;
        d.extents(tools, |extent| {
            let (mut row, last) = extent.rows;
            let columns = extent.columns;
            while row <= last {
                let mut job = jobs.last_mut().expect("never empty");
                if job.pixels >= JOB_PIXELS {
                    jobs.push(Job::default());
                    job = jobs.last_mut().expect("just pushed");
                }
                let room = ((JOB_PIXELS - job.pixels) / columns).max(1);
                let end = (row + room - 1).min(last);
                job.parts.push(Part { drawn: i, piece, rows: (row, end) });
                job.pixels += (end - row + 1) * columns + SET_UP;
                row = end + 1;
            }
            piece += 1;
        });
    }
    jobs
}

/// How many of `jobs` make up a wave: enough that no thread waits, and few enough that what they
/// make is still in the caches when it is written.
pub(super) fn wave_length(jobs: &[Job]) -> usize {
    jobs.len().min(WAVE * rayon::current_num_threads())
}

impl Job {
    /// Adds what it draws to `fragments`.
    pub(super) fn run(&self, drawn: &[Drawn], tools: &Tools<'_>, fragments: &mut Vec<Fragment>) {
        let mut room = Room { changes: [[0; MOST]; 3], hits: Hits::default() };
        dispatch!(tools.level, simd => for part in &self.parts {
            drawn[part.drawn].fragments(simd, part, tools, &mut room, fragments);
        });
    }
}

//! The table of `docs/PERFORMANCE.md`: how near the replay comes to the machine's limits.
//!
//! `cargo bench --bench limits` prints it as Markdown, in two minutes; with `-- --large`
//! a trace of 10^8 fragments is written (3.3 GB, beside the build) and replayed, too.
//!
//! Machines are shared and change their speed while one looks. So every row is a ratio, its
//! two sides measured one right after the other, and that again and again: what is shown is
//! the median and the quartiles of the ratios.

mod common;

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use common::{Tile, Work, assert_same, binned, captured, draw_all, in_file};
use rayon::{ThreadPool, ThreadPoolBuilder};
use screendoor::capture::{Capture, CaptureOptions};
use screendoor::design::{Configured, REFERENCE, configure};
use screendoor::rop::{Frame, Implementation, ReplayOptions, TiledDesign};
use screendoor::trace::{Trace, TraceWriter, WriteOptions};

/// Designs beside those that have rows of their own, whose engines draw many fragments of a tile
/// at once.
const OTHERS: [&str; 5] = ["kbuffer", "wboit", "adaptive", "hashed-alpha", "mboit"];

/// Measurements of every row; with `--test`, one.
const ROUNDS: usize = 9;

/// A row of the table.
struct Row<'a> {
    what: String,
    least: f64,
    /// Where it lies below `least`, the figure is a cost.
    aim: f64,
    unit: &'static str,
    measure: Box<dyn Fn() -> f64 + 'a>,
    found: Vec<f64>,
}

impl<'a> Row<'a> {
    fn new(
        what: impl Into<String>,
        [least, aim]: [f64; 2],
        unit: &'static str,
        measure: impl Fn() -> f64 + 'a,
    ) -> Self {
        Row { what: what.into(), least, aim, unit, measure: Box::new(measure), found: Vec::new() }
    }

    fn print(mut self) {
        let Row { what, least, aim, unit, .. } = self;
        self.found.sort_by(f64::total_cmp);
        let at = |share: f64| self.found[((self.found.len() - 1) as f64 * share).round() as usize];
        let [low, median, high] = [0.25, 0.5, 0.75].map(at);
        let held = |limit: f64| if aim < least { median <= limit } else { median >= limit };
        let verdict = match (held(aim), held(least)) {
            (true, _) => "aim reached",
            (false, true) => "held",
            (false, false) => "missed",
        };
        println!(
            "| {what} | {least}{unit} | {aim}{unit} | {median:.2}{unit} ({low:.2} to {high:.2}) | {verdict} |"
        );
    }
}

/// A design's engines and what they draw.
struct Kernel {
    fast: Box<dyn TiledDesign>,
    reference: Box<dyn TiledDesign>,
    frame: Frame,
    tiles: Vec<Tile>,
    fragments: usize,
}

impl Kernel {
    fn new(trace: &Trace, name: &str, samples: u32) -> Self {
        let design = design(name);
        let frame = design.frame(trace, samples, 1).expect("it has the samples");
        let build = |which| design.build(&frame, which).expect("it is built");
        let (fast, reference) = (build(Implementation::Fast), build(Implementation::Reference));
        let (tiles, fragments) = binned(trace, &frame);
        assert_same(&*fast, &*reference, &frame, &tiles);
        Kernel { fast, reference, frame, tiles, fragments }
    }

    /// Seconds of the fast engine.
    fn time(&self, work: Work) -> f64 {
        draw_all(&*self.fast, &self.frame, &self.tiles, work).as_secs_f64()
    }

    /// Seconds of the plain text.
    fn reference_time(&self, work: Work) -> f64 {
        draw_all(&*self.reference, &self.frame, &self.tiles, work).as_secs_f64()
    }
}

fn design(name: &str) -> Configured {
    configure(name, &[]).expect("defaults are good")
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

/// Seconds of a whole replay through `lk` at 8 samples: one that reads the trace, or of
/// fragments that another has left sorted.
fn replay(trace: &Trace, pool: &ThreadPool, keep: bool) -> f64 {
    let design = design("lk");
    let options = ReplayOptions { keep, ..ReplayOptions::default() };
    let run = || design.replay(trace, 8, 1, &options).expect("it replays");
    seconds(|| drop(black_box(pool.install(run))))
}

/// So many layers over each of 1024 × 1024 pixels, in a file.
fn layers(folder: &Path, count: u32) -> Trace {
    let path = folder.join(format!("layers-{count}.arrow"));
    let scene = format!("builtin:layers:count={count},alpha=0.1,coloured=true");
    let scene = screendoor::scene::load(&scene).expect("it is built in");
    let (width, height, samples) = (1024, 1024, 8);
    let options = CaptureOptions { width, height, samples, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).expect("the options are good");
    in_file(&path, |file| {
        let header = capture.header().clone();
        let mut writer = TraceWriter::new(file, "layers", header, WriteOptions::default())
            .expect("the header is good");
        capture.draw(&mut writer, |_, _| ()).expect("it is drawn");
        writer.finish().expect("it writes").0
    })
}

fn main() {
    let asked = |wanted: &str| std::env::args().any(|argument| argument == wanted);
    let rounds = if asked("--test") { 1 } else { ROUNDS };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("there is room");
    let memory = captured("builtin:engine", 512);
    let path = folder.path().join("engine.arrow");
    let trace = in_file(&path, |file| common::write(&memory, file, WriteOptions::default()));
    let kernel = |name, samples| Kernel::new(&memory, name, samples);
    let (lk, lk_64) = (kernel("lk", 8), kernel("lk", 64));
    let (systematic, enderton) = (kernel("systematic", 8), kernel("enderton", 8));
    let exact = kernel(REFERENCE, 8);
    let scenes = ["builtin:smoke", "builtin:glass"].map(|scene| captured(scene, 512));
    let [smoke, glass] = scenes.each_ref().map(|trace| Kernel::new(trace, "lk", 8));
    let words = common::stream();
    let (one, two) = (pool(1), pool(2));
    let file = std::fs::metadata(&path).expect("it has been written").len();

    let rate = |kernel: &Kernel| kernel.fragments as f64 / kernel.time(Work::Picture) / 1e6;
    // Samples in lanes against pixels in lanes.
    let gained = |kernel: &Kernel| kernel.time(Work::Blocks) / kernel.time(Work::Picture);
    let over_reference =
        |kernel: &Kernel| kernel.reference_time(Work::Picture) / kernel.time(Work::Picture);
    let per_sample = |kernel: &Kernel, samples: usize| {
        kernel.time(Work::Picture) / (kernel.fragments * samples) as f64
    };
    let of_lk = |kernel: &Kernel| lk.time(Work::Picture) / kernel.time(Work::Picture);
    let (mlab, merging) = (&kernel("mlab", 8), &kernel("merging", 8));
    let residual = kernel("residual", 8);
    let others = OTHERS.map(|name| (name, kernel(name, 8)));
    let mut rows = vec![
        Row::new(
            "`lk`, 8 samples, kernel, one core: fast ÷ reference",
            [12.0, 18.0],
            "×",
            || over_reference(&lk),
        ),
        Row::new(
            "million fragments/s per core, `lk`, 8 samples, kernel: engine",
            [100.0, 140.0],
            "",
            || rate(&lk),
        ),
        Row::new("the same: smoke", [100.0, 140.0], "", || rate(&smoke)),
        Row::new("the same: glass", [70.0, 90.0], "", || rate(&glass)),
        Row::new("`systematic`, 8 samples, kernel ÷ `lk` kernel", [0.8, 1.0], "×", || {
            of_lk(&systematic)
        }),
        Row::new("`enderton`, the same", [0.8, 1.0], "×", || of_lk(&enderton)),
        Row::new("`residual`, the same", [0.5, 0.7], "×", || of_lk(&residual)),
        Row::new(
            "`merging`, 8 samples, kernel ÷ the plain text of `mlab`",
            [1.0, 2.0],
            "×",
            || mlab.reference_time(Work::Picture) / merging.time(Work::Picture),
        ),
        Row::new("`merging`, 8 samples, kernel ÷ `mlab` kernel", [1.0, 1.0], "×", || {
            mlab.time(Work::Picture) / merging.time(Work::Picture)
        }),
        Row::new(
            "pixels in lanes ÷ samples in lanes, `lk`, 8 samples: engine",
            [1.5, 2.2],
            "×",
            || gained(&lk),
        ),
        Row::new("the same: smoke", [1.5, 2.2], "×", || gained(&smoke)),
        Row::new("the same: glass", [1.5, 2.2], "×", || gained(&glass)),
        Row::new("counting events: on ÷ off", [1.08, 1.02], "×", || {
            lk.time(Work::Count) / lk.time(Work::Picture)
        }),
        Row::new("time per sample at 64 samples ÷ at 8", [1.5, 1.0], "×", || {
            per_sample(&lk_64, 64) / per_sample(&lk, 8)
        }),
        Row::new("`exact` ÷ a per-pixel `Vec`, standard sort", [5.0, 6.0], "×", || {
            over_reference(&exact)
        }),
        Row::new("second replay of a trace ÷ first, one thread", [2.0, 3.0], "×", || {
            let first = replay(&trace, &one, false);
            // One fills, the next finds.
            replay(&trace, &one, true);
            first / replay(&trace, &one, true)
        }),
        Row::new("two threads ÷ one, first replay", [1.85, 1.95], "×", || {
            replay(&trace, &one, false) / replay(&trace, &two, false)
        }),
        Row::new(
            "bytes of the file per second ÷ streaming, first replay, one thread",
            [10.0, 20.0],
            " %",
            || {
                let first = replay(&trace, &one, false);
                let sum = || {
                    black_box(common::sum(&words));
                };
                let streamed = size_of_val(&words[..]) as f64 / seconds(sum);
                100.0 * file as f64 / first / streamed
            },
        ),
    ];
    let named = [("mlab", mlab), ("merging", merging)];
    for (name, kernel) in named.into_iter().chain(others.iter().map(|(name, k)| (*name, k))) {
        let what = format!("`{name}`, 8 samples, kernel: fast ÷ reference");
        rows.push(Row::new(what, [2.0, 4.0], "×", move || over_reference(kernel)));
    }
    for _ in 0..rounds {
        for row in &mut rows {
            row.found.push((row.measure)());
        }
    }
    println!("| what | at least | aim | median (quartiles) | |");
    println!("|---|---|---|---|---|");
    rows.into_iter().for_each(Row::print);
    if asked("--large") {
        let (short, long) = (layers(folder.path(), 1), layers(folder.path(), 100));
        let per_fragment = |trace: &Trace| replay(trace, &two, false) / trace.rows() as f64;
        let what = "time per fragment at 10^8 fragments ÷ at 10^6";
        let mut row =
            Row::new(what, [1.1, 1.0], "×", || per_fragment(&long) / per_fragment(&short));
        row.found = (0..3).map(|_| (row.measure)()).collect();
        row.print();
    }
}

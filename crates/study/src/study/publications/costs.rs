//! What designs cost, as the papers print it: multiples of one alpha-blended pass (Enderton et al. 2011,
//! table 1), depth peeling in the same time (figure 6), how costs grow and vary with the view
//! (section 5), and run times of layers against samples (Wyman 2016, section 3).
//!
//! No study: costs of several scenes are set against each other, and times are measured in turns.

use serde::Serialize;

use crate::metrics::{PixelClasses, rmse};
use crate::study::engine::FAST;
use crate::study::publications::experiment::Lab;
use crate::study::publications::{Effort, MEMORY, capture, layers_at, options, replay};
use crate::study::throughput::Spread;
use screendoor_designs::{Configured, REFERENCE, configure};
use screendoor_rop::Family;
use screendoor_scene::capture::{CameraOptions, CaptureOptions, PatternKind, pattern};
use screendoor_trace::error::Result;
use screendoor_trace::trace::{Trace, Unorm32, statistics_within};

/// Samples of a pixel, and layers.
pub const SAMPLES: u32 = 8;
/// What costs are multiples of.
pub const BASE: &str = "blend";
/// The final algorithm of Enderton et al.
pub const FINAL: &str = "enderton:method=depth-correction";
/// What else is measured.
const DESIGNS: [&str; 19] = [
    "enderton",
    "enderton:method=alpha-correction",
    "enderton:method=depth",
    FINAL,
    "lk",
    "lk:method=depth-correction",
    "systematic",
    "residual",
    "hashed-alpha",
    "merging:layers=5",
    "kbuffer:layers=8",
    "mlab:layers=8",
    "slab:layers=8,bits=16",
    "hybrid:layers=8",
    "adaptive:layers=8",
    "mboit",
    "wboit",
    "depth-peeling:layers=8",
    REFERENCE,
];
/// The scenes.
pub const SCENES: [&str; 5] = ["engine", "cloth", "hair", "smoke", "foliage"];
/// Layers over which growth is measured: no design peels more.
pub const LAYERS: [u32; 4] = [4, 8, 16, 32];
/// Views around the scene.
pub const VIEWS: u32 = 24;
/// Layers and samples of Wyman's run times.
pub const WYMAN: [u32; 2] = [4, 8];
/// Timed replays of each design, in turns.
const ROUNDS: usize = 5;

/// What is measured of costs.
#[derive(Debug, Serialize)]
pub struct Costs {
    /// Frame side in pixels.
    pub side: u32,
    /// Threads of a replay.
    pub threads: usize,
    /// Design by design.
    pub rows: Vec<CostRow>,
    /// Depth peeling for the bytes of [`FINAL`], scene by scene.
    pub equal: Vec<EqualCost>,
    /// Bytes by layers over each pixel: of [`FINAL`] and of depth peeling of all layers.
    pub growth: [Growth; 2],
    /// Around the engine.
    pub views: Vec<View>,
    /// Wyman's, by layers.
    pub wyman: Vec<WymanTimes>,
}

/// A design's cost as multiples of [`BASE`], on each of [`SCENES`].
#[derive(Debug, Serialize)]
pub struct CostRow {
    /// The design.
    pub design: String,
    /// What kind it is of.
    pub family: Family,
    /// Passes over the fragments, at most.
    pub passes: u32,
    /// Bytes of state that are read and written.
    pub bytes: Vec<f64>,
    /// Time to the picture, by medians.
    pub time: Vec<f64>,
}

/// Depth peeling for the same bytes.
#[derive(Debug, Serialize)]
pub struct EqualCost {
    /// The scene.
    pub scene: &'static str,
    /// Layers that are peeled for at most the bytes that [`FINAL`] moves.
    pub layers: u32,
    /// Fragments in the deepest pixel.
    pub deepest: u32,
    /// The errors of that and of [`FINAL`], in 8-bit units.
    pub rmse: [f64; 2],
}

/// How a cost grows.
#[derive(Debug, Serialize)]
pub struct Growth {
    /// The design.
    pub design: &'static str,
    /// Bytes for each pixel at each of [`LAYERS`].
    pub bytes: Vec<f64>,
    /// p of bytes ∝ layers^p, over all of them.
    pub exponent: f64,
}

/// A view of the engine.
#[derive(Debug, Serialize)]
pub struct View {
    /// Degrees to the right.
    pub yaw: f64,
    /// Fragments.
    pub fragments: u64,
    /// Fragments in the deepest pixel: peels that all layers take.
    pub deepest: u32,
    /// Bytes that [`FINAL`] moves for each fragment.
    pub bytes: f64,
}

/// Run times of SLAB against others, on each of [`SCENES`].
#[derive(Debug, Serialize)]
pub struct WymanTimes {
    /// Layers, and samples.
    pub layers: u32,
    /// Time of SLAB ÷ that of stochastic transparency, both normalised as Enderton et al. do.
    pub to_stochastic: Vec<f64>,
    /// ÷ that of multi-layer alpha blending.
    pub to_mlab: Vec<f64>,
    /// Time of the k-buffer ÷ that of SLAB.
    pub kbuffer: Vec<f64>,
}

/// Measures all of it.
///
/// # Errors
/// As captures and replays of the built-in scenes.
pub fn costs(lab: &Lab<'_>, effort: Effort) -> Result<Costs> {
    let side = effort.comparison_side * 4 / 3;
    let steps = SCENES.len() as u64 + 2;
    let designs: Vec<Configured> = std::iter::once(BASE)
        .chain(DESIGNS)
        .map(|design| configure(design, &[]))
        .collect::<Result<_>>()?;
    let row = |design: &Configured| CostRow {
        design: design.label(),
        family: design.info().family,
        passes: 0,
        bytes: Vec::new(),
        time: Vec::new(),
    };
    let mut rows: Vec<CostRow> = designs.iter().map(row).collect();
    let (mut equal, mut wyman) = (Vec::new(), Vec::new());
    wyman.extend(WYMAN.map(|layers| WymanTimes {
        layers,
        to_stochastic: Vec::new(),
        to_mlab: Vec::new(),
        kbuffer: Vec::new(),
    }));
    for (i, scene) in SCENES.into_iter().enumerate() {
        (lab.watch)(&format!("costs on {scene}"), i as u64, steps);
        let trace = seen(scene, side, None)?;
        let times = times(&designs, &trace, SAMPLES)?;
        let base = moved(&designs[0], &trace)?.0;
        for ((row, design), time) in rows.iter_mut().zip(&designs).zip(&times) {
            let (bytes, passes) = moved(design, &trace)?;
            row.passes = row.passes.max(passes);
            row.bytes.push(bytes / base);
            row.time.push(time / times[0]);
        }
        equal.push(at_equal_cost(scene, &trace)?);
        for own in &mut wyman {
            own.measure(&trace)?;
        }
    }
    (lab.watch)("growth with layers", steps - 2, steps);
    let growth = [growth(FINAL, |_| FINAL.to_string())?, {
        growth("depth-peeling", |layers| format!("depth-peeling:layers={layers}"))?
    }];
    (lab.watch)("views around the engine", steps - 1, steps);
    let turn = |i: u32| view(f64::from(i) * 360.0 / f64::from(VIEWS), side);
    let views = (0..VIEWS).map(turn).collect::<Result<_>>()?;
    let threads = rayon::current_num_threads();
    Ok(Costs { side, threads, rows, equal, growth, views, wyman })
}

fn seen(scene: &str, side: u32, yaw: Option<f64>) -> Result<Trace> {
    let options = CaptureOptions {
        width: side,
        height: side,
        camera: CameraOptions { angle: yaw.map(|yaw| [yaw, 15.0]), ..CameraOptions::default() },
        ..CaptureOptions::default()
    };
    capture(&format!("builtin:{scene}"), &options, false)
}

/// Bytes of state that a design moves, and its passes.
fn moved(design: &Configured, trace: &Trace) -> Result<(f64, u32)> {
    let counting = screendoor_rop::ReplayOptions { count_events: true, ..options() };
    let replayed = design.replay(trace, SAMPLES, 0, &counting)?;
    let events = replayed.events.unwrap_or_default();
    let bits = events.state_bits_read + events.state_bits_written;
    Ok((bits as f64 / 8.0, replayed.passes))
}

/// Median times of designs, in turns, so that what disturbs one disturbs all.
fn times(designs: &[Configured], trace: &Trace, samples: u32) -> Result<Vec<f64>> {
    let mut all = vec![Vec::new(); designs.len()];
    // The first round finds caches cold.
    for round in 0..=ROUNDS {
        for (design, seconds) in designs.iter().zip(&mut all) {
            let start = std::time::Instant::now();
            FAST.replay(design, trace, samples, 0, &options())?;
            if round > 0 {
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
    }
    Ok(all.iter().map(|seconds| Spread::of(seconds).map_or(f64::NAN, |s| s.median)).collect())
}

/// How far depth peeling comes for the bytes of [`FINAL`].
fn at_equal_cost(scene: &'static str, trace: &Trace) -> Result<EqualCost> {
    let peeling = |layers: u32| configure(&format!("depth-peeling:layers={layers}"), &[]);
    let (budget, _) = moved(&configure(FINAL, &[])?, trace)?;
    let mut layers = 0;
    while layers < LAYERS[LAYERS.len() - 1] && moved(&peeling(layers + 1)?, trace)?.0 <= budget {
        layers += 1;
    }
    let exact = replay(REFERENCE, trace, SAMPLES, 0)?.picture;
    let covered = PixelClasses::of(trace, SAMPLES)?.covered;
    let error = |picture| rmse(&picture, &exact, &covered);
    let peeled = peeling(layers.max(1))?.replay(trace, SAMPLES, 0, &options())?.picture;
    let stochastic = replay(FINAL, trace, SAMPLES, 0)?.picture;
    Ok(EqualCost {
        scene,
        layers,
        deepest: deepest(trace)?.1,
        rmse: [error(peeled), error(stochastic)],
    })
}

/// How many fragments there are, and how many in the deepest pixel.
fn deepest(trace: &Trace) -> Result<(u64, u32)> {
    let statistics = statistics_within(trace, MEMORY, |_, _| ())?;
    Ok((statistics.fragments, statistics.depth_complexity.max as u32))
}

/// Bytes of a design over whole layers.
fn growth(name: &'static str, design: impl Fn(u32) -> String) -> Result<Growth> {
    const SIDE: u32 = 32;
    let of = |count: &u32| {
        let depth = |i: u32| Unorm32((i + 1) << 24);
        let layers = (0..*count).map(|i| (depth(i), [0.5; 3], 0.3));
        let trace = layers_at(SIDE, pattern(PatternKind::Auto, SAMPLES)?, [0.0; 3], layers)?;
        let (bytes, _) = moved(&configure(&design(*count), &[])?, &trace)?;
        Ok(bytes / f64::from(SIDE * SIDE))
    };
    let bytes: Vec<f64> = LAYERS.iter().map(of).collect::<Result<_>>()?;
    let last = LAYERS.len() - 1;
    let exponent = (bytes[last] / bytes[0]).ln() / f64::from(LAYERS[last] / LAYERS[0]).ln();
    Ok(Growth { design: name, bytes, exponent })
}

fn view(yaw: f64, side: u32) -> Result<View> {
    let trace = seen("engine", side, Some(yaw))?;
    let (fragments, deepest) = deepest(&trace)?;
    let (bytes, _) = moved(&configure(FINAL, &[])?, &trace)?;
    Ok(View { yaw, fragments, deepest, bytes: bytes / fragments.max(1) as f64 })
}

impl WymanTimes {
    /// Adds a scene.
    fn measure(&mut self, trace: &Trace) -> Result<()> {
        let n = self.layers;
        let designs = [
            format!("slab:layers={n},bits={}", 2 * n),
            FINAL.to_string(),
            format!("mlab:layers={n}"),
            format!("kbuffer:layers={n}"),
        ];
        let designs = designs.iter().map(|design| configure(design, &[]));
        let times = times(&designs.collect::<Result<Vec<_>>>()?, trace, n)?;
        self.to_stochastic.push(times[0] / times[1]);
        self.to_mlab.push(times[0] / times[2]);
        self.kbuffer.push(times[3] / times[0]);
        Ok(())
    }
}

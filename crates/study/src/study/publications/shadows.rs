//! Stochastic shadow maps: Enderton et al. 2011, sections 3.2 and 3.6, figures 3 and 5, and the
//! same question put to every design that can answer it.
//!
//! No study: what is measured is no picture but visibility. A light's view is an ordinary trace, seen
//! along parallel lines; who asks are its own fragments, each at its depth, as in hair and smoke that
//! shadow themselves.

use rayon::prelude::*;
use serde::Serialize;

use crate::metrics::{Convergence, Estimate};
use crate::study::publications::experiment::Lab;
use crate::study::publications::{Effort, capture, layers_at, options};
use screendoor_designs::{REFERENCE, configure};
use screendoor_rop::Family;
use screendoor_rop::visibility::{Filter, Receiver, VisibilityMap};
use screendoor_scene::capture::{CameraOptions, CaptureOptions, PatternKind, pattern};
use screendoor_trace::error::Result;
use screendoor_trace::random::{Stream, hash};
use screendoor_trace::trace::{Trace, Unorm32};

/// What is measured of shadow maps.
#[derive(Debug, Serialize)]
pub struct Shadows {
    /// What was spent.
    pub effort: Effort,
    /// Figure 3.
    pub clouds: Clouds,
    /// How the error falls with the samples of a pixel, design by design.
    pub slopes: Vec<Slope>,
    /// Seeds of what stands below.
    pub seeds: u32,
    /// Frame side in pixels of the lights' views.
    pub side: u32,
    /// Figure 5, and all designs.
    pub scenes: Vec<LightView>,
}

/// Figure 3: a random set of blockers, and what is thought of it.
#[derive(Debug, Serialize)]
pub struct Clouds {
    /// The blockers: depth (0 to 1) and opacity.
    pub blockers: Vec<(f64, f64)>,
    /// Where visibility is asked for, 0 to 1.
    pub depths: Vec<f64>,
    /// The true visibility at these.
    pub truth: Vec<f64>,
    /// Two estimates of 8 samples.
    pub two: [Vec<f64>; 2],
    /// Many estimates by one number of samples after the other.
    pub clouds: Vec<Cloud>,
}

/// Many estimates of the same number of samples.
#[derive(Debug, Serialize)]
pub struct Cloud {
    /// Samples of each.
    pub samples: u32,
    /// How many estimates.
    pub estimates: usize,
    /// At each depth what 5 % and 95 % of the estimates lie below.
    pub between: Vec<[f64; 2]>,
    /// The root of the mean squared error over depths and estimates.
    pub rmse: f64,
    /// The mean error.
    pub mean: f64,
}

/// How an error falls.
#[derive(Debug, Serialize)]
pub struct Slope {
    /// The design.
    pub design: String,
    /// What lies before the light.
    pub blockers: &'static str,
    /// The root of the mean squared error by numbers of samples.
    pub errors: Vec<(u32, f64)>,
    /// How fast it falls: p, where it is about `a·N^−p`, and its interval.
    pub exponent: Estimate,
}

/// A scene seen from its light.
#[derive(Debug, Serialize)]
pub struct LightView {
    /// The scene.
    pub name: &'static str,
    /// How many fragments ask.
    pub queries: usize,
    /// The mean of the true visibilities.
    pub truth: f64,
    /// Of those who ask, the share to whom masks' answer at 8 samples is worse after correction,
    /// of those to whom it is not right before.
    pub worse: f64,
    /// Design by design, by samples and taps.
    pub rows: Vec<ShadowRow>,
}

/// What a design thinks of a light's visibility.
#[derive(Clone, Debug, Serialize)]
pub struct ShadowRow {
    /// The design.
    pub design: String,
    /// What kind it is of.
    pub family: Family,
    /// Samples of a pixel of the map.
    pub samples: u32,
    /// Pixels of the map that are looked up.
    pub taps: u32,
    /// State of a pixel of the map without colours, in bits.
    pub bits: u32,
    /// How many times the light's trace is read.
    pub passes: u32,
    /// The root of the mean squared error.
    pub rmse: Estimate,
    /// The mean error: above 0 where too much light is thought to come through.
    pub mean: Estimate,
    /// The root of the mean squared error in eighths of the depths that ask, from near to far.
    pub by_depth: [f64; PARTS],
}

/// Parts of the fragments that ask, by depth.
pub const PARTS: usize = 8;
/// Samples of the clouds of figure 3.
pub const CLOUDS: [u32; 4] = [8, 32, 256, 1024];
/// Samples over which the error's fall is fitted: a pixel has no more than the last.
pub const FITTED: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Designs whose error's fall is fitted.
pub const SLOPES: [&str; 4] = ["enderton:mask=naive", "enderton", "lk", "systematic"];
/// Samples of a map's pixel.
pub const SAMPLES: [u32; 3] = [1, 4, 8];
/// Taps, and the half width of the region that they lie in.
pub const TAPS: [(u32, f64); 2] = [(1, 0.0), (16, 2.0)];
/// Figure 5: coin tosses, masks, and these corrected.
pub const FIGURE_5: [&str; 3] =
    ["enderton:mask=naive", "enderton", "enderton:method=alpha-correction"];
/// All that is measured on the lights' views: figure 5's first.
pub const DESIGNS: [&str; 17] = [
    FIGURE_5[0],
    FIGURE_5[1],
    FIGURE_5[2],
    "lk",
    "systematic",
    "residual",
    "hashed-alpha",
    "merging:layers=4",
    "kbuffer:layers=4",
    "mlab:layers=4",
    "hybrid:layers=4",
    "adaptive:layers=4",
    "slab:layers=4,bits=8,normalise=none",
    "abuffer:layers=8",
    "mboit:moments=4",
    "mboit:moments=6",
    "mboit:moments=8",
];

/// The lights' views: a name, the scene, and from where the light comes.
const SCENES: [(&str, &str, [f64; 2]); 2] =
    [("hair", "builtin:hair", [20.0, 60.0]), ("smoke", "builtin:smoke", [30.0, 50.0])];
/// Fragments that ask, at most, of a view.
const QUERIES: u64 = 20_000;
/// Blockers of figure 3.
const BLOCKERS: u32 = 12;
/// Side of the frame whose pixels are estimates of figure 3, each with its own random numbers.
const SIDE: u32 = 16;
/// Depths at which they are looked at.
const DEPTHS: u32 = 65;

/// Measures all of it.
///
/// # Errors
/// As captures and replays of the built-in scenes.
pub fn shadows(lab: &Lab<'_>, effort: Effort) -> Result<Shadows> {
    let seeds = 2 * effort.seeds.max(1);
    let side = 2 * effort.comparison_side;
    let steps = (2 + SCENES.len() * DESIGNS.len()) as u64;
    (lab.watch)("clouds of visibility", 0, steps);
    let clouds = clouds()?;
    (lab.watch)("visibility by samples", 1, steps);
    let slopes = slopes()?;
    let mut scenes = Vec::new();
    for (i, (name, source, angle)) in SCENES.into_iter().enumerate() {
        let watch = |done: usize, design: &str| {
            let done = 2 + i * DESIGNS.len() + done;
            (lab.watch)(&format!("shadows of {name} by {design}"), done as u64, steps);
        };
        scenes.push(light_view(name, source, angle, (side, seeds), &watch)?);
    }
    Ok(Shadows { effort, clouds, slopes, seeds, side, scenes })
}

fn map(design: &str, trace: &Trace, samples: u32, seed: u32) -> Result<VisibilityMap> {
    configure(design, &[])?.visibility_map(trace, samples, seed, &options())
}

/// Depths from 0 to 1 as the trace has them.
fn unorm(depth: f64) -> Unorm32 {
    Unorm32((depth * f64::from(u32::MAX)) as u32)
}

/// A trace of layers over a small frame.
fn blockers(layers: &[(f64, f64)]) -> Result<Trace> {
    let layers = layers.iter().map(|(depth, alpha)| (unorm(*depth), [0.0; 3], *alpha as f32));
    layers_at(SIDE, pattern(PatternKind::Auto, 64)?, [0.0; 3], layers)
}

/// Depths and opacities drawn at random.
fn random_blockers() -> Vec<(f64, f64)> {
    let mut random = Stream::new([0x5ad0]);
    let mut one = || (f64::from(random.range(0.1, 0.95)), f64::from(random.range(0.05, 0.4)));
    (0..BLOCKERS).map(|_| one()).collect()
}

/// Π (1 − α) over what lies nearer.
fn truth(blockers: &[(f64, f64)], depth: f64) -> f64 {
    let nearer = blockers.iter().filter(|(z, _)| *z < depth);
    nearer.map(|(_, alpha)| 1.0 - f64::from(*alpha as f32)).product()
}

/// Where visibility is asked for.
fn depths() -> Vec<f64> {
    (0..DEPTHS).map(|i| f64::from(i) / f64::from(DEPTHS - 1)).collect()
}

/// Estimates of `samples` samples each: curves over [`depths`], a pixel each. More samples than a
/// pixel has are the mean of several maps with other seeds.
fn estimates(design: &str, trace: &Trace, samples: u32) -> Result<Vec<Vec<f64>>> {
    let of_a_map = samples.min(64);
    let maps = (0..samples / of_a_map)
        .map(|round| map(design, trace, of_a_map, hash([samples, round])))
        .collect::<Result<Vec<_>>>()?;
    let curve = |pixel: u32| {
        let at = |depth: f64| {
            let z = unorm(depth);
            let of = |map: &VisibilityMap| map.pixel(pixel % SIDE, pixel / SIDE, z);
            maps.iter().map(of).sum::<f64>() / maps.len() as f64
        };
        depths().into_iter().map(at).collect()
    };
    Ok((0..SIDE * SIDE).map(curve).collect())
}

/// Over all estimates and depths: the root of the mean squared error, and the mean error.
fn errors(estimates: &[Vec<f64>], truth: &[f64]) -> [f64; 2] {
    let count = (estimates.len() * truth.len()) as f64;
    let all = estimates.iter().flat_map(|curve| curve.iter().zip(truth).map(|(v, t)| v - t));
    let (squares, sum) = all.fold((0.0, 0.0), |(squares, sum), e| (squares + e * e, sum + e));
    [(squares / count).sqrt(), sum / count]
}

fn clouds() -> Result<Clouds> {
    let blockers = random_blockers();
    let trace = self::blockers(&blockers)?;
    let depths = depths();
    let truth: Vec<f64> = depths.iter().map(|z| truth(&blockers, *z)).collect();
    let mut two = None;
    let mut clouds = Vec::new();
    for samples in CLOUDS {
        let estimates = estimates("enderton", &trace, samples)?;
        two.get_or_insert_with(|| [estimates[0].clone(), estimates[1].clone()]);
        let between = |i: usize| {
            let mut values: Vec<f64> = estimates.iter().map(|curve| curve[i]).collect();
            values.sort_by(f64::total_cmp);
            [5, 95].map(|percent| values[(values.len() - 1) * percent / 100])
        };
        let [rmse, mean] = errors(&estimates, &truth);
        clouds.push(Cloud {
            samples,
            estimates: estimates.len(),
            between: (0..depths.len()).map(between).collect(),
            rmse,
            mean,
        });
    }
    Ok(Clouds { blockers, depths, truth, two: two.unwrap_or_default(), clouds })
}

/// Random blockers, one that takes half of the light, and many thin ones.
fn slopes() -> Result<Vec<Slope>> {
    let thin = (0..48).map(|i| (0.1 + f64::from(i) / 60.0, 1.0 / 64.0)).collect();
    let sets: [(&str, Vec<(f64, f64)>); 3] =
        [("random", random_blockers()), ("one of 0.3", vec![(0.5, 0.3)]), ("48 of 1/64", thin)];
    let mut slopes = Vec::new();
    for (name, layers) in sets {
        let trace = blockers(&layers)?;
        let truth: Vec<f64> = depths().iter().map(|z| truth(&layers, *z)).collect();
        for design in SLOPES {
            let error = |samples: u32| {
                Ok((samples, errors(&estimates(design, &trace, samples)?, &truth)[0]))
            };
            let errors = FITTED.into_iter().map(error).collect::<Result<Vec<_>>>()?;
            let points: Vec<(f64, Estimate)> =
                errors.iter().map(|(n, e)| (f64::from(*n), Estimate::exactly(*e))).collect();
            let Some(fit) = Convergence::fit(&points) else { continue };
            let (design, exponent) = (design.to_string(), fit.exponent);
            slopes.push(Slope { design, blockers: name, errors, exponent });
        }
    }
    Ok(slopes)
}

/// Who asks: fragments of the light's own view.
fn receivers(trace: &Trace) -> Result<Vec<Receiver>> {
    let every = (trace.rows() / QUERIES).max(1);
    let mut list = Vec::new();
    let mut row = 0;
    for batch in trace.batches() {
        for f in batch?.iter() {
            row += 1;
            if row % every == 0 {
                let slopes = [f.depth.dzdx, f.depth.dzdy].map(i32::unsigned_abs);
                list.push(Receiver {
                    at: [f.x, f.y].map(|p| f32::from(p) + 0.5),
                    z: f.depth.z,
                    slope: slopes[0].max(slopes[1]),
                    key: [u32::from(f.x) | u32::from(f.y) << 16, f.primitive],
                });
            }
        }
    }
    // By depth, so that parts of the list are parts of it.
    list.sort_by_key(|r| (r.z, r.key));
    Ok(list)
}

fn light_view(
    name: &'static str,
    source: &str,
    angle: [f64; 2],
    (side, seeds): (u32, u32),
    watch: &dyn Fn(usize, &str),
) -> Result<LightView> {
    let camera =
        CameraOptions { angle: Some(angle), field_of_view: Some(0.0), ..CameraOptions::default() };
    let options = CaptureOptions { width: side, height: side, camera, ..CaptureOptions::default() };
    let trace = capture(source, &options, false)?;
    let receivers = receivers(&trace)?;
    let filters = TAPS.map(|(taps, radius)| {
        // A surface's pixels that are looked up lie so far from its own.
        Filter { taps, radius, slope_bias: radius + 0.5, ..Filter::default() }
    });
    let asked = |map: &VisibilityMap, filter: &Filter| -> Vec<f64> {
        receivers.par_iter().map(|r| filter.visibility(map, r)).collect()
    };
    // By samples, then by filter.
    let mut truths = Vec::new();
    for samples in SAMPLES {
        let exact = map(REFERENCE, &trace, samples, 0)?;
        truths.push(filters.each_ref().map(|filter| asked(&exact, filter)));
    }
    let mut rows = Vec::new();
    for (done, spec) in DESIGNS.into_iter().enumerate() {
        watch(done, spec);
        let design = configure(spec, &[])?;
        let seeds = if design.promises().seeded { seeds } else { 1 };
        for (samples, truths) in SAMPLES.into_iter().zip(&truths) {
            let maps = (0..seeds)
                .map(|seed| map(spec, &trace, samples, seed))
                .collect::<Result<Vec<_>>>()?;
            for (filter, truth) in filters.iter().zip(truths) {
                let found: Vec<Parts> =
                    maps.iter().map(|map| Parts::of(&asked(map, filter), truth)).collect();
                let each = |of: &dyn Fn(&Parts) -> f64| {
                    Estimate::of(&found.iter().map(of).collect::<Vec<_>>())
                };
                rows.push(ShadowRow {
                    design: spec.to_string(),
                    family: design.info().family,
                    samples,
                    taps: filter.taps,
                    bits: maps[0].state_bits().total(),
                    passes: maps[0].passes(),
                    rmse: each(&|parts| parts.squares.iter().sum::<f64>()).sqrt(),
                    mean: each(&|parts| parts.mean),
                    by_depth: std::array::from_fn(|part| {
                        let of_part = each(&|parts| parts.squares[part]).value;
                        (of_part * PARTS as f64).sqrt()
                    }),
                });
            }
        }
    }
    let all = &truths[SAMPLES.len() - 1][0];
    let truth = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let [plain, corrected] = [FIGURE_5[1], FIGURE_5[2]].map(|spec| -> Result<Vec<f64>> {
        Ok(asked(&map(spec, &trace, SAMPLES[2], 0)?, &filters[0]))
    });
    let off = |answers: Vec<f64>| answers.into_iter().zip(all).map(|(v, t)| (v - t).abs());
    let pairs = off(plain?).zip(off(corrected?));
    // What is right but for rounding may be off by more of it.
    let (mut worse, mut asked) = (0_u32, 0_u32);
    for (before, after) in pairs.filter(|(before, _)| *before > 1e-6) {
        worse += u32::from(after > before + 1e-6);
        asked += 1;
    }
    let worse = f64::from(worse) / f64::from(asked.max(1));
    Ok(LightView { name, queries: receivers.len(), truth, worse, rows })
}

/// Errors of a map.
struct Parts {
    /// By parts of the depths, of the mean squared error over all.
    squares: [f64; PARTS],
    mean: f64,
}

impl Parts {
    fn of(found: &[f64], truth: &[f64]) -> Self {
        let count = found.len().max(1) as f64;
        let mut parts = Parts { squares: [0.0; PARTS], mean: 0.0 };
        for (i, (v, t)) in found.iter().zip(truth).enumerate() {
            parts.squares[i * PARTS / found.len()] += (v - t) * (v - t) / count;
            parts.mean += (v - t) / count;
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_of_blockers_is_what_the_exact_design_tells() {
        let layers = random_blockers();
        let trace = blockers(&layers).unwrap();
        let exact = estimates(REFERENCE, &trace, 8).unwrap();
        let truth: Vec<f64> = depths().iter().map(|z| self::truth(&layers, *z)).collect();
        let [rmse, mean] = errors(&exact, &truth);
        assert!(rmse < 1e-7 && mean.abs() < 1e-7, "{rmse} {mean}");
        assert_eq!(truth[0], 1.0);
        assert!(truth.is_sorted_by(|a, b| a >= b) && truth[64] < 0.3, "{truth:?}");
    }

    #[test]
    fn clouds_narrow_as_samples_grow() {
        let clouds = clouds().unwrap();
        let rmse: Vec<f64> = clouds.clouds.iter().map(|c| c.rmse).collect();
        assert!(rmse.windows(2).all(|pair| pair[1] < 0.7 * pair[0]), "{rmse:?}");
        // Without bias: 256 estimates at 65 depths that hang together; as if 256 numbers.
        let biased = |c: &&Cloud| c.mean.abs() > 5.0 * c.rmse / (c.estimates as f64).sqrt();
        assert!(clouds.clouds.iter().find(biased).is_none());
        let steps = clouds.two.iter().flatten().map(|v| v * 8.0);
        assert!(steps.into_iter().all(|v| v == v.floor()), "eighths");
    }

    #[test]
    fn coin_tosses_fall_as_the_root_and_masks_faster() {
        let slopes = slopes().unwrap();
        assert_eq!(slopes.len(), 3 * SLOPES.len());
        for slope in &slopes {
            let exponent = slope.exponent.value;
            if slope.design == SLOPES[0] {
                assert!((exponent - 0.5).abs() < 0.06, "{} {exponent}", slope.blockers);
            } else {
                assert!((0.45..1.2).contains(&exponent), "{} {exponent}", slope.design);
            }
        }
    }
}

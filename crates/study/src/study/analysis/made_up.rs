//! Results that nobody measured, for tests and for looking at pages.

use std::collections::BTreeMap;

use crate::metrics::{EnsembleErrors, Estimate, Temporal};
use crate::study::file::{SceneEntry, Study};
use crate::study::publications::experiment::MeasuredScene;
use crate::study::record::{
    Filtered, FlipOverSeeds, Promised, Record, SpectrumOverSeeds, Speed, VERSION,
};
use crate::study::results::{Machine, Missing, Results, SceneFacts};
use crate::study::throughput::Spread;
use screendoor_rop::{EventCounts, Promise, StateBits};
use screendoor_trace::trace::{AlphaStatistics, Distribution, Objects, Statistics};

/// Results with these errors: for each design one a scene, the same at all sample counts.
/// The first design is the baseline.
pub fn planted(scenes: &[&str], counts: &[u32], designs: &[(&str, &[Estimate])]) -> Results {
    let mut results = empty(scenes, counts, &designs.iter().map(|d| d.0).collect::<Vec<_>>());
    for (i, scene) in scenes.iter().enumerate() {
        for samples in counts {
            for (series, errors) in designs {
                results.records.push(record(scene, series, *samples, errors[i]));
            }
        }
    }
    results
}

fn empty(scenes: &[&str], counts: &[u32], designs: &[&str]) -> Results {
    let study = Study {
        name: "made up".into(),
        description: "Numbers that nobody measured.".into(),
        designs: designs.iter().map(|d| d.to_string()).collect(),
        samples: counts.to_vec(),
        seeds: 8,
        first_seed: 0,
        engines: vec![],
        timing: 3,
        metrics: vec![],
        filters: vec![],
        baseline: designs[0].to_string(),
        publications: vec![],
        pictures: vec![],
        memory: 512,
        scenes: scenes.iter().map(|name| entry(name)).collect(),
    };
    let scenes = scenes.iter().enumerate().map(|(i, name)| facts(name, i)).collect();
    let machine = Machine {
        screendoor: "0.1.0".into(),
        processor: "a processor".into(),
        threads: 16,
        memory: Some(64 << 30),
        system: "Linux, x86_64".into(),
        vectors: "avx2".into(),
        gpu: None,
    };
    Results { study, machine, scenes, records: vec![], missing: vec![] }
}

fn entry(name: &str) -> SceneEntry {
    let text = format!("name = '{name}'\nsource = 'builtin:{name}'");
    toml::from_str(&text).unwrap()
}

fn facts(name: &str, place: usize) -> SceneFacts {
    let fragments = 1_000_000 + 700_000 * place as u64;
    let statistics = Statistics {
        fragments,
        covered_pixels: 150_000,
        whole_fragments: fragments / 2,
        interior_pixels: 80_000,
        depth_complexity: Distribution {
            mean: fragments as f64 / 150_000.0,
            median: 6,
            p95: 19,
            max: 62,
            histogram: vec![10, 20, 30, 40, 20, 10],
        },
        layers: fragments as f64 / 200_000.0,
        tied_fragments: fragments / 50 * place as u64,
        alpha: AlphaStatistics {
            min: 0.1,
            mean: 0.37,
            max: 1.0,
            zero: 0,
            opaque: fragments / 10,
            histogram: [1; 10],
        },
        depth: Some([0.2, 0.8]),
        objects: Objects { count: 12, more: false, largest: vec![(0, fragments)] },
        primitives: 40_000,
    };
    SceneFacts {
        name: name.into(),
        trace: format!("traces/{name}.arrow"),
        content: format!("{:016x}", 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(place as u64 + 1)),
        size: [512, 512],
        samples: 64,
        source: format!("builtin:{name}"),
        camera: "angle 0, 0; distance 3; field of view 45".into(),
        view: None,
        space: Default::default(),
        warnings: Vec::new(),
        pixel: [256, 256],
        statistics,
        shadow: None,
    }
}

/// A scene of an experiment with records.
pub fn scene(name: &str, records: Vec<Record>) -> MeasuredScene {
    MeasuredScene { name: name.to_string(), statistics: facts(name, 0).statistics, records }
}

/// A record with an error and nothing else of note.
pub fn record(scene: &str, series: &str, samples: u32, rmse: Estimate) -> Record {
    let design = series.replace("{n}", &samples.to_string());
    let errors = EnsembleErrors {
        seeds: 8,
        pixels: 150_000,
        rmse,
        rmse_srgb: rmse.scaled(1.1),
        mean: Estimate { value: 0.001, low: -0.01, high: 0.012 },
        max: rmse.value * 8.0,
        variance: Some(rmse.value * rmse.value),
        bias_squared: Some(Estimate::exactly(0.0)),
        temporal: None,
    };
    Record {
        version: VERSION,
        id: format!("{scene}-{}-{samples}", design.replace([':', '=', ','], "_")),
        scene: scene.into(),
        trace: "0".into(),
        series: series.into(),
        design,
        family: "stochastic".into(),
        promises: Promised {
            unbiased: Promise::Always,
            consistent: Promise::Always,
            same_picture: true,
            same_expectation: Promise::Always,
            seeded: true,
        },
        samples,
        seeds: 8,
        fragments: 1_000_000,
        tied_fragments: 0,
        frame: errors.clone(),
        covered: errors.clone(),
        interior: errors.clone(),
        edges: errors,
        fine: rmse.scaled(1.3),
        filtered: vec![],
        blocks: None,
        post: vec![],
        flip: None,
        flip_hdr: None,
        spectrum: None,
        events: EventCounts { fragments: 1_000_000, ..EventCounts::default() },
        state_bits: StateBits { samples: 64 * samples, extra: 16, unbounded: false },
        layout: format!("{samples} × (32 depth + 32 colour) + 16 made up"),
        passes: 1,
        touched_tiles: 800,
        picture: "0".into(),
        speed: BTreeMap::new(),
    }
}

/// Name, family, error at one sample, exponent, extra bits, hashes a fragment, bias share.
type Habit = (&'static str, &'static str, f64, f64, u32, f64, f64);

const HABITS: [Habit; 25] = [
    ("enderton", "stochastic", 26.0, 0.5, 8, 1.0, 0.0),
    ("lk", "stochastic", 26.0, 0.62, 42, 6.0, 0.02),
    ("lk:track=covered", "stochastic", 25.5, 0.62, 48, 6.0, 0.0),
    ("lk:sort=false", "stochastic", 27.0, 0.56, 38, 6.0, 0.0),
    ("systematic", "stochastic", 25.0, 0.64, 42, 1.1, 0.0),
    ("systematic:mask=naive", "stochastic", 27.0, 0.5, 10, 1.0, 0.0),
    ("hashed-alpha", "stochastic", 30.0, 0.42, 0, 1.0, 0.5),
    ("alpha-to-coverage", "stochastic", 34.0, 0.2, 0, 0.0, 0.9),
    ("enderton:method=depth-based", "stochastic", 19.0, 0.5, 8, 2.0, 0.1),
    ("enderton:method=alpha-correction", "stochastic", 21.0, 0.5, 40, 2.0, 0.1),
    ("slab:layers={n},bits={2n}", "stochastic", 22.0, 0.6, 64, 1.5, 0.03),
    ("slab:layers={n},bits={2n},opacity=exact", "stochastic", 20.0, 0.6, 90, 1.5, 0.03),
    ("kbuffer:layers={n}", "layered", 22.0, 0.9, 64, 0.0, 1.0),
    ("mlab:layers={n}", "layered", 18.0, 1.1, 64, 0.0, 1.0),
    ("adaptive:layers={n}", "layered", 17.0, 1.05, 96, 0.0, 1.0),
    ("hybrid:layers={n}", "layered", 16.0, 0.8, 128, 0.0, 1.0),
    ("abuffer:layers={n}", "layered", 30.0, 1.3, 64, 0.0, 1.0),
    ("depth-peeling:layers={n}", "layered", 24.0, 1.2, 80, 0.0, 1.0),
    ("wboit", "blended", 9.0, 0.0, 80, 0.0, 1.0),
    ("wboit:weight=eq7", "blended", 11.0, 0.0, 80, 0.0, 1.0),
    ("wboit:weight=eq9", "blended", 10.0, 0.0, 80, 0.0, 1.0),
    ("mboit:moments=power4", "blended", 6.0, 0.0, 224, 0.0, 1.0),
    ("mboit:moments=trigonometric3", "blended", 4.8, 0.0, 352, 0.0, 1.0),
    ("blend", "blended", 14.0, 0.0, 0, 0.0, 1.0),
    ("exact", "reference", 0.0, 0.0, 0, 0.0, 0.0),
];

const SCENES: [&str; 9] =
    ["cycloidal", "drape", "cloth", "oak", "mohawk", "smoke", "guitar", "lamp", "neon"];

/// Plausible results of this size, with holes where a study has them: a scene that lacks,
/// a run that failed, designs without a GPU port.
pub fn plausible(scenes: usize, designs: usize, counts: &[u32]) -> Results {
    let names: Vec<&str> = HABITS.iter().take(designs).map(|h| h.0).collect();
    let mut results = empty(&SCENES[..scenes], counts, &names);
    if names.contains(&"lk") {
        results.study.baseline = "lk".into();
    }
    for (place, scene) in SCENES[..scenes].iter().enumerate() {
        for samples in counts {
            for habit in &HABITS[..designs] {
                let record = plausible_record(scene, place, *samples, habit);
                let gone = habit.0 == "hybrid:layers={n}" && place == 3 && *samples == 8
                    || habit.0 == "adaptive:layers={n}" && place == 7;
                if gone {
                    results.missing.push(Missing {
                        id: record.id,
                        scene: record.scene,
                        series: record.series,
                        samples: *samples,
                        why: (place == 7).then(|| "ran out of memory".into()),
                    });
                } else {
                    results.records.push(record);
                }
            }
        }
    }
    results
}

fn unit(words: [u32; 4]) -> f64 {
    f64::from(screendoor_trace::random::hash::<4>(words)) / 2_f64.powi(32)
}

fn plausible_record(scene: &str, place: usize, samples: u32, habit: &Habit) -> Record {
    let (name, family, at_one, exponent, extra, hashes, bias) = *habit;
    let salt = name.bytes().fold(7, |a, b| a * 31 % 65521 + u32::from(b));
    let scatter = |k: u32| unit([salt, place as u32, samples, k]) - 0.5;
    let hard = 0.5 + 1.3 * unit([3, place as u32, 0, 0]);
    let seeded = family == "stochastic" && name != "alpha-to-coverage";
    let n = f64::from(samples);
    let value = at_one * hard * n.powf(-exponent) * (1.0 + 0.12 * scatter(0));
    let by = if seeded { 1.0 + 0.01 * (1.5 + scatter(1)) } else { 1.0 };
    let rmse = Estimate { value, low: value / by, high: value * by };
    let mut r = record(scene, name, samples, rmse);
    r.design =
        name.replace("{n}", &samples.to_string()).replace("{2n}", &(2 * samples).to_string());
    r.id = format!("{scene}-{}-{samples}", r.design.replace([':', '=', ','], "_"));
    r.family = family.into();
    r.seeds = if seeded { 8 } else { 1 };
    let in_order = matches!(name, "mlab:layers={n}" | "adaptive:layers={n}" | "blend");
    r.promises = Promised {
        unbiased: Promise::always_if(bias == 0.0),
        consistent: Promise::always_if(exponent > 0.0),
        same_picture: !in_order && name != "lk:track=covered",
        same_expectation: Promise::always_if(!in_order),
        seeded,
    };
    let square = value * value;
    r.covered.variance = seeded.then_some(square * (1.0 - bias * bias));
    r.covered.bias_squared = seeded.then(|| {
        let value = square * bias * bias + 0.002 * square * scatter(2);
        Estimate { value, low: value - 0.003 * square, high: value + 0.003 * square }
    });
    r.covered.temporal = seeded.then_some(Temporal {
        deviation_median: value * 0.6,
        deviation_p95: value * 1.9,
        deviation_max: value * 5.0,
    });
    r.passes = match name {
        "depth-peeling:layers={n}" => samples,
        "mboit:moments=power4" | "mboit:moments=trigonometric3" => 2,
        "enderton:method=depth-based" => 3,
        _ => 1,
    };
    r.state_bits.extra = extra;
    r.state_bits.samples = if family == "blended" { 0 } else { 64 * samples };
    r.state_bits.unbounded = name == "exact";
    let f = 1e6;
    r.events.samples_tested = (n * f * 0.8) as u64;
    r.events.samples_passed = (n * f * 0.5) as u64;
    r.events.samples_written = (n * f * 0.2) as u64;
    r.events.hashes = (hashes * f * if hashes > 3.0 { n / 8.0 } else { 1.0 }) as u64;
    if name.starts_with("lk") {
        r.events.sorts_by_length[samples as usize] = 300_000;
    }
    r.events.surfaces = 300_000;
    r.events.state_bits_read = (f * (n * 32.0 + f64::from(extra))) as u64 * u64::from(r.passes);
    r.events.state_bits_written = (f * n * 14.0) as u64 * u64::from(r.passes);
    metrics(&mut r, rmse, &scatter);
    let time = 0.01 * (1.0 + n / 6.0 + f64::from(extra) / 60.0) * (1.0 + scatter(5));
    let spread = |s: f64| Some(Spread { low: 0.96 * s, median: s, high: 1.07 * s });
    let speed = |seconds| Speed { seconds, same_bits: Some(true), ..Speed::default() };
    r.speed.insert("fast".into(), speed(spread(time)));
    if seeded {
        r.speed.insert("gpu".into(), speed(spread(time / 6.0)));
    } else {
        let missing = Some("no port to GPUs".into());
        r.speed.insert("gpu".into(), Speed { missing, same_bits: None, ..speed(None) });
    }
    r
}

fn metrics(r: &mut Record, rmse: Estimate, scatter: &dyn Fn(u32) -> f64) {
    let seeded = r.promises.seeded;
    let white = if seeded { 1.0 } else { 3.0 };
    r.filtered = [0.0, 1.0, 2.0]
        .iter()
        .map(|sigma| {
            let left = if seeded { 1.0 / (1.0 + 2.6 * sigma) } else { 1.0 / (1.0 + 0.3 * sigma) };
            Filtered { sigma: *sigma, rmse: rmse.scaled(left * (1.0 + 0.2 * scatter(9) * sigma)) }
        })
        .collect();
    let flip = rmse.scaled(0.011 / white);
    let over = |e: Estimate| FlipOverSeeds {
        mean: e,
        quartiles: [e.scaled(0.5), e.scaled(0.9), e.scaled(1.4)],
    };
    r.flip = Some(over(flip));
    r.flip_hdr = Some(over(flip.scaled(1.6)));
    let frequency: Vec<f64> = (0..40).map(|i| (f64::from(i) + 0.5) / 80.0).collect();
    let tilt = if seeded { scatter(11) } else { -1.6 };
    let square = rmse.value * rmse.value;
    let power = frequency.iter().map(|f| square * (1.0 + f * 8.0).powf(tilt)).collect();
    let blue = 10.0 * tilt;
    let blueness =
        (square > 0.0).then_some(Estimate { value: blue, low: blue - 0.2, high: blue + 0.2 });
    r.spectrum = Some(SpectrumOverSeeds { frequency, power, blueness });
}

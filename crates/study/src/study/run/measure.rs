//! One run: a design at a sample count on a scene, over all seeds.

use std::collections::BTreeMap;
use std::time::Instant;

use rayon::prelude::*;

use crate::metrics::{
    Ensemble, EnsembleErrors, Estimate, FlipFigures, Spectrum, errors, filtered_rmse,
};
use crate::study::engine::{Engine, EngineName, OnGpu};
use crate::study::file::{Metric, Study};
use crate::study::record::{Filtered, FlipOverSeeds, Record, SpectrumOverSeeds, Speed};
use crate::study::run::scene::{OpenScene, Reference, Watch};
use crate::study::run::tasks::Job;
use crate::study::throughput::Spread;
use screendoor_designs::Configured;
use screendoor_rop::{EventCounts, ReplayOptions, Replayed, StateBits, Which};
use screendoor_trace::error::Result;
use screendoor_trace::param::Options;
use screendoor_trace::picture::Picture;

/// Standard deviations of the Gaussians that stand for a viewer further away, in pixels.
pub const SIGMAS: [f64; 2] = [1.0, 2.0];

/// The engines of a study; why one could not be made ready.
pub(super) type Engines = Vec<(EngineName, std::result::Result<Engine, String>)>;

/// Measures a run. Returns its record and the picture of the first seed.
///
/// # Errors
/// As [`Engine::replay`] of the study's first engine; where that is not ready.
pub(super) fn measure(
    study: &Study,
    engines: &Engines,
    scene: &OpenScene,
    reference: &Reference,
    job: &Job,
    watch: Watch<'_>,
) -> Result<(Record, Picture), String> {
    let design = study.design(&job.series, job.samples).map_err(|e| e.to_string())?;
    let Some((_, first)) = engines.first() else { return Err("there is no engine".to_string()) };
    let first = first.as_ref().map_err(Clone::clone)?;
    let run = Run { study, first, scene, reference, design: &design };
    let promises = design.promises();
    let seeds = if promises.seeded { study.seeds } else { 1 };
    watch(&format!("{} at {} on {}", design.label(), job.samples, scene.facts.name));
    let (seen, first, counted) = run.over(seeds).map_err(|e| e.to_string())?;
    let picture = first.hash();
    let [frame, covered, interior, edges] = seen.ensemble;
    let record = Record {
        id: job.id.clone(),
        scene: scene.facts.name.clone(),
        trace: scene.facts.content.clone(),
        series: job.series.clone(),
        design: design.label(),
        family: design.info().family.name().to_string(),
        promises: promises.into(),
        samples: job.samples,
        seeds,
        fragments: reference.fragments,
        tied_fragments: reference.tied_fragments,
        frame,
        covered,
        interior,
        edges,
        fine: seen.fine,
        filtered: seen.filtered,
        flip: seen.flip,
        flip_hdr: seen.flip_hdr,
        spectrum: seen.spectrum,
        events: counted.events,
        state_bits: counted.state_bits,
        layout: counted.layout,
        passes: counted.passes,
        touched_tiles: counted.touched_tiles as u64,
        speed: run.speed(engines, &picture),
        picture,
    };
    // What is not finite would be lost in the file, and no later run would know why.
    let text = serde_json::to_string(&record).map_err(|e| e.to_string())?;
    if serde_json::from_str::<Record>(&text).is_err() {
        let pixels = first.not_finite();
        return Err(format!("its errors are not finite; {pixels} pixels of its picture are not"));
    }
    Ok((record, first))
}

struct Run<'a> {
    study: &'a Study,
    first: &'a Engine,
    scene: &'a OpenScene,
    reference: &'a Reference,
    design: &'a Configured,
}

/// What a replay tells beside its picture.
struct Counted {
    events: EventCounts,
    state_bits: StateBits,
    layout: String,
    passes: u32,
    touched_tiles: usize,
}

impl Counted {
    /// `None` where no events were counted.
    fn of(replayed: &Replayed) -> Option<Self> {
        Some(Counted {
            events: replayed.events.clone()?,
            state_bits: replayed.state_bits,
            layout: replayed.layout.to_string(),
            passes: replayed.passes,
            touched_tiles: replayed.touched_tiles,
        })
    }
}

/// What is seen of one seed's picture.
struct Seen {
    fine_square: f64,
    filtered_squares: Vec<f64>,
    flip: Option<FlipFigures>,
    flip_hdr: Option<FlipFigures>,
    spectrum: Option<Spectrum>,
}

/// What is seen of all.
struct SeenOverSeeds {
    ensemble: [EnsembleErrors; 4],
    fine: Estimate,
    filtered: Vec<Filtered>,
    flip: Option<FlipOverSeeds>,
    flip_hdr: Option<FlipOverSeeds>,
    spectrum: Option<SpectrumOverSeeds>,
}

impl Run<'_> {
    fn replay(&self, engine: &Engine, seed: u32, count: bool) -> Result<(Replayed, Option<OnGpu>)> {
        let options = ReplayOptions { count_events: count, ..self.study.replay_options() };
        let seed = self.study.first_seed + seed;
        engine.replay(self.design, &self.scene.trace, self.reference.samples, seed, &options)
    }

    /// The first seed's picture, and what was counted. GPUs count nothing: the processor's
    /// fast engine does, and draws the same.
    fn first(&self) -> Result<(Picture, Counted)> {
        let first = self.replay(self.first, 0, true)?.0;
        match Counted::of(&first) {
            Some(counted) => Ok((first.picture, counted)),
            None => {
                let again = self.replay(&Engine::Cpu(Which::Fast), 0, true)?.0;
                Ok((first.picture, Counted::of(&again).expect("it was asked to count")))
            }
        }
    }

    /// Replays all seeds; a batch's pictures are looked at side by side.
    fn over(&self, seeds: u32) -> Result<(SeenOverSeeds, Picture, Counted)> {
        let reference = self.reference;
        let classes = &reference.classes;
        let regions = [&reference.frame, &classes.covered, &classes.interior, &classes.edges];
        let mut ensemble = Ensemble::new(&reference.picture, &regions);
        let (first, counted) = self.first()?;
        let mut seen = Vec::new();
        let batch = rayon::current_num_threads().max(1);
        let all: Vec<u32> = (0..seeds).collect();
        for batch in all.chunks(batch) {
            let picture = |seed: &u32| match seed {
                0 => Ok(first.clone()),
                _ => Ok(self.replay(self.first, *seed, false)?.0.picture),
            };
            let pictures = batch.iter().map(picture).collect::<Result<Vec<_>>>()?;
            pictures.iter().for_each(|picture| ensemble.add(picture));
            seen.par_extend(pictures.par_iter().map(|picture| self.see(picture)));
        }
        let ensemble = ensemble.finish().try_into().expect("one for each region");
        Ok((together(ensemble, &seen), first, counted))
    }

    fn see(&self, picture: &Picture) -> Seen {
        let reference = self.reference;
        let takes = |metric| self.study.takes(metric);
        let fine = errors(picture, &self.scene.fine, &self.scene.fine_covered).rmse;
        let filtered = |sigma: &f64| {
            filtered_rmse(picture, &reference.picture, *sigma, &reference.classes.covered).powi(2)
        };
        let sigmas: &[f64] = if takes(Metric::Filtered) { &SIGMAS } else { &[] };
        let flip = |metric| reference.flip.as_ref().filter(|_| takes(metric));
        Seen {
            fine_square: fine * fine,
            filtered_squares: sigmas.iter().map(filtered).collect(),
            flip: flip(Metric::Flip).map(|f| f.ldr(picture).figures()),
            flip_hdr: flip(Metric::FlipHdr).map(|f| f.hdr(picture).figures()),
            spectrum: takes(Metric::Spectrum).then(|| Spectrum::of(picture, &reference.picture)),
        }
    }

    /// Times every engine, one after the other in each round, so that what is compared is
    /// measured at about the same time.
    fn speed(&self, engines: &Engines, expected: &str) -> BTreeMap<String, Speed> {
        if self.study.timing == 0 {
            return BTreeMap::new();
        }
        let mut timed: Vec<Timed> = engines.iter().map(|(name, _)| Timed::new(*name)).collect();
        for round in 0..=self.study.timing {
            for (timed, (_, engine)) in timed.iter_mut().zip(engines) {
                if timed.missing.is_some() {
                    continue;
                }
                let replayed = match engine {
                    Err(why) => Err(why.clone()),
                    Ok(engine) => self.time(engine, timed, expected, round == 0),
                };
                timed.missing = replayed.err();
            }
        }
        timed.into_iter().map(|t| (t.name.name().to_string(), t.finish())).collect()
    }

    fn time(
        &self,
        engine: &Engine,
        timed: &mut Timed,
        expected: &str,
        is_warming_up: bool,
    ) -> Result<(), String> {
        if matches!(engine, Engine::Gpu(..)) && !self.design.is_ported() {
            return Err("no port to GPUs".to_string());
        }
        let start = Instant::now();
        let replayed = self.replay(engine, 0, false);
        let seconds = start.elapsed().as_secs_f64();
        let (replayed, gpu) = replayed.map_err(|e| e.to_string())?;
        if is_warming_up {
            timed.same_bits = Some(replayed.picture.hash() == expected);
            return Ok(());
        }
        timed.seconds.push(seconds);
        let drawn = gpu.and_then(|g| g.seconds.device?.get("draw").copied());
        timed.kernel.extend(drawn);
        Ok(())
    }
}

/// An engine while it is timed.
struct Timed {
    name: EngineName,
    missing: Option<String>,
    same_bits: Option<bool>,
    seconds: Vec<f64>,
    kernel: Vec<f64>,
}

impl Timed {
    fn new(name: EngineName) -> Self {
        Timed { name, missing: None, same_bits: None, seconds: Vec::new(), kernel: Vec::new() }
    }

    fn finish(self) -> Speed {
        let known = |list: &[f64]| Spread::of(list).filter(|_| self.missing.is_none());
        Speed {
            seconds: known(&self.seconds),
            kernel: known(&self.kernel),
            same_bits: self.same_bits,
            missing: self.missing,
        }
    }
}

fn together(ensemble: [EnsembleErrors; 4], seen: &[Seen]) -> SeenOverSeeds {
    let over = |of: &dyn Fn(&Seen) -> f64| Estimate::of(&seen.iter().map(of).collect::<Vec<_>>());
    let sigmas = seen.first().map_or(0, |s| s.filtered_squares.len());
    let filtered = SIGMAS[..sigmas].iter().enumerate().map(|(i, sigma)| Filtered {
        sigma: *sigma,
        rmse: over(&|s| s.filtered_squares[i]).sqrt(),
    });
    SeenOverSeeds {
        ensemble,
        fine: over(&|s| s.fine_square).sqrt(),
        filtered: filtered.collect(),
        flip: flip(seen, |s| s.flip),
        flip_hdr: flip(seen, |s| s.flip_hdr),
        spectrum: spectrum(seen),
    }
}

fn flip(seen: &[Seen], of: impl Fn(&Seen) -> Option<FlipFigures>) -> Option<FlipOverSeeds> {
    let all: Vec<FlipFigures> = seen.iter().map(of).collect::<Option<_>>()?;
    let over = |value: &dyn Fn(&FlipFigures) -> f64| {
        Estimate::of(&all.iter().map(value).collect::<Vec<_>>())
    };
    Some(FlipOverSeeds {
        mean: over(&|f| f.mean),
        quartiles: [0, 1, 2].map(|i| over(&|f| f.quartiles[i])),
    })
}

fn spectrum(seen: &[Seen]) -> Option<SpectrumOverSeeds> {
    let all: Vec<Spectrum> = seen.iter().map(|s| s.spectrum.clone()).collect::<Option<_>>()?;
    let mean = Spectrum::mean(&all)?;
    let blueness: Option<Vec<f64>> = all.iter().map(Spectrum::blueness).collect();
    Some(SpectrumOverSeeds {
        frequency: mean.frequency,
        power: mean.power,
        blueness: blueness.map(|b| Estimate::of(&b)),
    })
}

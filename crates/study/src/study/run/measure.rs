//! One run of a study: its record, and how fast engines replay it.

use std::collections::BTreeMap;

use crate::study::engine::{Engine, EngineName};
use crate::study::file::Study;
use crate::study::measure::{Reference, Setup, Subject, Timed, measure, replays};
use crate::study::record::{Record, Speed};
use crate::study::run::scene::Watch;
use crate::study::run::tasks::Job;
use crate::study::throughput::Spread;
use screendoor_designs::Configured;
use screendoor_rop::ReplayOptions;
use screendoor_trace::picture::Picture;

/// The engines of a study; why one could not be made ready.
pub(super) type Engines = Vec<(EngineName, std::result::Result<Engine, String>)>;

/// Measures a run. Returns its record and the picture of the first seed.
///
/// # Errors
/// As [`Engine::replay`] of the study's first engine; where that is not ready.
pub(super) fn measure_job(
    study: &Study,
    engines: &Engines,
    subject: &Subject,
    reference: &Reference,
    job: &Job,
    watch: Watch<'_>,
) -> Result<(Record, Picture), String> {
    let design = study.design(&job.series, job.samples).map_err(|e| e.to_string())?;
    let Some((_, first)) = engines.first() else { return Err("there is no engine".to_string()) };
    let engine = first.as_ref().map_err(Clone::clone)?;
    watch(&format!("{} at {} on {}", design.label(), job.samples, subject.name));
    let seeds = study.first_seed..study.first_seed + study.seeds;
    let setup = Setup { engine, seeds, metrics: &study.metrics };
    let measured = measure(subject, reference, &design, &setup).map_err(|e| e.to_string())?;
    let timing = Timing { study, subject, samples: job.samples, design: &design };
    let record = Record {
        id: job.id.clone(),
        series: job.series.clone(),
        speed: timing.speed(engines, measured.timed, &measured.record.picture),
        ..measured.record
    };
    // What is not finite would be lost in the file, and no later run would know why.
    let text = serde_json::to_string(&record).map_err(|e| e.to_string())?;
    if serde_json::from_str::<Record>(&text).is_err() {
        let pixels = measured.picture.not_finite();
        return Err(format!("its errors are not finite; {pixels} pixels of its picture are not"));
    }
    Ok((record, measured.picture))
}

/// What is timed.
struct Timing<'a> {
    study: &'a Study,
    subject: &'a Subject,
    samples: u32,
    design: &'a Configured,
}

impl Timing<'_> {
    /// Times every engine until there are as many replays as the study asks for. The first
    /// engine begins with those of the seeds, which are replays like any other; the others with
    /// one that is not timed. What is left is done one engine after the other in each round, so
    /// that what is compared is measured at about the same time.
    fn speed(&self, engines: &Engines, of_seeds: Timed, expected: &str) -> BTreeMap<String, Speed> {
        if self.study.timing == 0 {
            return BTreeMap::new();
        }
        let mut list: Vec<OfEngine> =
            engines.iter().map(|(name, _)| OfEngine::new(*name)).collect();
        if let Some(first) = list.first_mut() {
            // Errors are of its picture.
            (first.timed, first.same_bits) = (of_seeds, Some(true));
        }
        for _ in 0..=self.study.timing {
            for (of_engine, (_, engine)) in list.iter_mut().zip(engines) {
                if of_engine.missing.is_some() || of_engine.is_done(self.study.timing) {
                    continue;
                }
                let replayed = match engine {
                    Err(why) => Err(why.clone()),
                    Ok(engine) => self.time(engine, of_engine, expected),
                };
                of_engine.missing = replayed.err();
            }
        }
        list.into_iter().map(|one| (one.name.name().to_string(), one.finish())).collect()
    }

    fn time(
        &self,
        engine: &Engine,
        of_engine: &mut OfEngine,
        expected: &str,
    ) -> Result<(), String> {
        if matches!(engine, Engine::Gpu(..)) && !self.design.is_ported() {
            return Err("no port to GPUs".to_string());
        }
        let options = ReplayOptions { memory: self.study.memory << 20, ..ReplayOptions::default() };
        let (trace, seed) = (&self.subject.trace, self.study.first_seed);
        let mut replay = replays(engine, self.design, trace, self.samples, [seed], options);
        let replay = replay.next().expect("there is one seed").map_err(|e| e.to_string())?;
        if of_engine.same_bits.is_none() {
            of_engine.same_bits = Some(replay.replayed.picture.hash() == expected);
        } else {
            of_engine.timed.add(&replay);
        }
        Ok(())
    }
}

/// An engine while it is timed.
struct OfEngine {
    name: EngineName,
    missing: Option<String>,
    /// Not known before the replay that is not timed.
    same_bits: Option<bool>,
    timed: Timed,
}

impl OfEngine {
    fn new(name: EngineName) -> Self {
        OfEngine { name, missing: None, same_bits: None, timed: Timed::default() }
    }

    fn is_done(&self, timing: u32) -> bool {
        self.same_bits.is_some() && self.timed.seconds.len() >= timing as usize
    }

    fn finish(self) -> Speed {
        let is_known = self.missing.is_none();
        let known = |list: &[f64]| Spread::of(list).filter(|_| is_known);
        Speed {
            seconds: known(&self.timed.seconds),
            kernel: known(&self.timed.kernel),
            threads: is_known.then(|| rayon::current_num_threads() as u32),
            same_bits: self.same_bits,
            missing: self.missing,
        }
    }
}

//! One run of a study: its record, and how fast engines replay it.

use std::collections::BTreeMap;
use std::time::Instant;

use crate::study::engine::{Engine, EngineName};
use crate::study::file::Study;
use crate::study::measure::{Reference, Setup, Subject, measure};
use crate::study::record::{Record, Speed};
use crate::study::run::scene::Watch;
use crate::study::run::tasks::Job;
use crate::study::throughput::Spread;
use screendoor_designs::Configured;
use screendoor_rop::ReplayOptions;
use screendoor_trace::error::Result;
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
    let timed = Timing { study, subject, samples: job.samples, design: &design };
    let record = Record {
        id: job.id.clone(),
        series: job.series.clone(),
        speed: timed.speed(engines, &measured.record.picture),
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
        let options = ReplayOptions { memory: self.study.memory << 20, ..ReplayOptions::default() };
        let (trace, seed) = (&self.subject.trace, self.study.first_seed);
        let start = Instant::now();
        let replayed = engine.replay(self.design, trace, self.samples, seed, &options);
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

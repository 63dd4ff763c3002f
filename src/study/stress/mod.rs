//! Hard cases: what designs and engines make of them, against the truth.

mod case;
mod cases;
mod child;
mod claims;
mod correlation;
mod faults;
mod judge;
mod truth;
mod unfit;

use rayon::prelude::*;
use serde::Serialize;

pub use case::{Case, Facts, Group};
pub use cases::cases;
pub use judge::{Outcome, SIGNIFICANCE};

use crate::design::{Configured, DESIGNS, configure};
use crate::error::Result;
use crate::gpu::{Gpu, GpuOptions, TOLERANCE};
use crate::param::Options;
use crate::picture::Picture;
use crate::rop::{ReplayOptions, Which};
use crate::study::stress::judge::Judge;
use crate::trace::Trace;

/// Designs beside the defaults: those that hard cases are hard for.
const EXTREMES: [&str; 10] = [
    "lk:track=covered",
    "lk:depth-bits=24",
    "lk:depth-bits=16",
    "lk:surfaces=object",
    "slab:layers=1",
    "kbuffer:layers=1",
    "mlab:layers=1",
    "depth-peeling:ties=kept",
    "wboit:weight=eq10",
    "mboit:moments=8",
];

/// What is tried.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// A GPU, for the designs that have a port to it.
    pub gpu: Option<&'a Gpu>,
    /// Seeds of each design that has any; at least 2.
    pub seeds: u32,
    /// Is told what is measured, how many of how many.
    pub progress: &'a (dyn Fn(&str, u64, u64) + Sync),
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Stability {
    /// Seeds of each design that has any.
    pub seeds: u32,
    /// The cases.
    pub cases: Vec<Facts>,
    /// The designs.
    pub series: Vec<Series>,
    /// Engines that were tried on this machine.
    pub engines: Vec<String>,
    /// What was found, case by case, and of each design by design.
    pub findings: Vec<Finding>,
}

/// A design of the suite.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// Its name with its settings.
    pub name: String,
    /// Whether its mean is promised to be the truth.
    pub unbiased: bool,
    /// Whether it is random.
    pub seeded: bool,
}

/// What a design makes of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// The case.
    pub case: String,
    /// The design.
    pub design: String,
    /// How close it comes.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// What each engine beside the plain text gave.
    pub engines: Vec<Agreement>,
    /// What a design or engine promised and did not keep.
    pub broken: Option<String>,
}

/// An engine's picture beside the plain text's.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// Its name.
    pub engine: String,
    /// The largest difference, as a share of one plus the value; 0 for the same bits. None
    /// where the engine refuses.
    pub difference: Option<f64>,
    /// Why it refuses.
    pub refused: Option<String>,
}

impl Stability {
    /// What was promised and not kept.
    pub fn broken(&self) -> impl Iterator<Item = (&Finding, &str)> {
        self.findings.iter().filter_map(|f| Some((f, f.broken.as_deref()?)))
    }

    /// What a design makes of a case.
    pub fn finding(&self, case: &str, design: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.case == case && f.design == design)
    }
}

/// Tries every design on every case with every engine.
///
/// # Errors
/// Where a case makes no trace or a design's name is unknown; what a design refuses is a
/// finding.
pub fn stress(plan: &Plan<'_>) -> Result<Stability> {
    let designs = designs()?;
    let cases = cases();
    let seeded = designs.iter().filter(|d| d.promises().seeded).count();
    let tests = seeded * 3 * cases.iter().map(|c| c.kinds.len()).sum::<usize>();
    let engines = engines(plan);
    let total = cases.len() as u64;
    let mut findings = Vec::new();
    for (i, case) in cases.iter().enumerate() {
        (plan.progress)(&case.name, i as u64, total);
        let trial = Trial { case, trace: case.trace()?, judge: Judge::new(case, tests)?, plan };
        let found: Vec<Finding> = designs.par_iter().map(|design| trial.finding(design)).collect();
        findings.extend(found);
        // One after the other: there is one device.
        for (finding, design) in findings.iter_mut().rev().zip(designs.iter().rev()) {
            trial.on_gpu(design, finding);
        }
    }
    (plan.progress)("hard cases", total, total);
    Ok(Stability {
        seeds: plan.seeds,
        cases: cases.iter().map(Case::facts).collect(),
        series: designs.iter().map(series).collect(),
        engines,
        findings,
    })
}

fn designs() -> Result<Vec<Configured>> {
    let defaults = DESIGNS.iter().map(|entry| entry.configure(&[]));
    defaults.chain(EXTREMES.iter().map(|spec| configure(spec, &[]))).collect()
}

fn series(design: &Configured) -> Series {
    let promises = design.promises();
    Series { name: design.label(), unbiased: promises.unbiased, seeded: promises.seeded }
}

/// Engines of the processor that are held against the plain text.
fn others() -> impl Iterator<Item = (Which, &'static str)> {
    let all = Which::ALL.iter().zip(Which::CHOICES).map(|(which, choice)| (*which, choice.name));
    all.filter(|(which, _)| *which != Which::Reference && which.level().is_ok())
}

fn engines(plan: &Plan<'_>) -> Vec<String> {
    let gpu = plan.gpu.map(|gpu| gpu.adapter().to_string());
    let plain = Which::CHOICES[Which::Reference as usize].name.to_string();
    [plain].into_iter().chain(others().map(|(_, name)| name.to_string())).chain(gpu).collect()
}

/// A case that designs are tried on.
struct Trial<'a> {
    case: &'a Case,
    trace: Trace,
    judge: Judge<'a>,
    plan: &'a Plan<'a>,
}

impl Trial<'_> {
    fn finding(&self, design: &Configured) -> Finding {
        let plain = self.picture(design, Which::Reference, 0);
        let mut finding = Finding {
            case: self.case.name.clone(),
            design: design.label(),
            outcome: self.outcome(design, &plain),
            engines: Vec::new(),
            broken: None,
        };
        for (which, name) in others() {
            // What draws on this machine, and with small cases all that can.
            if which == Which::Fast || self.case.is_light() {
                finding.engines.push(agreement(name, &plain, self.picture(design, which, 0)));
            }
        }
        finding.broken = broken(design, &finding);
        finding
    }

    fn picture(&self, design: &Configured, engine: Which, seed: u32) -> Result<Picture> {
        let options = ReplayOptions { engine, ..ReplayOptions::default() };
        Ok(design.replay(&self.trace, self.case.samples, seed, &options)?.picture)
    }

    fn outcome(&self, design: &Configured, first: &Result<Picture>) -> Outcome {
        let refused = |e: &crate::error::Error| Outcome::Refused { message: e.to_string() };
        let first = match first {
            Ok(picture) => picture.clone(),
            Err(e) => return refused(e),
        };
        let seeds = match design.promises().seeded {
            true if self.case.is_light() => self.plan.seeds,
            true => self.plan.seeds.min(8),
            false => 1,
        };
        let rest = (1..seeds).map(|seed| self.picture(design, Which::Fast, seed));
        match std::iter::once(Ok(first)).chain(rest).collect::<Result<Vec<_>>>() {
            Ok(pictures) => self.judge.outcome(&pictures),
            Err(e) => refused(&e),
        }
    }

    fn on_gpu(&self, design: &Configured, finding: &mut Finding) {
        let Some(gpu) = self.plan.gpu.filter(|_| design.is_ported()) else { return };
        let options = GpuOptions::default();
        let replayed = design.replay_on(gpu, &self.trace, self.case.samples, 0, &options);
        let plain = self.picture(design, Which::Reference, 0);
        let found = agreement("gpu", &plain, replayed.map(|(r, ..)| r.picture));
        finding.engines.push(found);
        finding.broken = broken(design, finding);
    }
}

/// How far an engine's picture is from the plain text's. Pixels that are not finite in both
/// agree.
fn agreement(engine: &str, plain: &Result<Picture>, other: Result<Picture>) -> Agreement {
    let engine = engine.to_string();
    match (plain, other) {
        (Ok(plain), Ok(other)) => {
            Agreement { engine, difference: Some(difference(plain, &other)), refused: None }
        }
        (_, Err(e)) => Agreement { engine, difference: None, refused: Some(e.to_string()) },
        (Err(_), Ok(_)) => Agreement { engine, difference: Some(f64::INFINITY), refused: None },
    }
}

fn difference(a: &Picture, b: &Picture) -> f64 {
    let mut most = 0.0_f64;
    for tile in a.tiles_with(b) {
        let background =
            |p: &Picture, within: usize| p.tile(tile).map_or(p.background(), |t| t[within]);
        for within in 0..crate::tile::TILE_PIXELS {
            for (a, b) in background(a, within).into_iter().zip(background(b, within)) {
                let off = if a.to_bits() == b.to_bits() || !a.is_finite() && !b.is_finite() {
                    0.0
                } else {
                    (a - b).abs() / (1.0 + a.abs())
                };
                most = if off.is_nan() { f64::INFINITY } else { most.max(off) };
            }
        }
    }
    most
}

/// What was promised and not kept.
fn broken(design: &Configured, finding: &Finding) -> Option<String> {
    if design.promises().unbiased
        && let Outcome::Degraded { error, bound, .. } = finding.outcome
    {
        return Some(format!(
            "it is unbiased, and its mean is off by {error:.2e} ({bound:.2e} at most)"
        ));
    }
    let refuses = matches!(finding.outcome, Outcome::Refused { .. });
    finding.engines.iter().find_map(|a| {
        let allowed = if a.engine == "gpu" { TOLERANCE } else { 0.0 };
        match (a.difference, &a.refused) {
            (Some(d), _) if d > allowed => Some(format!("{} differs by {d:.2e}", a.engine)),
            (None, Some(why)) if !refuses && a.engine != "gpu" => {
                Some(format!("{} refuses: {why}", a.engine))
            }
            _ => None,
        }
    })
}

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

use std::cell::RefCell;
use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

pub use case::{Case, Facts, Group};
pub use cases::cases;
pub use claims::{Claim, MOST_BYTES, MOST_SECONDS};
pub use correlation::{Between, Correlation, CorrelationRow};
pub use faults::Fault;
pub use judge::{DECIDED, Outcome, SIGNIFICANCE, Tally};
pub use unfit::Unfit;

use crate::study::engine::{EngineName, FAST};
use crate::study::measure::replays;
use crate::study::stress::judge::Judge;
use screendoor_designs::{Configured, DESIGNS, configure};
use screendoor_gpu::{self as gpu, Gpu, GpuOptions, TOLERANCE};
use screendoor_rop::stochastic::{METHOD, Method};
use screendoor_rop::{Implementation, Promise, ReplayOptions, colour};
use screendoor_trace::error::Result;
use screendoor_trace::param::Options;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::{ColourFormat, Trace, tied_fragments};

/// Seeds of cases with many fragments, at most.
pub const HEAVY_SEEDS: u32 = 16;

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

/// Designs that are tried with each of their methods of several passes, too.
const SAMPLERS: [&str; 3] = ["lk", "systematic", "enderton"];

/// What is tried.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// The program's own file, to be run under faults; without it they are left out.
    pub program: Option<&'a Path>,
    /// Opens a GPU, for the designs that have a port to it, if there is one.
    pub gpu: &'a dyn Fn() -> Result<Option<Gpu>>,
    /// Seeds of each design that has any; at least 8, since fewer tell little.
    pub seeds: u32,
    /// Is told what is tried, how many of how many.
    pub progress: &'a dyn Fn(&str, u64, u64),
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct Stability {
    /// Seeds of each design that has any.
    pub seeds: u32,
    /// Values that no trace may hold.
    pub unfit: Vec<Unfit>,
    /// The cases.
    pub cases: Vec<Facts>,
    /// The designs.
    pub series: Vec<Series>,
    /// Engines that were tried on this machine.
    pub engines: Vec<String>,
    /// What was found, case by case, and of each design by design.
    pub findings: Vec<Finding>,
    /// Correlations of reference values, by hash.
    pub hashes: Vec<CorrelationRow>,
    /// Correlations of pictures, by design.
    pub pictures: Vec<CorrelationRow>,
    /// Files that claim what they do not hold.
    pub claims: Vec<Claim>,
    /// Faults of the system.
    pub faults: Vec<Fault>,
}

/// A design of the suite.
#[derive(Clone, Debug, Serialize)]
pub struct Series {
    /// Its name with its settings.
    pub name: String,
    /// Where its mean is promised to be the truth.
    pub unbiased: Promise,
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

impl Agreement {
    /// Whether the engine is a GPU.
    pub fn is_gpu(&self) -> bool {
        self.engine == EngineName::Gpu.name()
    }
}

/// What goes with every study: designs alone, on the processor.
///
/// # Errors
/// As [`stress`].
pub(crate) fn stress_designs(
    seeds: u32,
    progress: impl FnMut(&str, u64, u64),
) -> Result<Stability> {
    let progress = RefCell::new(progress);
    let told = |what: &str, done, total| (progress.borrow_mut())(what, done, total);
    stress(&Plan { program: None, gpu: &|| Ok(None), seeds, progress: &told })
}

impl Stability {
    /// What was promised and not kept, in words.
    pub fn broken(&self) -> Vec<String> {
        let designs = self.findings.iter().filter_map(|f| {
            Some(format!("{} on '{}': {}", f.design, f.case, f.broken.as_deref()?))
        });
        let unfit = self.unfit.iter().filter(|u| !u.held);
        let unfit = unfit.map(|u| match &u.written {
            Some(message) => format!("{} is refused: {message}", u.what),
            None => format!("{} is taken", u.what),
        });
        let claims = self.claims.iter().filter(|c| !c.held).map(|c| {
            format!("{} ({}): {:.3} s, {} bytes, {}", c.file, c.what, c.seconds, c.bytes, c.message)
        });
        let faults = self
            .faults
            .iter()
            .flat_map(|f| f.failures.iter().map(|failure| format!("{}: {failure}", f.name)));
        let hashes = self.hashes.iter().filter(|r| r.promised).flat_map(|row| {
            let related = |c: &&Correlation| c.correlated && c.between != Between::Pixels;
            row.correlations.iter().filter(related).map(|c| {
                let (r, between) = (c.r.unwrap_or(0.0), c.between.words());
                format!("reference={}: {between} are correlated, {r:.3}", row.name)
            })
        });
        designs.chain(unfit).chain(hashes).chain(claims).chain(faults).collect()
    }

    /// What a design makes of a case.
    pub fn finding(&self, case: &str, design: &str) -> Option<&Finding> {
        self.findings.iter().find(|f| f.case == case && f.design == design)
    }
}

/// Tries every design on every case with every engine, and the program under faults.
///
/// # Errors
/// Where a case makes no trace, a design's name is unknown, or the program cannot be run;
/// what a design refuses is a finding.
pub fn stress(plan: &Plan<'_>) -> Result<Stability> {
    let told = |what: &str| (plan.progress)(what, 0, 1);
    told("false claims");
    // First: a process begins with the memory that this one had at most.
    let claims = plan.program.map_or(Ok(Vec::new()), claims::claims)?;
    told("faults");
    let gpu = (plan.gpu)()?;
    let faults = plan.program.map_or(Ok(Vec::new()), |p| faults::faults(p, plan.gpu))?;
    let designs = designs()?;
    let cases = cases();
    let (facts, findings) = findings(plan, gpu.as_ref(), &designs, &cases)?;
    told("correlations");
    let random: Vec<Configured> = designs.iter().filter(|d| d.promises().seeded).cloned().collect();
    Ok(Stability {
        seeds: plan.seeds,
        unfit: unfit::unfit()?,
        cases: facts,
        series: designs.iter().map(series).collect(),
        engines: engines(gpu.as_ref()),
        findings,
        hashes: correlation::hashes(),
        pictures: correlation::pictures(&random)?,
        claims,
        faults,
    })
}

/// The cases, and what every design makes of each.
fn findings(
    plan: &Plan<'_>,
    gpu: Option<&Gpu>,
    designs: &[Configured],
    cases: &[Case],
) -> Result<(Vec<Facts>, Vec<Finding>)> {
    let seeded = designs.iter().filter(|d| d.promises().seeded).count();
    let tests = seeded * 3 * cases.iter().map(|c| c.kinds.len()).sum::<usize>();
    let total = cases.len() as u64;
    let (mut facts, mut findings) = (Vec::new(), Vec::new());
    for (i, case) in cases.iter().enumerate() {
        (plan.progress)(&case.name, i as u64, total);
        let trial = Trial {
            case,
            trace: case.trace()?,
            judge: Judge::new(case, tests)?,
            seeds: plan.seeds,
        };
        let tied = tied_fragments(&trial.trace, case.samples)?;
        facts.push(case.facts(tied));
        let found: Vec<(Finding, Result<Picture>)> =
            designs.par_iter().map(|d| trial.finding(d)).collect();
        // One after the other: there is one device.
        for ((mut finding, plain), design) in found.into_iter().zip(designs) {
            if let Some(gpu) = gpu.filter(|_| design.is_ported()) {
                finding.engines.push(trial.on_gpu(gpu, design, &plain));
            }
            let promised = trial.promised(design, tied)?;
            finding.broken = broken(&promised, &finding);
            if finding.broken.is_some()
                && let Some(outcome) = trial.outcome_of_single_precision(design)
            {
                finding.broken = broken(&promised, &Finding { outcome, ..finding.clone() });
            }
            findings.push(finding);
        }
    }
    Ok((facts, findings))
}

fn designs() -> Result<Vec<Configured>> {
    let defaults = DESIGNS.iter().map(|entry| entry.configure(&[]));
    let methods = Method::CHOICES.iter().filter(|m| m.name != METHOD.param.default);
    let of_several_passes = SAMPLERS.iter().flat_map(|sampler| {
        methods.clone().map(move |m| format!("{sampler}:{}={}", METHOD.param.name, m.name))
    });
    let beside = EXTREMES.iter().map(|spec| spec.to_string()).chain(of_several_passes);
    defaults.chain(beside.map(|spec| configure(&spec, &[]))).collect()
}

fn series(design: &Configured) -> Series {
    let promises = design.promises();
    Series { name: design.label(), unbiased: promises.unbiased, seeded: promises.seeded }
}

/// Engines of the processor that are held against the plain text.
fn others() -> impl Iterator<Item = (Implementation, &'static str)> {
    let all = Implementation::ALL
        .iter()
        .zip(Implementation::CHOICES)
        .map(|(which, choice)| (*which, choice.name));
    all.filter(|(which, _)| *which != Implementation::Reference && which.level().is_ok())
}

fn engines(gpu: Option<&Gpu>) -> Vec<String> {
    let gpu = gpu.map(|gpu| gpu.adapter().to_string());
    let plain = Implementation::CHOICES[Implementation::Reference as usize].name.to_string();
    [plain].into_iter().chain(others().map(|(_, name)| name.to_string())).chain(gpu).collect()
}

/// A case that designs are tried on.
struct Trial<'a> {
    case: &'a Case,
    trace: Trace,
    judge: Judge<'a>,
    seeds: u32,
}

impl Trial<'_> {
    /// What the processor's engines make of it, and the plain text's first picture.
    fn finding(&self, design: &Configured) -> (Finding, Result<Picture>) {
        let plain = self.picture(design, Implementation::Reference, 0);
        let mut finding = Finding {
            case: self.case.name.clone(),
            design: design.label(),
            outcome: self.outcome(design, &plain),
            engines: Vec::new(),
            broken: None,
        };
        for (which, name) in others() {
            // What draws on this machine, and with small cases all that can.
            if which == Implementation::Fast || self.case.is_light() {
                finding.engines.push(agreement(name, &plain, self.picture(design, which, 0)));
            }
        }
        (finding, plain)
    }

    fn picture(
        &self,
        design: &Configured,
        implementation: Implementation,
        seed: u32,
    ) -> Result<Picture> {
        let options = ReplayOptions { implementation, ..ReplayOptions::default() };
        Ok(design.replay(&self.trace, self.case.samples, seed, &options)?.picture)
    }

    fn outcome(&self, design: &Configured, first: &Result<Picture>) -> Outcome {
        let refused =
            |e: &screendoor_trace::error::Error| Outcome::Refused { message: e.to_string() };
        let first = match first {
            Ok(picture) => picture.clone(),
            Err(e) => return refused(e),
        };
        let seeds = match design.promises().seeded {
            true if self.case.is_light() => self.seeds,
            true => self.seeds.min(HEAVY_SEEDS),
            false => 1,
        };
        let (trace, samples) = (&self.trace, self.case.samples);
        let rest = replays(FAST, design, trace, samples, 1..seeds, ReplayOptions::default());
        let rest = rest.map(|seed| Ok(seed?.replayed.picture));
        match std::iter::once(Ok(first)).chain(rest).collect::<Result<Vec<_>>>() {
            Ok(pictures) => self.judge.outcome(&pictures),
            Err(e) => refused(&e),
        }
    }

    /// What a design promises where `tied` fragments share a depth.
    fn promised(&self, design: &Configured, tied: u64) -> Result<OnCase> {
        let frame = design.frame(&self.trace, self.case.samples, 0)?;
        let passes = design.build(&frame, Implementation::Reference)?.passes();
        let unbiased = design.promises().unbiased.holds(tied);
        Ok(OnCase { unbiased, finite: unbiased && passes == 1 })
    }

    /// What comes of a trace of half floats where the design stores and sums its colours in
    /// single precision, of which alone it promises anything: sums in half floats lose what
    /// is less than 3e-8. None where colours are that wide anyway, or the design stores none.
    fn outcome_of_single_precision(&self, design: &Configured) -> Option<Outcome> {
        let single = (colour::PARAM.param.name.to_string(), "32".to_string());
        let wide = configure(&design.label(), &[single]).ok()?;
        let narrow = self.case.colour == ColourFormat::F16;
        narrow.then(|| self.outcome(&wide, &self.picture(&wide, Implementation::Reference, 0)))
    }

    fn on_gpu(&self, gpu: &Gpu, design: &Configured, plain: &Result<Picture>) -> Agreement {
        let options = GpuOptions::default();
        let replayed = gpu::replay(gpu, design, &self.trace, self.case.samples, 0, &options);
        agreement(EngineName::Gpu.name(), plain, replayed.map(|(r, ..)| r.picture))
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
        for within in 0..screendoor_trace::tile::TILE_PIXELS {
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

/// What a design promises on a case.
struct OnCase {
    /// That its mean is the truth.
    unbiased: bool,
    /// That its pictures are finite: what sums up colours over several passes may overflow,
    /// as it would in hardware, and has no mean then.
    finite: bool,
}

/// What was promised and not kept.
fn broken(promised: &OnCase, finding: &Finding) -> Option<String> {
    let unbiased = promised.unbiased;
    if promised.finite
        && let Outcome::NotFinite { pixels } = finding.outcome
    {
        return Some(format!("it is unbiased in one pass, and {pixels} pixels are not finite"));
    }
    if unbiased && let Outcome::Refused { message } = &finding.outcome {
        return Some(format!("it is unbiased, and refuses: {message}"));
    }
    if unbiased && let Outcome::Degraded { error, bound, .. } = finding.outcome {
        return Some(format!(
            "it is unbiased, and its mean is off by {error:.2e} ({bound:.2e} at most)"
        ));
    }
    let refuses = matches!(finding.outcome, Outcome::Refused { .. });
    finding.engines.iter().find_map(|a| {
        let allowed = if a.is_gpu() { TOLERANCE } else { 0.0 };
        match (a.difference, &a.refused) {
            (Some(d), _) if d > allowed => Some(format!("{} differs by {d:.2e}", a.engine)),
            (None, Some(why)) if !refuses && !a.is_gpu() => {
                Some(format!("{} refuses: {why}", a.engine))
            }
            _ => None,
        }
    })
}

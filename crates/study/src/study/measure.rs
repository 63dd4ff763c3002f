//! The one way to measure: a design's seeds on a trace at a sample count become a [`Record`].
//!
//! A [`Subject`] is a trace with what all its runs share, a [`Reference`] adds what those at
//! one sample count share; [`measure`] does one run. Whoever looks at pictures otherwise, as
//! the publications' figures do, takes them from [`replays`], the one loop over seeds.

use std::borrow::Borrow;
use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;

use crate::metrics::{
    Ensemble, EnsembleErrors, Estimate, FlipFigures, Spectrum, filtered_rmse, rmse,
};
use crate::post::PostFilter;
use crate::study::engine::{Engine, FAST, OnGpu};
use crate::study::file::Metric;
use crate::study::record::{
    Filtered, FlipOverSeeds, PostFiltered, Record, SpectrumOverSeeds, VERSION,
};
pub use crate::study::subject::{BLOCK, Reference, Subject, averaged};
use screendoor_designs::Configured;
use screendoor_rop::{EventCounts, ReplayOptions, Replayed, StateBits};
use screendoor_trace::error::Result;
use screendoor_trace::param::Options;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::Trace;

/// Standard deviations of the Gaussians that stand for a viewer further away, in pixels.
pub(crate) const SIGMAS: [f64; 2] = [1.0, 2.0];

/// One seed's replay.
#[derive(Debug)]
pub struct OneSeed {
    /// What it gave.
    pub replayed: Replayed,
    /// What a GPU says of it.
    pub gpu: Option<OnGpu>,
    /// How long it took.
    pub seconds: f64,
}

/// A design's replays, seed after seed. Counting costs time: where it is asked for, only the
/// first seed's replay counts.
///
/// # Errors
/// As [`Engine::replay`], for each seed.
pub fn replays<'a>(
    engine: &'a Engine,
    design: impl Borrow<Configured> + 'a,
    trace: &'a Trace,
    samples: u32,
    seeds: impl IntoIterator<Item = u32, IntoIter: 'a>,
    options: ReplayOptions<'a>,
) -> impl Iterator<Item = Result<OneSeed>> + 'a {
    seeds.into_iter().enumerate().map(move |(place, seed)| {
        let count_events = options.count_events && place == 0;
        let start = Instant::now();
        let options = ReplayOptions { count_events, ..options };
        let (replayed, gpu) = engine.replay(design.borrow(), trace, samples, seed, &options)?;
        Ok(OneSeed { replayed, gpu, seconds: start.elapsed().as_secs_f64() })
    })
}

/// How a run is measured.
#[derive(Clone)]
pub struct Setup<'a> {
    /// What draws.
    pub engine: &'a Engine,
    /// The seeds; of a design that has none the first alone is replayed.
    pub seeds: Range<u32>,
    /// Metrics beyond the errors.
    pub metrics: &'a [Metric],
}

/// A run that was measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// What it says, without [`Record::speed`]; as series and as its id it has the design's
    /// label.
    pub record: Record,
    /// The picture of the first seed.
    pub picture: Picture,
    /// How long the seeds' replays took.
    pub timed: Timed,
}

/// How long replays took that counted nothing, since counting takes time, and were not the
/// first, which finds caches cold and, on GPUs, programs that are not compiled.
#[derive(Clone, Debug, Default)]
pub struct Timed {
    /// Seconds from the file, or from its fragments as an earlier replay left them, to the picture.
    pub seconds: Vec<f64>,
    /// Seconds in which a GPU drew, by its own clock.
    pub kernel: Vec<f64>,
}

impl Timed {
    /// Adds a replay.
    pub(super) fn add(&mut self, replay: &OneSeed) {
        self.seconds.push(replay.seconds);
        let device = replay.gpu.as_ref().and_then(|gpu| gpu.seconds.device.as_ref());
        self.kernel.extend(device.and_then(|device| device.get("draw").copied()));
    }
}

/// Measures a design on a subject, at the reference's sample count.
///
/// # Errors
/// As [`Engine::replay`].
pub fn measure(
    subject: &Subject,
    reference: &Reference,
    design: &Configured,
    setup: &Setup<'_>,
) -> Result<Measured> {
    let promises = design.promises();
    let Range { start, end } = setup.seeds;
    let seeds = if promises.seeded { start..end } else { start..start + 1 };
    let run = Run { subject, reference, design, setup };
    let count = seeds.len() as u32;
    let Looked { seen, ensemble, first, counted, timed } = run.over(seeds)?;
    let [frame, covered, interior, edges] = ensemble;
    let over = |of: &dyn Fn(&Seen) -> f64| Estimate::of(&seen.iter().map(of).collect::<Vec<_>>());
    let sigmas = seen.first().map_or(0, |s| s.filtered_squares.len());
    let filtered = SIGMAS[..sigmas].iter().enumerate().map(|(i, sigma)| Filtered {
        sigma: *sigma,
        rmse: over(&|s| s.filtered_squares[i]).sqrt(),
    });
    let blocks: Option<Vec<f64>> = seen.iter().map(|s| s.blocks_square).collect();
    let record = Record {
        version: VERSION,
        id: design.label(),
        scene: subject.name.clone(),
        trace: subject.content.clone(),
        series: design.label(),
        design: design.label(),
        family: design.info().family.name().to_string(),
        promises: promises.into(),
        samples: reference.samples,
        seeds: count,
        fragments: reference.fragments,
        tied_fragments: reference.tied_fragments,
        frame,
        covered,
        interior,
        edges,
        fine: over(&|s| s.fine_square).sqrt(),
        filtered: filtered.collect(),
        flip: flip(&seen, |s| s.flip),
        flip_hdr: flip(&seen, |s| s.flip_hdr),
        spectrum: spectrum(&seen),
        blocks: blocks.map(|squares| Estimate::of(&squares).sqrt()),
        post: post(reference, &seen),
        events: counted.events,
        state_bits: counted.state_bits,
        layout: counted.layout,
        passes: counted.passes,
        touched_tiles: counted.touched_tiles as u64,
        picture: first.hash(),
        speed: Default::default(),
    };
    Ok(Measured { record, picture: first, timed })
}

/// What is measured, on what and how.
struct Run<'a> {
    subject: &'a Subject,
    reference: &'a Reference,
    design: &'a Configured,
    setup: &'a Setup<'a>,
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
    blocks_square: Option<f64>,
    post: Vec<SeenFiltered>,
}

/// What is seen of a seed's picture after a filter.
struct SeenFiltered {
    square: f64,
    interior_square: f64,
    edges_square: f64,
    flip: Option<f64>,
}

/// What came of looking at all seeds.
struct Looked {
    seen: Vec<Seen>,
    ensemble: [EnsembleErrors; 4],
    /// The first seed's picture.
    first: Picture,
    counted: Counted,
    timed: Timed,
}

impl Run<'_> {
    fn replays<'a>(
        &'a self,
        engine: &'a Engine,
        seeds: Range<u32>,
    ) -> impl Iterator<Item = Result<OneSeed>> + 'a {
        let options = ReplayOptions { count_events: true, ..self.subject.options() };
        let (trace, samples) = (&self.subject.trace, self.reference.samples);
        replays(engine, self.design, trace, samples, seeds, options)
    }

    /// What a replay of the first seed counts where the engine's own has counted nothing, as
    /// GPUs do not: the processor's fast engine does, and draws the same.
    fn counted(&self, seed: u32) -> Result<Counted> {
        let again = self.replays(FAST, seed..seed + 1).next();
        let again = again.expect("there is one seed")?.replayed;
        Ok(Counted::of(&again).expect("it was asked to count"))
    }

    /// Replays all seeds; a batch's pictures are looked at side by side.
    fn over(&self, seeds: Range<u32>) -> Result<Looked> {
        let reference = self.reference;
        let classes = &reference.classes;
        let regions = [&reference.frame, &classes.covered, &classes.interior, &classes.edges];
        let mut ensemble = Ensemble::against(&reference.picture, &reference.encoded, &regions);
        let start = seeds.start;
        let mut replays = self.replays(self.setup.engine, seeds);
        let first = replays.next().expect("a run has a seed")?;
        let counted = match Counted::of(&first.replayed) {
            Some(counted) => counted,
            None => self.counted(start)?,
        };
        let first = first.replayed.picture;
        let (mut seen, mut timed) = (Vec::new(), Timed::default());
        let batch = rayon::current_num_threads().max(1);
        let mut pictures = vec![first.clone()];
        loop {
            for seed in replays.by_ref().take(batch - pictures.len()) {
                let seed = seed?;
                timed.add(&seed);
                pictures.push(seed.replayed.picture);
            }
            if pictures.is_empty() {
                break;
            }
            ensemble.add_all(&pictures);
            seen.par_extend(pictures.par_iter().map(|picture| self.see(picture)));
            pictures.clear();
        }
        let ensemble = ensemble.finish().try_into().expect("one for each region");
        Ok(Looked { seen, ensemble, first, counted, timed })
    }

    fn see(&self, picture: &Picture) -> Seen {
        let reference = self.reference;
        let takes = |metric| self.setup.metrics.contains(&metric);
        let fine = rmse(picture, &self.subject.fine, &self.subject.fine_covered);
        let filtered = |sigma: &f64| {
            filtered_rmse(picture, &reference.picture, *sigma, &reference.classes.covered).powi(2)
        };
        let sigmas: &[f64] = if takes(Metric::Filtered) { &SIGMAS } else { &[] };
        let flip = |metric| reference.flip.as_ref().filter(|_| takes(metric));
        let blocks = reference.blocks.as_ref().filter(|_| takes(Metric::Blocks));
        Seen {
            fine_square: fine * fine,
            filtered_squares: sigmas.iter().map(filtered).collect(),
            flip: flip(Metric::Flip).map(|f| f.ldr(picture).figures()),
            flip_hdr: flip(Metric::FlipHdr).map(|f| f.hdr(picture).figures()),
            spectrum: takes(Metric::Spectrum).then(|| Spectrum::of(picture, &reference.picture)),
            blocks_square: blocks
                .map(|(exact, frame)| rmse(&averaged(picture, BLOCK), exact, frame).powi(2)),
            post: self.filtered(picture),
        }
    }

    /// What the reference's filters leave of a picture's error.
    fn filtered(&self, picture: &Picture) -> Vec<SeenFiltered> {
        let Reference { post, classes, picture: exact, flip, .. } = self.reference;
        let Some(post) = post else { return Vec::new() };
        let flip = flip.as_ref().filter(|_| self.setup.metrics.contains(&Metric::Flip));
        let seen = |filter: &PostFilter| {
            let filtered = filter.apply(picture, &post.guides);
            let square = |region| rmse(&filtered, exact, region).powi(2);
            SeenFiltered {
                square: square(&classes.covered),
                interior_square: square(&classes.interior),
                edges_square: square(&classes.edges),
                flip: flip.map(|flip| flip.ldr(&filtered).figures().mean),
            }
        };
        post.filters.iter().map(|(_, filter, _)| seen(filter)).collect()
    }
}

/// What the reference's filters leave, over all seeds.
fn post(reference: &Reference, seen: &[Seen]) -> Vec<PostFiltered> {
    let filters = reference.post.iter().flat_map(|post| &post.filters);
    let each = |(i, (filter, _, blur)): (usize, &(String, PostFilter, f64))| {
        let over = |of: &dyn Fn(&SeenFiltered) -> f64| {
            Estimate::of(&seen.iter().map(|s| of(&s.post[i])).collect::<Vec<_>>())
        };
        let flip: Option<Vec<f64>> = seen.iter().map(|s| s.post[i].flip).collect();
        PostFiltered {
            filter: filter.clone(),
            covered: over(&|s| s.square).sqrt(),
            interior: over(&|s| s.interior_square).sqrt(),
            edges: over(&|s| s.edges_square).sqrt(),
            flip: flip.map(|all| Estimate::of(&all)),
            blur: *blur,
        }
    };
    filters.enumerate().map(each).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_designs::configure;
    use screendoor_scene::capture::{Capture, CaptureOptions};
    use screendoor_scene::scene;

    fn subject() -> Subject {
        let options =
            CaptureOptions { width: 24, height: 20, samples: 64, ..CaptureOptions::default() };
        let scene = scene::load("builtin:cloth").unwrap();
        let trace = Capture::new(&scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
        Subject::new("cloth", trace, None, 1 << 28).unwrap()
    }

    #[test]
    fn a_record_says_what_was_measured_and_is_the_same_again() {
        let subject = subject();
        let metrics = [Metric::Blocks, Metric::Filtered];
        let reference = Reference::of(&subject, 4, &metrics).unwrap();
        let of = |design: &str, seeds: Range<u32>, metrics: &[Metric]| {
            let setup = Setup { engine: FAST, seeds, metrics };
            measure(&subject, &reference, &configure(design, &[]).unwrap(), &setup).unwrap()
        };
        let found = of("enderton", 0..3, &metrics);
        assert_eq!(of("enderton", 0..3, &metrics).record, found.record);
        let record = &found.record;
        assert_eq!((record.samples, record.seeds, record.scene.as_str()), (4, 3, "cloth"));
        assert_eq!((record.covered.seeds, found.timed.seconds.len()), (3, 2));
        assert_eq!(record.picture, found.picture.hash());
        assert!(record.events.fragments > 0 && record.fragments > 0);
        // Noise averages out over blocks, and over a Gaussian.
        let error = record.frame.rmse.value;
        assert!(error > 1.0 && record.blocks.unwrap().value < error / 2.0, "{record:?}");
        assert!(record.filtered[0].rmse.value < record.covered.rmse.value);
        // The first seed is the one that is asked for.
        assert_ne!(of("enderton", 1..3, &[]).record.picture, record.picture);
        // What has no seeds is replayed once, and what was not asked for is not there.
        let exact = of("exact", 0..3, &[]);
        assert_eq!((exact.record.seeds, exact.timed.seconds.len()), (1, 0));
        assert_eq!((exact.record.covered.rmse.value, exact.record.blocks), (0.0, None));
        // Of all samples the picture of four is not the exact one.
        assert!(exact.record.fine.value > 0.0);
    }

    #[test]
    fn replays_go_through_the_seeds_and_count_in_the_first() {
        let subject = subject();
        let design = configure("lk", &[]).unwrap();
        let options = ReplayOptions { count_events: true, ..subject.options() };
        let found: Vec<OneSeed> = replays(FAST, &design, &subject.trace, 4, 5..8, options)
            .collect::<Result<_>>()
            .unwrap();
        let counted: Vec<bool> = found.iter().map(|s| s.replayed.events.is_some()).collect();
        assert_eq!(counted, [true, false, false]);
        for (seed, one) in (5..).zip(&found) {
            let alone = design.replay(&subject.trace, 4, seed, &subject.options()).unwrap();
            assert_eq!(alone.picture.hash(), one.replayed.picture.hash());
        }
    }
}

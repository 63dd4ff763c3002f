//! `screendoor replay`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{MemoryArgument, RunArguments, engine_name, seeds};
use crate::cli::console::{Console, grouped, shown};
use crate::cli::files::{JsonArgument, check, report, write_pictures};
use crate::design::{Configured, REFERENCE, configure};
use crate::error::{Error, Result};
use crate::metrics::{Ensemble, EnsembleErrors, PixelClasses, Region};
use crate::param::{Options, Values};
use crate::picture::{Picture, PictureFile, Space};
use crate::post::{Guides, PostFilter};
use crate::rop::{EventCounts, Layout, Promises, ReplayOptions, Replayed, StateBits};
use crate::study::engine::{EngineName, OnGpu};
use crate::study::measure::{averaged, replays};
use crate::trace::Trace;

/// Replay a trace through a design: a picture, its error, what the ROP did
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that fragments may take that are sorted into tiles, and the exact answer's state; less takes more passes")
}))]
pub(super) struct Arguments {
    #[command(flatten)]
    run: RunArguments,
    /// Replay this many seeds, from --seed on, and tell variance from bias;
    /// implies --exact
    #[arg(long, default_value_t = 1, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: u32,
    /// Composite the exact picture too and give the error against it
    #[arg(long)]
    exact: bool,
    /// Filter the picture against noise before it is written and held against the exact one:
    /// NAME[:parameter=value,…] (gaussian, bilateral, alpha, depth; docs/STUDIES.md, filters)
    #[arg(long, value_name = "FILTER")]
    filter: Option<String>,
    /// Average the pictures that are written over blocks of K × K pixels; errors are of the pictures
    /// before
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=64))]
    supersample: Option<u32>,
    /// A picture to write, .exr or .png; can be given several times
    #[arg(long, short, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonArgument,
    /// What draws; all give the same bits, but that a GPU computes in single precision
    /// where a design blends
    #[arg(long, default_value = "fast", value_name = "ENGINE", value_parser = engine_name())]
    engine: EngineName,
    /// The GPU to use: a part of its name or of its driver's
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    memory: MemoryArgument,
    /// Fragments that are sorted into tiles at a time, at most; by default as many as fit into
    /// the memory
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    window: Option<u64>,
}

/// The result of one replay command.
#[derive(Serialize)]
struct Document<'a> {
    trace: &'a str,
    content: Option<&'a str>,
    design: &'a str,
    parameters: &'a Values,
    promises: Promises,
    samples: u32,
    seed: u32,
    engine: EngineName,
    gpu: &'a Option<OnGpu>,
    /// Of the first seed's picture: equal hashes are equal pictures.
    picture: String,
    /// What it was filtered by.
    filter: Option<&'a str>,
    seconds: f64,
    fragments_per_second: f64,
    passes: u32,
    state_bits: StateBits,
    /// How these are made up.
    layout: &'a Layout,
    touched_tiles: usize,
    /// Drawn, over all passes.
    fragments: u64,
    /// A GPU counts none.
    events: Option<&'a EventCounts>,
    errors: Option<ErrorsByRegion>,
}

/// Errors against the exact picture, in 8-bit units.
#[derive(Serialize)]
struct ErrorsByRegion {
    frame: EnsembleErrors,
    covered: EnsembleErrors,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let json = arguments.json.path();
    let outputs: Vec<&Path> = arguments.output.iter().map(|o| &**o).chain(json).collect();
    check(&[arguments.run.path()], &outputs)?;
    let (design, trace, samples) = arguments.run.open(console)?;
    let engine = arguments.engine.open(arguments.adapter.as_deref())?;
    let filter = arguments.filter.as_deref().map(PostFilter::parse).transpose()?;
    let header = trace.header();
    let side = arguments.supersample.unwrap_or(1);
    let [width, height] = [header.width, header.height];
    if width % side != 0 || height % side != 0 {
        return Err(Error::config(
            format_args!("{width}x{height} pixels do not fall into blocks of {side}x{side}"),
            "capture a frame whose sides are multiples of --supersample",
        ));
    }
    let create = |path| PictureFile::create(path, width / side, height / side);
    let mut files = arguments.output.iter().map(create).collect::<Result<Vec<_>>>()?;
    let json = arguments.json.open()?;
    let seed = arguments.run.seed;
    let seeds = seeds(seed, arguments.seeds)?;
    let progress = console.progress("replaying", "fragments");
    let watch = |done, total| progress.set(done, total);
    let options = ReplayOptions {
        count_events: true,
        window: arguments.window.map_or(usize::MAX, |window| window as usize),
        memory: arguments.memory.bytes(),
        progress: &watch,
        ..ReplayOptions::default()
    };

    let start = Instant::now();
    let (mut first, gpu) = engine.replay(&design, &trace, samples, seed, &options)?;
    let seconds = start.elapsed().as_secs_f64();
    let guided = |filter| Ok((filter, Guides::of(&trace, samples, options.memory)?));
    let filter: Option<(PostFilter, Guides)> = filter.map(guided).transpose()?;
    let finished = |picture: Picture| match &filter {
        Some((filter, guides)) => filter.apply(&picture, guides),
        None => picture,
    };
    first.picture = finished(first.picture);

    let reference = if arguments.exact || arguments.seeds > 1 {
        progress.name("compositing");
        Some(configure(REFERENCE, &[])?.replay(&trace, samples, 0, &options)?.picture)
    } else {
        None
    };
    let errors = match &reference {
        None => None,
        Some(reference) => {
            let plain = ReplayOptions { count_events: false, ..options };
            let others = seeds.skip(1).inspect(|seed| {
                let place = seed - arguments.run.seed + 1;
                progress.name(&format!("seed {place} of {}", arguments.seeds));
            });
            let replayed = replays(&engine, &design, &trace, samples, others, plain);
            let pictures = replayed.map(|seed| Ok(finished(seed?.replayed.picture)));
            Some(by_region(&trace, samples, reference, &first.picture, pictures)?)
        }
    };
    drop(progress);
    match first.picture.not_finite() {
        0 => {}
        n => console.warn(&format!(
            "{n} pixels are NaN or infinite: sums of '{}' in single precision have overflowed",
            design.label()
        )),
    }

    // No file appears unless all could be written.
    let written = |picture: &Picture| match side {
        1 => picture.clone(),
        side => averaged(picture, side),
    };
    let (picture, exact) = (written(&first.picture), reference.as_ref().map(written));
    let saved = write_pictures(&mut files, &picture, exact.as_ref(), console)
        .and_then(|()| files.into_iter().try_for_each(PictureFile::commit));
    let counted = first.events.as_ref().map_or(0, |events| events.fragments);
    let fragments = gpu.as_ref().map_or(counted, |gpu| gpu.fragments);
    let document = Document {
        trace: trace.place(),
        content: trace.content(),
        design: design.info().name,
        parameters: design.values(),
        promises: design.promises(),
        samples,
        seed,
        engine: arguments.engine,
        gpu: &gpu,
        picture: first.picture.hash(),
        filter: arguments.filter.as_deref(),
        seconds,
        fragments,
        fragments_per_second: fragments as f64 / seconds,
        passes: first.passes,
        state_bits: first.state_bits,
        layout: &first.layout,
        touched_tiles: first.touched_tiles,
        events: first.events.as_ref(),
        errors,
    };
    let reported = report(json, "screendoor.replay", &document, console, || {
        let place = shown(trace.place());
        console
            .print(format_args!("{} at {samples} samples, seed {seed}: {place}", design.label()))?;
        print_speed(&document, trace.rows(), console)?;
        if let Some(errors) = &document.errors {
            print_errors(errors, trace.header().space, console)?;
        }
        print_events(&first, &design, console)
    });
    saved.and(reported)
}

fn by_region(
    trace: &Trace,
    samples: u32,
    reference: &Picture,
    first: &Picture,
    others: impl Iterator<Item = Result<Picture>>,
) -> Result<ErrorsByRegion> {
    let whole = Region::frame(reference.grid());
    let covered = PixelClasses::of(trace, samples)?.covered;
    let mut ensemble = Ensemble::new(reference, &[&whole, &covered]);
    ensemble.add(first);
    for picture in others {
        ensemble.add(&picture?);
    }
    let [frame, covered] = ensemble.finish().try_into().expect("one a region");
    Ok(ErrorsByRegion { frame, covered })
}

fn print_speed(document: &Document<'_>, rows: u64, console: &Console) -> Result<()> {
    let drawn = document.fragments;
    console.print(format_args!(
        "{} fragments in {:.2} s ({:.2} million a second)",
        grouped(drawn),
        document.seconds,
        document.fragments_per_second / 1e6
    ))?;
    if let Some(gpu) = document.gpu {
        print_gpu(gpu, console)?;
    }
    if drawn == rows * u64::from(document.passes) {
        return Ok(());
    }
    console.print(format_args!(
        "(of {}: the others cover none of the first {} samples)",
        grouped(rows * u64::from(document.passes)),
        document.samples
    ))
}

fn print_gpu(gpu: &OnGpu, console: &Console) -> Result<()> {
    console.print(format_args!("on {}", shown(gpu.adapter.to_string())))?;
    let ms = |seconds: f64| format!("{:.1} ms", seconds * 1e3);
    let seconds = &gpu.seconds;
    let device = seconds.device.iter().flatten();
    let parts: Vec<String> = device.map(|(name, s)| format!("{name} {}", ms(*s))).collect();
    let told = if parts.is_empty() { "nothing".to_string() } else { parts.join(", ") };
    console.print(format_args!(
        "  upload {}, back {}; by its own clock: {told}",
        ms(seconds.upload),
        ms(seconds.back)
    ))
}

fn print_errors(errors: &ErrorsByRegion, space: Space, console: &Console) -> Result<()> {
    let seeds = errors.frame.seeds;
    let of = if seeds > 1 { format!(" of {seeds} seeds, 95 % intervals") } else { String::new() };
    console.print(format_args!("error against exact in 8-bit units{of}"))?;
    for (name, e) in [("frame", &errors.frame), ("covered", &errors.covered)] {
        if e.pixels == 0 {
            console.print(format_args!("  {name:<8} no pixel holds a fragment"))?;
            continue;
        }
        let spread = |v: f64| if seeds > 1 { format!(" ± {v:.3}") } else { String::new() };
        console.print(format_args!(
            "  {name:<8} RMSE {:.3}{} {}, {:.3}{} sRGB; mean error {:+.4}{}; max {:.1}",
            e.rmse.value,
            spread(e.rmse.half_width()),
            // As it is blended; what an 8-bit picture cannot show counts in the first alone.
            space.name(),
            e.rmse_srgb.value,
            spread(e.rmse_srgb.half_width()),
            e.mean.value,
            spread(e.mean.half_width()),
            e.max
        ))?;
        if let (Some(variance), Some(bias)) = (e.variance, e.bias_squared) {
            // Without a word a negative square looks like a mistake.
            let half = bias.half_width();
            let half = if half.is_finite() { format!(" ± {half:.4}") } else { String::new() };
            let bias = bias.value;
            let why = if bias < 0.0 { " (an unbiased estimate: it scatters around 0)" } else { "" };
            console.print(format_args!(
                "  {:<8} variance {variance:.3}, squared bias {bias:+.4}{half}{why}",
                ""
            ))?;
        }
    }
    Ok(())
}

fn print_events(replayed: &Replayed, design: &Configured, console: &Console) -> Result<()> {
    match &replayed.events {
        Some(events) => print_counts(events, console)?,
        None => {
            console.print(format_args!("events are not counted on a GPU: use --engine fast"))?
        }
    }
    let bits = replayed.state_bits;
    let size = if bits.unbounded {
        "grows with the fragments".to_string()
    } else {
        format!("{} bits: {} of samples, {} beside", bits.total(), bits.samples, bits.extra)
    };
    console.print(format_args!("state per pixel         {size}"))?;
    console.print(format_args!("  made up of            {}", replayed.layout))?;
    console.print(format_args!("passes over the trace   {}", replayed.passes))?;
    let promises = design.promises();
    console.print(format_args!("promises                {}", promises.words().join(", ")))
}

fn print_counts(events: &EventCounts, console: &Console) -> Result<()> {
    let per = |n: u64| n as f64 / events.fragments.max(1) as f64;
    let line = |name: &str, n: u64| {
        console.print(format_args!("  {name:<22}{:>18}{:>12.3}", grouped(n), per(n)))
    };
    console.print(format_args!("{:<24}{:>18}{:>12}", "events", "", "a fragment"))?;
    line("samples tested", events.samples_tested)?;
    line("samples passed", events.samples_passed)?;
    line("samples written", events.samples_written)?;
    line("hashes", events.hashes)?;
    line("sorts", events.sorts())?;
    for (length, n) in events.sorts_by_length.iter().enumerate().filter(|(_, n)| **n > 0) {
        line(&format!("  of {length}"), *n)?;
    }
    line("surfaces started", events.surfaces)?;
    line("layers compared", events.layers_compared)?;
    if let Some(count) = events.multiplications {
        line("multiplications", count)?;
    }
    let [read, written] = events.state_bytes();
    line("state bytes read", read)?;
    line("state bytes written", written)
}

//! `screendoor throughput`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{MemoryArgument, design_list, engine_name, option, samples};
use crate::cli::console::{Console, grouped, shown, table};
use crate::cli::files::{JsonArgument, check, open_trace, report};
use crate::error::Result;
use crate::gpu::{Adapter, Threads};
use crate::rop::Implementation;
use crate::study::engine::EngineName;
use crate::study::machine::processor;
use crate::study::throughput::{Plan, Spread, Throughput, measure};

/// Measure how fast engines replay a trace: fragments, samples and bytes a second
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that a design may take whose state grows with the fragments")
}))]
pub(super) struct Arguments {
    /// The trace
    trace: PathBuf,
    /// The designs, separated by commas, with settings as in 'lk,lk:sort=false,compact=false'
    #[arg(long, default_value = "lk,systematic", value_name = "LIST")]
    designs: String,
    /// Samples per pixel, separated by commas: 8 where not given, or as many as the trace
    /// has, if that serves no 8
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = samples)]
    samples: Vec<u32>,
    /// The engines, separated by commas: 'fast' where not given, and 'gpu' where there is one
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = engine_name())]
    engines: Vec<EngineName>,
    /// The GPU to use: a part of its name or of its driver's
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// What a GPU's thread is given
    #[arg(long, default_value = "pixel", value_name = "WHAT", value_parser = option::<Threads>())]
    gpu_threads: Threads,
    /// How often each is measured, after one replay that warms up
    #[arg(long, default_value_t = 5, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1000))]
    runs: u16,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(Serialize)]
struct Document<'a> {
    trace: &'a str,
    content: Option<&'a str>,
    rows: u64,
    processor: String,
    threads: usize,
    adapter: Option<&'a Adapter>,
    results: Vec<Throughput>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    check(&[&arguments.trace], &arguments.json.path().into_iter().collect::<Vec<_>>())?;
    let designs = design_list(&arguments.designs)?;
    let trace = open_trace(&arguments.trace, console)?;
    let pattern = &trace.header().pattern;
    let samples = match &arguments.samples[..] {
        [] if pattern.prefix(8).is_ok() => vec![8],
        [] => vec![pattern.samples()],
        given => given.to_vec(),
    };
    for count in &samples {
        pattern.prefix(*count)?;
    }
    let names = match &arguments.engines[..] {
        [] => usual_engines(arguments.adapter.as_deref(), console)?,
        given => given.to_vec(),
    };
    // An adapter is for the GPU among the engines; without one it is a mistake.
    let has_gpu = names.contains(&EngineName::Gpu);
    let open = |name: &EngineName| {
        let adapter = arguments.adapter.as_deref().filter(|_| *name == EngineName::Gpu || !has_gpu);
        Ok((*name, name.open(adapter)?.with_threads(arguments.gpu_threads)))
    };
    let engines = names.iter().map(open).collect::<Result<Vec<_>>>()?;
    let json = arguments.json.open()?;
    let plan = Plan {
        designs,
        samples,
        runs: usize::from(arguments.runs),
        memory: arguments.memory.bytes(),
    };
    let progress = console.progress("measuring", "replays");
    let results = measure(&trace, &engines, &plan, &|name, done, total| {
        progress.name(name);
        progress.set(done, total);
    })?;
    drop(progress);
    let document = Document {
        trace: trace.place(),
        content: trace.content(),
        rows: trace.rows(),
        processor: processor(),
        threads: rayon::current_num_threads(),
        adapter: engines.iter().find_map(|(_, engine)| engine.adapter()),
        results,
    };
    report(json, "screendoor.throughput", &document, console, || print(&document, console))
}

/// The engines where none are named: a machine without a GPU is no mistake of the user's,
/// unless one was named.
fn usual_engines(adapter: Option<&str>, console: &Console) -> Result<Vec<EngineName>> {
    let fast = EngineName::Cpu(Implementation::Fast);
    match (EngineName::Gpu.open(adapter), adapter) {
        (Ok(_), _) => Ok(vec![fast, EngineName::Gpu]),
        (Err(error), Some(_)) => Err(error),
        (Err(error), None) => {
            console.warn(&format!("no GPU is measured: {error}"));
            Ok(vec![fast])
        }
    }
}

/// Millions of things a second.
fn rate(things: u64, spread: Option<Spread>) -> String {
    spread.map_or_else(String::new, |s| format!("{:.1}", things as f64 / s.median / 1e6))
}

fn milliseconds(spread: Option<Spread>) -> String {
    let ms = |seconds: f64| format!("{:.1}", seconds * 1e3);
    spread
        .map_or_else(String::new, |s| format!("{} ({} to {})", ms(s.median), ms(s.low), ms(s.high)))
}

/// What names a result.
fn names(result: &Throughput) -> Vec<String> {
    vec![result.design.clone(), result.samples.to_string(), result.engine.name().to_string()]
}

/// Fragments over all passes.
fn drawn(result: &Throughput) -> u64 {
    result.fragments * u64::from(result.passes)
}

fn gigabytes(result: &Throughput, spread: Option<Spread>) -> String {
    spread.map_or_else(String::new, |s| format!("{:.2}", result.bytes as f64 / s.median / 1e9))
}

/// A result as a row of the table of whole replays.
fn whole(result: &Throughput) -> Vec<String> {
    let mut row = names(result);
    match &result.missing {
        Some(why) => row.push(why.clone()),
        None => row.extend([
            milliseconds(result.whole),
            rate(drawn(result), result.whole),
            rate(result.covered * u64::from(result.passes), result.whole),
            gigabytes(result, result.whole),
        ]),
    }
    row
}

/// A result as a row of the table of what a GPU does.
fn on_gpu(result: &Throughput) -> Vec<String> {
    let mut row = names(result);
    row.extend([
        milliseconds(result.kernel),
        rate(drawn(result), result.kernel),
        gigabytes(result, result.kernel),
        milliseconds(result.bin),
        milliseconds(result.upload),
        milliseconds(result.back),
    ]);
    row
}

fn print(document: &Document<'_>, console: &Console) -> Result<()> {
    let place = shown(document.trace);
    console.print(format_args!("{place}: {} fragments", grouped(document.rows)))?;
    console.print(format_args!(
        "processor: {}, {} threads",
        shown(&document.processor),
        document.threads
    ))?;
    if let Some(adapter) = document.adapter {
        console.print(format_args!("GPU: {}", shown(adapter.to_string())))?;
    }
    let header = ["design", "samples", "engine", "whole, ms", "M frag/s", "M samples/s", "GB/s"];
    let rows = document.results.iter().map(whole).collect();
    console.print(format_args!("\n{}", table(&header, rows)))?;
    let of_gpu: Vec<_> =
        document.results.iter().filter(|r| r.upload.is_some()).map(on_gpu).collect();
    if !of_gpu.is_empty() {
        let header = [
            "design",
            "samples",
            "engine",
            "kernel, ms",
            "M frag/s",
            "GB/s",
            "sorting, ms",
            "upload, ms",
            "back, ms",
        ];
        console.print(format_args!("\n{}", table(&header, of_gpu)))?;
    }
    console.print(format_args!(
        "\nmedians (quartiles) of several replays; kernel and sorting by the GPU's own clock; \
         bytes are those that must move: columns and state, once a pass"
    ))
}

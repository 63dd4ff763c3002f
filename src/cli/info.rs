//! `screendoor info`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::arguments::MemoryArgument;
use crate::cli::console::{Console, grouped, shown};
use crate::cli::files::{JsonArgument, check, open_trace, report};
use crate::error::Result;
use crate::param::Options;
use crate::trace::{Checksums, Header, Statistics, Trace, View, statistics_within};

/// Show what a user wants to know first about a trace
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that the search for fragments at one depth may take; less takes longer")
}))]
pub(super) struct Arguments {
    /// The trace
    trace: PathBuf,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    json: JsonArgument,
}

#[derive(serde::Serialize)]
struct Document<'a> {
    trace: String,
    header: &'a Header,
    content: Option<&'a str>,
    checksums: Checksums,
    converted_columns: Vec<(&'static str, String, String)>,
    extra_columns: &'a [(String, String)],
    row_bytes: usize,
    batches: usize,
    statistics: &'a Statistics,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let outputs: Vec<&Path> = arguments.json.path().into_iter().collect();
    check(&[&arguments.trace], &outputs)?;
    let trace = open_trace(&arguments.trace, console)?;
    let json = arguments.json.open()?;
    let progress = console.progress("counting", "fragments");
    let memory = arguments.memory.bytes();
    let mut last = 0;
    let stats = statistics_within(&trace, memory, |done, total| {
        if done < last {
            progress.name("looking for equal depths");
        }
        last = done;
        progress.set(done, total);
    })?;
    drop(progress);
    let document = Document {
        trace: trace.place().to_string(),
        header: trace.header(),
        content: trace.content(),
        checksums: trace.checksums(),
        converted_columns: trace
            .converted_columns()
            .map(|(name, stored, read)| (name, stored, read.to_string()))
            .collect(),
        extra_columns: trace.extra_columns(),
        row_bytes: trace.header().row_bytes(),
        batches: trace.batch_count(),
        statistics: &stats,
    };
    report(json, "screendoor.info", &document, console, || print(&trace, &stats, console))
}

fn print(trace: &Trace, stats: &Statistics, console: &Console) -> Result<()> {
    let line =
        |name: &str, value: String| console.print(format_args!("{name:<18}{}", shown(value)));
    let header = trace.header();
    let share = |part: u64, whole: u64| {
        if whole == 0 { 0.0 } else { 100.0 * part as f64 / whole as f64 }
    };
    console.print(format_args!("{}", shown(trace.place())))?;
    line("source", header.source.clone())?;
    line("camera", header.camera.clone())?;
    for (name, value) in header.view.iter().flat_map(view_lines) {
        line(name, value)?;
    }
    line("frame", format!("{} x {} pixels", header.width, header.height))?;
    let nested = if header.pattern.nested { ", serves every smaller count" } else { "" };
    line("samples", format!("{} ({}{nested})", header.pattern.samples(), header.pattern.name))?;
    let [r, g, b] = header.background;
    line("background", format!("{r} {g} {b}"))?;
    line("colours", format!("{}, as designs blend them", header.space.name()))?;
    line("fragments", format!("{} of {} bytes", grouped(stats.fragments), header.row_bytes()))?;
    for (column, value) in &header.constants {
        line("  constant", format!("{} = {value}", column.name()))?;
    }
    for (column, stored, read) in trace.converted_columns() {
        line("  read", format!("{column}: {read} from {stored}"))?;
    }
    for (column, stored) in trace.extra_columns() {
        line("  passed over", format!("{column}: {stored}"))?;
    }
    if let Some(content) = trace.content() {
        line("content", content.to_string())?;
    }
    let pixels = u64::from(header.width) * u64::from(header.height);
    line(
        "covered pixels",
        format!("{} ({:.1} %)", grouped(stats.covered_pixels), share(stats.covered_pixels, pixels)),
    )?;
    line(
        "  without an edge",
        format!(
            "{} ({:.1} % of them)",
            grouped(stats.interior_pixels),
            share(stats.interior_pixels, stats.covered_pixels)
        ),
    )?;
    line(
        "whole fragments",
        format!(
            "{} ({:.1} %)",
            grouped(stats.whole_fragments),
            share(stats.whole_fragments, stats.fragments)
        ),
    )?;
    let depth = &stats.depth_complexity;
    line(
        "depth complexity",
        format!(
            "mean {:.2}, median {}, 95th percentile {}, max {} fragments per covered pixel",
            depth.mean, depth.median, depth.p95, depth.max
        ),
    )?;
    console.print(format_args!("  pixels by their fragments"))?;
    for (i, n) in depth.histogram.iter().enumerate() {
        let low = if i == 0 { 1 } else { (1_u64 << (i - 1)) + 1 };
        let range = if low >= 1 << i { format!("{low}") } else { format!("{low}-{}", 1_u64 << i) };
        line(&format!("    {range}"), bar(*n, stats.covered_pixels))?;
    }
    line("layers", format!("{:.2} per sample of the covered pixels", stats.layers))?;
    line(
        "alpha",
        format!(
            "min {}, mean {:.4}, max {}; {} exactly 0, {} exactly 1",
            stats.alpha.min,
            stats.alpha.mean,
            stats.alpha.max,
            grouped(stats.alpha.zero),
            grouped(stats.alpha.opaque)
        ),
    )?;
    console.print(format_args!("  fragments by their alpha"))?;
    for (i, n) in stats.alpha.histogram.iter().enumerate() {
        let range = format!("    {:.1}-{:.1}", i as f64 / 10.0, (i + 1) as f64 / 10.0);
        line(&range, bar(*n, stats.fragments))?;
    }
    line(
        "at equal depths",
        format!(
            "{} ({:.1} % of the fragments share a depth with another one at a sample)",
            grouped(stats.tied_fragments),
            share(stats.tied_fragments, stats.fragments)
        ),
    )?;
    if let Some([near, far]) = stats.depth {
        line("depth", format!("{near:.6} to {far:.6} of the range"))?;
    }
    let last = stats.primitives.checked_sub(1);
    let numbered = last.map_or("none".to_string(), |n| format!("numbered up to {}", grouped(n)));
    line("primitives", numbered)?;
    let more = if stats.objects.more { "more than " } else { "" };
    line("objects", format!("{more}{}", grouped(stats.objects.count as u64)))?;
    console.print(format_args!("  fragments of the largest objects, by number"))?;
    for (object, n) in &stats.objects.largest {
        line(&format!("    {object}"), bar(*n, stats.fragments))?;
    }
    Ok(())
}

/// A view: its kind and planes, and its matrices row by row.
fn view_lines(view: &View) -> Vec<(&'static str, String)> {
    let View { near, far, .. } = view;
    let kind = view.projection.name();
    let mut lines = vec![("view", format!("{kind}, from {near:.6} to {far:.6} scene units"))];
    for (name, matrix) in
        [("  world to view", &view.world_to_view), ("  view to clip", &view.view_to_clip)]
    {
        for row in 0..4 {
            let elements = matrix.iter().skip(row).step_by(4);
            let text: String = elements.map(|v| format!("{v:>14.6}")).collect();
            lines.push((if row == 0 { name } else { "" }, text));
        }
    }
    lines
}

/// A bar of up to 30 characters with its figure.
fn bar(n: u64, whole: u64) -> String {
    let length = if whole == 0 { 0 } else { (30 * n).div_ceil(whole) as usize };
    format!("{:<31}{}", "#".repeat(length), grouped(n))
}

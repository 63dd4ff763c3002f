//! `screendoor explain`.

use std::path::Path;

use clap::Args;

use crate::cli::arguments::{MemoryArgument, RunArguments, numbers};
use crate::cli::console::{Console, shown};
use crate::cli::files::{JsonArgument, check, report};
use crate::error::{Error, Result};
use crate::picture::Space;
use crate::rop::{Contents, ExplainLimits, Site, Step};
use crate::study::explained::Explained;
use crate::trace::{SampleMask, Unorm32};

/// Show what a design does at one pixel, fragment by fragment
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that the story may take, as text too; a longer one is refused")
}))]
pub(super) struct Arguments {
    #[command(flatten)]
    run: RunArguments,
    /// The pixel: column and row from the top left
    #[arg(long, value_name = "X,Y", value_parser = numbers::<2>, allow_hyphen_values = true)]
    pixel: [f64; 2],
    /// Show only the last N fragments
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    last: Option<usize>,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    json: JsonArgument,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let outputs: Vec<&Path> = arguments.json.path().into_iter().collect();
    check(&[arguments.run.path()], &outputs)?;
    let (design, trace, samples) = arguments.run.open(console)?;
    let seed = arguments.run.seed;
    let coordinate = |v: f64| {
        let whole = v.fract() == 0.0 && (0.0..65536.0).contains(&v);
        whole.then_some(v as u16).ok_or_else(|| {
            Error::config(format_args!("{v} is no pixel coordinate"), "give whole numbers from 0")
        })
    };
    let site = Site { x: coordinate(arguments.pixel[0])?, y: coordinate(arguments.pixel[1])? };
    let json = arguments.json.open()?;
    let progress = console.progress("searching", "fragments");
    let watch = |done, total| progress.set(done, total);
    let place = (&trace, trace.place());
    let last = arguments.last.unwrap_or(usize::MAX);
    let limits =
        ExplainLimits { last, memory: arguments.memory.bytes(), ..ExplainLimits::default() };
    let document = Explained::of(&design, place, samples, seed, site, limits, &watch)?;
    drop(progress);
    let explanation = &document.explanation;
    let passes = explanation.passes();
    let left_out = explanation.left_out as usize;
    let all = left_out + explanation.steps.len();
    report(json, "screendoor.explain", &document, console, || {
        console.print(format_args!(
            "{} at pixel {},{} of {}: {samples} samples, seed {}",
            design.label(),
            site.x,
            site.y,
            shown(trace.place()),
            seed
        ))?;
        if all == 0 {
            console.print(format_args!("no fragment of the trace covers this pixel"))?;
        }
        if left_out > 0 {
            console.print(format_args!("… {left_out} fragments before"))?;
        }
        let before = explanation.before.as_ref().unwrap_or(&explanation.cleared);
        let mut before = before.clone();
        for (i, step) in explanation.steps.iter().enumerate() {
            print_step(left_out + i + 1, all, passes, step, &before, console)?;
            before = step.contents.clone();
        }
        let [r, g, b] = explanation.colour;
        let space = trace.header().space;
        let space = if space == Space::Linear { "" } else { " (encoded)" };
        console.print(format_args!("resolved: {r:.5} {g:.5} {b:.5}{space}"))
    })
}

fn list(mask: SampleMask) -> String {
    let samples: Vec<String> = mask.iter().map(|s| s.to_string()).collect();
    if samples.is_empty() { "none".to_string() } else { samples.join(" ") }
}

/// A depth as a share of the depth range.
fn depth(z: Unorm32) -> String {
    if z == Unorm32::FAR {
        return "far".to_string();
    }
    format!("{:.6}", f64::from(z.0) / f64::from(u32::MAX))
}

fn print_step(
    number: usize,
    all: usize,
    passes: u32,
    step: &Step,
    before: &Contents,
    console: &Console,
) -> Result<()> {
    let line = |name: &str, value: String| console.print(format_args!("  {name:<10} {value}"));
    let f = &step.fragment;
    let [r, g, b] = f.colour;
    let pass = if passes > 1 { format!("pass {}, ", step.pass + 1) } else { String::new() };
    console.print(format_args!(
        "\n{pass}fragment {number} of {all}, row {}: primitive {}, object {}",
        step.row, f.primitive, f.object
    ))?;
    line("fragment", format!("alpha {}, colour {r:.4} {g:.4} {b:.4}", f.alpha))?;
    line("depth", format!("{} at the centre", depth(f.depth.z)))?;
    line("covers", list(f.coverage))?;
    let record = &step.record;
    if let Some(passed) = record.passed {
        line("nearer", format!("{} pass the depth test", list(passed)))?;
    }
    if let Some(surface) = record.surface {
        line("surface", format!("starts surface {surface}"))?;
    }
    if let Some(order) = &record.order {
        let order: Vec<String> = order.iter().map(u8::to_string).collect();
        line("sorted", order.join(" "))?;
    }
    if !record.references.is_empty() {
        let tests = record.references.iter().map(|t| {
            let verdict = if t.passed { "passes" } else { "fails" };
            format!("{} as #{}: {:.4} {verdict}", t.sample, t.number, t.value)
        });
        let tests: Vec<String> = tests.collect();
        for (i, few) in tests.chunks(4).enumerate() {
            let name = if i == 0 { "references" } else { "" };
            line(name, few.join("  "))?;
        }
    }
    line("writes", list(record.written))?;
    for remark in &record.remarks {
        line("", remark.clone())?;
    }
    let after = &step.contents;
    if !after.samples.is_empty() {
        let shown: Vec<String> = after
            .samples
            .iter()
            .enumerate()
            .map(|(s, sample)| {
                let changed = before.samples.get(s) != Some(sample);
                let [r, g, b] = sample.colour;
                let mark = if changed { "*" } else { " " };
                format!("{mark}{s:>2} {} ({r:.3} {g:.3} {b:.3})", depth(sample.depth))
            })
            .collect();
        for (i, few) in shown.chunks(3).enumerate() {
            let name = if i == 0 { "samples" } else { "" };
            line(name, few.join("  "))?;
        }
    }
    for (name, value) in &after.fields {
        for (i, part) in value.split("; ").enumerate() {
            line(if i == 0 { name } else { "" }, part.to_string())?;
        }
    }
    Ok(())
}

//! `screendoor shade`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{MemoryArgument, RunArguments, option};
use crate::cli::console::{Console, grouped};
use crate::cli::edit::{Document, Target};
use crate::cli::files::report;
use crate::error::Result;
use crate::param::Values;
use crate::rop::ReplayOptions;
use crate::rop::visibility::{Filter, Taps};
use crate::study::shadows::{Shade, ShadowCost, ShadowOptions, VisibilityError};

/// Give a camera's trace the shadows of a light: the light's trace is drawn by a design, and tells
/// how much light reaches each fragment
#[derive(Debug, Args)]
#[command(mut_arg("trace", |trace| trace.value_name("LIGHT").help(
    "The light's trace, as 'capture --light-trace' writes it beside the camera's"
)))]
#[command(mut_arg("samples", |samples| {
    samples.help("Samples per pixel of the light's map; its trace's own count where not given")
}))]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that the light's fragments may take that are sorted into tiles, and the exact answer's state")
}))]
pub(super) struct Arguments {
    /// The camera's trace, captured with --light
    camera: PathBuf,
    #[command(flatten)]
    run: RunArguments,
    #[command(flatten)]
    target: Target,
    /// Draw the light's trace so many times, with a seed each, and take the mean: 1 to 64
    #[arg(long, default_value_t = 1, value_name = "N", allow_negative_numbers = true)]
    rounds: u32,
    /// How many places of the map a fragment is compared with (percentage-closer filtering): 1 to
    /// 64, a square number with --taps regular
    #[arg(long, default_value_t = Filter::default().taps, value_name = "N", allow_negative_numbers = true)]
    pcf: u32,
    /// Half the width of the region in which they lie, in pixels of the map
    #[arg(long, default_value_t = 1.5, value_name = "PIXELS", allow_negative_numbers = true)]
    radius: f64,
    /// Where in the region they lie
    #[arg(long, default_value = "regular", value_parser = option::<Taps>())]
    taps: Taps,
    /// How far a fragment is drawn towards the light before it is compared, as a share of the
    /// light's depth range
    #[arg(long, default_value_t = Filter::default().bias, value_name = "SHARE", allow_negative_numbers = true)]
    bias: f64,
    /// The same, in pixels of the map for which the surface's slope is followed
    #[arg(long, default_value_t = Filter::default().slope_bias, value_name = "PIXELS", allow_negative_numbers = true)]
    slope_bias: f64,
    /// Do not take the exact answer beside it, nor the error against that
    #[arg(long)]
    no_error: bool,
    #[command(flatten)]
    memory: MemoryArgument,
}

#[derive(Serialize)]
struct Shaded<'a> {
    #[serde(flatten)]
    edit: &'a Document<'a>,
    design: String,
    parameters: &'a Values,
    light_samples: u32,
    seed: u32,
    rounds: u32,
    pcf: u32,
    radius: f64,
    taps: Taps,
    bias: f64,
    slope_bias: f64,
    cost: ShadowCost,
    /// Of visibility, 0 to 1, against the exact one over the same taps.
    error: Option<VisibilityError>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let run = &arguments.run;
    let (traces, files) = arguments.target.begin(&[&arguments.camera, run.path()], console)?;
    let [camera, light] = &traces[..] else { unreachable!("two are asked for") };
    let (design, samples) = run.of(light)?;
    let filter = Filter {
        taps: arguments.pcf,
        radius: arguments.radius,
        kind: arguments.taps,
        bias: arguments.bias,
        slope_bias: arguments.slope_bias,
        seed: run.seed,
    };
    let options = ShadowOptions {
        design,
        samples,
        seed: run.seed,
        rounds: arguments.rounds,
        filter,
        measure: !arguments.no_error,
    };
    let progress = console.progress("drawing the light's view", "fragments");
    let watch = |done, total| progress.set(done, total);
    let replay = ReplayOptions {
        memory: arguments.memory.bytes(),
        progress: &watch,
        ..ReplayOptions::default()
    };
    let shade = Shade::new(camera, light, &options, &replay)?;
    drop(progress);
    // What the camera's trace loses is told of it alone.
    let (edit, json) = files.write(&shade, &traces[..1], console)?;
    let document = Shaded {
        edit: &edit,
        design: options.design.label(),
        parameters: options.design.values(),
        light_samples: samples,
        seed: run.seed,
        rounds: arguments.rounds,
        pcf: filter.taps,
        radius: filter.radius,
        taps: filter.kind,
        bias: filter.bias,
        slope_bias: filter.slope_bias,
        cost: shade.cost(),
        error: shade.error(),
    };
    if document.error.as_ref().is_some_and(|error| error.queries == 0) {
        console.warn("no fragment has anything of the light's");
    }
    report(json, "screendoor.shade", &document, console, || {
        edit.print(console)?;
        let ShadowCost { state_bits, passes } = document.cost;
        let passes = if passes == 1 { "1 pass".into() } else { format!("{passes} passes") };
        let state = match state_bits {
            Some(bits) => format!("{bits} bits a pixel"),
            None => "a state that grows with the fragments".into(),
        };
        console.print(format_args!(
            "light: {} at {samples} samples, {state}, {passes}",
            document.design
        ))?;
        let Some(error) = &document.error else { return Ok(()) };
        console.print(format_args!(
            "visibility: RMSE {:.4}, mean error {:+.4}, greatest {:.3}, over {} fragments (mean {:.3})",
            error.rmse,
            error.mean,
            error.max,
            grouped(error.queries),
            error.truth
        ))
    })
}

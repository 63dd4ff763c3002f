//! `screendoor demo`.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::capture::{Capture, CaptureOptions};
use crate::cli::console::{Console, grouped, table};
use crate::design::configure;
use crate::error::{Error, Result};
use crate::picture::{Layer, write_exr, write_png};
use crate::scene;
use crate::study::{Measured, Plan, measure};
use crate::trace::{Trace, TraceWriter, WriteOptions};

/// Do the main job on a built-in scene: capture it, replay it through 'lk' and
/// 'enderton' at 4, 8 and 16 samples, hold them against 'exact'
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where the trace and the pictures go
    #[arg(long, short, default_value = "screendoor-demo", value_name = "FOLDER")]
    output: PathBuf,
    /// The scene
    #[arg(long, default_value = "builtin:engine", value_name = "SCENE")]
    scene: String,
}

const SAMPLES: [u32; 3] = [4, 8, 16];
const DESIGNS: [&str; 2] = ["lk", "enderton"];
const SIDE: u32 = 512;
const SEEDS: u32 = 4;

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let path = folder.join("trace.arrow");
    let fragments = capture(&arguments.scene, &path, console)?;
    console.print(format_args!(
        "captured {} at {SIDE}x{SIDE}: {} fragments in {}",
        arguments.scene,
        grouped(fragments),
        path.display()
    ))?;

    let trace = Trace::open(&path)?;
    let designs = DESIGNS.map(|d| configure(d, &[])).into_iter().collect::<Result<_>>()?;
    let plan = Plan { designs, samples: SAMPLES.to_vec(), seeds: SEEDS };
    let progress = console.progress("replaying", "replays");
    let measured = measure(&trace, &plan, 512 << 20, |what, done, total| {
        progress.name(what);
        progress.set(done, total);
    })?;
    drop(progress);

    console.print(format_args!(
        "\nerror against exact, RMSE in 8-bit units of the pixels that hold fragments, {SEEDS} seeds"
    ))?;
    console.print(format_args!("{}", error_table(&measured.runs)))?;

    for (samples, reference) in SAMPLES.iter().zip(&measured.references) {
        for m in measured.runs.iter().filter(|m| m.run.samples == *samples) {
            let name = format!("{}-{samples}", m.run.design);
            write_png(folder.join(format!("{name}.png")), &m.picture)?;
            let error = m.picture.zip(reference, |a, b| std::array::from_fn(|i| a[i] - b[i]));
            let layers = [
                Layer { name: "colour", picture: &m.picture },
                Layer { name: "reference", picture: reference },
                Layer { name: "error", picture: &error },
            ];
            write_exr(folder.join(format!("{name}.exr")), &layers)?;
        }
    }
    if let Some(reference) = measured.references.last() {
        write_png(folder.join("exact.png"), reference)?;
    }
    console.print(format_args!(
        "\npictures are in {0}/ (.png to look at, .exr with the layers colour, reference and error)\n\
         next: screendoor info {1}; screendoor explain {1} --pixel {2},{2} --samples 8",
        folder.display(),
        path.display(),
        SIDE / 2
    ))
}

fn capture(source: &str, path: &Path, console: &Console) -> Result<u64> {
    let scene = scene::load(source)?;
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let options = CaptureOptions { width: SIDE, height: SIDE, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options)?;
    let header = capture.header().clone();
    let mut writer = TraceWriter::create(path, header, WriteOptions::default())?;
    let progress = console.progress("capturing", "triangles");
    capture.draw(&mut writer, |done, total| progress.set(done, total))?;
    drop(progress);
    let (file, written) = writer.finish()?;
    file.commit()?;
    Ok(written.rows)
}

fn error_table(runs: &[Measured]) -> comfy_table::Table {
    let header = [
        "design",
        "samples",
        "RMSE",
        "sRGB",
        "mean",
        "fragments/s",
        "hashes/frag",
        "state bytes/frag",
        "state bits/pixel",
    ];
    let rows = runs.iter().map(|m| {
        let (run, e) = (&m.run, &m.run.covered);
        let fragments = run.events.fragments as f64;
        let [read, written] = run.events.state_bytes();
        vec![
            run.design.clone(),
            run.samples.to_string(),
            format!("{:.2} ± {:.2}", e.rmse.value, e.rmse.half_width()),
            format!("{:.2}", e.rmse_srgb.value),
            format!("{:+.3}", e.mean.value),
            format!("{:.1} M", fragments / run.seconds / 1e6),
            format!("{:.2}", run.events.hashes as f64 / fragments),
            format!("{:.1}", (read + written) as f64 / fragments),
            run.state_bits.total().to_string(),
        ]
    });
    table(&header, rows.collect())
}

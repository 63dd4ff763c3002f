//! `screendoor demo`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::capture::CaptureOptions;
use crate::cli::arguments;
use crate::cli::capture::record;
use crate::cli::console::{Console, grouped, shown, table};
use crate::cli::files::{Json, JsonArgument, check, check_scene, report, write_pictures};
use crate::cli::kind::{Kind, check_output};
use crate::design::{Configured, REFERENCE, configure};
use crate::error::{Error, Result};
use crate::output::OutputFile;
use crate::picture::{Picture, PictureFile};
use crate::scene;
use crate::study::engine::FAST;
use crate::study::measure::{Measured, Reference, Setup, Subject, measure};
use crate::study::record::{Record, Speed};
use crate::study::throughput::Spread;
use crate::trace::{Trace, WriteOptions};

/// Do the main job on a built-in scene: capture it, replay it through 'lk' and
/// through 'enderton', stratified and naive, at 4, 8 and 16 samples, hold them
/// against 'exact'
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where the trace and the pictures go
    #[arg(long, short, default_value = "screendoor-demo", value_name = "FOLDER")]
    output: PathBuf,
    /// The scene
    #[arg(long, default_value = "builtin:engine", value_name = "SCENE")]
    scene: OsString,
    #[command(flatten)]
    json: JsonArgument,
}

const SAMPLES: [u32; 3] = [4, 8, 16];
/// The proposal, what it is held against, and what it improves on.
const DESIGNS: [&str; 3] = ["lk", "enderton", "enderton:mask=naive"];
const SIDE: u32 = 512;
const SEEDS: u32 = 4;

#[derive(Serialize)]
struct Document<'a> {
    scene: &'a str,
    content: Option<&'a str>,
    fragments: u64,
    width: u32,
    height: u32,
    runs: Vec<&'a Record>,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let folder = &arguments.output;
    let (source, scene_path) = arguments::scene(&arguments.scene)?;
    check_output(folder, Kind::Folder)?;
    scene::check(source)?;
    let designs = DESIGNS.map(|d| configure(d, &[])).into_iter().collect::<Result<Vec<_>>>()?;
    let path = folder.join("trace.arrow");
    // Before the check: names of files are compared within folders that exist.
    std::fs::create_dir_all(folder).map_err(|e| Error::io("create", folder, e))?;
    let names = picture_paths(folder, &designs);
    let outputs = names.iter().chain([&path]).map(|p| &**p).chain(arguments.json.path());
    let outputs: Vec<&Path> = outputs.collect();
    check(scene_path.as_slice(), &outputs)?;
    let file = OutputFile::create(&path)?;
    let create = |path| PictureFile::create(path, SIDE, SIDE);
    let files = names.iter().map(create).collect::<Result<Vec<_>>>()?;
    let json = arguments.json.open()?;
    // Standard output holds either JSON or text. Where nobody reads it any more the
    // files are written all the same.
    let aloud = !matches!(json, Some(Json::Standard));
    let mut said = Ok(());
    let mut say = |text: std::fmt::Arguments<'_>| {
        if aloud && said.is_ok() {
            said = console.print(text);
        }
    };

    let loading = console.progress("loading the scene", "");
    let scene = scene::load(source)?;
    drop(loading);
    check_scene(&scene, &outputs)?;
    let options = CaptureOptions { width: SIDE, height: SIDE, ..CaptureOptions::default() };
    let fragments = record(&scene, &options, WriteOptions::default(), file, console)?.rows;
    say(format_args!(
        "captured {} at {SIDE}x{SIDE}: {} fragments in {}",
        shown(source),
        grouped(fragments),
        shown(path.display())
    ));
    let trace = Trace::open(&path)?;
    let content = trace.content().map(ToString::to_string);
    let measured = Measurements::of(source, trace, &designs, console)?;

    say(format_args!(
        "\nerror against exact, RMSE in 8-bit units of the pixels that hold fragments, {SEEDS} seeds"
    ));
    say(format_args!("{}", error_table(&measured.runs)));
    if let Some(comparison) = comparison(&measured.runs) {
        say(format_args!("\n{comparison}"));
    }
    let saved = save(files, &measured, console);
    if saved.is_ok() {
        say(format_args!(
            "\npictures are in {0}/ (.png to look at, .exr with the layers colour, reference and \
             error)\n\
             next: screendoor info {1}; screendoor explain {1} --pixel {2},{2} --samples 8",
            shown(folder.display()),
            shown(path.display()),
            SIDE / 2
        ));
    }
    let document = Document {
        scene: source,
        content: content.as_deref(),
        fragments,
        width: SIDE,
        height: SIDE,
        runs: measured.runs.iter().map(|m| &m.record).collect(),
    };
    // The text has been printed.
    let reported = json.map_or(Ok(()), |json| {
        report(Some(json), "screendoor.demo", &document, console, || Ok(()))
    });
    saved.and(reported).and(said)
}

/// What is measured: the runs, sample count after sample count, and the exact picture at each.
struct Measurements {
    runs: Vec<Measured>,
    references: Vec<Picture>,
}

impl Measurements {
    fn of(scene: &str, trace: Trace, designs: &[Configured], console: &Console) -> Result<Self> {
        const MEMORY: u64 = 512 << 20;
        let progress = console.progress("replaying", "runs");
        let total = (SAMPLES.len() * (designs.len() + 1) + 1) as u64;
        let mut done = 0;
        let mut tell = |what: &str| {
            progress.name(what);
            progress.set(done, total);
            done += 1;
        };
        tell(REFERENCE);
        let subject = Subject::new(scene, trace, None, MEMORY)?;
        let setup = Setup { engine: FAST, seeds: 0..SEEDS, metrics: &[] };
        let mut measured = Measurements { runs: Vec::new(), references: Vec::new() };
        for samples in SAMPLES {
            tell(&format!("{REFERENCE} at {samples}"));
            let reference = Reference::of(&subject, samples, setup.metrics)?;
            for design in designs {
                tell(&format!("{} at {samples}", design.label()));
                let mut run = measure(&subject, &reference, design, &setup)?;
                let seconds = Spread::of(&run.timed.seconds);
                let threads = Some(rayon::current_num_threads() as u32);
                let speed = Speed { seconds, threads, ..Speed::default() };
                run.record.speed.insert("fast".to_string(), speed);
                measured.runs.push(run);
            }
            measured.references.push(reference.picture);
        }
        Ok(measured)
    }
}

/// Names that every file system takes.
fn file_name(design: &str, samples: u32) -> String {
    format!("{}-{samples}", design.replace([':', '=', ','], "-"))
}

/// The demo's pictures: two files a run, run after run, and the exact one.
fn picture_paths(folder: &Path, designs: &[Configured]) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    for samples in SAMPLES {
        for design in designs {
            let name = file_name(&design.label(), samples);
            paths.extend(["png", "exr"].map(|ending| folder.join(format!("{name}.{ending}"))));
        }
    }
    paths.push(folder.join("exact.png"));
    paths
}

/// Writes the pictures, in the order of [`picture_paths`].
fn save(mut files: Vec<PictureFile>, measured: &Measurements, console: &Console) -> Result<()> {
    let mut rest = files.chunks_mut(2);
    for (m, pair) in measured.runs.iter().zip(rest.by_ref()) {
        let at =
            SAMPLES.iter().position(|s| *s == m.record.samples).expect("a sample count of ours");
        write_pictures(pair, &m.picture, Some(&measured.references[at]), console)?;
    }
    if let (Some(exact), Some(reference)) = (rest.next(), measured.references.last()) {
        write_pictures(exact, reference, None, console)?;
    }
    files.into_iter().try_for_each(PictureFile::commit)
}

/// What the table's last rows say of the claim: LK against what it improves on.
fn comparison(runs: &[Measured]) -> Option<String> {
    let samples = SAMPLES[SAMPLES.len() - 1];
    let noise = |design: &str| {
        let run = runs.iter().find(|m| m.record.design == design && m.record.samples == samples)?;
        Some(run.record.covered.rmse.value).filter(|_| run.record.covered.pixels > 0)
    };
    let [lk, stratified, naive] = DESIGNS.map(noise);
    let (by_stratified, by_naive) = (lk? / stratified?, lk? / naive?);
    (by_stratified.is_finite() && by_naive.is_finite()).then(|| {
        format!(
            "at {samples} samples lk has {by_naive:.2} of the noise (RMSE) of naive stochastic \
             transparency\n(enderton:mask=naive), and {by_stratified:.2} of that of the \
             stratified one (enderton)"
        )
    })
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
        let (run, e) = (&m.record, &m.record.covered);
        let seconds = run.speed.values().find_map(|s| s.seconds).map_or(f64::NAN, |s| s.median);
        let fragments = run.events.fragments as f64;
        // Where there is no fragment there is nothing to say of one.
        let known = |text: String| if run.events.fragments == 0 { "-".to_string() } else { text };
        let [read, written] = run.events.state_bytes();
        vec![
            run.design.clone(),
            run.samples.to_string(),
            known(format!("{:.2} ± {:.2}", e.rmse.value, e.rmse.half_width())),
            known(format!("{:.2}", e.rmse_srgb.value)),
            known(format!("{:+.3}", e.mean.value)),
            known(format!("{:.1} M", fragments / seconds / 1e6)),
            known(format!("{:.2}", run.events.hashes as f64 / fragments)),
            known(format!("{:.1}", (read + written) as f64 / fragments)),
            run.state_bits.total().to_string(),
        ]
    });
    table(&header, rows.collect())
}

//! `screendoor capture --vulkan`: the fragments of another program.

use std::ffi::OsString;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::cli::arguments::{MemoryArgument, option, range};
use crate::cli::capture::CommonArguments;
use crate::cli::console::{Console, grouped, shown, table};
use crate::cli::files::{Json, check, keep_trace, print_trace, report};
use crate::cli::kind::{Kind, check_output};
use crate::cli::signals::runs_under_us;
use crate::error::{Error, Result};
use crate::output::{OutputFile, TemporaryFolder};
use crate::param::Options;
use crate::trace::{Header, MAX_SAMPLES, TraceWriter, WriteOptions, Written};
use crate::vulkan::{
    Captures, Check, Conversion, ConvertOptions, Converted, DepthRule, Ended, ListedDevice,
    ListedPass, Listing, Run, Settings, Span, TargetChoice, layer_library, why_nothing,
};

/// What is captured of which program.
#[derive(Debug, Args)]
#[command(mut_arg("memory", |memory| {
    memory.help("MiB that fragments may take that are put into order together; less takes longer")
}))]
pub(super) struct VulkanArguments {
    /// Run a program and record the fragments of a frame of it
    #[arg(long, group = "held_against")]
    vulkan: bool,
    /// Which frame, from 0 on, counted by presentations: the first that draws anything where not
    /// given, and all there is of a program that presents nothing
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "submits")]
    frame: Option<u64>,
    /// Which submissions to the GPU, from 0 on, in place of a frame
    #[arg(long, value_name = "A-B", value_parser = range::<u64>)]
    submits: Option<RangeInclusive<u64>>,
    /// Which of the images that are drawn into: largest (with the most fragments), present (what
    /// is shown), a size such as 800x600, or a number of --list such as '#2'
    #[arg(long, default_value_t, value_name = "TARGET")]
    target: TargetChoice,
    /// Which of the shaders' colour outputs is recorded
    #[arg(long, default_value_t = 0, value_name = "L", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(0..=31))]
    location: u32,
    /// What the trace's depths are
    #[arg(long, default_value = "auto", value_parser = option::<DepthRule>())]
    depth: DepthRule,
    /// Print what passes there are, and write no trace
    #[arg(long, conflicts_with = "check")]
    list: bool,
    /// Have Mesa run the program's OpenGL on Vulkan (zink)
    #[arg(long, conflicts_with = "from")]
    opengl: bool,
    /// End the program as soon as the frame is recorded
    #[arg(long, conflicts_with = "from")]
    stop: bool,
    /// Keep what was recorded in a folder, for --from
    #[arg(long, value_name = "FOLDER", conflicts_with = "from")]
    keep: Option<PathBuf>,
    /// Run nothing, and take what was kept
    #[arg(long, value_name = "FOLDER")]
    from: Option<PathBuf>,
    /// Records of fragments to have memory for on the GPU at the start, 48 bytes each
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "from", value_parser = clap::value_parser!(u64).range(1..=1 << 32))]
    capacity: Option<u64>,
    #[command(flatten)]
    memory: MemoryArgument,
    /// The program, and what it is given
    #[arg(last = true, value_name = "PROGRAM", conflicts_with = "from")]
    program: Vec<OsString>,
}

#[derive(Serialize)]
struct Document<'a> {
    trace: &'a str,
    width: u32,
    height: u32,
    samples: u32,
    fragments: u64,
    bytes: u64,
    content: &'a str,
    #[serde(flatten)]
    converted: &'a Converted,
    /// With `--check`: how far what was recorded is from the program's own picture.
    check: Option<&'a Check>,
}

pub(super) fn run(
    arguments: &VulkanArguments,
    common: &CommonArguments,
    console: &Console,
) -> Result<()> {
    let mut begun = Begun::new(arguments, common)?;
    let json = begun.json.take();
    let captures = begun.capture(arguments, common.check, console)?;
    if arguments.list {
        let progress = console.progress("counting", "fragments");
        let listing = Listing::new(&captures)?;
        drop(progress);
        return report(json, "screendoor.vulkan-list", &listing, console, || {
            listing.devices.iter().try_for_each(|device| print(device, console))
        });
    }
    if arguments.from.is_some() {
        captures.notes().for_each(|note| console.note(format_args!("note: {note}")));
    }
    let file = begun.file.take();
    let written = arguments.convert(common, &captures, file, console);
    if written.is_err() && matches!(begun.folder, Folder::Temporary(_)) {
        console.note(format_args!("what was recorded is gone: --keep FOLDER keeps it for --from"));
    }
    let done = written?;
    report(json, "screendoor.vulkan", &done.document(), console, || done.print(console))
}

/// A trace that is made and kept.
struct Done {
    place: String,
    header: Header,
    written: Written,
    converted: Converted,
    check: Option<Check>,
}

impl VulkanArguments {
    /// Makes the trace.
    fn convert(
        &self,
        common: &CommonArguments,
        captures: &Captures,
        file: Option<OutputFile>,
        console: &Console,
    ) -> Result<Done> {
        let Some(file) = file else {
            return Err(Error::config("it is not said where the trace goes", "name it with -o"));
        };
        let options = ConvertOptions {
            span: self.span(),
            target: self.target,
            depth: self.depth,
            background: common.background.map(|b| b.map(|c| c as f32)),
            space: common.space,
            colour: common.colour(),
            samples: Some(common.samples.unwrap_or(MAX_SAMPLES)),
            memory: self.memory.bytes(),
        };
        let progress = console.progress("counting", "fragments");
        let conversion = Conversion::new(captures, options)?;
        progress.name("converting");
        let place = file.path().display().to_string();
        let write = WriteOptions { compression: common.compress, ..WriteOptions::default() };
        let header = conversion.header().clone();
        let mut writer = TraceWriter::new(file, &place, header.clone(), write)?;
        let told = &mut |done, of| progress.set(done, of);
        let converted = conversion.write(&mut writer, told)?;
        progress.name("blending as the program does");
        let check = common.check.then(|| conversion.check(told)).transpose()?;
        drop(progress);
        let (file, written) = writer.finish()?;
        console.warn_all(&converted.warnings, common.strict, &header.source)?;
        keep_trace(file)?;
        Ok(Done { place, header, written, converted, check })
    }
}

impl Done {
    fn document(&self) -> Document<'_> {
        Document {
            trace: &self.place,
            width: self.header.width,
            height: self.header.height,
            samples: self.header.pattern.samples(),
            fragments: self.written.rows,
            bytes: self.written.bytes,
            content: &self.written.content,
            converted: &self.converted,
            check: self.check.as_ref(),
        }
    }

    fn print(&self, console: &Console) -> Result<()> {
        let Done { header, converted, written, .. } = self;
        console.print(format_args!(
            "{}, target #{}: {} draws into {} x {} pixels, {}, samples: {}, depth: {}",
            converted.frame,
            converted.target,
            grouped(converted.objects.len() as u64),
            header.width,
            header.height,
            converted.format,
            header.pattern.samples(),
            converted.depth.name(),
        ))?;
        print_trace(&self.place, written, written.rows, console)?;
        self.check.iter().try_for_each(|check| print_check(check, console))
    }
}

/// Prints how far what was recorded is from the program's own picture.
fn print_check(check: &Check, console: &Console) -> Result<()> {
    for caveat in &check.caveats {
        console.print(format_args!("not done again: {}", shown(caveat)))?;
    }
    if let Some(why) = &check.incomparable {
        return console.print(format_args!("not held against its picture: {}", shown(why)));
    }
    let beyond = check.beyond.iter();
    let beyond = beyond.map(|b| format!("{} by more than {}", grouped(b.pixels), b.units));
    console.print(format_args!(
        "held against the program's picture: of {} pixels {} are exact, {}; {:.2} of 255 at most",
        grouped(check.pixels),
        grouped(check.exact),
        beyond.collect::<Vec<_>>().join(", "),
        check.greatest
    ))
}

impl VulkanArguments {
    fn span(&self) -> Span {
        match (self.frame, &self.submits) {
            (Some(frame), _) => Span::Frames(frame, frame),
            (None, Some(submits)) => Span::Submissions(*submits.start(), *submits.end()),
            (None, None) => Span::First,
        }
    }
}

/// What is written, begun, and the folder that is recorded in.
struct Begun {
    file: Option<OutputFile>,
    json: Option<Json>,
    folder: Folder,
}

enum Folder {
    /// What was kept.
    Given(PathBuf),
    /// What is to be kept.
    Kept(PathBuf),
    Temporary(TemporaryFolder),
}

impl Begun {
    fn new(arguments: &VulkanArguments, common: &CommonArguments) -> Result<Self> {
        if arguments.from.is_none() && arguments.program.is_empty() {
            return Err(Error::config(
                "no program is given to run",
                "name it after --, as in: screendoor capture --vulkan -o t.arrow -- vkcube",
            ));
        }
        let output = if arguments.list { None } else { Some(common.output()?) };
        let outputs: Vec<&Path> = output.into_iter().chain(common.json.path()).collect();
        check(&[], &outputs)?;
        output.map(|output| check_output(output, Kind::Trace)).transpose()?;
        let file = output.map(OutputFile::create).transpose()?;
        let json = common.json.open()?;
        let folder = match (&arguments.from, &arguments.keep) {
            (Some(from), _) => Folder::Given(from.clone()),
            (None, Some(keep)) => Folder::Kept(new_folder(keep)?),
            (None, None) => {
                Folder::Temporary(TemporaryFolder::beside(output.unwrap_or(Path::new("list")))?)
            }
        };
        Ok(Begun { file, json, folder })
    }

    /// Runs the program, where one is to be run, and reads what is there.
    fn capture(
        &self,
        arguments: &VulkanArguments,
        pictures: bool,
        console: &Console,
    ) -> Result<Captures> {
        let folder = match &self.folder {
            Folder::Given(folder) => return given(folder),
            Folder::Kept(folder) => folder.as_path(),
            Folder::Temporary(folder) => folder.path(),
        };
        let mut words = arguments.program.iter().cloned();
        let program = words.next().unwrap_or_default();
        let own = Settings::default();
        let run = Run {
            program: program.clone(),
            arguments: words.collect(),
            settings: Settings {
                folder: Some(folder.to_path_buf()),
                span: arguments.span(),
                location: arguments.location,
                capacity: arguments.capacity.unwrap_or(own.capacity),
                pictures,
                ..own
            },
            library: layer_library()?,
            opengl: arguments.opengl,
            stop: arguments.stop,
        };
        let ended = run.run(&mut |process| runs_under_us(Some(process)));
        runs_under_us(None);
        let ended = ended?;
        let name = program.display();
        match ended {
            Ended::Code(0) | Ended::Stopped => {}
            Ended::Code(code) => console.warn(&format!("{name} ended with exit code {code}")),
            Ended::Signal(signal) => console.warn(&format!("{name} was ended by signal {signal}")),
        }
        let captures = Captures::read(folder)?;
        if captures.is_empty() {
            let (what, hint) = why_nothing(&program, ended);
            return Err(Error::unsupported(name, what, hint));
        }
        Ok(match ended {
            Ended::Signal(_) => captures.broken_off(),
            _ => captures,
        })
    }
}

/// What was kept in a folder.
fn given(folder: &Path) -> Result<Captures> {
    if folder.is_file() {
        return Err(Error::config(
            format_args!("{} is no folder", folder.display()),
            "name a folder that --keep has filled",
        ));
    }
    let captures = Captures::read(folder)?;
    if captures.is_empty() {
        return Err(Error::config(
            format_args!("{} holds no capture", folder.display()),
            "name a folder that --keep has filled",
        ));
    }
    Ok(captures)
}

/// A folder that is new, or has nothing in it, from the root on.
fn new_folder(path: &Path) -> Result<PathBuf> {
    check_output(path, Kind::Folder)?;
    let fail = |e| Error::io("make the folder", path, e);
    match std::fs::read_dir(path).map(|mut entries| entries.next().is_some()) {
        Ok(true) => {
            return Err(Error::config(
                format_args!("{} is not empty", path.display()),
                "name a new folder to keep the capture in",
            ));
        }
        Ok(false) => {}
        Err(_) => std::fs::create_dir(path).map_err(fail)?,
    }
    path.canonicalize().map_err(fail)
}

/// The most passes of a device that are listed one by one.
const MOST_PASSES: usize = 100;

/// Prints what a device recorded.
fn print(device: &ListedDevice, console: &Console) -> Result<()> {
    console.print(format_args!(
        "{}, process {}, on {}",
        shown(&device.program),
        device.process,
        shown(&device.device)
    ))?;
    let presented = device.presented;
    console.print(format_args!("{} frames presented", grouped(presented)))?;
    for note in device.notes.iter().chain(&device.flawed) {
        console.print(format_args!("note: {}", shown(note)))?;
    }
    let cells: Vec<_> = device.passes.iter().map(ListedPass::cells).collect();
    let Some(first) = cells.first() else {
        return console.print(format_args!("no pass was recorded"));
    };
    let header: Vec<&str> = first.iter().map(|(name, _)| *name).collect();
    let told = cells.iter().take(MOST_PASSES);
    let rows = told.map(|row| row.iter().map(|(_, text)| shown(text)).collect()).collect();
    console.print(format_args!("{}", table(&header, rows)))?;
    if let Some(more) = cells.len().checked_sub(MOST_PASSES).filter(|more| *more > 0) {
        let more = grouped(more as u64);
        console.print(format_args!("and {more} passes more: --json lists them all"))?;
    }
    for pass in device.passes.iter().take(MOST_PASSES) {
        let name = pass.target.as_ref().map_or("-".to_string(), |t| format!("#{}", t.number));
        for refusal in &pass.refused {
            console.print(format_args!(
                "{name}, submission {}: {} draws ({} fragments) cannot be in a trace: {}",
                pass.submission,
                refusal.draws,
                grouped(refusal.fragments),
                shown(&refusal.why)
            ))?;
        }
    }
    Ok(())
}

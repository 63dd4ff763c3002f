//! `screendoor capture`.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use serde::Serialize;

use crate::capture::{
    CameraChoice, CameraOptions, Capture, CaptureOptions, Faces, Light, Opacity, Order,
    PatternKind, ScreenDoor, SplatRules, Unseen,
};
use crate::cli::arguments::{self, Change, Each, colour, numbers, option, samples, size};
use crate::cli::console::{Console, grouped, table};
use crate::cli::files::{JsonArgument, check, check_scene, keep_trace, print_trace, report};
use crate::cli::kind::{Kind, check_output};
use crate::cli::vulkan::{self, VulkanArguments};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::capture::{CrossCheck, GpuCapture};
use crate::output::OutputFile;
use crate::picture::Space;
use crate::scene::{self, Axes, LoadOptions, Scene};
use crate::trace::{
    ColourFormat, ColumnId, Compression, Header, Scalar, TraceWriter, WriteOptions, Written,
};

/// Draw a scene and record its fragments as a trace; or record those of another program
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: Each<SceneArguments, NotWithVulkan>,
    #[command(flatten)]
    pub common: CommonArguments,
    #[command(flatten, next_help_heading = "Another program's fragments, by a layer of Vulkan")]
    vulkan: Each<VulkanArguments, WithVulkan>,
}

/// What is for scenes alone.
#[derive(Debug)]
struct NotWithVulkan;

impl Change for NotWithVulkan {
    fn change(argument: Arg) -> Arg {
        argument.conflicts_with("vulkan")
    }
}

/// What is for other programs alone.
#[derive(Debug)]
struct WithVulkan;

impl Change for WithVulkan {
    fn change(argument: Arg) -> Arg {
        // What is required is not asked for where something else forbids it: a scene.
        let argument = argument.conflicts_with("scene");
        if argument.get_id() == "vulkan" { argument } else { argument.requires("vulkan") }
    }
}

/// What a trace is made into, whatever it is of.
#[derive(Debug, Args)]
pub(super) struct CommonArguments {
    /// The trace to write
    #[arg(long, short, value_name = "TRACE", required_unless_present = "list")]
    pub output: Option<PathBuf>,
    /// Write nothing where there is anything to warn of
    #[arg(long)]
    pub strict: bool,
    /// What colours stand for, and so in what designs blend them: 'encoded' for splats, which
    /// are trained so, and else 'linear', where not given; with --vulkan, what the target's
    /// format says
    #[arg(long, value_parser = option::<Space>())]
    pub space: Option<Space>,
    /// Samples per pixel: 64 where not given, 4 with --gpu, 16 with --pattern standard; a
    /// trace of 64 serves every smaller count too. With --vulkan a multiple of the program's own,
    /// which are repeated
    #[arg(long, value_name = "N", value_parser = samples, allow_negative_numbers = true)]
    pub samples: Option<u32>,
    /// Linear colour behind all, each channel 0 to 65504
    #[arg(long, value_name = "R,G,B", value_parser = colour, allow_hyphen_values = true)]
    pub background: Option<[f64; 3]>,
    /// Keep colours in single precision, not in half
    #[arg(long)]
    pub float_colour: bool,
    /// How the trace's columns are stored
    #[arg(long, default_value = "none", value_parser = option::<Compression>())]
    pub compress: Compression,
    /// With --gpu, draw with our own rasteriser too, and print where the two differ; with --vulkan,
    /// blend what was recorded as the program does, and print how far that is from its picture
    #[arg(long, requires = "held_against")]
    pub check: bool,
    #[command(flatten)]
    pub json: JsonArgument,
}

impl CommonArguments {
    /// Precision of colours.
    pub fn colour(&self) -> ColourFormat {
        if self.float_colour { ColourFormat::F32 } else { ColourFormat::F16 }
    }

    /// Where the trace goes. Clap has seen to it that it is given.
    pub fn output(&self) -> Result<&Path> {
        let none = || Error::config("it is not said where the trace goes", "name it with -o");
        self.output.as_deref().ok_or_else(none)
    }
}

/// What is drawn, and how.
#[derive(Debug, Args)]
struct SceneArguments {
    #[arg(required_unless_present = "vulkan", help = format!(
        "A scene's file ({}), or builtin:NAME[:parameter=value,…] ('screendoor scenes' lists them)",
        scene::endings()
    ))]
    scene: Option<OsString>,
    /// Frame size in pixels: that of --camera, or 800x800, where not given
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Where the samples lie
    #[arg(long, default_value = "auto", value_parser = option::<PatternKind>())]
    pattern: PatternKind,
    /// Opacity in place of the materials' own; texture alphas still multiply it, and splats keep
    /// theirs, multiplied by it
    #[arg(long, value_name = "A", allow_negative_numbers = true)]
    alpha: Option<f32>,
    /// How opaque surfaces are by the angle at which they are seen: NAME[:parameter=value,…]
    /// ('screendoor scenes' lists them)
    #[arg(long, value_name = "MODEL", default_value = "constant")]
    opacity: String,
    /// Cut what lets light through into opaque points or holes: NAME[:parameter=value,…]
    /// ('screendoor scenes' lists them)
    #[arg(long, value_name = "MODEL")]
    screen_door: Option<String>,
    /// A picture (PNG, JPEG, WebP, BMP, TGA) for surfaces that have no texture
    #[arg(long, value_name = "FILE")]
    texture: Option<PathBuf>,
    /// Which grid of a .vdb file to draw: 'density' or the first fog volume where not given
    #[arg(long, value_name = "NAME")]
    grid: Option<String>,
    /// Make every surface white, keeping alphas
    #[arg(long)]
    white: bool,
    /// Open files outside the scene's folder too, where the scene names them
    #[arg(long)]
    allow_outside: bool,
    /// The order in which triangles are drawn
    #[arg(long, default_value = "api", value_parser = option::<Order>())]
    order: Order,
    /// Which shuffle --order random takes
    #[arg(long, default_value_t = 0, value_name = "N", allow_negative_numbers = true)]
    order_seed: u32,
    /// Which sides of surfaces are drawn
    #[arg(long, default_value = "material", value_parser = option::<Faces>())]
    faces: Faces,
    /// Camera: degrees to the right of the scene's front, degrees above
    #[arg(long, value_name = "YAW,PITCH", value_parser = numbers::<2>, allow_hyphen_values = true)]
    angle: Option<[f64; 2]>,
    /// Camera: distance in radii of the scene; framed on it where not given
    #[arg(long, value_name = "RADII", allow_negative_numbers = true)]
    distance: Option<f64>,
    /// Camera: vertical field of view in degrees; 0 for parallel lines
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    fov: Option<f64>,
    /// Camera: one of the scene's own (glTF) by its name or its number from 0; or the first, or
    /// that of --camera-name, of a cameras.json or transforms.json, in the space of the scene's
    /// file
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["angle", "distance", "fov"])]
    camera: Option<PathBuf>,
    /// Camera: which of --camera, by its picture's name or its number from 0
    #[arg(long, value_name = "NAME", requires = "camera")]
    camera_name: Option<String>,
    /// How Gaussian splats are drawn ('screendoor scenes' lists the rules)
    #[arg(long, default_value = "inria", value_name = "NAME[:parameter=value,…]")]
    splat_rules: String,
    /// Which way is up in the scene's file; where not given, as its format has it by habit: y,
    /// and in trained splats -y
    #[arg(long, value_parser = option::<Axes>())]
    axes: Option<Axes>,
    /// How wide lines of OBJ and glTF files are drawn, in the scene's units; where not given, lines
    /// beside surfaces are left out, and others are as wide as suits their extent
    #[arg(long, value_name = "WIDTH", allow_negative_numbers = true)]
    line_width: Option<f64>,
    /// Record of each fragment what of its colour comes from a light, which 'screendoor shade' gives
    /// shadows: NAME[:parameter=value,…] ('screendoor scenes' lists them)
    #[arg(long, value_name = "LIGHT")]
    light: Option<String>,
    /// With --light, the trace of the light's own view, drawn by our own rasteriser
    #[arg(long, value_name = "TRACE", requires = "light")]
    light_trace: Option<PathBuf>,
    /// Its size in pixels: 512x512 where not given
    #[arg(long, value_name = "WxH", value_parser = size, requires = "light_trace")]
    light_size: Option<(u32, u32)>,
    /// Have a GPU find which samples are covered, at its own 4 samples a pixel
    #[arg(long, group = "held_against")]
    gpu: bool,
    /// Which GPU: a part of its name or its driver's
    #[arg(long, value_name = "NAME", requires = "gpu")]
    adapter: Option<String>,
}

#[derive(Serialize)]
struct Document<'a> {
    trace: String,
    scene: &'a str,
    width: u32,
    height: u32,
    samples: u32,
    fragments: u64,
    bytes: u64,
    content: &'a str,
    /// Objects of which nothing was recorded.
    unseen: &'a [Unseen],
    /// With `--check`: where the GPU's rasteriser and ours differ.
    check: Option<CrossCheck>,
    /// With `--light-trace`: the light's.
    light: Option<OfLight>,
}

/// The trace of a light's view.
#[derive(Serialize)]
struct OfLight {
    trace: String,
    width: u32,
    height: u32,
    fragments: u64,
    bytes: u64,
    content: String,
    #[serde(skip)]
    written: Written,
}

/// Pixels of a light's view of which nothing says the size.
const LIGHT_SIZE: (u32, u32) = (512, 512);

/// Pixels of a frame of which nothing says the size.
const DEFAULT_SIZE: [u32; 2] = [800, 800];

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let (of_scene, of_program) = (&arguments.scene.given, &arguments.vulkan.given);
    match &of_scene.scene {
        Some(scene) => run_scene(scene, of_scene, &arguments.common, console),
        None => vulkan::run(of_program, &arguments.common, console),
    }
}

fn run_scene(
    scene: &OsStr,
    arguments: &SceneArguments,
    common: &CommonArguments,
    console: &Console,
) -> Result<()> {
    let (source, path) = arguments::scene(scene)?;
    let output = common.output()?;
    // A misspelt name and a machine without a GPU are told before anything is done.
    scene::check(source)?;
    let splats = SplatRules::parse(&arguments.splat_rules)?;
    let choice = CameraChoice {
        camera: arguments.camera.clone(),
        name: arguments.camera_name.as_deref(),
        size: arguments.size.map(<[u32; 2]>::from),
        default_size: DEFAULT_SIZE,
    };
    if choice.name.is_some() && choice.file().is_none() {
        let what = "--camera-name is for a file of cameras";
        return Err(Error::config(what, "name the scene's own camera by --camera alone"));
    }
    let opacity = Opacity::parse(&arguments.opacity)?;
    let light = arguments.light.as_deref().map(Light::parse).transpose()?;
    let screen_door = arguments.screen_door.as_deref().map(ScreenDoor::parse).transpose()?;
    let of_file = choice.file().map(|_| choice.choose(&[])).transpose()?;
    let gpu = arguments.gpu.then(|| Gpu::open(arguments.adapter.as_deref())).transpose()?;
    let inputs: Vec<&Path> =
        path.into_iter().chain(arguments.texture.as_deref()).chain(choice.file()).collect();
    let light_trace = arguments.light_trace.as_deref();
    let traces: Vec<&Path> = [output].into_iter().chain(light_trace).collect();
    let outputs: Vec<&Path> = traces.iter().copied().chain(common.json.path()).collect();
    check(&inputs, &outputs)?;
    traces.iter().try_for_each(|path| check_output(path, Kind::Trace))?;
    let file = OutputFile::create(output)?;
    let light_file = light_trace.map(OutputFile::create).transpose()?;
    let json = common.json.open()?;
    let loading = console.progress("loading the scene", "");
    let load = LoadOptions {
        grid: arguments.grid.clone(),
        allow_outside: arguments.allow_outside,
        axes: arguments.axes,
        line_width: arguments.line_width,
    };
    let mut scene = scene::load_with(source, &load)?;
    drop(loading);
    if let Some(texture) = &arguments.texture {
        scene.apply_texture(texture)?;
    }
    check_scene(&scene, &outputs)?;
    if arguments.white {
        scene.whiten();
    }
    let chosen = match of_file {
        Some(chosen) => chosen,
        None => choice.choose(&scene.cameras)?,
    };
    scene.warnings.extend(chosen.warnings);
    let [width, height] = chosen.size;
    let options = CaptureOptions {
        width,
        height,
        samples: common.samples.unwrap_or(match arguments.pattern {
            _ if arguments.gpu => 4,
            // The largest there is.
            PatternKind::Standard => 16,
            _ => 64,
        }),
        pattern: arguments.pattern,
        alpha: arguments.alpha,
        opacity,
        order: arguments.order,
        order_seed: arguments.order_seed,
        faces: arguments.faces,
        colour: common.colour(),
        background: common.background.map(|b| b.map(|c| c as f32)),
        camera: CameraOptions {
            angle: arguments.angle,
            distance: arguments.distance,
            field_of_view: arguments.fov,
            pose: chosen.pose,
        },
        splats,
        space: common.space,
        light,
        screen_door,
    };
    scene.warnings.extend(options.unused(&scene));
    let write = WriteOptions { compression: common.compress, ..WriteOptions::default() };
    let reporting = Reporting { scene: &scene, warns: true, unseen: true, strict: common.strict };
    let ((written, unseen), differences) = match &gpu {
        None => (reporting.record(&Capture::new(&scene, &options)?, write, file, console)?, None),
        Some(gpu) => {
            let capture = GpuCapture::new(gpu, &scene, &options)?;
            let recorded = reporting.record(&capture, write, file, console)?;
            let found = common.check.then(|| cross_check(&capture, console)).transpose()?;
            (recorded, found)
        }
    };
    let of_light = light_file
        .map(|file| {
            let size = arguments.light_size.unwrap_or(LIGHT_SIZE);
            record_light(&scene, &options, size, (write, file), console)
        })
        .transpose()?;
    let document = Document {
        trace: output.display().to_string(),
        scene: &scene.source,
        width,
        height,
        samples: options.samples,
        fragments: written.rows,
        bytes: written.bytes,
        content: &written.content,
        unseen: &unseen,
        check: differences,
        light: of_light,
    };
    report(json, "screendoor.capture", &document, console, || {
        if let Some(found) = differences {
            let rows = found.rows().map(|(what, count)| vec![what.to_string(), count]);
            let header = ["our rasteriser against the GPU's", ""];
            console.print(format_args!("{}", table(&header, rows.into())))?;
        }
        print_trace(&document.trace, &written, written.rows, console)?;
        document.light.as_ref().map_or(Ok(()), |light| {
            print_trace(&light.trace, &light.written, light.written.rows, console)
        })
    })
}

/// Captures `scene` as its light sees it.
fn record_light(
    scene: &Scene,
    options: &CaptureOptions,
    (width, height): (u32, u32),
    (write, file): (WriteOptions, OutputFile),
    console: &Console,
) -> Result<OfLight> {
    let trace = file.path().display().to_string();
    let of_light = Capture::new(scene, options)?.of_light([width, height]);
    let Some(of_light) = of_light else { unreachable!("a light's trace is asked for with one") };
    // What there is to warn of in the scene has been said of its own trace.
    let reporting = Reporting { scene, warns: false, unseen: false, strict: false };
    let capture = Capture::new(scene, &of_light)?;
    let (written, _) = reporting.record(&capture, write, file, console)?;
    Ok(OfLight {
        trace,
        width,
        height,
        fragments: written.rows,
        bytes: written.bytes,
        content: written.content.clone(),
        written,
    })
}

/// Captures `scene` into `file` and puts it in its place, with the scene's warnings.
pub(super) fn record(
    scene: &Scene,
    options: &CaptureOptions,
    write: WriteOptions,
    file: OutputFile,
    console: &Console,
) -> Result<Written> {
    let reporting = Reporting { scene, warns: true, unseen: false, strict: false };
    reporting
        .record(&Capture::new(scene, options)?, write, file, console)
        .map(|(written, _)| written)
}

/// What a trace is recorded from: our own rasteriser or a GPU's.
trait Recording {
    fn header(&self) -> &Header;
    fn draw(
        &self,
        writer: &mut TraceWriter<OutputFile>,
        progress: &mut (dyn FnMut(u64, u64) + Send),
    ) -> Result<()>;
    fn unseen(&self) -> Vec<Unseen>;
}

/// By what a rasteriser has of its own.
macro_rules! recording {
    ($($kind:ident),*) => {$(
        impl Recording for $kind<'_> {
            fn header(&self) -> &Header {
                self.header()
            }

            fn draw(
                &self,
                writer: &mut TraceWriter<OutputFile>,
                progress: &mut (dyn FnMut(u64, u64) + Send),
            ) -> Result<()> {
                self.draw(writer, progress)
            }

            fn unseen(&self) -> Vec<Unseen> {
                self.unseen()
            }
        }
    )*};
}

recording!(Capture, GpuCapture);

/// The most objects without fragments that are listed one by one.
const MOST_UNSEEN: usize = 20;

/// What is told of a capture.
struct Reporting<'a> {
    scene: &'a Scene,
    /// Whether the scene's warnings are.
    warns: bool,
    /// Whether objects without fragments are.
    unseen: bool,
    /// Whether it is an error where anything is.
    strict: bool,
}

/// What was written, and the objects that left nothing.
type Recorded = (Written, Vec<Unseen>);

impl Reporting<'_> {
    /// Writes what `capture` draws.
    fn record(
        &self,
        capture: &impl Recording,
        options: WriteOptions,
        file: OutputFile,
        console: &Console,
    ) -> Result<Recorded> {
        let header = capture.header();
        if self.warns {
            console.warn_all(&self.scene.warnings, self.strict, &self.scene.source)?;
        }
        let place = file.path().display().to_string();
        let mut writer = TraceWriter::new(file, &place, header.clone(), options)?;
        let progress = console.progress("capturing", "primitives");
        capture.draw(&mut writer, &mut |done, total| progress.set(done, total))?;
        drop(progress);
        let (file, written) = writer.finish()?;
        let unseen = if self.unseen { capture.unseen() } else { Vec::new() };
        let mut warnings: Vec<String> =
            unseen.iter().take(MOST_UNSEEN).map(Unseen::to_string).collect();
        if let Some(more) = unseen.len().checked_sub(MOST_UNSEEN + 1) {
            warnings.push(format!(
                "nor was one of {} more objects: --json lists them all",
                grouped(more as u64 + 1)
            ));
        }
        if written.rows == 0 {
            warnings.push(format!("the trace has no fragments: {}", why_empty(header)));
        }
        console.warn_all(&warnings, self.strict, &self.scene.source)?;
        keep_trace(file)?;
        Ok((written, unseen))
    }
}

/// Where the GPU's rasteriser and ours differ.
fn cross_check(capture: &GpuCapture<'_>, console: &Console) -> Result<CrossCheck> {
    let progress = console.progress("comparing", "triangles");
    let pattern = &capture.header().pattern;
    let found = capture.check(pattern, |done, total| progress.set(done, total))?;
    drop(progress);
    Ok(found)
}

/// Why nothing was drawn, as far as it is known.
fn why_empty(header: &Header) -> &'static str {
    match header.constants.get(&ColumnId::Alpha) {
        // What is next to transparent is not recorded: half a step of 16 bits.
        Some(Scalar::Real(alpha)) if *alpha < 1.0 / 65536.0 => "all of the scene is transparent",
        Some(_) => "nothing of the scene is in sight",
        None => "nothing of the scene is in sight, or all of that is transparent",
    }
}

//! `screendoor capture`.

use std::path::PathBuf;

use clap::Args;

use crate::capture::{CameraOptions, Capture, CaptureOptions, Faces, Order, PatternKind};
use crate::cli::arguments::{numbers, option, samples, size};
use crate::cli::console::{Console, grouped};
use crate::error::Result;
use crate::scene;
use crate::trace::{ColourFormat, Compression, TraceWriter, WriteOptions};

/// Draw a scene and record its fragments as a trace
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A .obj, .gltf or .glb file, or builtin:NAME[:parameter=value,…]
    /// ('screendoor scenes' lists them)
    scene: String,
    /// The trace to write
    #[arg(long, short, value_name = "TRACE")]
    output: PathBuf,
    /// Frame size in pixels
    #[arg(long, default_value = "800x800", value_name = "WxH", value_parser = size)]
    size: (u32, u32),
    /// Samples per pixel; a trace of 64 serves every smaller count too
    #[arg(long, default_value = "64", value_name = "N", value_parser = samples)]
    samples: u32,
    /// Where the samples lie
    #[arg(long, default_value = "auto", value_parser = option::<PatternKind>())]
    pattern: PatternKind,
    /// Opacity in place of the materials' own; texture alphas still multiply it
    #[arg(long, value_name = "A")]
    alpha: Option<f32>,
    /// A PNG or JPEG for surfaces that have no texture
    #[arg(long, value_name = "FILE")]
    texture: Option<PathBuf>,
    /// Make every surface white, keeping alphas
    #[arg(long)]
    white: bool,
    /// The order in which triangles are drawn
    #[arg(long, default_value = "api", value_parser = option::<Order>())]
    order: Order,
    /// Which shuffle --order random takes
    #[arg(long, default_value_t = 0, value_name = "N")]
    order_seed: u32,
    /// Which sides of surfaces are drawn
    #[arg(long, default_value = "material", value_parser = option::<Faces>())]
    faces: Faces,
    /// Camera: degrees to the right of the scene's front, degrees above
    #[arg(long, value_name = "YAW,PITCH", value_parser = numbers::<2>, allow_hyphen_values = true)]
    angle: Option<[f64; 2]>,
    /// Camera: distance in radii of the scene; framed on it where not given
    #[arg(long, value_name = "RADII")]
    distance: Option<f64>,
    /// Camera: vertical field of view in degrees; 0 for parallel lines
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f64>,
    /// Linear colour behind the scene
    #[arg(long, value_name = "R,G,B", value_parser = numbers::<3>, allow_hyphen_values = true)]
    background: Option<[f64; 3]>,
    /// Keep colours in single precision, not in half
    #[arg(long)]
    float_colour: bool,
    /// How the trace's columns are stored
    #[arg(long, default_value = "none", value_parser = option::<Compression>())]
    compress: Compression,
}

pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<()> {
    let mut scene = scene::load(&arguments.scene)?;
    if let Some(texture) = &arguments.texture {
        scene.apply_texture(texture)?;
    }
    if arguments.white {
        scene.whiten();
    }
    for warning in &scene.warnings {
        console.warn(warning);
    }
    let (width, height) = arguments.size;
    let options = CaptureOptions {
        width,
        height,
        samples: arguments.samples,
        pattern: arguments.pattern,
        alpha: arguments.alpha,
        order: arguments.order,
        order_seed: arguments.order_seed,
        faces: arguments.faces,
        colour: if arguments.float_colour { ColourFormat::F32 } else { ColourFormat::F16 },
        background: arguments.background.map(|b| b.map(|c| c as f32)),
        camera: CameraOptions {
            angle: arguments.angle,
            distance: arguments.distance,
            field_of_view: arguments.fov,
        },
    };
    let capture = Capture::new(&scene, &options)?;
    let write = WriteOptions { compression: arguments.compress, ..WriteOptions::default() };
    let mut writer = TraceWriter::create(&arguments.output, capture.header().clone(), write)?;
    let progress = console.progress("capturing", "triangles");
    capture.draw(&mut writer, |done, total| progress.set(done, total))?;
    drop(progress);
    let (file, written) = writer.finish()?;
    file.commit()?;
    if written.rows == 0 {
        console.warn("the trace has no fragments: nothing of the scene is in sight");
    }
    console.print(format_args!(
        "{}: {} fragments, {:.1} MB, content {}",
        arguments.output.display(),
        grouped(written.rows),
        written.bytes as f64 / 1e6,
        &written.content[..16],
    ))
}

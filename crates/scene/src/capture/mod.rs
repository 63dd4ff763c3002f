//! Capture: a scene becomes a stream of fragments.
//!
//! A rasteriser by the rules of Direct3D and Vulkan on fixed-point coordinates,
//! with one shading per fragment. Fragments come out in API order (or in the
//! order asked for), the same ones whatever the number of threads, and go
//! straight into a [`TraceWriter`]: memory is bounded by the scene and some ten
//! thousand pixels' worth of work in flight for each thread.
//!
//! Triangles are drawn in vectors (`scan`, `batch`). `raster` and `shade` hold the
//! plain text of that, which other rasterisers' coverage is shaded by and tests hold
//! the vectors to, bit for bit.

mod batch;
mod camera;
mod covered;
mod geometry;
mod job;
mod lanes;
mod light;
mod model;
mod opacity;
mod order;
mod pattern;
#[cfg(test)]
mod plain;
mod raster;
mod samples;
mod scan;
mod screen_door;
mod setup;
mod shade;
mod splat;
mod unseen;

use std::io::Write;

use fearless_simd::Level;
use glam::DVec3;
use rayon::prelude::*;

pub use camera::{Camera, CameraChoice, CameraOptions, Chosen, Pose};
pub use covered::{Drawing, SetUp};
pub use light::{DIRECT, DIRECT_COLUMNS, LIGHTS, Light};
pub use model::Model;
pub use opacity::{Cosine, OPACITY_MODELS, Opacity};
pub use order::Order;
pub use pattern::{PatternKind, pattern};
pub use screen_door::{SCREEN_DOORS, ScreenDoor};
pub use splat::{OnFrame as SplatOnFrame, PARAMS as SPLAT_PARAMS, RULE_SETS, RuleSet, SplatRules};
pub use unseen::Unseen;

use crate::capture::geometry::{Geometry, Primitive, Triangle};
use crate::capture::job::{Drawn, Tools, cut_into_jobs, wave_length};
use crate::capture::samples::Samples;
use crate::capture::screen_door::Door;
use crate::capture::setup::{Pieces, set_up};
use crate::capture::shade::Shader;
use crate::capture::splat::Painter;
use crate::capture::unseen::Recorded;
use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Options;
use screendoor_trace::picture::Space;
use screendoor_trace::trace::{
    ColourFormat, ColumnId, Fragment, Header, Scalar, Trace, TraceWriter, WriteOptions,
};

screendoor_trace::options! {
    /// Which sides of surfaces are drawn.
    pub enum Faces {
        Material = "material": "as each material says",
        Both = "both": "fronts and backs of all",
        Front = "front": "only fronts",
    }
}

/// How to capture a scene.
#[derive(Clone, Debug)]
pub struct CaptureOptions {
    /// Frame width in pixels.
    pub width: u32,
    /// Frame height in pixels.
    pub height: u32,
    /// Samples per pixel: 1, 2, 4, 8, 16, 32 or 64.
    pub samples: u32,
    /// Which family of sample patterns.
    pub pattern: PatternKind,
    /// An alpha in place of the materials' own; texture alphas still multiply it.
    pub alpha: Option<f32>,
    /// How opaque surfaces are by the angle at which they are seen; splats have it in their alphas.
    pub opacity: Opacity,
    /// The order in which triangles and splats are drawn.
    pub order: Order,
    /// Which shuffle a random order takes.
    pub order_seed: u32,
    /// Which sides of surfaces are drawn.
    pub faces: Faces,
    /// Precision of colours in the trace.
    pub colour: ColourFormat,
    /// Linear colour behind the scene, in place of the scene's own.
    pub background: Option<[f32; 3]>,
    /// From where to look.
    pub camera: CameraOptions,
    /// How splats are drawn.
    pub splats: SplatRules,
    /// What the trace's colours stand for; where not given, encoded for splats and else linear.
    pub space: Option<Space>,
    /// The light of which it is recorded what of each colour comes from it; none where not given.
    pub light: Option<Light>,
    /// What cuts holes into that which lets light through; nothing where not given.
    pub screen_door: Option<ScreenDoor>,
}

impl Default for CaptureOptions {
    fn default() -> Self {
        CaptureOptions {
            width: 800,
            height: 800,
            samples: 64,
            pattern: PatternKind::Auto,
            alpha: None,
            opacity: Opacity::Constant,
            order: Order::Api,
            order_seed: 0,
            faces: Faces::Material,
            colour: ColourFormat::F16,
            background: None,
            camera: CameraOptions::default(),
            splats: SplatRules::default(),
            space: None,
            light: None,
            screen_door: None,
        }
    }
}

impl CaptureOptions {
    /// What of the options changes nothing, since the scene has nothing that it is for.
    pub fn unused(&self, scene: &Scene) -> Vec<String> {
        let mut told = Vec::new();
        if self.faces != Faces::Material && scene.is_all_splats() {
            told.push(format!(
                "splats have no sides: faces '{}' changes nothing",
                self.faces.name()
            ));
        }
        if self.opacity.varies() && scene.is_all_splats() {
            let opacity = self.opacity.spec();
            told.push(format!("splats have no surface: opacity '{opacity}' changes nothing"));
        }
        if self.splats != SplatRules::default() && !scene.has_splats() {
            let rules = self.splats.spec();
            told.push(format!("the scene has no splats: splat rules '{rules}' change nothing"));
        }
        told
    }
}

/// A scene about to be captured.
pub struct Capture<'a> {
    scene: &'a Scene,
    options: &'a CaptureOptions,
    camera: Camera,
    header: Header,
    recorded: Recorded,
}

/// Triangles and splats set up at a time, for each thread: as many as its cache holds.
const CHUNK: usize = 1 << 11;
impl<'a> Capture<'a> {
    /// Places the camera and makes the trace's header.
    ///
    /// # Errors
    /// [`Error::Config`] for options out of range.
    pub fn new(scene: &'a Scene, options: &'a CaptureOptions) -> Result<Self> {
        if options.alpha.is_some_and(|a| !(0.0..=1.0).contains(&a)) {
            return Err(Error::config("an alpha lies in [0, 1]", "give such a number"));
        }
        let space = space(scene, options)?;
        let size = [options.width, options.height];
        let camera = Camera::frame(scene, &options.camera, &options.splats, size)?;
        let background = options.background.unwrap_or(scene.view.background);
        let mut header = Header {
            width: options.width,
            height: options.height,
            pattern: pattern(options.pattern, options.samples)?,
            background: background.map(|c| space.of_linear(f64::from(c)) as f32),
            space,
            colour: options.colour,
            source: scene.source.clone(),
            camera: camera.description().to_string(),
            view: camera.view(),
            ..Header::default()
        };
        header.check()?;
        if let Some(alpha) = options.alpha {
            header.source.push_str(&format!(", alpha {alpha}"));
        }
        if options.opacity.varies() {
            header.source.push_str(&format!(", opacity {}", options.opacity.spec()));
        }
        match options.order {
            Order::Api => {}
            Order::Random => {
                header.source.push_str(&format!(", random order {}", options.order_seed));
            }
            Order::NearToFar => header.source.push_str(", near to far"),
            Order::FarToNear => header.source.push_str(", far to near"),
        }
        if scene.has_splats() {
            header.source.push_str(&format!(", splats by {}", options.splats.spec()));
        }
        if scene.objects.len() == 1 {
            header.constants.insert(ColumnId::Object, Scalar::Unsigned(0));
        }
        if let Some(light) = options.light {
            light.check(scene, space)?;
            header.optional.extend(DIRECT);
            header.source.push_str(&format!(", light {}", light.spec()));
        }
        if let Some(door) = options.screen_door {
            screen_door::check(scene)?;
            header.source.push_str(&format!(", screen door {}", door.spec()));
        }
        let shader = Shader::new(scene, &camera, options, space);
        if let Some(alpha) = shader.constant_alpha() {
            header.constants.insert(ColumnId::Alpha, Scalar::Real(alpha));
        }
        let recorded = Recorded::new(scene.objects.len());
        let capture = Capture { scene, options, camera, header, recorded };
        capture.check_points()?;
        Ok(capture)
    }

    /// The header of the trace that the capture makes.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Draws the scene into `writer`, which was made with [`Capture::header`].
    /// `progress` is told how many triangles and splats are done, of how many.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn draw<W: Write + Send>(
        &self,
        writer: &mut TraceWriter<W>,
        mut progress: impl FnMut(u64, u64) + Send,
    ) -> Result<()> {
        let geometry = Geometry::new(self.scene, &self.camera);
        let tools = self.tools();
        let seed = self.options.order_seed;
        let order = order::drawing_order(self.options.order, seed, &geometry, &self.camera);
        let total = geometry.len() as usize;
        let number = |i: usize| order.as_ref().map_or(i as u32, |order| order[i]);

        // What the previous wave made, written while this one is drawn. Both keep their memory.
        let [mut finished, mut drawing] = [const { Vec::<Vec<Fragment>>::new() }; 2];
        let chunk = CHUNK * rayon::current_num_threads();
        for start in (0..total).step_by(chunk) {
            let end = (start + chunk).min(total);
            let drawn: Vec<Drawn> = (start..end)
                .into_par_iter()
                .map(|i| self.prepare(geometry.primitive(number(i)), &tools))
                .collect();
            let jobs = cut_into_jobs(&drawn, &tools);
            let mut rest = &jobs[..];
            while !rest.is_empty() {
                let (wave, later) = rest.split_at(wave_length(rest));
                rest = later;
                drawing.iter_mut().for_each(Vec::clear);
                drawing.resize_with(drawing.len().max(wave.len()), Vec::new);
                let (written, ()) = rayon::join(
                    || self.write_all(writer, &finished),
                    || {
                        wave.par_iter()
                            .zip(&mut drawing)
                            .for_each(|(job, fragments)| job.run(&drawn, &tools, fragments));
                    },
                );
                written?;
                std::mem::swap(&mut finished, &mut drawing);
            }
            progress(end as u64, total as u64);
        }
        self.write_all(writer, &finished)
    }

    /// The splats that are drawn, on the frame or outside of it, with their numbers.
    pub fn splats_on_frame(&self) -> Vec<(u32, SplatOnFrame)> {
        let (geometry, tools) = (Geometry::new(self.scene, &self.camera), self.tools());
        let on_frame = |number: u32| match geometry.primitive(number) {
            Primitive::Triangle(_) => None,
            Primitive::Splat(splat) => Some((number, tools.project(&splat).ok()?)),
        };
        (0..geometry.len()).into_par_iter().filter_map(on_frame).collect()
    }

    /// Draws the scene into a trace in memory.
    ///
    /// # Errors
    /// As [`TraceWriter::push`].
    pub fn to_memory(&self, progress: impl FnMut(u64, u64) + Send) -> Result<Trace> {
        let source = &self.header.source;
        let options = WriteOptions::default();
        let mut writer = TraceWriter::new(Vec::new(), source, self.header.clone(), options)?;
        self.draw(&mut writer, progress)?;
        Trace::from_bytes(writer.finish()?.0, source)
    }

    /// Whether a triangle is drawn where it shows its back.
    fn keeps_back(&self, triangle: &Triangle, shader: &Shader<'_>) -> bool {
        match self.options.faces {
            Faces::Both => true,
            Faces::Front => false,
            Faces::Material => shader.material(triangle.material).double_sided,
        }
    }

    fn write_all<W: Write>(
        &self,
        writer: &mut TraceWriter<W>,
        fragments: &[Vec<Fragment>],
    ) -> Result<()> {
        for fragments in fragments {
            for run in fragments.chunk_by(|a, b| a.object == b.object) {
                self.recorded.mark(run[0].object);
            }
            writer.push_all(fragments)?;
        }
        Ok(())
    }

    /// Writes a fragment, and notes that its object has one.
    pub fn write<W: Write>(&self, writer: &mut TraceWriter<W>, fragment: &Fragment) -> Result<()> {
        self.recorded.mark(fragment.object);
        writer.push(fragment)
    }

    /// What clipping leaves of a triangle.
    fn set_up(&self, triangle: &Triangle, shader: &Shader<'_>) -> Pieces {
        let mut pieces = Pieces::default();
        set_up(triangle, &self.camera, self.keeps_back(triangle, shader), &mut pieces);
        pieces
    }

    fn prepare(&self, primitive: Primitive<'_>, tools: &Tools<'_>) -> Drawn {
        match primitive {
            Primitive::Triangle(triangle) => {
                let pieces = self.set_up(&triangle, &tools.shader);
                Drawn::Triangle { triangle, pieces }
            }
            Primitive::Splat(splat) => {
                let on_frame = tools.project(&splat);
                let (object, primitive) = (splat.object, splat.primitive);
                Drawn::Splat { on_frame, object, primitive }
            }
        }
    }

    fn shader(&self) -> Shader<'_> {
        Shader::new(self.scene, &self.camera, self.options, self.header.space)
    }

    /// The unit vector towards the key light where none is given, in the scene's space.
    fn key(&self) -> DVec3 {
        light::turned(&self.camera, shade::KEY)
    }

    fn tools(&self) -> Tools<'_> {
        let (rules, space) = (&self.options.splats, self.header.space);
        let painter = Painter::new(&self.camera, rules, space, self.options.alpha);
        let placed = self.scene.objects.iter().map(|o| painter.placed(o.place)).collect();
        let positions = &self.header.pattern.positions;
        Tools {
            shader: self.shader(),
            painter,
            placed,
            rules,
            level: Level::new(),
            samples: Samples::new(positions),
            pixels: positions.iter().map(|p| p.map(|v| f64::from(v) / 16.0)).collect(),
            size: [self.options.width, self.options.height],
            door: self.options.screen_door.map(|door| Door::new(door, self.scene)),
        }
    }
}

/// What the trace's colours stand for.
fn space(scene: &Scene, options: &CaptureOptions) -> Result<Space> {
    let own = |space| scene.shapes.iter().any(|shape| shape.space() == space);
    match options.space {
        Some(space) => Ok(space),
        None if own(Space::Encoded) && own(Space::Linear) => Err(Error::unsupported(
            &scene.source,
            "it has splats, which are trained to be blended as encoded, and shapes that are \
             blended in linear light",
            "say as its space which of both all of it is blended in",
        )),
        None if own(Space::Encoded) => Ok(Space::Encoded),
        None => Ok(Space::Linear),
    }
}

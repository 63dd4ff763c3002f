//! Objects of which a capture has recorded nothing, and why.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::capture::Capture;
use crate::capture::geometry::{Geometry, Primitive, Splat, Triangle};
use crate::capture::job::Tools;
use crate::capture::setup::{Pieces, set_up};
use crate::capture::shade::LEAST_ALPHA;
use crate::capture::splat::Nothing;
use crate::scene::{AlphaMode, Material, Shape};

/// An object of which no fragment was recorded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Unseen {
    /// Which of the scene's objects.
    pub object: u32,
    /// Its name.
    pub name: String,
    /// How many triangles or splats it has.
    pub primitives: u64,
    /// Why nothing of them is there.
    pub reason: String,
}

impl fmt::Display for Unseen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unseen { object, name, reason, .. } = self;
        write!(f, "no fragment of object {object}, '{name}', was recorded: {reason}")
    }
}

/// Which objects have left a fragment.
pub(super) struct Recorded(Vec<AtomicBool>);

impl Recorded {
    pub(super) fn new(objects: usize) -> Self {
        Recorded((0..objects).map(|_| AtomicBool::new(false)).collect())
    }

    pub(super) fn mark(&self, object: u32) {
        self.0[object as usize].store(true, Ordering::Relaxed);
    }

    fn missing(&self) -> impl Iterator<Item = usize> {
        let objects = self.0.iter().enumerate();
        objects.filter(|(_, recorded)| !recorded.load(Ordering::Relaxed)).map(|(i, _)| i)
    }
}

/// Why nothing of a primitive is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Reason {
    Transparent,
    Outside,
    Behind,
    Back,
    NoArea,
    Thin,
}

/// All of them, with what is said of primitives.
const REASONS: [(Reason, &str); 6] = [
    (Reason::Transparent, "wholly transparent"),
    (Reason::Outside, "outside the frame"),
    (Reason::Behind, "behind the camera"),
    (Reason::Back, "seen from behind, which the material hides"),
    (Reason::NoArea, "without an area"),
    (Reason::Thin, "so small that no sample is covered"),
];

impl Capture<'_> {
    /// The objects of which the drawing so far has recorded no fragment, in their order.
    pub fn unseen(&self) -> Vec<Unseen> {
        let geometry = Geometry::new(self.scene, &self.camera);
        let tools = self.tools();
        let unseen = |object: usize| {
            let range = geometry.of_object(object);
            let count = |counts: [u64; REASONS.len()], primitive: u32| {
                let reason = match geometry.primitive(primitive) {
                    Primitive::Triangle(triangle) => self.reason(&triangle, &tools),
                    Primitive::Splat(splat) => reason_of_splat(&splat, &tools),
                };
                let mut counts = counts;
                counts[reason as usize] += 1;
                counts
            };
            let add = |a: [u64; REASONS.len()], b: [u64; REASONS.len()]| {
                std::array::from_fn(|i| a[i] + b[i])
            };
            let counts = range
                .clone()
                .into_par_iter()
                .fold(Default::default, count)
                .reduce(Default::default, add);
            let placed = &self.scene.objects[object];
            let shape = &self.scene.shapes[placed.shape];
            let (noun, transparent) = match shape {
                Shape::Splats(_) => ("splat", "their alphas are below what the rules draw".into()),
                _ => ("triangle", self.why_transparent(tools.shader.material(shape.material()))),
            };
            Unseen {
                object: object as u32,
                name: placed.name.clone(),
                primitives: range.len() as u64,
                reason: said(noun, counts, &transparent, self.options.splats.near()),
            }
        };
        self.recorded.missing().map(unseen).collect()
    }

    /// Why nothing of a triangle was recorded, of which nothing was.
    fn reason(&self, triangle: &Triangle, tools: &Tools<'_>) -> Reason {
        let [a, b, c] = triangle.vertices.map(|v| v.position);
        if (b - a).cross(c - a) == DVec3::ZERO {
            return Reason::NoArea;
        }
        let pieces = self.set_up(triangle, &tools.shader);
        if pieces.is_empty() {
            let depth = |p: DVec3| (self.camera.to_clip * p.extend(1.0)).z;
            if [a, b, c].into_iter().all(|p| depth(p) < 0.0) {
                return Reason::Behind;
            }
            let mut whole = Pieces::default();
            set_up(triangle, &self.camera, true, &mut whole);
            return if whole.is_empty() { Reason::Thin } else { Reason::Back };
        }
        let mut inside = false;
        for piece in pieces.iter() {
            let raster = tools.raster(piece);
            let (first, last) = raster.rows();
            for y in first..=last {
                inside = true;
                let mut covered = false;
                raster.row(y, |_| covered = true);
                if covered {
                    return Reason::Transparent;
                }
            }
        }
        if inside { Reason::Thin } else { Reason::Outside }
    }

    /// What makes all of a material transparent.
    fn why_transparent(&self, material: &Material) -> String {
        let Material { name, alpha_mode, transmission, base, .. } = material;
        if let AlphaMode::Mask { cutoff } = alpha_mode {
            return format!("all alphas of its material '{name}' are below the cutoff {cutoff}");
        }
        if let Some(door) = self.options.screen_door {
            return format!("the screen door {} has left nothing of it", door.spec());
        }
        match self.options.alpha {
            Some(alpha) if alpha < LEAST_ALPHA => "the alpha asked for is 0".to_string(),
            None if *alpha_mode == AlphaMode::Blend && base.w < LEAST_ALPHA => {
                format!("its material '{name}' has the alpha {}", base.w)
            }
            None if *transmission > 0.0 => {
                format!(
                    "its material '{name}' lets all light through, with a transmission of {transmission}"
                )
            }
            _ => format!("the alphas of its vertices or its material's ('{name}') textures are 0"),
        }
    }
}

/// Why nothing of a splat was recorded, of which nothing was.
fn reason_of_splat(splat: &Splat<'_>, tools: &Tools<'_>) -> Reason {
    match tools.project(splat) {
        Err(Nothing::Behind) => Reason::Behind,
        Err(Nothing::Transparent) => Reason::Transparent,
        Err(Nothing::NoArea) => Reason::NoArea,
        Ok(on_frame) => {
            let (first, last) = on_frame.rows();
            let [x, y] = [on_frame.centre.x, on_frame.centre.y];
            let [width, height] = tools.size.map(f64::from);
            let inside = (0.0..=width).contains(&x) && (0.0..=height).contains(&y);
            if first > last && !inside { Reason::Outside } else { Reason::Thin }
        }
    }
}

/// How many primitives are missing for which reason.
fn said(noun: &str, counts: [u64; REASONS.len()], transparent: &str, near: f64) -> String {
    let all: u64 = counts.iter().sum();
    let mut parts: Vec<(u64, String)> = Vec::new();
    for ((reason, text), count) in REASONS.into_iter().zip(counts) {
        let text = match reason {
            Reason::Transparent => format!("{text} ({transparent})"),
            Reason::Behind if noun == "splat" => {
                format!("{text} or nearer than the rules' near={near}")
            }
            _ => text.to_string(),
        };
        parts.push((count, text));
    }
    parts.retain(|(count, _)| *count > 0);
    parts.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    match &parts[..] {
        [] => format!("it has no {noun}s"),
        [(1, text)] => format!("its one {noun} is {text}"),
        [(_, text)] => format!("its {all} {noun}s are {text}"),
        parts => {
            let each: Vec<String> = parts.iter().map(|(n, text)| format!("{n} {text}")).collect();
            format!("of its {all} {noun}s {}", each.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{CameraOptions, CaptureOptions};
    use crate::scene::{Mesh, Scene, Shape};
    use glam::Vec3;

    /// A triangle with its middle at `at`, which faces +z, or with `turn` away from it.
    fn triangle(at: Vec3, turn: bool) -> Shape {
        let mut corners = [Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::Y];
        if turn {
            corners.swap(0, 1);
        }
        let positions = corners.map(|c| c + at).to_vec();
        Shape::Mesh(Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() })
    }

    #[test]
    fn what_is_out_of_sight_is_told_as_that() {
        let material = Material { double_sided: false, ..Material::default() };
        let mut scene = Scene { materials: vec![material], ..Scene::default() };
        scene.add("seen", triangle(Vec3::ZERO, false));
        scene.add("back", triangle(Vec3::ZERO, true));
        scene.add("aside", triangle(Vec3::new(60.0, 0.0, 0.0), false));
        scene.add("behind", triangle(Vec3::new(0.0, 0.0, 60.0), false));
        scene.add("other side", triangle(Vec3::new(0.0, 0.0, -60.0), false));
        scene.add("other side", triangle(Vec3::new(-60.0, 0.0, 0.0), false));
        let camera = CameraOptions {
            angle: Some([0.0, 0.0]),
            distance: Some(0.25),
            field_of_view: Some(30.0),
            ..CameraOptions::default()
        };
        let options = CaptureOptions {
            width: 32,
            height: 32,
            samples: 1,
            camera,
            ..CaptureOptions::default()
        };
        let capture = Capture::new(&scene, &options).unwrap();
        capture.to_memory(|_, _| ()).unwrap();
        let reasons: Vec<(u32, String)> =
            capture.unseen().into_iter().map(|u| (u.object, u.reason)).collect();
        let one = |text: &str| format!("its one triangle is {text}");
        assert_eq!(
            reasons,
            [
                (1, one("seen from behind, which the material hides")),
                (2, one("outside the frame")),
                (3, one("behind the camera")),
                (5, one("outside the frame")),
            ]
        );
    }

    #[test]
    fn reasons_are_counted_and_listed_as_they_are_numbered() {
        assert!(REASONS.iter().enumerate().all(|(i, (reason, _))| *reason as usize == i));
        assert_eq!(said("triangle", [0; 6], "", 0.0), "it has no triangles");
        assert_eq!(
            said("triangle", [0, 1, 0, 0, 0, 0], "", 0.0),
            "its one triangle is outside the frame"
        );
        assert_eq!(
            said("triangle", [2, 0, 0, 0, 0, 0], "why", 0.0),
            "its 2 triangles are wholly transparent (why)"
        );
        assert_eq!(
            said("triangle", [1, 0, 3, 0, 0, 0], "why", 0.0),
            "of its 4 triangles 3 behind the camera, 1 wholly transparent (why)"
        );
    }
}

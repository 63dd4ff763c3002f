//! Screen doors: what lets light through is drawn as opaque points, or with holes, so that any design
//! draws it as it draws what is opaque (*Object-space screen-door transparency*, 2003, and the
//! image-plane stipples that it is held against).

mod masks;
mod points;
#[cfg(test)]
mod tests;

use glam::DVec3;
use rayon::prelude::*;

use crate::capture::Capture;
use crate::capture::camera::Camera;
use crate::capture::geometry::{Geometry, Primitive, Triangle};
use crate::capture::job::Tools;
use crate::capture::model::Model;
use crate::capture::raster::Raster;
use crate::capture::screen_door::masks::{Mask, Stipple};
use crate::capture::screen_door::points::{MOST_POINTS, Points};
use crate::capture::setup::Pieces;
use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::Typed;
use screendoor_trace::random::hash;
use screendoor_trace::trace::Fragment;

const SEED: Typed<i64> = Typed::integer("seed", "0", (0, 4_294_967_295), "which random choice");
const SIDE: Typed<f64> = Typed::real(
    "side",
    "200",
    (0.01, 100_000.0),
    "points along a line as long as the scene's radius",
);
const PATTERNS: Typed<i64> =
    Typed::integer("patterns", "8", (2, 1024), "among how many patterns each polygon chooses");

/// The screen doors that a capture may have.
pub const SCREEN_DOORS: [Model; 6] = [
    Model {
        name: "points",
        help: "as many points spread over a triangle as it has pixels where it faces the viewer, \
               each opaque with probability alpha (section 4.1)",
        params: &[SEED.param],
    },
    Model {
        name: "points-static",
        help: "the same with a number that does not depend on the distance, which fails near by (3.1)",
        params: &[SEED.param, SIDE.param],
    },
    Model {
        name: "mask",
        help: "a random mask of 128 by 128 an alpha, mapped on each triangle so that a texel is as \
               large as a pixel where it faces the viewer; the nearest texel counts (4.2)",
        params: &[SEED.param],
    },
    Model {
        name: "mask-max",
        help: "the same, opaque where any texel within the pixel is (section 5)",
        params: &[SEED.param],
    },
    Model {
        name: "stipple",
        help: "a pattern of 32 by 32 pixels an alpha, fixed to the frame: OpenGL's polygon stipple",
        params: &[SEED.param],
    },
    Model {
        name: "stipple-random",
        help: "the same, each polygon with one of several patterns by chance",
        params: &[SEED.param, PATTERNS.param],
    },
];

/// How what lets light through becomes opaque points or holes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ScreenDoor {
    /// Points in the surface.
    Points {
        /// Which random choice.
        seed: u32,
        /// How many lie along the scene's radius, where that does not follow the distance.
        side: Option<f64>,
    },
    /// A mask in the surface.
    Mask {
        /// Which random choice.
        seed: u32,
        /// Whether any texel within a pixel counts.
        max: bool,
    },
    /// Patterns in the frame.
    Stipple {
        /// Which random choice.
        seed: u32,
        /// How many patterns there are.
        patterns: u32,
    },
}

impl ScreenDoor {
    /// Reads `NAME` or `NAME:parameter=value,…`.
    ///
    /// # Errors
    /// [`Error::Config`] for an unknown screen door or parameter, naming the nearest.
    pub fn parse(spec: &str) -> Result<Self> {
        let (place, values) = Model::read("screen door", &SCREEN_DOORS, spec)?;
        let seed = values.get(SEED) as u32;
        Ok(match place {
            0 => ScreenDoor::Points { seed, side: None },
            1 => ScreenDoor::Points { seed, side: Some(values.get(SIDE)) },
            2 => ScreenDoor::Mask { seed, max: false },
            3 => ScreenDoor::Mask { seed, max: true },
            4 => ScreenDoor::Stipple { seed, patterns: 1 },
            _ => ScreenDoor::Stipple { seed, patterns: values.get(PATTERNS) as u32 },
        })
    }

    /// The screen door as [`ScreenDoor::parse`] reads it.
    pub fn spec(&self) -> String {
        let (place, seed, more) = match self {
            ScreenDoor::Points { seed, side: None } => (0, seed, String::new()),
            ScreenDoor::Points { seed, side: Some(side) } => (1, seed, format!(",side={side}")),
            ScreenDoor::Mask { seed, max: false } => (2, seed, String::new()),
            ScreenDoor::Mask { seed, max: true } => (3, seed, String::new()),
            ScreenDoor::Stipple { seed, patterns: 1 } => (4, seed, String::new()),
            ScreenDoor::Stipple { seed, patterns } => (5, seed, format!(",patterns={patterns}")),
        };
        format!("{}:seed={seed}{more}", SCREEN_DOORS[place].name)
    }
}

/// A screen door, made ready for a capture.
pub(super) enum Door {
    Points(Points),
    Mask(Mask),
    Stipple(Stipple),
}

impl Door {
    pub(super) fn new(door: ScreenDoor, scene: &Scene) -> Self {
        match door {
            ScreenDoor::Points { seed, side } => {
                let per_area = side.map(|side| (side / radius(scene)).powi(2));
                Door::Points(Points { seed, per_area })
            }
            ScreenDoor::Mask { seed, max } => Door::Mask(Mask { seed, max }),
            ScreenDoor::Stipple { seed, patterns } => Door::Stipple(Stipple::new(seed, patterns)),
        }
    }

    /// Cuts the fragments from the place `from` on, of a piece of a triangle: what lets light through
    /// becomes opaque, or is no more.
    pub(super) fn cut(
        &self,
        triangle: &Triangle,
        raster: &Raster<'_>,
        camera: &Camera,
        (fragments, from): (&mut Vec<Fragment>, usize),
    ) {
        let mapped = match self {
            Door::Mask(mask) => Some(mask.on(triangle, camera)),
            Door::Points(_) | Door::Stipple(_) => None,
        };
        let mut kept = from;
        for i in from..fragments.len() {
            let mut fragment = fragments[i];
            if fragment.alpha < 1.0 {
                let is_opaque = match self {
                    // Points are drawn in its place.
                    Door::Points(_) => false,
                    Door::Mask(_) => {
                        mapped.as_ref().is_some_and(|m| m.is_opaque(&fragment, raster))
                    }
                    Door::Stipple(stipple) => stipple.is_opaque(&fragment),
                };
                if !is_opaque {
                    continue;
                }
                fragment.alpha = 1.0;
            }
            fragments[kept] = fragment;
            kept += 1;
        }
        fragments.truncate(kept);
    }

    /// Adds the points of a triangle, all at once.
    pub(super) fn add_points(
        &self,
        (triangle, pieces): (&Triangle, &Pieces),
        tools: &Tools<'_>,
        fragments: &mut Vec<Fragment>,
    ) {
        if let Door::Points(points) = self {
            points.draw(triangle, pieces, tools, fragments);
        }
    }

    /// The piece of a triangle, and the row in it, with which all of its points are drawn: the first that
    /// lies on the frame.
    pub(super) fn place_of_points(
        &self,
        pieces: &Pieces,
        tools: &Tools<'_>,
    ) -> Option<(usize, i64)> {
        let Door::Points(_) = self else { return None };
        let rows = pieces.iter().map(|piece| tools.raster(piece).rows());
        let mut on_frame = rows.enumerate().filter(|(_, (first, last))| first <= last);
        on_frame.next().map(|(piece, (first, _))| (piece, first))
    }
}

/// Refuses scenes that have no surface to cut.
pub(super) fn check(scene: &Scene) -> Result<()> {
    if scene.has_splats() {
        return Err(Error::config(
            "splats have no surface that a screen door could be cut into",
            "leave the screen door out",
        ));
    }
    Ok(())
}

impl Capture<'_> {
    /// Refuses triangles of more points than anybody waits for, of those that are drawn with points.
    pub(super) fn check_points(&self) -> Result<()> {
        let Some(ScreenDoor::Points { .. }) = self.options.screen_door else { return Ok(()) };
        let tools = self.tools();
        let Some(door @ Door::Points(points)) = &tools.door else { return Ok(()) };
        let geometry = Geometry::new(self.scene, &self.camera);
        let refused = (0..geometry.len()).into_par_iter().find_map_first(|number| {
            let Primitive::Triangle(triangle) = geometry.primitive(number) else { return None };
            let count = points.count(&triangle, &self.camera);
            if count <= MOST_POINTS || !tools.shader.may_let_through(triangle.material) {
                return None;
            }
            let pieces = self.set_up(&triangle, &tools.shader);
            door.place_of_points(&pieces, &tools).map(|_| (number, triangle.object, count))
        });
        let Some((number, object, count)) = refused else { return Ok(()) };
        let name = &self.scene.objects[object as usize].name;
        Err(Error::config(
            format_args!("primitive {number} ('{name}') would have {count:.0} points"),
            "look from further away, or at a smaller frame; 'mask' has no such limit",
        ))
    }
}

/// The radius of a ball around the scene.
fn radius(scene: &Scene) -> f64 {
    let bounds = scene.framed_points().fold(None, |bounds, (point, around)| {
        let (low, high) = bounds.unwrap_or((point, point));
        Some((low.min(point - around), high.max(point + around)))
    });
    let Some((low, high)) = bounds else { return 1.0 };
    let centre = (low + high) * 0.5;
    let reach = scene.framed_points().map(|(point, around)| (point - centre).length() + around);
    Some(reach.fold(0.0, f64::max)).filter(|radius| *radius > 0.0).unwrap_or(1.0)
}

/// Pixels that a unit of length has at the triangle's middle where it lies parallel to the frame.
fn pixels_per_unit(triangle: &Triangle, camera: &Camera) -> f64 {
    let [x, y] = camera.focal;
    let focal = (x * y).sqrt();
    if camera.eye.is_none() {
        return focal;
    }
    let ahead = |p: DVec3| Some(camera.seen(p).z).filter(|z| *z > 0.0 && camera.depth(*z) >= 0.0);
    let [a, b, c] = triangle.vertices.map(|v| v.position);
    // A middle that is not before the near plane: the nearest corner that is counts.
    let nearest = || [a, b, c].into_iter().filter_map(ahead).fold(f64::INFINITY, f64::min);
    focal / ahead((a + b + c) / 3.0).unwrap_or_else(nearest)
}

/// A random number in 0 to 1, 1 excluded.
fn random<const N: usize>(words: [u32; N]) -> f64 {
    f64::from(hash(words)) / (f64::from(u32::MAX) + 1.0)
}

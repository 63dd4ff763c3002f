//! From the scene's space to the frame.

mod choice;
mod file;
mod pose;

use glam::{DMat3, DMat4, DVec3, DVec4};

pub use self::choice::{CameraChoice, Chosen};
pub use self::pose::Pose;
use crate::capture::splat::SplatRules;
use crate::scene::Scene;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{Projection, View};

/// From where and how wide to look. What is not given follows the scene's own
/// view, framed so that all of it shows.
#[derive(Clone, Debug, Default)]
pub struct CameraOptions {
    /// Degrees to the right of the scene's front (+z), and above the horizontal.
    pub angle: Option<[f64; 2]>,
    /// Distance from the scene's centre, in units of the radius of the sphere
    /// that holds it.
    pub distance: Option<f64>,
    /// Vertical field of view in degrees; 0 looks along parallel lines.
    pub field_of_view: Option<f64>,
    /// Where it stands, in place of all that.
    pub pose: Option<Pose>,
}

/// Degrees from top to bottom where nothing else is asked for.
const FIELD_OF_VIEW: f64 = 35.0;
/// The share of the frame left free around a framed scene, on each side.
const MARGIN: f64 = 0.03;
/// The near plane is at least this share of the far plane's distance.
const NEAREST: f64 = 1e-3;
/// The same of poses, which stand among things.
const NEAREST_AMONG: f64 = 1e-5;
/// Parallel lines of sight begin nowhere. View space begins this many radii before the
/// scene's centre where they are recorded, so that distances are those of a perspective
/// camera about as far away, and above 0.
const PARALLEL_RADII: f64 = 2.0;

/// A camera over a frame.
#[derive(Clone, Debug)]
pub struct Camera {
    /// From the scene's space to clip space: depth 0 at the near plane.
    pub(crate) to_clip: DMat4,
    /// Unit vectors of the view, in the scene's space.
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    /// From the scene's centre towards the camera.
    pub(crate) back: DVec3,
    /// Where the camera stands; `None` looks along parallel lines.
    pub(crate) eye: Option<DVec3>,
    /// Frame size in pixels.
    pub(crate) size: [f64; 2],
    /// Focal lengths in pixels; pixels per unit where lines of sight are parallel.
    pub(crate) focal: [f64; 2],
    /// Where the view axis meets the frame, in pixels from its top left.
    pub(crate) principal: [f64; 2],
    /// Where distances along the view axis are counted from, and those of the near and the
    /// far plane.
    origin: DVec3,
    range: [f64; 2],
    view: View,
    description: String,
}

impl Camera {
    /// The camera that `options` and the scene's view describe, over a frame of `size` pixels.
    /// Splats are drawn by `rules`, which say how near they may be.
    ///
    /// # Errors
    /// [`Error::Config`] for options out of range.
    pub fn frame(
        scene: &Scene,
        options: &CameraOptions,
        rules: &SplatRules,
        size: [u32; 2],
    ) -> Result<Self> {
        if let Some(pose) = &options.pose {
            return pose.camera(scene, rules, size);
        }
        let size = size.map(f64::from);
        let view = scene.view;
        let [yaw, pitch] = options.angle.unwrap_or([view.yaw, view.pitch]);
        if !(yaw.is_finite() && (-90.0..=90.0).contains(&pitch)) {
            return Err(Error::config(
                format_args!("the camera cannot stand at {yaw},{pitch} degrees"),
                "give degrees to the right, and -90 to 90 degrees above",
            ));
        }
        let default = if view.orthographic { 0.0 } else { FIELD_OF_VIEW };
        let fov = options.field_of_view.unwrap_or(default);
        if !(fov == 0.0 || (1.0..=150.0).contains(&fov)) {
            return Err(Error::config(
                format_args!("a field of view of {fov} degrees cannot be"),
                "give 1 to 150 degrees, or 0 for parallel lines",
            ));
        }
        if options.distance.is_some_and(|d| !(d > 0.0 && d < 1e6)) {
            return Err(Error::config(
                "the camera's distance is out of range",
                "give it in units of the scene's radius, above 0",
            ));
        }

        let (sin_yaw, cos_yaw) = libm::sincos(yaw.to_radians());
        let (sin_pitch, cos_pitch) = libm::sincos(pitch.to_radians());
        let back = DVec3::new(sin_yaw * cos_pitch, sin_pitch, cos_yaw * cos_pitch);
        let right = DVec3::new(cos_yaw, 0.0, -sin_yaw);
        let up = back.cross(right);

        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (point, radius) in scene.framed_points() {
            low = low.min(point - radius);
            high = high.max(point + radius);
        }
        let centre = (low + high) * 0.5;
        let mut radius = 0.0_f64;
        for (point, around) in scene.framed_points() {
            radius = radius.max((point - centre).length() + around);
        }
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let in_view = |point: DVec3| {
            let p = point - centre;
            DVec3::new(right.dot(p), up.dot(p), back.dot(p))
        };
        // Scene space to view space: the camera looks along −z from `centre`.
        let to_view = DMat4::from_cols(
            DVec4::new(right.x, up.x, back.x, 0.0),
            DVec4::new(right.y, up.y, back.y, 0.0),
            DVec4::new(right.z, up.z, back.z, 0.0),
            DVec4::new(-right.dot(centre), -up.dot(centre), -back.dot(centre), 1.0),
        );

        let aspect = size[0] / size[1];
        let room = 1.0 - 2.0 * MARGIN;
        let (mut nearest, mut furthest) = (f64::NEG_INFINITY, f64::INFINITY);
        let flat = fov == 0.0;
        for (point, around) in scene.solid_points().chain(scene.splat_points().filter(|_| flat)) {
            let z = in_view(point).z;
            nearest = nearest.max(z + around);
            furthest = furthest.min(z - around);
        }
        // Something flat still needs a depth range.
        let slack = (1e-3 * radius).max(f64::MIN_POSITIVE);
        let (nearest, furthest) = (nearest + slack, furthest - slack);
        let framed = scene.framed_points().map(|(point, around)| in_view(point).z + around);
        let framed = framed.fold(f64::NEG_INFINITY, f64::max) + slack;

        // Scene space to the view space of a camera so far before the centre.
        let from =
            |distance: f64| DMat4::from_translation(DVec3::new(0.0, 0.0, -distance)) * to_view;
        let (to_clip, eye, seen, focal) = if fov == 0.0 {
            let [mut half_width, mut half_height] = view.frame.unwrap_or([0.0; 2]);
            if view.frame.is_none() {
                for (point, around) in scene.framed_points() {
                    let p = in_view(point);
                    half_width = half_width.max((p.x.abs() + around) / room);
                    half_height = half_height.max((p.y.abs() + around) / room);
                }
            }
            // The frame's shape decides; what was asked for fits inside.
            let half_height = half_height.max(half_width / aspect).max(slack);
            let half_width = half_height * aspect;
            let half = [half_width, half_height];
            let projection = parallel(half, -nearest, -furthest);
            let distance = PARALLEL_RADII * radius;
            let (near, far) = (distance - nearest, distance - furthest);
            let seen = View {
                projection: Projection::Orthographic,
                near,
                far,
                world_to_view: from(distance).to_cols_array(),
                view_to_clip: parallel(half, near, far).to_cols_array(),
            };
            (projection * to_view, None, seen, half.map(|half| 0.5 / half))
        } else {
            let tangent_y = libm::tan(fov.to_radians() / 2.0);
            let tangent_x = tangent_y * aspect;
            let distance = match options.distance {
                Some(units) => units * radius,
                None => {
                    let mut distance = 0.0_f64;
                    for (point, around) in scene.framed_points() {
                        let p = in_view(point);
                        let fit = |offset: f64, tangent: f64| {
                            let tangent = tangent * room;
                            // A sphere's silhouette lies outside its centre's ray.
                            let outward = around * (1.0 + tangent * tangent).sqrt();
                            (offset.abs() + outward) / tangent + p.z
                        };
                        distance = distance.max(fit(p.x, tangent_x)).max(fit(p.y, tangent_y));
                    }
                    distance.max(framed + slack)
                }
            };
            let solid = (distance - nearest, distance - furthest);
            let eye = centre + back * distance;
            let [near, far] = range(scene, solid, NEAREST, (eye, -back, rules))?;
            let projection = DMat4::from_cols(
                DVec4::new(1.0 / tangent_x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, 1.0 / tangent_y, 0.0, 0.0),
                DVec4::new(0.0, 0.0, -far / (far - near), -1.0),
                DVec4::new(0.0, 0.0, -far * near / (far - near), 0.0),
            );
            let retreat = DMat4::from_translation(DVec3::new(0.0, 0.0, -distance));
            let seen = View {
                projection: Projection::Perspective,
                near,
                far,
                world_to_view: from(distance).to_cols_array(),
                view_to_clip: projection.to_cols_array(),
            };
            let focal = [tangent_x, tangent_y].map(|tangent| 0.5 / tangent);
            (projection * retreat * to_view, Some(eye), seen, focal)
        };
        let range = match eye {
            Some(_) => [seen.near, seen.far],
            None => [-nearest, -furthest],
        };
        let lens = match (fov, options.distance) {
            (0.0, _) => "parallel lines".to_string(),
            (fov, Some(d)) => format!("field of view {fov}, distance {d} radii"),
            (fov, None) => format!("field of view {fov}, framed"),
        };
        Ok(Camera {
            to_clip,
            right,
            up,
            back,
            eye,
            size,
            focal: [0, 1].map(|i| focal[i] * size[i]),
            principal: size.map(|side| side / 2.0),
            origin: eye.unwrap_or(centre),
            range,
            view: seen,
            description: format!("angle {yaw},{pitch}, {lens}"),
        })
    }

    /// The camera in words, for a trace's header.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// The camera in numbers, for a trace's header; `None` for a scene so small, large or
    /// far away that double precision does not tell its planes and axes well enough.
    pub fn view(&self) -> Option<View> {
        self.view.check().is_ok().then_some(self.view)
    }

    /// A point as the camera sees it: to the right, downwards, and along the view axis.
    pub(crate) fn seen(&self, point: DVec3) -> DVec3 {
        self.to_axes() * (point - self.origin)
    }

    /// Turns directions of the scene's space into right, down and forward.
    pub(crate) fn to_axes(&self) -> DMat3 {
        DMat3::from_cols(self.right, -self.up, -self.back).transpose()
    }

    /// The depth at a distance along the view axis: 0 on the near plane, 1 on the far one;
    /// below 0 before the near one.
    pub(crate) fn depth(&self, distance: f64) -> f64 {
        let [near, far] = self.range;
        let share = (distance - near) / (far - near);
        if self.eye.is_some() { share * far / distance } else { share }
    }

    /// By how much [`Camera::depth`] changes with one divided by the distance; where lines of
    /// sight are parallel, with the distance.
    pub(crate) fn depth_slope(&self) -> f64 {
        let [near, far] = self.range;
        if self.eye.is_some() { -near * far / (far - near) } else { 1.0 / (far - near) }
    }

    /// Unit vector from `point` towards the camera.
    pub(crate) fn towards(&self, point: DVec3) -> DVec3 {
        self.eye.map_or(self.back, |eye| (eye - point).normalize_or(self.back))
    }
}

/// How far the near and the far plane stand from an eye that looks along `forward`. What is no
/// splat has `solid` for its nearest and furthest distance, and is cut where it is nearer than
/// the share `least` of the far one. Splats are drawn or not as a whole: none that is drawn has
/// its mean before the near plane, nor beyond the far one by its distance from the eye.
fn range(
    scene: &Scene,
    solid: (f64, f64),
    least: f64,
    (eye, forward, rules): (DVec3, DVec3, &SplatRules),
) -> Result<[f64; 2]> {
    let from = rules.near();
    let (mut near, mut far) = (f64::INFINITY, f64::NEG_INFINITY);
    if solid.1 > 0.0 {
        (near, far) = (solid.0.max(solid.1 * least), solid.1);
    }
    for (mean, around) in scene.splat_points() {
        // Where depth varies over a splat, all of it is told apart, not its mean alone.
        let around = if rules.is_deep() { around } else { 0.0 };
        let distance = forward.dot(mean - eye);
        if distance > from {
            near = near.min((distance - around).max(from) * 0.999);
            far = far.max(((mean - eye).length() + around) * 1.001);
        }
    }
    let known = far.is_finite() && near > 0.0 && near < far;
    if !known {
        let hint = match scene.has_splats() {
            true => "move the camera away, or set near of the splat rules lower",
            false => "move the camera away",
        };
        let nearer = if scene.has_splats() { " or nearer than splats are drawn" } else { "" };
        let what = format_args!("the whole scene lies behind the camera{nearer}");
        return Err(Error::config(what, hint));
    }
    Ok([near, far])
}

/// The projection along parallel lines of the `half` width and height, with depth 0 at the
/// distance `near` and 1 at `far`.
fn parallel([half_width, half_height]: [f64; 2], near: f64, far: f64) -> DMat4 {
    DMat4::from_cols(
        DVec4::new(1.0 / half_width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 1.0 / half_height, 0.0, 0.0),
        DVec4::new(0.0, 0.0, -1.0 / (far - near), 0.0),
        DVec4::new(0.0, 0.0, -near / (far - near), 1.0),
    )
}

/// What cameras are tested on.
#[cfg(test)]
mod testing {
    use crate::scene::{Mesh, Scene, Shape};
    use glam::Vec3;

    /// The corners of a cube from 0 to 1, with a triangle at each of them.
    pub(super) fn cube() -> Scene {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let mesh = Mesh {
            positions: (0..8).map(corner).collect(),
            triangles: (0..6).map(|i| [i, i + 1, i + 2]).collect(),
            ..Mesh::default()
        };
        let mut scene = Scene::default();
        scene.add("cube", Shape::Mesh(mesh));
        scene
    }
}

#[cfg(test)]
mod tests {
    use super::testing::cube;
    use super::*;
    use crate::scene::{Mesh, Shape};
    use glam::Vec3;

    fn frame(scene: &Scene, options: &CameraOptions, size: [u32; 2]) -> Result<Camera> {
        Camera::frame(scene, options, &SplatRules::default(), size)
    }

    #[test]
    fn a_framed_scene_lies_in_the_frame_and_touches_its_margin() {
        for fov in [0.0, 10.0, 60.0, 120.0] {
            for angle in [[0.0, 0.0], [30.0, 20.0], [200.0, -90.0]] {
                for (width, height) in [(100, 100), (320, 100), (50, 200)] {
                    let options = CameraOptions {
                        angle: Some(angle),
                        field_of_view: Some(fov),
                        ..CameraOptions::default()
                    };
                    let scene = cube();
                    let camera = frame(&scene, &options, [width, height]).unwrap();
                    let mut reach = 0.0_f64;
                    for (point, _) in scene.bounding_points() {
                        let clip = camera.to_clip * point.extend(1.0);
                        let ndc = clip.truncate() / clip.w;
                        assert!((0.0..=1.0).contains(&ndc.z), "{fov} {angle:?} {ndc}");
                        reach = reach.max(ndc.x.abs()).max(ndc.y.abs());
                    }
                    assert!((reach - (1.0 - 2.0 * MARGIN)).abs() < 1e-9, "{fov} {angle:?} {reach}");
                }
            }
        }
    }

    #[test]
    fn what_is_recorded_is_what_is_drawn() {
        for fov in [0.0, 10.0, 60.0, 120.0] {
            for (angle, distance) in [([0.0, 0.0], None), ([30.0, 20.0], Some(3.0))] {
                let options = CameraOptions {
                    angle: Some(angle),
                    field_of_view: Some(fov),
                    distance,
                    ..CameraOptions::default()
                };
                let scene = cube();
                let camera = frame(&scene, &options, [320, 100]).unwrap();
                let view = camera.view().unwrap();
                let to_view = DMat4::from_cols_array(&view.world_to_view);
                let to_clip = DMat4::from_cols_array(&view.view_to_clip) * to_view;
                assert_eq!(view.projection == Projection::Orthographic, fov == 0.0);
                for (point, _) in scene.bounding_points() {
                    let distance = -to_view.transform_point3(point).z;
                    assert!((view.near..view.far).contains(&distance), "{fov} {distance}");
                    let [drawn, told] = [camera.to_clip, to_clip].map(|m| m.project_point3(point));
                    assert!((drawn - told).length() < 1e-12, "{fov} {drawn} {told}");
                }
                // The eye, where there is one, is where distances begin.
                let eye = camera.eye.map(|eye| to_view.transform_point3(eye).length());
                assert!(eye.is_none_or(|off| off < 1e-12), "{fov} {eye:?}");
            }
        }
    }

    #[test]
    fn a_scene_beyond_double_precision_has_no_view_and_is_drawn() {
        let mut scene = Scene::default();
        let far = Mesh {
            positions: vec![Vec3::splat(1e30), Vec3::splat(1e30), Vec3::splat(1e30)],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        scene.add("far", Shape::Mesh(far));
        let camera = frame(&scene, &CameraOptions::default(), [10, 10]).unwrap();
        assert!(camera.view().is_none_or(|view| view.check().is_ok()));
    }

    #[test]
    fn yaw_turns_right_and_pitch_lifts() {
        let at = |yaw, pitch| {
            let angle = Some([yaw, pitch]);
            let options = CameraOptions { angle, ..CameraOptions::default() };
            frame(&cube(), &options, [10, 10]).unwrap().back
        };
        assert!((at(90.0, 0.0) - DVec3::X).length() < 1e-12);
        assert!((at(0.0, 90.0) - DVec3::Y).length() < 1e-12);
        assert!((at(0.0, 0.0) - DVec3::Z).length() < 1e-12);
    }
}

//! Cameras that stand where they are told.

use std::f64::consts::PI;

use glam::{DMat3, DMat4, DVec3, DVec4};

use crate::capture::camera::{Camera, NEAREST_AMONG, range};
use crate::capture::splat::SplatRules;
use crate::scene::{FileCamera, Scene};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::trace::{Projection, View};

/// How far axes may be from unit vectors at right angles: what a file's decimals leave.
const RIGID: f64 = 1e-3;
/// How far the shapes of two frames may differ, as a share: what rounding to pixels leaves.
const SHAPE: f64 = 0.02;

/// A camera in perspective, in the space of the scene's file.
#[derive(Clone, PartialEq, Debug)]
pub struct Pose {
    /// Its name, for people.
    pub name: String,
    /// Where it stands.
    pub eye: DVec3,
    /// Unit vectors to the right, downwards and along the view axis.
    pub axes: [DVec3; 3],
    /// Focal lengths in pixels, along x and y.
    pub focal: [f64; 2],
    /// Where the view axis meets the frame, in pixels from its top left.
    pub principal: [f64; 2],
    /// The frame's size in pixels.
    pub size: [u32; 2],
}

impl Pose {
    /// A camera of the scene's own file, over a frame of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Config`] where its lines of sight are parallel.
    pub fn of_file(camera: &FileCamera, size: [u32; 2]) -> Result<Self> {
        let Some(field) = camera.field_of_view.filter(|f| *f > 0.0 && *f < PI) else {
            let what = format_args!("the camera '{}' is not one in perspective", camera.name);
            return Err(Error::config(what, "give an angle and a field of view in its place"));
        };
        let axes = camera.place.matrix3;
        let unit = |v: DVec3| v.normalize_or_zero();
        let focal = f64::from(size[1]) / 2.0 / libm::tan(field / 2.0);
        Ok(Pose {
            name: camera.name.clone(),
            eye: camera.place.translation,
            axes: [unit(axes.x_axis), unit(-axes.y_axis), unit(-axes.z_axis)],
            focal: [focal; 2],
            principal: size.map(|side| f64::from(side) / 2.0),
            size,
        })
    }

    /// Finds out whether it is one, over a frame of that size.
    ///
    /// # Errors
    /// [`Error::Config`] where its axes or its lens are none, and for a frame of another shape.
    pub(super) fn check(&self, [width, height]: [u32; 2]) -> Result<()> {
        let bad = |what: String, hint: &str| {
            Err(Error::config(format_args!("the camera '{}' {what}", self.name), hint))
        };
        let axes = DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]);
        let gram = axes.transpose() * axes;
        let rigid = (gram - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() < RIGID);
        // In sides of the frame. Beyond that nobody's lens is, and the grid of the frame ends.
        let sides = self.size.map(f64::from);
        let lens = [0, 1].iter().all(|i| {
            (1e-3..=1e4).contains(&(self.focal[*i] / sides[*i]))
                && (self.principal[*i] / sides[*i]).abs() <= 1e3
        });
        if !(rigid && axes.determinant() > 0.0 && self.eye.is_finite()) {
            return bad("has no axes at right angles".into(), "correct its matrix");
        }
        if !lens || self.size.contains(&0) {
            return bad(
                "has no lens or no frame".into(),
                "give it a size in pixels and focal lengths of a thousandth to 10000 of it",
            );
        }
        let scale = self.scale([width, height]);
        if (scale[0] / scale[1] - 1.0).abs() > SHAPE {
            let [w, h] = self.size;
            let what =
                format!("is one of {w}x{h} pixels, and not of the shape of {width}x{height}");
            return bad(what, "give the frame that shape");
        }
        Ok(())
    }

    /// How many pixels of a frame of that size one of its own is.
    fn scale(&self, size: [u32; 2]) -> [f64; 2] {
        [0, 1].map(|i| f64::from(size[i]) / f64::from(self.size[i]))
    }

    /// The camera over a frame of `size` pixels of the same shape.
    ///
    /// # Errors
    /// As [`Pose::check`], and where the scene lies behind it.
    pub(super) fn camera(
        &self,
        scene: &Scene,
        rules: &SplatRules,
        size: [u32; 2],
    ) -> Result<Camera> {
        self.check(size)?;
        let scale = self.scale(size);
        let turn = scene.world.matrix3;
        let forward = (turn * self.axes[2]).normalize();
        let right = turn * self.axes[0];
        let right = (right - forward * right.dot(forward)).normalize();
        let up = right.cross(forward);
        let back = -forward;
        let eye = scene.world.transform_point3(self.eye);
        let (mut near, mut far) = (f64::INFINITY, f64::NEG_INFINITY);
        for (point, around) in scene.solid_points() {
            let distance = forward.dot(point - eye);
            near = near.min(distance - around);
            far = far.max(distance + around);
        }
        // Something flat still needs a depth range.
        let solid = (near * 0.999, far * 1.001);
        let [near, far] =
            range(scene, solid, NEAREST_AMONG, (eye, forward, rules)).map_err(|e| match e {
                Error::Config { what, hint } => {
                    Error::Config { what: format!("camera '{}': {what}", self.name), hint }
                }
                other => other,
            })?;
        let focal = [0, 1].map(|i| self.focal[i] * scale[i]);
        let principal = [0, 1].map(|i| self.principal[i] * scale[i]);
        let size = size.map(f64::from);
        let to_view = DMat4::from_mat3(DMat3::from_cols(right, up, back).transpose())
            * DMat4::from_translation(-eye);
        let off = [0, 1].map(|i| 2.0 * principal[i] / size[i] - 1.0);
        let projection = DMat4::from_cols(
            DVec4::new(2.0 * focal[0] / size[0], 0.0, 0.0, 0.0),
            DVec4::new(0.0, 2.0 * focal[1] / size[1], 0.0, 0.0),
            DVec4::new(-off[0], off[1], -far / (far - near), -1.0),
            DVec4::new(0.0, 0.0, -far * near / (far - near), 0.0),
        );
        Ok(Camera {
            to_clip: projection * to_view,
            right,
            up,
            back,
            eye: Some(eye),
            size,
            focal,
            principal,
            origin: eye,
            range: [near, far],
            view: View {
                projection: Projection::Perspective,
                near,
                far,
                world_to_view: to_view.to_cols_array(),
                view_to_clip: projection.to_cols_array(),
            },
            description: format!("camera {}", self.name),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::cube;
    use super::*;
    use crate::capture::CameraOptions;

    fn pose() -> Pose {
        Pose {
            name: "one".into(),
            eye: DVec3::new(1.0, 2.0, -5.0),
            axes: [DVec3::X, DVec3::Y, DVec3::Z],
            focal: [100.0, 90.0],
            principal: [30.0, 40.0],
            size: [80, 60],
        }
    }

    fn camera(pose: Pose, scene: &Scene, size: [u32; 2]) -> Result<Camera> {
        let options = CameraOptions { pose: Some(pose), ..CameraOptions::default() };
        Camera::frame(scene, &options, &SplatRules::default(), size)
    }

    #[test]
    fn a_pose_projects_as_a_pinhole_does() {
        let scene = cube();
        for scale in [1, 2] {
            let camera = camera(pose(), &scene, [80 * scale, 60 * scale]).unwrap();
            for (point, _) in scene.bounding_points() {
                let p = point - pose().eye;
                let pixel = [
                    (100.0 * p.x / p.z + 30.0) * f64::from(scale),
                    (90.0 * p.y / p.z + 40.0) * f64::from(scale),
                ];
                let clip = camera.to_clip * point.extend(1.0);
                let drawn = [
                    (clip.x / clip.w + 1.0) * camera.size[0] / 2.0,
                    (1.0 - clip.y / clip.w) * camera.size[1] / 2.0,
                ];
                let seen = camera.seen(point);
                let told = [0, 1].map(|i| camera.focal[i] * seen[i] / seen.z + camera.principal[i]);
                for i in 0..2 {
                    assert!((drawn[i] - pixel[i]).abs() < 1e-9, "{drawn:?} {pixel:?}");
                    assert!((told[i] - pixel[i]).abs() < 1e-9, "{told:?} {pixel:?}");
                }
                assert!((camera.depth(seen.z) - clip.z / clip.w).abs() < 1e-9);
                assert!((0.0..=1.0).contains(&camera.depth(seen.z)));
            }
            assert!(camera.view().is_some());
        }
    }

    #[test]
    fn what_is_no_camera_is_told() {
        let says = |pose: Pose, part: &str| {
            let error = camera(pose, &cube(), [80, 60]).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("'one'"), "{error}");
        };
        says(Pose { axes: [DVec3::X, DVec3::X, DVec3::Z], ..pose() }, "right angles");
        says(Pose { axes: [DVec3::X, -DVec3::Y, DVec3::Z], ..pose() }, "right angles");
        says(Pose { focal: [0.0, 1.0], ..pose() }, "lens");
        says(Pose { focal: [1e20, 1e20], ..pose() }, "lens");
        says(Pose { principal: [f64::NAN, 0.0], ..pose() }, "lens");
        says(Pose { size: [60, 80], ..pose() }, "shape");
        says(Pose { eye: DVec3::new(0.0, 0.0, 9.0), ..pose() }, "behind");
    }
}

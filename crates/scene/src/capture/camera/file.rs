//! Cameras in files beside a scene: `cameras.json` of trainings of Gaussian splats (Kerbl et
//! al. 2023) and `transforms.json` of nerfstudio, instant-ngp and Blender's synthetic scenes.

use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde_json::Value;

use crate::capture::camera::Pose;
use crate::scene::file;
use screendoor_trace::error::{Error, Result, one_line};

/// The longest file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 28;

/// A camera of `cameras.json`: where it stands, and the rows of the matrix whose columns are
/// its axes, to the right, downwards and forward.
#[derive(Deserialize)]
struct Trained {
    img_name: Option<Value>,
    width: f64,
    height: f64,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fx: f64,
    fy: f64,
}

/// `transforms.json`. A lens is the file's, for all frames, or a frame's own.
#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    lens: Lens,
    camera_model: Option<String>,
    #[serde(default)]
    is_fisheye: bool,
    frames: Vec<Frame>,
    /// What nerfstudio has turned and scaled the cameras by.
    applied_transform: Option<Value>,
    applied_scale: Option<Value>,
}

/// The models of cameras whose lenses are pinholes, but for their distortion.
const PINHOLES: [&str; 7] = [
    "PINHOLE",
    "SIMPLE_PINHOLE",
    "OPENCV",
    "PERSPECTIVE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "FULL_OPENCV",
];

#[derive(Deserialize)]
struct Frame {
    file_path: Option<Value>,
    /// The rows of a matrix from camera space, x to the right, y up and z backwards.
    transform_matrix: Vec<[f64; 4]>,
    #[serde(flatten)]
    lens: Lens,
}

#[derive(Clone, Copy, Deserialize)]
struct Lens {
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

/// The cameras of a file, in its order.
#[derive(Debug)]
pub(super) struct Poses {
    /// The cameras; never empty.
    pub(super) poses: Vec<Pose>,
    /// What could not be honoured.
    pub(super) warnings: Vec<String>,
}

impl Poses {
    /// Reads the cameras of the file at `path`. Where it says nothing of its frames' size they
    /// have the size `frame`, in pixels.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be read, [`Error::Invalid`] where it holds no cameras.
    pub(super) fn read(path: &Path, frame: [u32; 2]) -> Result<Self> {
        let place = path.display().to_string();
        let bytes = file::read(path)?;
        if bytes.len() as u64 > MAX_BYTES {
            let hint = "give a file of fewer cameras";
            return Err(Error::unsupported(place, "it is longer than 256 MiB", hint));
        }
        let hint = "give a cameras.json of a training, or a transforms.json";
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        let bad = |what: String| Error::invalid(&place, what, hint);
        let cameras: Value =
            serde_json::from_slice(bytes).map_err(|e| bad(format!("it is no JSON: {e}")))?;
        let mut warnings = Vec::new();
        let poses: Vec<Pose> = match cameras {
            Value::Array(list) => {
                let one = |(i, camera): (usize, Value)| {
                    let camera = serde_json::from_value(camera).map_err(|e| e.to_string());
                    let pose = camera.and_then(|camera| trained(i, camera));
                    pose.map_err(|what| bad(format!("camera {i} of it: {what}")))
                };
                list.into_iter().enumerate().map(one).collect::<Result<_>>()?
            }
            other => {
                let file: Transforms = serde_json::from_value(other)
                    .map_err(|e| bad(format!("it holds no cameras that are known: {e}")))?;
                let model = file.camera_model.as_deref().unwrap_or(PINHOLES[0]);
                if file.is_fisheye || !PINHOLES.contains(&model) {
                    let model = if file.is_fisheye { "fisheye" } else { model };
                    let what = format!("its cameras are of the model '{}'", one_line(model));
                    return Err(Error::unsupported(place, what, "give it undistorted cameras"));
                }
                let mut distorted = false;
                let mut one = |i: usize, one: &Frame| {
                    let lens = one.lens.or(&file.lens)?;
                    distorted |= lens.is_distorted();
                    transformed(i, one, &lens, frame)
                };
                let all = file.frames.iter().enumerate().map(|(i, frame)| {
                    one(i, frame).map_err(|what| bad(format!("frame {i} of it: {what}")))
                });
                let poses = all.collect::<Result<_>>()?;
                if distorted {
                    let what = "its lenses' distortion is left out: give undistorted cameras";
                    warnings.push(format!("{place}: {what}"));
                }
                if file.is_moved() {
                    let what = "its cameras stand where 'applied_transform' and 'applied_scale' \
                                have put them, which is not undone: the scene has to be moved so, too";
                    warnings.push(format!("{place}: {what}"));
                }
                poses
            }
        };
        if poses.is_empty() {
            return Err(Error::invalid(place, "it holds no camera", hint));
        }
        Ok(Poses { poses, warnings })
    }
}

/// A name of text or a number.
fn named(name: Option<&Value>, i: usize) -> String {
    match name {
        Some(Value::String(name)) => name.clone(),
        Some(Value::Number(number)) => number.to_string(),
        _ => i.to_string(),
    }
}

/// A side of a frame in pixels.
fn side(v: f64) -> std::result::Result<u32, String> {
    let whole = (1.0..=65536.0).contains(&v).then(|| v.round() as u32);
    whole.ok_or_else(|| format!("its frame has a side of {v} pixels; 1 to 65536 can be"))
}

fn trained(i: usize, camera: Trained) -> std::result::Result<Pose, String> {
    let row = camera.rotation;
    let column = |k: usize| DVec3::new(row[0][k], row[1][k], row[2][k]);
    let size = [side(camera.width)?, side(camera.height)?];
    Ok(Pose {
        name: named(camera.img_name.as_ref(), i),
        eye: DVec3::from(camera.position),
        axes: [column(0), column(1), column(2)],
        focal: [camera.fx, camera.fy],
        principal: size.map(|side| f64::from(side) / 2.0),
        size,
    })
}

impl Transforms {
    /// Whether its cameras are said to be turned, moved or scaled. What is no matrix is taken
    /// for one that does.
    fn is_moved(&self) -> bool {
        let moved = self.applied_transform.as_ref().is_some_and(|matrix| {
            let rows: Option<Vec<Vec<f64>>> = serde_json::from_value(matrix.clone()).ok();
            let still = |rows: Vec<Vec<f64>>| {
                rows.iter().enumerate().all(|(i, row)| {
                    let own =
                        |(k, v): (usize, &f64)| (v - f64::from(u8::from(i == k))).abs() < 1e-6;
                    row.iter().enumerate().all(own)
                })
            };
            !rows.is_some_and(still)
        });
        let scaled = self.applied_scale.as_ref().is_some_and(|s| s.as_f64() != Some(1.0));
        moved || scaled
    }
}

impl Lens {
    /// All that it says, each with its name.
    fn parts(&mut self) -> [(&'static str, &mut Option<f64>); 14] {
        [
            ("w", &mut self.w),
            ("h", &mut self.h),
            ("fl_x", &mut self.fl_x),
            ("fl_y", &mut self.fl_y),
            ("cx", &mut self.cx),
            ("cy", &mut self.cy),
            ("camera_angle_x", &mut self.camera_angle_x),
            ("camera_angle_y", &mut self.camera_angle_y),
            ("k1", &mut self.k1),
            ("k2", &mut self.k2),
            ("k3", &mut self.k3),
            ("k4", &mut self.k4),
            ("p1", &mut self.p1),
            ("p2", &mut self.p2),
        ]
    }

    /// This one, a frame's, with what the file's says that it does not. What both say has to be
    /// one number: some programs take the file's (nerfstudio), others the frame's.
    fn or(mut self, file: &Lens) -> std::result::Result<Self, String> {
        let mut file = *file;
        let angles = [(self.camera_angle_x, self.fl_x), (self.camera_angle_y, self.fl_y)];
        for ((angle, own), all) in angles.into_iter().zip([file.fl_x, file.fl_y]) {
            if angle.is_some() && own.is_none() && all.is_some() {
                return Err("it has an angle, and the file has a focal length for all frames: \
                            leave one of both out"
                    .to_string());
            }
        }
        for ((name, own), (_, all)) in self.parts().into_iter().zip(file.parts()) {
            match (&own, &all) {
                (Some(own), Some(all)) if own != all => {
                    return Err(format!(
                        "its '{name}' is {own}, and the file's, for all frames, is {all}: leave \
                         one of both out"
                    ));
                }
                _ => *own = own.or(*all),
            }
        }
        Ok(self)
    }

    fn is_distorted(&self) -> bool {
        let all = [self.k1, self.k2, self.k3, self.k4, self.p1, self.p2];
        all.into_iter().flatten().any(|k| k != 0.0)
    }
}

fn transformed(
    i: usize,
    frame: &Frame,
    lens: &Lens,
    size: [u32; 2],
) -> std::result::Result<Pose, String> {
    let [rows @ .., _] = &frame.transform_matrix[..] else {
        return Err("its matrix has no rows".into());
    };
    let rows: &[[f64; 4]; 3] = match (rows.try_into(), frame.transform_matrix.as_slice().try_into())
    {
        // Four rows, or three where the last one, 0 0 0 1, is left out.
        (Ok(rows), _) | (_, Ok(rows)) => rows,
        _ => return Err("its matrix has neither three nor four rows".into()),
    };
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let [w, h] = match (lens.w, lens.h) {
        (Some(w), Some(h)) => [side(w)?, side(h)?],
        (None, None) => size,
        _ => return Err("it has one of 'w' and 'h'".into()),
    };
    let sides = [w, h].map(f64::from);
    let from_angle = |angle: Option<f64>, side: f64| angle.map(|a| side / 2.0 / libm::tan(a / 2.0));
    let x = lens.fl_x.or(from_angle(lens.camera_angle_x, sides[0]));
    let y = lens.fl_y.or(from_angle(lens.camera_angle_y, sides[1]));
    let Some([fx, fy]) = x.or(y).map(|either| [x.unwrap_or(either), y.unwrap_or(either)]) else {
        return Err("it says neither 'fl_x' nor 'camera_angle_x'".into());
    };
    Ok(Pose {
        name: named(frame.file_path.as_ref(), i),
        eye: column(3),
        axes: [column(0), -column(1), -column(2)],
        focal: [fx, fy],
        principal: [lens.cx.unwrap_or(sides[0] / 2.0), lens.cy.unwrap_or(sides[1] / 2.0)],
        size: [w, h],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Poses> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.json");
        std::fs::write(&path, text).unwrap();
        Poses::read(&path, [40, 20])
    }

    #[test]
    fn both_kinds_say_the_same() {
        // A quarter turn about the vertical: the camera looks along x.
        let trained = read(
            r#"[{"id": 0, "img_name": "a", "width": 40.0, "height": 20, "position": [1, 2, 3],
                "rotation": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "fx": 50.0, "fy": 60.0}]"#,
        );
        let transforms = read(
            r#"{"fl_x": 50, "fl_y": 60, "w": 40, "h": 20, "k1": 0, "frames": [{"file_path": "a",
                "transform_matrix": [[0, 0, -1, 1], [0, -1, 0, 2], [-1, 0, 0, 3], [0, 0, 0, 1]]}]}"#,
        );
        let [a, b] = [trained.unwrap(), transforms.unwrap()].map(|p| p.poses[0].clone());
        assert_eq!(a, b);
        assert_eq!(a.axes, [-DVec3::Z, DVec3::Y, DVec3::X]);
        let angle = read(
            r#"{"camera_angle_x": 1.5707963267948966, "frames": [{"k1": 0.1,
                "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}]}"#,
        )
        .unwrap();
        let [x, y] = angle.poses[0].focal;
        assert!((x - 20.0).abs() < 1e-9 && x == y);
        assert_eq!((angle.poses[0].size, angle.warnings.len()), ([40, 20], 1));
    }

    #[test]
    fn a_lens_is_put_together_of_the_file_s_and_a_frame_s() {
        let of = |file: &str, frame: &str| {
            let matrix = "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]";
            read(&format!(r#"{{{file} "frames": [{{{frame} "transform_matrix": {matrix}}}]}}"#))
        };
        let lens = |file: &str, frame: &str| {
            let pose = of(file, frame).unwrap().poses[0].clone();
            (pose.focal, pose.principal, pose.size)
        };
        let all = r#""fl_x": 30, "fl_y": 31, "cx": 9, "cy": 8, "w": 20, "h": 10,"#;
        let own = ([30.0, 31.0], [9.0, 8.0], [20, 10]);
        assert_eq!(lens(all, ""), own);
        assert_eq!(lens("", all), own);
        assert_eq!(lens(all, all), own);
        // What the file leaves out, frames may add, and say again what it says.
        assert_eq!(
            lens(r#""w": 20, "h": 10,"#, r#""fl_x": 30, "fl_y": 31, "cx": 9, "cy": 8,"#),
            own
        );
        assert_eq!(
            lens(r#""fl_x": 30, "fl_y": 31, "w": 20, "h": 10,"#, r#""cx": 9, "cy": 8, "w": 20,"#),
            own
        );
        for (frame, part) in [
            (r#""fl_x": 5,"#, "its 'fl_x' is 5, and the file's, for all frames, is 30"),
            (r#""camera_angle_x": 1,"#, "it has an angle, and the file has a focal length"),
            (r#""w": 4, "h": 3,"#, "its 'w' is 4"),
        ] {
            let error = of(all, frame).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("frame 0 of it"), "{error}");
        }
        // What the file says of distortion holds for a frame with a focal length of its own.
        let distorted = of(r#""k1": 0.1,"#, all).unwrap().warnings;
        assert!(distorted.len() == 1 && distorted[0].contains("distort"), "{distorted:?}");
    }

    #[test]
    fn cameras_that_were_moved_are_told_of() {
        let of = |said: &str| {
            let frame = r#""frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]"#;
            read(&format!(r#"{{"fl_x": 4, {said} {frame}}}"#)).unwrap().warnings
        };
        for still in
            ["", r#""applied_transform": [[1,0,0,0],[0,1,0,0],[0,0,1,0]], "applied_scale": 1,"#]
        {
            assert!(of(still).is_empty(), "{still}");
        }
        for moved in [
            r#""applied_transform": [[0,1,0,0],[1,0,0,0],[0,0,-1,0]],"#,
            r#""applied_transform": [[1,0,0,2],[0,1,0,0],[0,0,1,0]],"#,
            r#""applied_transform": "none","#,
            r#""applied_scale": 0.5,"#,
        ] {
            let told = of(moved);
            assert!(told.len() == 1 && told[0].contains("applied_transform"), "{told:?}");
        }
    }

    #[test]
    fn what_holds_no_cameras_is_one_error() {
        for (text, part) in [
            (r#"[{"width": 4.0, "height": 4, "fx": 1}]"#, "camera 0 of it: missing field"),
            (r#"{"camera_model": "EQUIRECTANGULAR", "frames": []}"#, "'EQUIRECTANGULAR'"),
            (r#"{"is_fisheye": true, "frames": []}"#, "fisheye"),
            (
                r#"{"w": 4, "fl_x": 4, "frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}"#,
                "one of 'w' and 'h'",
            ),
            ("{", "no JSON"),
            ("[]", "no camera"),
            ("{}", "no cameras that are known"),
            (r#"{"frames": [{"transform_matrix": [[1, 0, 0, 0]]}]}"#, "rows"),
            (
                r#"{"frames": [{"transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}"#,
                "neither 'fl_x'",
            ),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(part) && !error.contains('\n'), "{error}");
        }
    }
}

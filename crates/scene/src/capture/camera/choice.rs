//! Which camera a capture takes: one of a file of cameras, or one that the scene's file has.

use std::path::{Path, PathBuf};

use crate::capture::camera::Pose;
use crate::capture::camera::file::Poses;
use crate::scene::FileCamera;
use screendoor_trace::error::{Error, Result};

/// What is asked for.
#[derive(Clone, Debug)]
pub struct CameraChoice<'a> {
    /// A `.json` file of cameras, or one of the scene's own by its name or its number from 0;
    /// where not given, the camera follows the scene's view.
    pub camera: Option<PathBuf>,
    /// Which of the file's, by its picture's name or its number from 0; the first where not
    /// given.
    pub name: Option<&'a str>,
    /// The frame's size in pixels; where not given, the camera's own.
    pub size: Option<[u32; 2]>,
    /// The frame's size where the camera has none either.
    pub default_size: [u32; 2],
}

/// What was chosen.
#[derive(Clone, PartialEq, Debug)]
pub struct Chosen {
    /// The camera; `None` where it follows the scene's view.
    pub pose: Option<Pose>,
    /// The frame's size in pixels.
    pub size: [u32; 2],
    /// What of a file of cameras could not be honoured.
    pub warnings: Vec<String>,
}

impl CameraChoice<'_> {
    /// Whether a camera's name is that of a file of cameras, and not one of the scene's own.
    pub fn is_file(name: &Path) -> bool {
        name.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"))
    }

    /// The file of cameras, if it is one: then nothing of the scene is needed to choose.
    pub fn file(&self) -> Option<&Path> {
        self.camera.as_deref().filter(|name| CameraChoice::is_file(name))
    }

    /// The camera, its frame, and what is to be told. `own` are the cameras of the scene's file.
    ///
    /// # Errors
    /// [`Error::Io`] where a file of cameras cannot be read, [`Error::Invalid`] and
    /// [`Error::Unsupported`] where it holds none that can be, [`Error::Config`] where there is
    /// no such camera or it does not suit the frame.
    pub fn choose(&self, own: &[FileCamera]) -> Result<Chosen> {
        let frame = self.size.unwrap_or(self.default_size);
        let Some(camera) = &self.camera else {
            return Ok(Chosen { pose: None, size: frame, warnings: Vec::new() });
        };
        let (pose, warnings) = if let Some(path) = self.file() {
            let Poses { poses, warnings } = Poses::read(path, frame)?;
            let pose = match self.name {
                None => &poses[0],
                Some(wanted) => named(&poses, wanted, |pose| &pose.name, is_picture)?,
            };
            (pose.clone(), warnings)
        } else {
            let wanted = camera.to_string_lossy();
            if own.is_empty() {
                let what = format_args!("there is no camera '{wanted}': the scene's file has none");
                return Err(Error::config(what, "name a .json file of cameras, or give an angle"));
            }
            let camera = named(own, &wanted, |camera| &camera.name, |_, _| false)?;
            (Pose::of_file(camera, frame)?, Vec::new())
        };
        let size = self.size.unwrap_or(pose.size);
        pose.check(size)?;
        Ok(Chosen { pose: Some(pose), size, warnings })
    }
}

/// The camera of a list that is called `wanted`, or else by a name that `means` it, or else has
/// that number counted from 0.
fn named<'a, T>(
    list: &'a [T],
    wanted: &str,
    name: impl Fn(&T) -> &str,
    means: impl Fn(&str, &str) -> bool,
) -> Result<&'a T> {
    let called = list.iter().find(|camera| name(camera) == wanted);
    let meant = || list.iter().find(|camera| means(wanted, name(camera)));
    let numbered = || wanted.parse().ok().and_then(|i: usize| list.get(i));
    called
        .or_else(meant)
        .or_else(numbered)
        .ok_or_else(|| Error::unknown("camera", wanted, list.iter().map(name)))
}

/// Whether `wanted` is a picture's name without its folders, or without its ending too.
fn is_picture(wanted: &str, name: &str) -> bool {
    let path = Path::new(name);
    [path.file_name(), path.file_stem()].iter().flatten().any(|s| s.to_str() == Some(wanted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;

    const CAMERAS: &str = r#"{"fl_x": 50, "w": 40, "h": 20, "k1": 0.1, "frames": [
        {"file_path": "images/b.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]},
        {"file_path": "7", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]},
        {"file_path": "c", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}"#;

    fn choice(camera: Option<PathBuf>) -> CameraChoice<'static> {
        CameraChoice { camera, name: None, size: None, default_size: [8, 8] }
    }

    #[test]
    fn cameras_are_chosen_by_name_stem_or_number() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.JSON");
        std::fs::write(&path, CAMERAS).unwrap();
        let chosen = |name| {
            let choice = CameraChoice { name, ..choice(Some(path.clone())) };
            choice.choose(&[]).map(|chosen| chosen.pose.unwrap().name)
        };
        assert_eq!(chosen(None).unwrap(), "images/b.png");
        assert_eq!(chosen(Some("b")).unwrap(), "images/b.png");
        assert_eq!(chosen(Some("b.png")).unwrap(), "images/b.png");
        assert_eq!(chosen(Some("7")).unwrap(), "7");
        assert_eq!(chosen(Some("2")).unwrap(), "c");
        assert!(chosen(Some("3")).is_err());
    }

    #[test]
    fn a_size_that_is_given_comes_before_the_camera_s_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        std::fs::write(&path, CAMERAS).unwrap();
        let of = |size| CameraChoice { size, ..choice(Some(path.clone())) }.choose(&[]);
        let own = of(None).unwrap();
        assert_eq!((own.size, own.warnings.len()), ([40, 20], 1));
        assert_eq!(of(Some([80, 40])).unwrap().size, [80, 40]);
        let wrong = of(Some([80, 80])).unwrap_err().to_string();
        assert!(wrong.contains("40x20") && wrong.contains("80x80"), "{wrong}");
        // Without a camera there is the default.
        let none = choice(None).choose(&[]).unwrap();
        assert_eq!((none.pose, none.size), (None, [8, 8]));
    }

    #[test]
    fn the_scene_s_own_have_names_and_numbers() {
        let camera = |name: &str, field_of_view| FileCamera {
            name: name.into(),
            place: DAffine3::IDENTITY,
            field_of_view,
        };
        let own = [camera("1", Some(1.0)), camera("a.b", Some(0.5)), camera("flat", None)];
        let chosen = |name: &str, own: &[FileCamera]| {
            let chosen = choice(Some(name.into())).choose(own);
            chosen.map(|chosen| (chosen.pose.unwrap().name, chosen.size))
        };
        assert_eq!(chosen("1", &own).unwrap(), ("1".to_string(), [8, 8]));
        assert_eq!(chosen("0", &own).unwrap().0, "1");
        assert_eq!(chosen("a.b", &own).unwrap().0, "a.b");
        // No picture's name.
        assert!(chosen("a", &own).is_err());
        let says = |name: &str, own: &[FileCamera], part: &str| {
            let error = chosen(name, own).unwrap_err().to_string();
            assert!(error.contains(part) && !error.contains("--"), "{error}");
        };
        says("flat", &own, "not one in perspective");
        says("a", &[], "has none");
    }
}

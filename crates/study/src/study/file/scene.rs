//! A scene of a study.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::study::file::{ShadowEntry, defaults};
use screendoor_scene::capture::{
    CameraChoice, CameraOptions, CaptureOptions, Chosen, Faces, Light, Opacity, Order, PatternKind,
    ScreenDoor, SplatRules,
};
use screendoor_scene::scene::{self, Axes, LoadOptions, Scene};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Space;

/// A scene of a study: drawn for it, or a trace that is there already.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneEntry {
    /// A short name; the files' too.
    pub name: String,
    /// What is drawn: `builtin:NAME[:parameter=value,…]`, or a file, seen from the study
    /// file's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// In its place, a trace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trace: Option<String>,
    /// Frame width and height in pixels; where not given, 512 each, or those of the camera in a
    /// file of cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Opacity in place of the materials' own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f32>,
    /// How opaque surfaces are by the angle at which they are seen: `NAME[:parameter=value,…]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<String>,
    /// What cuts that which lets light through into opaque points or holes:
    /// `NAME[:parameter=value,…]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screen_door: Option<String>,
    /// A PNG or JPEG for surfaces that have no texture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<String>,
    /// Makes every surface white.
    #[serde(default)]
    pub white: bool,
    /// The order in which triangles are drawn.
    #[serde(default = "defaults::order")]
    pub order: Order,
    /// Which shuffle a random order takes.
    #[serde(default)]
    pub order_seed: u32,
    /// Which sides of surfaces are drawn.
    #[serde(default = "defaults::faces")]
    pub faces: Faces,
    /// Where the samples lie.
    #[serde(default = "defaults::pattern")]
    pub pattern: PatternKind,
    /// Samples per pixel that are recorded; the study's counts are its first ones.
    #[serde(default = "defaults::captured")]
    pub captured_samples: u32,
    /// Camera: degrees to the right of the scene's front, degrees above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<[f64; 2]>,
    /// Camera: distance in radii of the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
    /// Camera: vertical field of view in degrees; 0 for parallel lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fov: Option<f64>,
    /// In place of all three, one of the scene's own cameras (glTF) by its name or its number
    /// from 0; or a `.json` file of cameras, seen from the study file's folder: the first of them,
    /// or `camera_name`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Which of them, by its picture's name or its number from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_name: Option<String>,
    /// How Gaussian splats are drawn: `NAME[:parameter=value,…]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splat_rules: Option<String>,
    /// Which way is up in a file that does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axes: Option<Axes>,
    /// How wide lines of OBJ and glTF files are drawn, in the scene's units.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line_width: Option<f64>,
    /// What colours stand for, and so in what designs blend them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub space: Option<Space>,
    /// Linear colour behind the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<[f32; 3]>,
    /// The light of which it is recorded what of colours comes from it: `NAME[:parameter=value,…]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<String>,
    /// The pixel that the report's inspector opens at; one with a handful of fragments
    /// where not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel: Option<[u16; 2]>,
    /// The shadows of that light; without them it shines through everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow: Option<ShadowEntry>,
}

impl SceneEntry {
    /// Loads the scene; paths are seen from the folder `base`.
    ///
    /// # Errors
    /// As [`scene::load_with`].
    pub fn load(&self, base: &Path) -> Result<Scene> {
        let source = self.source.as_deref().unwrap_or("");
        let options =
            LoadOptions { axes: self.axes, line_width: self.line_width, ..LoadOptions::default() };
        scene::load_with(&scene::seen_from(source, base), &options)
    }

    /// Which camera it asks for; its file is seen from the folder `base`.
    pub fn camera_choice(&self, base: &Path) -> CameraChoice<'_> {
        let seen =
            |path: &String| if self.has_camera_file() { base.join(path) } else { path.into() };
        CameraChoice {
            camera: self.camera.as_ref().map(seen),
            name: self.camera_name.as_deref(),
            size: self.size,
            default_size: defaults::SIZE,
        }
    }

    pub(super) fn has_camera_file(&self) -> bool {
        self.camera.as_ref().is_some_and(|path| CameraChoice::is_file(Path::new(path)))
    }

    /// Its frame where no camera has one of its own.
    pub(crate) fn frame(&self) -> [u32; 2] {
        self.size.unwrap_or(defaults::SIZE)
    }

    /// How it is captured, seen by the camera that was chosen for it.
    ///
    /// # Errors
    /// As [`SplatRules::parse`], [`Opacity::parse`], [`ScreenDoor::parse`] and [`Light::parse`].
    pub fn options(&self, chosen: Chosen) -> Result<CaptureOptions> {
        let splats = self.splat_rules.as_deref().map(SplatRules::parse);
        let [width, height] = chosen.size;
        Ok(CaptureOptions {
            width,
            height,
            samples: self.captured_samples,
            pattern: self.pattern,
            alpha: self.alpha,
            opacity: self.opacity.as_deref().map(Opacity::parse).transpose()?.unwrap_or_default(),
            order: self.order,
            order_seed: self.order_seed,
            faces: self.faces,
            background: self.background,
            camera: CameraOptions {
                angle: self.angle,
                distance: self.distance,
                field_of_view: self.fov,
                pose: chosen.pose,
            },
            splats: splats.transpose()?.unwrap_or_default(),
            space: self.space,
            light: self.light.as_deref().map(Light::parse).transpose()?,
            screen_door: self.screen_door.as_deref().map(ScreenDoor::parse).transpose()?,
            ..CaptureOptions::default()
        })
    }
}

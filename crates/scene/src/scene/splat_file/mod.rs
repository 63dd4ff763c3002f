//! Files of 3D Gaussian splats (Kerbl et al. 2023): what they have in common.
//!
//! Colours are spherical harmonics, and splats are trained so that what comes of them is
//! blended as it is, encoded for a display. Files do not say which way is up: training leaves
//! the first camera's axes, of which y points down.

mod compressed;
mod packed;
pub(super) mod spz;
mod trained;

use std::path::Path;

use glam::{Quat, Vec3};

pub(super) use self::compressed::compressed;
pub(super) use self::trained::trained;
use crate::scene::bytes::Bytes;
use crate::scene::{Axes, Material, Scene, Shape, Splats, View, file, file_name};
use screendoor_trace::error::{Error, Result};

/// Loads antimatter15's `.splat` file at `path`.
pub(super) fn load_packed(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    packed::cloud(Bytes::new(&place, &content))?.scene(path, Axes::YDown)
}

/// Loads Niantic's `.spz` file at `path`.
pub(super) fn load_spz(path: &Path) -> Result<Scene> {
    let content = file::read(path)?;
    let place = path.display().to_string();
    spz::cloud(&place, &content)?.scene(path, Axes::YUp)
}

/// A splat as files have it.
pub(super) struct Stored {
    pub mean: [f64; 3],
    /// Standard deviations.
    pub scale: [f64; 3],
    /// A quaternion w, x, y, z, of any length.
    pub rotation: [f64; 4],
    /// 0 to 1.
    pub opacity: f64,
}

/// The splats of a file, as they are read.
pub(super) struct Cloud {
    place: String,
    splats: Splats,
    /// How many are no splats: not finite, or turned by nothing.
    broken: usize,
    /// What of the file is not read.
    told: Vec<String>,
}

impl Cloud {
    /// Notes something of the file that is not read.
    pub(super) fn tell(&mut self, what: &str) {
        self.told.push(format!("{}: {what}", self.place));
    }

    /// One with room for `count`, which the file is known to have.
    pub(super) fn new(place: &str, degree: u32, count: usize) -> Self {
        let mut splats = Splats { degree, ..Splats::default() };
        splats.means.reserve_exact(count);
        splats.scales.reserve_exact(count);
        splats.rotations.reserve_exact(count);
        splats.opacities.reserve_exact(count);
        splats.harmonics.reserve_exact(count * splats.coefficients());
        Cloud { place: place.to_string(), splats, broken: 0, told: Vec::new() }
    }

    pub(super) fn antialiased(mut self) -> Self {
        self.splats.antialiased = true;
        self
    }

    /// Adds a splat with the coefficients of its harmonics. One that is broken stays as one
    /// that shows nothing, so that the others keep their numbers.
    pub(super) fn push(&mut self, splat: &Stored, harmonics: &[[f32; 3]]) {
        let Stored { mean, scale, rotation, opacity } = splat;
        let mean = Vec3::from(mean.map(|v| v as f32));
        let scale = Vec3::from(scale.map(|v| v as f32));
        let length = rotation.iter().map(|v| v * v).sum::<f64>().sqrt();
        let [w, x, y, z] = rotation.map(|v| (v / length) as f32);
        let rotation = Quat::from_xyzw(x, y, z, w);
        let colour = harmonics.iter().flatten().all(|v| v.is_finite());
        let good = mean.is_finite()
            // What reaches beyond all numbers is nowhere.
            && (scale * 16.0).is_finite()
            && scale.min_element() >= 0.0
            && rotation.is_finite()
            && (0.0..=1.0).contains(opacity)
            && colour;
        if good {
            self.splats.push(mean, scale, rotation, *opacity as f32, harmonics);
        } else {
            self.broken += 1;
            let none = vec![[0.0; 3]; harmonics.len()];
            self.splats.push(Vec3::ZERO, Vec3::ZERO, Quat::IDENTITY, 0.0, &none);
        }
    }

    /// The splats, and what of them is not read or shows nothing.
    pub(super) fn finish(mut self) -> (Splats, Vec<String>) {
        if self.broken > 0 {
            let what = "have no finite place, size, turn, opacity or colour and show nothing";
            self.tell(&format!("{} splats {what}", self.broken));
        }
        (self.splats, self.told)
    }

    /// The scene of them, whose format has these axes by habit.
    pub(super) fn scene(self, path: &Path, axes: Axes) -> Result<Scene> {
        let (place, broken) = (&self.place, self.broken);
        if self.splats.means.is_empty() {
            return Err(Error::invalid(place, "it has no splats", "give a file with some"));
        }
        if broken == self.splats.means.len() {
            let what =
                format_args!("none of its {broken} splats has a finite place, size and turn");
            return Err(Error::invalid(place, what, "export it again"));
        }
        let (splats, warnings) = self.finish();
        let mut scene = Scene {
            source: file_name(path),
            files: vec![path.to_path_buf()],
            materials: vec![Material::default()],
            // Which side is the front, no file says.
            view: View { yaw: -30.0, pitch: 10.0, ..View::default() },
            axes,
            warnings,
            ..Scene::default()
        };
        scene.add("splats", Shape::Splats(splats));
        Ok(scene)
    }
}

/// The coefficient of the constant harmonic.
pub(super) const CONSTANT: f64 = 0.282_094_791_773_878_14;

/// The constant harmonic's coefficient for an encoded colour.
pub(super) fn constant(colour: f64) -> f32 {
    ((colour - 0.5) / CONSTANT) as f32
}

//! 3D Gaussian splats.

use glam::{Quat, Vec3};

use screendoor_trace::picture::Space;

/// How many standard deviations around its mean a splat is taken to reach where the scene is
/// bounded.
const REACH: f32 = 3.0;
/// The share of splats at each end of each axis that a camera's frame need not hold: trainings
/// leave some far outside.
const OUTSIDE: f64 = 0.01;
/// A splat's reach beyond its mean that a frame holds, as a share of what all means take.
const FAINT: f32 = 0.02;

/// 3D Gaussians with colours that change with the direction they are seen from (Kerbl et al.
/// 2023). One of an opacity of 0 shows nothing and keeps its number.
#[derive(Clone, Debug)]
pub struct Splats {
    /// Means.
    pub means: Vec<Vec3>,
    /// Standard deviations along own axes.
    pub scales: Vec<Vec3>,
    /// Unit quaternions that turn the own axes.
    pub rotations: Vec<Quat>,
    /// Opacities at the means, 0 to 1.
    pub opacities: Vec<f32>,
    /// The degree of the spherical harmonics, 0 to 4.
    pub degree: u32,
    /// Coefficients of red, green and blue, [`Splats::coefficients`] for each splat.
    pub harmonics: Vec<[f32; 3]>,
    /// Whether opacities are for splats whose own size on the frame counts (Mip-Splatting).
    pub antialiased: bool,
    /// What colours stand for, and so in what they were trained to be blended.
    pub space: Space,
}

impl Default for Splats {
    fn default() -> Self {
        Splats {
            means: Vec::new(),
            scales: Vec::new(),
            rotations: Vec::new(),
            opacities: Vec::new(),
            degree: 0,
            harmonics: Vec::new(),
            antialiased: false,
            space: Space::Encoded,
        }
    }
}

impl Splats {
    /// How many coefficients each splat has.
    pub fn coefficients(&self) -> usize {
        ((self.degree + 1) * (self.degree + 1)) as usize
    }

    pub(super) fn push(
        &mut self,
        mean: Vec3,
        scale: Vec3,
        rotation: Quat,
        opacity: f32,
        harmonics: &[[f32; 3]],
    ) {
        self.means.push(mean);
        self.scales.push(scale);
        self.rotations.push(rotation);
        self.opacities.push(opacity);
        self.harmonics.extend_from_slice(harmonics);
    }

    /// Gives all of them the same white.
    pub(super) fn whiten(&mut self) {
        self.degree = 0;
        let white = (0.5 / super::splat_file::CONSTANT) as f32;
        self.harmonics.clear();
        self.harmonics.resize(self.means.len(), [white; 3]);
    }

    fn shown(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.means.len()).filter(|i| self.opacities[*i] > 0.0)
    }

    fn point(&self, i: usize) -> (Vec3, f32) {
        (self.means[i], REACH * self.scales[i].max_element())
    }

    /// Points that bound what is shown, each with a radius around it.
    pub(super) fn bounding_points(&self) -> impl Iterator<Item = (Vec3, f32)> + '_ {
        self.shown().map(|i| self.point(i))
    }

    /// The points of those that lie among the others along each axis, but for the last of each
    /// hundred at either end.
    pub(super) fn framed_points(&self) -> impl Iterator<Item = (Vec3, f32)> + '_ {
        let ends = |axis: usize| {
            let mut all: Vec<f32> = self.shown().map(|i| self.means[i][axis]).collect();
            let skip = (all.len() as f64 * OUTSIDE) as usize;
            if all.is_empty() {
                return [0.0; 2];
            }
            let mut at = |place: usize| *all.select_nth_unstable_by(place, f32::total_cmp).1;
            let low = at(skip);
            [low, at(self.shown().count() - 1 - skip)]
        };
        let ends = [0, 1, 2].map(ends);
        let inside = move |mean: Vec3| {
            ends.iter().zip(mean.to_array()).all(|([low, high], v)| (*low..=*high).contains(&v))
        };
        // A large one reaches beyond the others, faintly.
        let least = move |(mean, reach): (Vec3, f32)| {
            let room = ends.iter().map(|[low, high]| high - low).fold(0.0, f32::max);
            (mean, if room > 0.0 { reach.min(room * FAINT) } else { reach })
        };
        self.shown().filter(move |i| inside(self.means[*i])).map(move |i| least(self.point(i)))
    }
}

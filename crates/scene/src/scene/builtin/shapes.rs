//! Meshes from rings of points: everything round, extruded or bent along a path
//! is a row of rings, each joined to the next.

use std::collections::HashMap;

use glam::{DAffine3, Vec2, Vec3};

use crate::scene::Mesh;
use crate::scene::builtin::outlines::{circle, rounded};

/// Faces that meet at less than this angle are shaded as one smooth surface: the
/// cosine of 40 degrees.
const CREASE: f32 = 0.766;

/// Triangles over shared points, without normals yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Solid {
    pub points: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Solid {
    /// Joins rings of equally many points, each to the next and, where `cyclic`,
    /// the last to the first. The outside is where the points of a ring go around
    /// counter-clockwise as seen from the next ring.
    pub(super) fn loft(rings: &[Vec<Vec3>], cyclic: bool) -> Self {
        Self::join(rings, cyclic, true)
    }

    /// Joins rows of equally many points, each to the next.
    pub(super) fn sheet(rows: &[Vec<Vec3>]) -> Self {
        Self::join(rows, false, false)
    }

    fn join(rings: &[Vec<Vec3>], cyclic: bool, around: bool) -> Self {
        let n = rings.first().map_or(0, Vec::len);
        let points: Vec<Vec3> = rings.iter().flatten().copied().collect();
        let mut triangles = Vec::with_capacity(points.len() * 2);
        for i in 0..if cyclic { rings.len() } else { rings.len().saturating_sub(1) } {
            for j in 0..if around { n } else { n.saturating_sub(1) } {
                let at = |i: usize, j: usize| (i % rings.len() * n + j % n) as u32;
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                let same = |i: u32, j: u32| points[i as usize] == points[j as usize];
                // A ring shrunk to a point leaves one triangle of each pair.
                triangles.extend(
                    [[a, b, c], [a, c, d]]
                        .into_iter()
                        .filter(|[a, b, c]| !same(*a, *b) && !same(*b, *c) && !same(*c, *a)),
                );
            }
        }
        Solid { points, triangles }
    }

    /// Turns a section around the z axis: `profile` holds (radius, z), upwards
    /// along the outside; `cyclic` closes the section.
    pub(super) fn lathe(sides: usize, profile: &[[f32; 2]], cyclic: bool) -> Self {
        Self::wheel(&circle(sides, 1.0), 0.0, profile, cyclic)
    }

    /// As [`Solid::lathe`], but instead of a radius the profile holds the share of
    /// the way from a circle of radius `hub` to the outline.
    pub(super) fn wheel(outline: &[Vec2], hub: f32, profile: &[[f32; 2]], cyclic: bool) -> Self {
        let ring = |[share, z]: &[f32; 2]| {
            let point = |p: &Vec2| (p.normalize_or_zero() * hub).lerp(*p, *share).extend(*z);
            outline.iter().map(point).collect()
        };
        Self::loft(&profile.iter().map(ring).collect::<Vec<_>>(), cyclic)
    }

    /// A plate of an outline around the origin between two heights, in `steps`
    /// rings from its middle to its edge; with a round hole where `hub` > 0.
    pub(super) fn plate(outline: &[Vec2], hub: f32, [low, high]: [f32; 2], steps: usize) -> Self {
        let share = |i: usize| i as f32 / steps as f32;
        let up = (0..=steps).map(|i| [share(i), low]);
        let profile: Vec<_> = up.chain((0..=steps).rev().map(|i| [share(i), high])).collect();
        Self::wheel(outline, hub, &profile, hub > 0.0)
    }

    /// A box with rounded corners along z: `section` holds how far its sides lie
    /// within `half`, and z, upwards along the outside.
    pub(super) fn shell(half: [f32; 2], corner: f32, sides: usize, section: &[[f32; 2]]) -> Self {
        let outline = rounded(half, corner, sides);
        let half = Vec2::from_array(half);
        let ring = |[inset, z]: &[f32; 2]| {
            let scale = (half - *inset) / half;
            outline.iter().map(|p| (*p * scale).extend(*z)).collect()
        };
        Self::loft(&section.iter().map(ring).collect::<Vec<_>>(), false)
    }

    /// Moves a section along a path. The section's x axis starts along `axis` and
    /// follows the bends without twisting; `section` gives it for each point.
    pub(super) fn sweep(
        path: &[Vec3],
        cyclic: bool,
        axis: Vec3,
        section: impl Fn(usize) -> Vec<Vec2>,
    ) -> Self {
        let n = path.len();
        let neighbours = |i: usize| {
            if cyclic {
                (path[(i + n - 1) % n], path[(i + 1) % n])
            } else {
                (path[i.saturating_sub(1)], path[(i + 1).min(n - 1)])
            }
        };
        let mut x = axis;
        let mut rings = Vec::with_capacity(n);
        for (i, centre) in path.iter().enumerate() {
            let (before, after) = neighbours(i);
            let along = (after - before).normalize_or(Vec3::Z);
            x = (x - along * x.dot(along)).normalize_or(along.any_orthonormal_vector());
            let y = along.cross(x);
            rings.push(section(i).iter().map(|p| centre + x * p.x + y * p.y).collect());
        }
        Self::loft(&rings, cyclic)
    }

    /// A tube of one radius along a path, open at its ends.
    pub(super) fn tube(path: &[Vec3], radius: f32, sides: usize) -> Self {
        Self::sweep(path, false, Vec3::X, |_| circle(sides, radius))
    }

    /// This and another.
    pub(super) fn and(mut self, other: Solid) -> Self {
        let first = self.points.len() as u32;
        self.points.extend(other.points);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
        self
    }

    /// The same at another place.
    pub(super) fn placed(self, place: &DAffine3) -> Self {
        self.bent(|p| place.transform_point3(p.as_dvec3()).as_vec3())
    }

    /// The same with each of its points put elsewhere.
    pub(super) fn bent(mut self, place: impl Fn(Vec3) -> Vec3) -> Self {
        self.points.iter_mut().for_each(|p| *p = place(*p));
        self
    }

    /// The same moved along.
    pub(super) fn moved(self, x: f32, y: f32, z: f32) -> Self {
        self.placed(&DAffine3::from_translation(Vec3::new(x, y, z).as_dvec3()))
    }

    /// The mesh: smooth across shallow edges, creased along sharp ones.
    pub(super) fn mesh(&self, material: usize) -> Mesh {
        let triangles = self.welded();
        let faces: Vec<Vec3> = triangles.iter().map(|t| self.area(t)).collect();
        let units: Vec<Vec3> = faces.iter().map(|f| f.normalize_or_zero()).collect();
        let mut around = vec![Vec::new(); self.points.len()];
        for (face, triangle) in triangles.iter().enumerate() {
            triangle.iter().for_each(|i| around[*i as usize].push(face));
        }
        let mut mesh = Mesh { material, ..Mesh::default() };
        // The mesh's vertices made from each point so far.
        let mut made: Vec<Vec<u32>> = vec![Vec::new(); self.points.len()];
        for (face, triangle) in triangles.iter().enumerate() {
            mesh.triangles.push(triangle.map(|point| {
                let near = around[point as usize]
                    .iter()
                    .filter(|f| **f == face || units[**f].dot(units[face]) > CREASE);
                let normal = near.map(|f| faces[*f]).sum::<Vec3>().normalize_or(units[face]);
                let of_point = &mut made[point as usize];
                let known = of_point.iter().find(|v| mesh.normals[**v as usize] == normal);
                known.copied().unwrap_or_else(|| {
                    let vertex = mesh.positions.len() as u32;
                    mesh.positions.push(self.points[point as usize]);
                    mesh.normals.push(normal);
                    of_point.push(vertex);
                    vertex
                })
            }));
        }
        mesh
    }

    /// Twice a triangle's area, along its normal.
    fn area(&self, triangle: &[u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|i| self.points[i as usize]);
        (b - a).cross(c - a)
    }

    /// The triangles with points at the same place taken as one.
    fn welded(&self) -> Vec<[u32; 3]> {
        let mut first = HashMap::with_capacity(self.points.len());
        let weld = |i: usize| {
            // The sum makes −0 and 0 the same.
            let key = (self.points[i] + Vec3::ZERO).to_array().map(f32::to_bits);
            *first.entry(key).or_insert(i as u32)
        };
        let welded: Vec<u32> = (0..self.points.len()).map(weld).collect();
        self.triangles.iter().map(|t| t.map(|i| welded[i as usize])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::outlines::cut;

    /// The volume within a closed solid; negative where it is inside out.
    fn volume(solid: &Solid) -> f32 {
        let point = |i: u32| solid.points[i as usize];
        let part = |[a, b, c]: &[u32; 3]| point(*a).dot(point(*b).cross(point(*c))) / 6.0;
        solid.triangles.iter().map(part).sum()
    }

    #[test]
    fn solids_have_their_outside_outside() {
        let close = |solid: &Solid, expected: f32| {
            let found = volume(solid);
            assert!((found / expected - 1.0).abs() < 0.01, "{found} in place of {expected}");
        };
        let pi = std::f32::consts::PI;
        let cylinder = [[0.0, 0.0], [0.5, 0.0], [0.5, 2.0], [0.0, 2.0]];
        close(&Solid::lathe(96, &cut(&cylinder, 0.3), false), 0.5 * pi);
        close(&Solid::plate(&circle(96, 1.0), 0.5, [-0.5, 0.5], 3), 0.75 * pi);
        let around: Vec<Vec3> = circle(96, 2.0).iter().map(|p| p.extend(0.0)).collect();
        let torus = Solid::sweep(&around, true, Vec3::Z, |_| circle(96, 0.5));
        close(&torus, 4.0 * pi * pi * 0.25);
        let shell = [[2.0, 0.0], [0.0, 0.0], [0.0, 1.0], [2.0, 1.0]];
        close(&Solid::shell([2.0, 2.0], 0.01, 400, &shell), 16.0);
    }

    #[test]
    fn edges_are_creased_and_round_walls_are_smooth() {
        let section = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mesh = Solid::lathe(24, &section, false).mesh(0);
        // Each point of the two rims has a normal up or down and one outwards.
        assert_eq!(mesh.positions.len(), 2 + 4 * 24);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let outwards = Vec3::new(p.x, p.y, 0.0).normalize_or_zero();
            assert!(n.z.abs() > 0.999 || n.dot(outwards) > 0.999, "{p} {n}");
        }
    }
}

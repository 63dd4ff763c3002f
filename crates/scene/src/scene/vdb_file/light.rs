//! How bright the voxels of a cloud are.

use std::collections::HashMap;

use glam::{DAffine3, DVec3, Vec3, Vec4};

use super::Voxel;

/// Towards the light: from the upper right, a little from the front.
const LIGHT: DVec3 = DVec3::new(0.62, 0.70, 0.35);
const LIT: Vec3 = Vec3::new(1.0, 0.97, 0.92);
const DARK: Vec3 = Vec3::new(0.14, 0.16, 0.20);
/// What a voxel of the greatest density takes of the light, as an optical depth.
const EXTINCTION: f32 = 0.2;

/// The voxels' colours: lit as far as the densities between them and the light let
/// it through. The light's rays are gathered into cells as wide as a voxel.
pub(super) fn colours(voxels: &[Voxel], greatest: f32, place: &DAffine3) -> Vec<Vec4> {
    let light = LIGHT.normalize();
    let (across, aside) = light.any_orthonormal_pair();
    let width = place.matrix3.determinant().abs().cbrt();
    let at = |v: &Voxel| place.transform_point3(v.at.as_dvec3()) / width;
    let mut order: Vec<(f64, usize)> =
        voxels.iter().enumerate().map(|(i, v)| (at(v).dot(light), i)).collect();
    // Those nearest to the light first.
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));

    let mut depths: HashMap<[i64; 2], f32> = HashMap::new();
    let mut colours = vec![Vec4::ONE; voxels.len()];
    for (_, i) in order {
        let p = at(&voxels[i]);
        let cells = cells(p.dot(across), p.dot(aside));
        let depth: f32 =
            cells.iter().map(|(cell, share)| share * depths.get(cell).unwrap_or(&0.0)).sum();
        let own = EXTINCTION * voxels[i].density / greatest;
        for (cell, share) in cells {
            *depths.entry(cell).or_default() += share * own;
        }
        colours[i] = DARK.lerp(LIT, libm::expf(-depth)).extend(1.0);
    }
    colours
}

/// The four cells around a point, each with its share of it.
fn cells(x: f64, y: f64) -> [([i64; 2], f32); 4] {
    let (low_x, low_y) = (x.floor(), y.floor());
    let (right, down) = ((x - low_x) as f32, (y - low_y) as f32);
    let (x, y) = (low_x as i64, low_y as i64);
    [
        ([x, y], (1.0 - right) * (1.0 - down)),
        ([x.saturating_add(1), y], right * (1.0 - down)),
        ([x, y.saturating_add(1)], (1.0 - right) * down),
        ([x.saturating_add(1), y.saturating_add(1)], right * down),
    ]
}

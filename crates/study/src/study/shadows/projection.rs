//! From a camera's frame to a light's map: where a fragment lies there follows from its depth and
//! from the views that both traces were taken in.

use glam::{DMat4, DVec3, DVec4};

use screendoor_rop::visibility::Receiver;
use screendoor_trace::trace::{Fragment, Header, Unorm32, View};

/// Takes places of the frame (pixels from its top left, depth 0 to 1) to places of the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection(DMat4);

/// From pixels of a frame of this size to −1 … 1, y up. Depth stays.
fn from_pixels([width, height]: [u32; 2]) -> DMat4 {
    let [x, y] = [width, height].map(|side| 2.0 / f64::from(side));
    DMat4::from_cols(
        DVec4::new(x, 0.0, 0.0, 0.0),
        DVec4::new(0.0, -y, 0.0, 0.0),
        DVec4::Z,
        DVec4::new(-1.0, 1.0, 0.0, 1.0),
    )
}

/// From the scene to clip space.
fn to_clip(view: &View) -> DMat4 {
    DMat4::from_cols_array(&view.view_to_clip) * DMat4::from_cols_array(&view.world_to_view)
}

/// Depths as traces have them.
const UNITS: f64 = u32::MAX as f64;
/// The part of a pixel over which a surface's slope is taken: so little that the camera's
/// perspective bends nothing.
const STEP: f64 = 1.0 / 16.0;

impl Projection {
    /// From the one view to the other, each over a frame of so many pixels.
    fn between(camera: (&View, [u32; 2]), light: (&View, [u32; 2])) -> Self {
        let to_scene = to_clip(camera.0).inverse();
        let to_map = from_pixels(light.1).inverse();
        Projection(to_map * to_clip(light.0) * to_scene * from_pixels(camera.1))
    }

    /// From a camera's trace to a light's; `None` where one of them has no view.
    pub(super) fn of(camera: &Header, light: &Header) -> Option<Self> {
        let of = |header: &Header| [header.width, header.height];
        let views = camera.view.as_ref().zip(light.view.as_ref());
        views.map(|(c, l)| Projection::between((c, of(camera)), (l, of(light))))
    }

    /// A place of the frame on the map; `None` behind the light.
    fn at(&self, place: DVec3) -> Option<DVec3> {
        let found = self.0 * place.extend(1.0);
        (found.w > 0.0).then(|| found.truncate() / found.w)
    }

    /// What of a fragment is compared; `None` behind the light.
    pub(super) fn receiver(&self, f: &Fragment) -> Option<Receiver> {
        let [dzdx, dzdy] = [f.depth.dzdx, f.depth.dzdy].map(|slope| f64::from(slope) / UNITS);
        let centre =
            DVec3::new(f64::from(f.x) + 0.5, f64::from(f.y) + 0.5, f64::from(f.depth.z.0) / UNITS);
        let here = self.at(centre)?;
        let right = self.at(centre + STEP * DVec3::new(1.0, 0.0, dzdx))? - here;
        let down = self.at(centre + STEP * DVec3::new(0.0, 1.0, dzdy))? - here;
        // How the surface's depth changes with its place on the map: a plane through both.
        let area = right.x * down.y - right.y * down.x;
        let slopes = [
            (right.z * down.y - down.z * right.y) / area,
            (right.x * down.z - down.x * right.z) / area,
        ];
        // Seen from its edge, it is as steep as can be.
        let steep = |slope: f64| if slope.is_finite() { slope.abs() * UNITS } else { UNITS };
        Some(Receiver {
            at: [here.x as f32, here.y as f32],
            // Saturates at the planes.
            z: Unorm32((here.z * UNITS).round() as u32),
            slope: steep(slopes[0]).max(steep(slopes[1])) as u32,
            key: [u32::from(f.x) | u32::from(f.y) << 16, f.primitive],
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use screendoor_scene::capture::{Capture, CaptureOptions, Light};
    use screendoor_scene::scene::load;

    #[test]
    fn a_primitive_that_both_see_lies_where_the_light_has_it() {
        let scene = load("builtin:engine:rows=1,detail=2").unwrap();
        for light in [Light::Key, Light::Directional([-60.0, 30.0])] {
            let options = CaptureOptions {
                width: 96,
                height: 80,
                samples: 8,
                light: Some(light),
                ..CaptureOptions::default()
            };
            let capture = Capture::new(&scene, &options).unwrap();
            let of_light = capture.of_light([128, 128]).unwrap();
            let camera = capture.to_memory(|_, _| ()).unwrap();
            let map = Capture::new(&scene, &of_light).unwrap().to_memory(|_, _| ()).unwrap();
            let projection = Projection::of(camera.header(), map.header()).unwrap();
            let mut planes = HashMap::new();
            for f in map.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>()) {
                planes.insert((f.x, f.y, f.primitive), f.depth);
            }
            let (mut compared, mut off, mut steep) = (0, 0, 0);
            for f in camera.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>()) {
                let Some(receiver) = projection.receiver(&f) else { continue };
                let [x, y] = receiver.at;
                let Some(plane) = planes.get(&(x as u16, y as u16, f.primitive)) else { continue };
                // Slopes are whole numbers, and of slivers none is recorded.
                if plane.dzdx == 0 && plane.dzdy == 0 || f.depth.dzdx == 0 && f.depth.dzdy == 0 {
                    continue;
                }
                let aside = [x, y].map(|p| f64::from(p) - f64::from(p).floor() - 0.5);
                let wanted = f64::from(plane.z.0)
                    + f64::from(plane.dzdx) * aside[0]
                    + f64::from(plane.dzdy) * aside[1];
                let slope = f64::from(plane.dzdx.unsigned_abs().max(plane.dzdy.unsigned_abs()));
                compared += 1;
                // Corners are moved to a grid of 1/256 pixel, in either view.
                let reach = slope / 64.0 + 1e-6 * UNITS;
                off += u32::from((f64::from(receiver.z.0) - wanted).abs() > reach);
                let bent = (f64::from(receiver.slope) - slope).abs();
                steep += u32::from(bent > 0.1 * slope + 1e-5 * UNITS);
            }
            assert!(compared > 500, "{compared}");
            // Triangles of less than a pixel, which the grid bends.
            assert!(off * 20 <= compared && steep * 50 <= compared, "{off} {steep} {compared}");
        }
    }

    #[test]
    fn what_lies_behind_a_light_receives_nothing_from_it() {
        let scene = load("builtin:glass").unwrap();
        let options = CaptureOptions { width: 32, height: 32, ..CaptureOptions::default() };
        let capture = Capture::new(&scene, &options).unwrap();
        let header = capture.header();
        let view = header.view.unwrap();
        // The same view turned about: what one sees lies behind the other.
        let turn = DMat4::from_rotation_y(std::f64::consts::PI);
        let world = turn * DMat4::from_cols_array(&view.world_to_view);
        let back = View { world_to_view: world.to_cols_array(), ..view };
        let projection = Projection::between((&view, [32, 32]), (&back, [32, 32]));
        let mut f = Fragment { x: 16, y: 16, ..Fragment::default() };
        f.depth.z = Unorm32(1 << 31);
        assert!(projection.receiver(&f).is_none());
        let same = Projection::between((&view, [32, 32]), (&view, [32, 32]));
        let receiver = same.receiver(&f).unwrap();
        assert_eq!((receiver.at, receiver.z), ([16.5, 16.5], f.depth.z));
        // From its edge a surface is as steep as can be, and no number is lost.
        f.depth.dzdx = i32::MAX;
        assert!(same.receiver(&f).unwrap().slope > 1 << 30);
    }
}

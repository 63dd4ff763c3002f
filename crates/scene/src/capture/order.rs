//! The order in which triangles and splats are drawn.

use rayon::prelude::*;

use crate::capture::camera::Camera;
use crate::capture::geometry::Geometry;
use screendoor_trace::random::Stream;

screendoor_trace::options! {
    /// The order in which triangles and splats are drawn.
    pub enum Order {
        Api = "api": "as the scene lists them",
        Random = "random": "shuffled, by --order-seed",
        NearToFar = "near-to-far": "by the depth of their centres, nearest first",
        FarToNear = "far-to-near": "by the depth of their centres, furthest first",
    }
}

/// The primitives' numbers in drawing order; `None` is 0, 1, 2, ….
pub(crate) fn drawing_order(
    order: Order,
    seed: u32,
    geometry: &Geometry<'_>,
    camera: &Camera,
) -> Option<Vec<u32>> {
    let all = 0..geometry.len();
    match order {
        Order::Api => None,
        Order::Random => {
            let mut order: Vec<u32> = all.collect();
            Stream::new([0x0bde5, seed]).shuffle(&mut order);
            Some(order)
        }
        Order::NearToFar | Order::FarToNear => {
            let mut keyed: Vec<(f64, u32)> = all
                .into_par_iter()
                .map(|i| {
                    let centre = geometry.middle(i);
                    let distance = match camera.eye {
                        Some(eye) => (centre - eye).length(),
                        None => -camera.back.dot(centre),
                    };
                    (distance, i)
                })
                .collect();
            keyed.par_sort_by(|a, b| {
                let distance = match order {
                    Order::FarToNear => b.0.total_cmp(&a.0),
                    _ => a.0.total_cmp(&b.0),
                };
                distance.then(a.1.cmp(&b.1))
            });
            Some(keyed.into_iter().map(|(_, i)| i).collect())
        }
    }
}

//! Where an adapter's samples lie, found by drawing.

use crate::capture::rasteriser::{Corner, Rasteriser, SAMPLES};
use crate::device::Gpu;
use screendoor_scene::capture::{PatternKind, pattern};
use screendoor_trace::error::Result;
use screendoor_trace::trace::SamplePattern;

/// Places along an axis: sixteenths of a pixel.
const PLACES: u32 = 16;
/// Pixels along an axis of the frame: one between two that are looked at.
const SIDE: u32 = 2 * PLACES;

/// Finds where the adapter's four samples lie: a small square around each of the 256 places
/// on the grid of 1/16 pixel is drawn, each in a pixel of its own, and whichever sample it
/// covers lies there.
///
/// # Errors
/// [`screendoor_trace::error::Error::Gpu`] where the adapter fails, or a sample is not found once.
pub fn sample_positions(gpu: &Gpu) -> Result<SamplePattern> {
    let mut corners = Vec::new();
    for place in 0..PLACES * PLACES {
        let [i, j] = [place % PLACES, place / PLACES];
        // From the frame's left or top, in pixels, to clip space: exact in single precision.
        let centre = |i: u32| 2.0 * i as f32 + 0.5 + (i as f32 - 8.0) / 16.0;
        let at = |i: u32, side: f32| (centre(i) + side / 32.0) / SIDE as f32 * 2.0 - 1.0;
        let corner = |x, y| Corner { position: [at(i, x), -at(j, y), 0.5, 1.0], keep_back: 1 };
        let [a, b] = [corner(-1.0, -1.0), corner(1.0, 1.0)];
        corners.extend([a, corner(1.0, -1.0), b, a, b, corner(-1.0, 1.0)]);
    }
    let mut found: Vec<Vec<[i8; 2]>> = vec![Vec::new(); SAMPLES as usize];
    let rasteriser = Rasteriser::new(gpu, [SIDE; 2], 4 * PLACES * PLACES)?;
    rasteriser.draw(&corners, |fragments| {
        for fragment in fragments {
            let place = fragment.primitive / 2;
            let [i, j] = [place % PLACES, place / PLACES];
            if fragment.pixel != ((2 * i) | ((2 * j) << 16)) {
                // A square at the pixel's border reaches over it.
                continue;
            }
            for (sample, found) in found.iter_mut().enumerate() {
                if fragment.coverage >> sample & 1 == 1 {
                    found.push([i as i8 - 8, j as i8 - 8]);
                }
            }
        }
        Ok(())
    })?;
    let positions: Vec<[i8; 2]> = found.iter().flat_map(|f| f.first().copied()).collect();
    if found.iter().any(|found| found.len() != 1) {
        return Err(gpu.error(
            format_args!("where its samples lie cannot be found ({found:?})"),
            "update its driver, or capture without the GPU",
        ));
    }
    let standard = pattern(PatternKind::Standard, SAMPLES)?;
    Ok(if positions == standard.positions {
        standard
    } else {
        SamplePattern { name: format!("measured-{SAMPLES}"), positions, nested: false }
    })
}

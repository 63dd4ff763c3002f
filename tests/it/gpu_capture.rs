//! Fragments captured by a GPU, held against our own rasteriser's.

use screendoor::capture::{Capture, CaptureOptions, Order};
use screendoor::gpu::Gpu;
use screendoor::gpu::capture::{CrossCheck, GpuCapture, sample_positions};
use screendoor::scene::builtin::BUILTINS;
use screendoor::trace::SamplePattern;

use crate::util::gpu;

fn options() -> CaptureOptions {
    CaptureOptions { width: 96, height: 64, samples: 4, ..CaptureOptions::default() }
}

/// The built-in scenes, the large ones made smaller.
fn scenes() -> impl Iterator<Item = String> {
    BUILTINS.iter().map(|builtin| {
        let settings = match builtin.name {
            "engine" => ":rows=1,detail=2",
            "cloth" => ":sheets=3,cells=24",
            "hair" => ":strands=300",
            "smoke" => ":puffs=300",
            "foliage" => ":cards=500",
            _ => "",
        };
        format!("builtin:{}{settings}", builtin.name)
    })
}

fn cross_check(gpu: &Gpu, scene: &str, pattern: Option<&SamplePattern>) -> CrossCheck {
    let (scene, options) = (screendoor::scene::load(scene).unwrap(), options());
    let capture = GpuCapture::new(gpu, &scene, &options).unwrap();
    capture.check(pattern.unwrap_or(&capture.header().pattern), |_, _| ()).unwrap()
}

#[test]
fn both_rasterisers_cover_the_same() {
    let Some(gpu) = gpu() else { return };
    for scene in scenes() {
        let found = cross_check(gpu, &scene, None);
        println!("{scene} {found:?}");
    }
}

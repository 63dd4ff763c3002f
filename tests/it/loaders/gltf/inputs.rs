//! Small files that were once drawn wrongly, each held to what it should be.

use std::path::Path;

use screendoor::capture::{Capture, CaptureOptions};
use screendoor::scene::Scene;

use super::model::{at, drawn, is, middle};
use crate::loaders::{load_in, warned};

fn input(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs/gltf");
    load_in(&folder, name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// As [`input`], for a file that gives no warning.
fn quiet(name: &str) -> Scene {
    let scene = input(name);
    assert_eq!(scene.warnings, [""; 0], "{name}");
    scene
}

#[test]
fn opaque_surfaces_and_emission_have_no_alpha() {
    // 200 of 255 as sRGB is 0.578.
    assert!(is(middle(&quiet("opaque_alpha0.gltf")), [0.578; 3], 1.0));
    assert!(is(middle(&quiet("emissive_alpha0.gltf")), [0.578; 3], 1.0));
}

#[test]
fn transmission_is_what_its_texture_says() {
    assert!(is(middle(&quiet("transmission_texture.gltf")), [0.6559; 3], 1.0));
    let both = drawn(&quiet("transmission.gltf"));
    let glass = both.iter().find(|f| f.object == 1).unwrap();
    assert!((glass.alpha - (1.0 - (0.1 + 0.8 + 0.1) / 3.0)).abs() < 1e-3, "{}", glass.alpha);
}

#[test]
fn clear_glass_vanishes_and_is_listed() {
    let scene = input("volume.gltf");
    let says = ["KHR_materials_volume is not read: its attenuation is not applied (2 triangles)"];
    warned(&scene, 1, &says);
    let options = CaptureOptions { width: 32, height: 32, samples: 4, ..CaptureOptions::default() };
    let capture = Capture::new(&scene, &options).unwrap();
    assert_eq!(capture.to_memory(|_, _| ()).unwrap().rows(), 0);
    let unseen = capture.unseen();
    assert_eq!(
        unseen.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["no fragment of object 0, 'node 0', was recorded: its 2 triangles are wholly \
             transparent (its material '' lets all light through, with a transmission of 1)"]
    );
}

#[test]
fn skins_stand_in_their_default_pose() {
    let scene = quiet("skin.gltf");
    let middles: Vec<_> = scene.bounding_points().map(|(p, _)| p).collect();
    let (skinned, other) = middles.split_at(middles.len() / 2);
    for (points, x) in [(skinned, -5.0), (other, 5.0)] {
        let sum: glam::DVec3 = points.iter().sum();
        let bounds =
            points.iter().map(|p| p.x).fold((9.0_f64, -9.0_f64), |b, x| (b.0.min(x), b.1.max(x)));
        assert!((bounds.0 - (x - 1.0)).abs() + (bounds.1 - (x + 1.0)).abs() < 1e-6, "{points:?}");
        assert!(sum.y.abs() < 1e-6, "{points:?}");
    }
}

#[test]
fn morph_targets_have_their_default_weights() {
    let scene = quiet("morph.gltf");
    let xs: Vec<f64> = scene.bounding_points().map(|(p, _)| p.x).collect();
    assert!(xs.iter().all(|x| *x == -1.0 || *x == 0.0) && xs.contains(&0.0), "{xs:?}");
}

#[test]
fn instances_are_drawn() {
    let scene = quiet("instancing.gltf");
    let places: Vec<f64> = scene.objects.iter().map(|o| o.place.translation.x).collect();
    assert_eq!(places, [-4.0, 0.0, 4.0]);
    assert_eq!(scene.objects[2].name, "node 0, instance 2");
}

#[test]
fn the_older_diffuse_colour_is_read() {
    assert!(is(middle(&quiet("specgloss.gltf")), [0.6559, 0.0, 0.0], 0.25));
}

#[test]
fn nearest_texels_have_sharp_edges() {
    let scene = quiet("nearest.gltf");
    assert_eq!(at(&scene, 12, 16), None);
    assert_eq!(at(&scene, 19, 16).unwrap().1, 1.0);
}

#[test]
fn valid_files_are_drawn() {
    let scene = input("anim_no_node.gltf");
    warned(&scene, 1, &["its animation '' is not played (0 triangles)"]);
    assert!(is(middle(&scene), [1.0; 3], 1.0));
    assert!(is(middle(&quiet("quant.gltf")), [1.0; 3], 1.0));
    let scene = input("basisu.gltf");
    warned(&scene, 1, &["KHR_texture_basisu is not read", "(2 triangles)"]);
    assert!(is(middle(&scene), [0.6559; 3], 1.0));
}

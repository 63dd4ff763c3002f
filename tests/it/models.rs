//! Real models from elsewhere, where there are any.

use std::path::{Path, PathBuf};

use screendoor::capture::{Capture, CaptureOptions, Faces};
use screendoor::scene::{AlphaMode, Scene, load};
use screendoor::trace::{Statistics, statistics};

use crate::util::{design, picture};

fn folder() -> PathBuf {
    std::env::var_os("SCREENDOOR_MODELS").expect("SCREENDOOR_MODELS names the folder").into()
}

fn model(path: &str) -> Scene {
    load(&folder().join(path).display().to_string()).unwrap()
}

/// Captures a model, replays it and finds something to see; its statistics.
fn look(scene: &Scene, alpha: Option<f32>) -> Statistics {
    let options = CaptureOptions {
        width: 256,
        height: 256,
        samples: 8,
        alpha,
        faces: Faces::Both,
        ..CaptureOptions::default()
    };
    let trace = Capture::new(scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    let stats = statistics(&trace, |_| ()).unwrap();
    let exact = picture(&design("exact"), &trace, 8, 0);
    let seen = (0..256).flat_map(|y| (0..256).map(move |x| (x, y)));
    let lit = seen.filter(|(x, y)| exact.get(*x, *y) != exact.background()).count();
    assert!(lit > 256 * 256 / 50, "{}: {lit} pixels", scene.source);
    stats
}

#[test]
#[ignore = "needs SCREENDOOR_MODELS"]
fn gltf_models_load_whole() {
    // Triangles, and objects placed, as the models' own catalogue has them.
    let cases = [
        ("cycloidal.glb", 376_520, 72),
        ("love_neon_sign.glb", 46_552, 22),
        ("SheenCloth/SheenCloth.gltf", 115_200, 1),
        ("StainedGlassLamp/StainedGlassLamp.gltf", 35_132, 8),
    ];
    for (path, triangles, objects) in cases {
        let scene = model(path);
        assert_eq!(scene.primitive_count(), triangles, "{path}");
        assert_eq!(scene.objects.len(), objects, "{path}");
        assert!(look(&scene, None).depth_complexity.mean > 1.0, "{path}");
    }
    // Only some of its textures are there: warnings, not an end.
    let lamp = model("StainedGlassLamp/StainedGlassLamp.gltf");
    assert!(!lamp.warnings.is_empty() && !lamp.textures.is_empty());
    assert!(lamp.materials.iter().any(|m| m.transmission > 0.0));
    let sign = model("love_neon_sign.glb");
    assert!(sign.materials.iter().any(|m| m.alpha_mode == AlphaMode::Blend));
}

#[test]
#[ignore = "needs SCREENDOOR_MODELS"]
fn obj_models_load_whole() {
    let drape = model("codimipc_multilayer_drape.obj");
    assert_eq!(drape.primitive_count(), 84_159);
    let stats = look(&drape, Some(0.4));
    assert!(stats.depth_complexity.max > 20);

    let mut leaves = model("oak_large_leaves.obj");
    assert_eq!(leaves.primitive_count(), 10_560);
    let cards = look(&leaves, None);
    leaves.apply_texture(Path::new(&folder().join("oak_leaf_color.png"))).unwrap();
    let cut = look(&leaves, None);
    // The texture's alpha cuts the leaves out of their cards.
    assert!(cut.fragments < cards.fragments && cut.alpha.mean < 1.0);
}

#[test]
#[ignore = "needs SCREENDOOR_MODELS"]
fn clouds_and_hair_load_whole() {
    let smoke = model("openusd_smoke_000003.vdb");
    let billboards = smoke.primitive_count() / 2;
    // Its 90 197 active voxels without those next to empty.
    assert!((60_000..90_197).contains(&billboards), "{billboards}");
    let stats = look(&smoke, None);
    assert!(stats.depth_complexity.mean > 50.0 && stats.alpha.max < 0.05);

    let hair = model("Ratboy_mohawk.tfx");
    assert_eq!(hair.primitive_count(), 2228 * 31 * 2);
    assert!(look(&hair, None).depth_complexity.mean > 3.0);

    let guitar = model("guitar.compressed.ply");
    assert_eq!(guitar.primitive_count(), 90_854);
    assert!(look(&guitar, None).depth_complexity.mean > 50.0);
}

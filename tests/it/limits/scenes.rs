//! Scenes of hostile sizes.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use image::ImageEncoder;
use image::codecs::png::PngEncoder;

use crate::measured::Run;

/// What a capture may take beside its scene, in MiB.
const BESIDE_SCENE: u64 = 96;

fn capture(folder: &Path, scene: &str, size: &str) -> Run {
    let arguments = ["capture", scene, "-o", "t.arrow", "--size", size, "--samples", "4"];
    Run::of(folder, &arguments)
}

/// A scene of one triangle with a texture.
fn textured(folder: &Path, texture: &[u8]) {
    fs::write(folder.join("t.png"), texture).unwrap();
    fs::write(folder.join("t.mtl"), "newmtl m\nmap_Kd t.png\n").unwrap();
    let scene = "mtllib t.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
                 f 1/1 2/2 3/3\n";
    fs::write(folder.join("t.obj"), scene).unwrap();
}

#[test]
pub(super) fn a_texture_costs_its_texels_and_a_claim_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let side = 3072_u32;
    let mut texture = Vec::new();
    let texels = [200, 100, 50, 128].repeat((side * side) as usize);
    let encoder = PngEncoder::new(&mut texture);
    encoder.write_image(&texels, side, side, image::ExtendedColorType::Rgba8).unwrap();
    assert!(texture.len() < 1 << 20, "a small file: {}", texture.len());
    textured(folder.path(), &texture);
    let run = capture(folder.path(), "t.obj", "8x8");
    // 11 bytes a texel when it is loaded, and at most 8 while it is.
    run.is_good(((u64::from(side * side) * 19) >> 20) + BESIDE_SCENE, "a texture");
    assert!(!run.error.contains("warning"), "{}", run.error);

    // The same file's head, and nothing behind it; then more texels than are read.
    for (claimed, says) in [(side, "hold no 3072 x 3072 texels"), (16384, "16384 x 16384 texels")] {
        let mut claim = texture[..64].to_vec();
        claim[16..20].copy_from_slice(&claimed.to_be_bytes());
        claim[20..24].copy_from_slice(&claimed.to_be_bytes());
        let crc = crc32fast::hash(&claim[12..29]);
        claim[29..33].copy_from_slice(&crc.to_be_bytes());
        textured(folder.path(), &claim);
        let run = capture(folder.path(), "t.obj", "8x8");
        run.is_good(BESIDE_SCENE, "a claim");
        assert!(run.error.contains(says), "{}", run.error);
        assert!(run.seconds < 10.0, "{} s", run.seconds);
    }
}

/// An OBJ of `count` triangles that lie on few pixels, and of two that make the scene large.
fn many_triangles(count: usize) -> String {
    let mut scene = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 90 90 0\nv 91 90 0\nv 90 91 0\n");
    for i in 0..count {
        let corners = [[1, 2, 3], [2, 3, 1], [4, 5, 6]][i % 3];
        writeln!(scene, "f {} {} {}", corners[0], corners[1], corners[2]).unwrap();
    }
    scene
}

#[test]
pub(super) fn triangles_cost_little_and_too_many_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("t.obj"), many_triangles(300_000)).unwrap();
    let run = capture(folder.path(), "t.obj", "200x200");
    assert!(!run.error.contains("no fragment"), "{}", run.error);
    // A file of 4 MB; three indices and what they stand for.
    run.is_good(BESIDE_SCENE, "many triangles");

    // A file of 7 MB that says of 2^20 triangles 4096 times that they are drawn.
    let (mesh, nodes) = (1 << 20, 4096);
    let corners = [0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
    let indices = [0_u16, 1, 2].map(u16::to_le_bytes).concat().repeat(mesh);
    fs::write(folder.path().join("t.bin"), [corners, indices].concat()).unwrap();
    let numbers: Vec<usize> = (0..nodes).collect();
    let document = serde_json::json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": numbers}],
        "nodes": vec![serde_json::json!({"mesh": 0}); nodes],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": "t.bin", "byteLength": 36 + 6 * mesh}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6 * mesh},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3 * mesh, "type": "SCALAR"},
        ],
    });
    fs::write(folder.path().join("t.gltf"), document.to_string()).unwrap();
    let run = capture(folder.path(), "t.gltf", "4x4");
    assert_eq!(run.status.code(), Some(1), "{}", run.error);
    assert!(
        run.error.contains("more than 2^32 triangles and splats; split the scene"),
        "{}",
        run.error
    );
    assert!(run.mib <= 2 * BESIDE_SCENE, "{} MiB", run.mib);
    assert!(run.seconds < 30.0, "{} s", run.seconds);
}

#[test]
pub(super) fn a_vast_frame_costs_what_is_drawn_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "v 0 0 0\nv 0.0001 0 0\nv 0 0.0001 0\nv 1 1 0\nv 1.0001 1 0\nv 1 1.0001 0\n\
                 f 1 2 3\nf 4 5 6\n";
    fs::write(folder.path().join("t.obj"), scene).unwrap();
    let run = capture(folder.path(), "t.obj", "65536x65536");
    run.is_good(BESIDE_SCENE, "a vast frame");
    assert!(run.seconds < 30.0, "{} s", run.seconds);
}

#[test]
#[ignore = "takes a quarter of a minute"]
pub(super) fn a_demo_of_many_triangles() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("t.obj"), many_triangles(30_000)).unwrap();
    let run = Run::of(folder.path(), &["demo", "--scene", "t.obj", "-o", "d"]);
    // It allows 'exact' 512 MiB, and keeps thirteen pictures of 512 × 512 pixels.
    run.is_within(512, "demo");
}

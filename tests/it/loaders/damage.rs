//! Good files damaged at random: they load, or give one error.

use std::fs;

use screendoor::random::Stream;
use serde_json::json;

use super::gltf::textured;
use super::{folder, hair, load_in, png, splats, tfx, vdb};
use crate::hostile;

/// Changes a file as damage does: bytes changed, cut out, doubled, or words swapped
/// for others.
fn mutate(bytes: &[u8], random: &mut Stream) -> Vec<u8> {
    const WORDS: [&[u8]; 16] = [
        b"0",
        b"-1",
        b"1",
        b"99999999999",
        b"4294967295",
        b"nan",
        b"1e39",
        b"{}",
        b"[]",
        b"null",
        b"\"\"",
        b"-",
        b"/",
        b"\\\n",
        b"\n",
        b"\xff",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(3) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len() as u32) as usize;
        let end = (at + random.below(12) as usize).min(bytes.len());
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.word() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            4 => {
                // A whole word.
                let solid = |b: &u8| b.is_ascii_alphanumeric() || b"._-+".contains(b);
                let start = bytes[..at].iter().rposition(|b| !solid(b)).map_or(0, |i| i + 1);
                let end =
                    bytes[at..].iter().position(|b| !solid(b)).map_or(bytes.len(), |i| at + i);
                let word = WORDS[random.below(16) as usize];
                bytes.splice(start..end.max(start), word.iter().copied());
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

/// Good files, each of which says much of what its format can.
pub fn good_files() -> Vec<(&'static str, Vec<u8>)> {
    let mtl = b"newmtl m\nKd 1 .5 0\nKe 0 0 1\nd .5\nmap_Kd -s 1 1 1 a.png\nmap_d a.png\nnewmtl n\nTr 0\n";
    let text = "mtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 0 1 0 1\nv 1 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\n\
                usemtl m\nf 1/1/1 2/2/1 3/1/1\ng b\nusemtl n\nf -4//1 -3//1 -2//1 -1//1\nl 1 2\n";
    let image = png(image::RgbaImage::from_pixel(2, 2, image::Rgba([9, 99, 199, 99])));
    let full = hostile::gltf(|j| {
        textured(j);
        j["nodes"] =
            json!([{ "children": [1, 2] }, { "mesh": 0 }, { "mesh": 0, "scale": [1, 2, 3] }]);
        let uri = j["buffers"][0]["uri"].as_str().unwrap();
        // Behind the triangle's 36 bytes its indices: 0, 1, 2 in base64.
        j["buffers"][0] = json!({ "byteLength": 39, "uri": format!("{uri}AAEC") });
        j["bufferViews"] = json!([
            { "buffer": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 3 },
        ]);
        j["accessors"] = json!([j["accessors"][0], {
            "bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR",
            "sparse": {
                "count": 1,
                "indices": { "bufferView": 1, "componentType": 5121 },
                "values": { "bufferView": 1 },
            },
        }]);
        let primitive = &mut j["meshes"][0]["primitives"][0];
        primitive["indices"] = 1.into();
        primitive["attributes"]["NORMAL"] = 0.into();
        primitive["attributes"]["_X"] = 0.into();
        j["images"] = json!([{ "bufferView": 0, "mimeType": "image/png" }, { "uri": "a.png" }]);
    });
    let glb = glb(&full);
    let tressfx = tfx::tfx(4, 8, |_| ());
    let packed = vdb::Written { packing: 6, half: true, ..vdb::full() }.bytes();
    let zipped = vdb::Written { packing: 3, tile: Some(0.5), ..vdb::full() }.bytes();
    let packed_splats = splats::splats(&[[0x1234_5678, 0x4567_89ab, 0x89ab_cdef, 0xffee_ddcc]; 20]);
    vec![
        ("a.tfx", tressfx),
        ("a.ply", packed_splats),
        ("b.ply", splats::trained("ascii")),
        ("c.ply", splats::trained("binary_little_endian")),
        ("d.ply", splats::MESH.into()),
        ("a.splat", splats::packed()),
        ("a.hair", hair::hair(31, |_| ())),
        ("a.stl", hair::stl(0)),
        ("a.spz", splats::spz(2, true)),
        ("b.spz", splats::spz(4, false)),
        ("b.vdb", packed),
        ("c.vdb", zipped),
        ("a.obj", text.into()),
        ("a.mtl", mtl.to_vec()),
        ("a.png", image),
        ("a.gltf", full),
        ("a.glb", glb),
    ]
}

#[test]
fn damaged_files_load_or_give_one_error() {
    let files = good_files();
    let good: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let folder = folder(&good);
    for name in [
        "a.obj", "a.gltf", "a.glb", "a.tfx", "a.ply", "b.ply", "c.ply", "d.ply", "a.splat",
        "a.hair", "a.stl", "a.spz", "b.spz", "b.vdb", "c.vdb",
    ] {
        load_in(folder.path(), name).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    // SCREENDOOR_MUTATIONS: for a longer search, how many changes to each file.
    let rounds: u32 =
        std::env::var("SCREENDOOR_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(80);
    let mut failed = 0;
    for (kind, (name, bytes)) in good.iter().copied().enumerate() {
        let scene = if name.ends_with(".mtl") || name.ends_with(".png") { "a.obj" } else { name };
        for round in 0..rounds {
            let damaged = mutate(bytes, &mut Stream::new([kind as u32, round]));
            fs::write(folder.path().join(name), &damaged).unwrap();
            if let Err(e) = load_in(folder.path(), scene) {
                failed += 1;
                let e = e.to_string();
                assert!(!e.contains('\n') && e.contains(scene), "{name}, {round}: {e}");
            }
        }
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    // The damage is neither always fatal nor never.
    let all = good.len() as u32 * rounds;
    assert!((all / 5..4 * all / 5).contains(&failed), "{failed} of {all}");
}

/// A GLB file of a document.
fn glb(json: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |n: usize| (n as u32).to_le_bytes();
    [b"glTF\x02\0\0\0", &length(json.len() + 20)[..], &length(json.len()), b"JSON", &json].concat()
}

//! What scene files of other programs say, and what is read from them.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use image::{DynamicImage, ImageFormat};
use screendoor::error::Error;
use screendoor::random::Stream;
use screendoor::scene::{AlphaMode, Mesh, Scene, Shape, load};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::hostile;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A folder with files in it.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn load_in(folder: &Path, name: &str) -> Result<Scene, Error> {
    load(&folder.join(name).display().to_string())
}

/// The scene of an OBJ file.
fn obj(text: impl AsRef<[u8]>) -> Result<Scene, Error> {
    load_in(folder(&[("a.obj", text.as_ref())]).path(), "a.obj")
}

/// The scene of a triangle of the material `m` that the MTL file defines.
fn with_mtl(mtl: impl AsRef<[u8]>) -> Scene {
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let folder = folder(&[("a.obj", text.as_bytes()), ("a.mtl", mtl.as_ref())]);
    load_in(folder.path(), "a.obj").unwrap()
}

fn mesh(scene: &Scene, i: usize) -> &Mesh {
    match &scene.shapes[scene.objects[i].shape] {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = Vec::new();
    image.into().write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
    bytes
}

#[track_caller]
fn warned(scene: &Scene, count: usize, parts: &[&str]) {
    assert_eq!(scene.warnings.len(), count, "{:?}", scene.warnings);
    let all = |w: &&String| parts.iter().all(|part| w.contains(part));
    assert!(scene.warnings.iter().any(|w| all(&w)), "{parts:?}: {:?}", scene.warnings);
}

#[test]
fn a_bad_mtl_statement_costs_only_itself() {
    let bad = [
        "Kd",
        "Kd 1 2",
        "Kd spectral f.rfl",
        "Kd -1 0 0",
        "Kd nan 0 0",
        "Ke",
        "Ke 1 2",
        "map_Kd",
        "map_d -s 1 1",
        "d",
        "d 2",
        "d -1",
        "d nan",
        "Tr 3",
        "newmtl",
    ];
    for statement in bad {
        let scene =
            with_mtl(format!("# made by hand\nnewmtl m\nd 0.25\nKd .1 .2 .3\n{statement}\n"));
        let material = &scene.materials[mesh(&scene, 0).material];
        assert_eq!(material.base, Vec4::new(0.1, 0.2, 0.3, 0.25), "{statement}");
        assert_eq!(material.alpha_mode, AlphaMode::Blend);
        warned(&scene, 1, &["a.mtl, line 5", &format!("('{statement}')")]);
    }
    // What is not drawn may say what it likes, and short colours are greys.
    let scene = with_mtl("newmtl m\nKa 1\nKs\nillum 99999999999\nNs x\nKd .5\nKe 1\nd -halo 0.5\n");
    let material = &scene.materials[0];
    assert_eq!((material.base, material.emissive), (Vec4::splat(0.5), Vec3::ONE));
    warned(&scene, 1, &["a.mtl, line 8", "halo"]);
    let scene = with_mtl("\u{feff}newmtl m\r\nTr 0.75\r\nKd 1 \\\r\n 0 0\r\n");
    assert_eq!(scene.materials[0].base, Vec4::new(1.0, 0.0, 0.0, 0.25));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn mtl_files_are_found_or_named() {
    let text = format!(
        "mtllib a.mtl b.mtl\nmtllib gone.mtl\nmtllib c d.mtl\n{TRIANGLE}\
         usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl d #2\nf 1 2 3\n"
    );
    let files: [(&str, &[u8]); 4] = [
        ("a.obj", text.as_bytes()),
        ("a.mtl", b"newmtl a\nKd 1 0 0\n"),
        ("b.mtl", b"newmtl b\nKd 0 1 0\n"),
        ("c d.mtl", b"newmtl d #2\nKd 0 0 1\n"),
    ];
    let scene = load_in(folder(&files).path(), "a.obj").unwrap();
    let base = |i| scene.materials[mesh(&scene, i).material].base.truncate();
    assert_eq!([base(0), base(1), base(2)], [Vec3::X, Vec3::Y, Vec3::Z]);
    warned(&scene, 1, &["cannot read", "gone.mtl"]);

    let scene = obj(format!("{TRIANGLE}usemtl zzz\nf 1 2 3\n")).unwrap();
    warned(&scene, 1, &["a.obj, line 4", "'zzz'"]);
}

#[test]
fn files_of_ordinary_exporters_are_read() {
    let plain = obj(format!("{TRIANGLE}f 1 2 3\n")).unwrap();
    let same: [&[u8]; 8] = [
        b"# Sch\xf6n\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"v 0 0 0 # origin\nv 1 0 0 #1\nv 0 1 0\nf 1 2 3 # all\n",
        b"v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\r\n 2 \\  \n 3\n",
        b"# in C:\\models\\\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3",
        b"v 0 0 0 2\nv 2 0 0 2\nv 0 1 0 1\nf -3 -2 -1\n",
        b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3/3\n",
    ];
    for (i, text) in same.into_iter().enumerate() {
        let scene = obj(text).unwrap_or_else(|e| panic!("{i}: {e}"));
        let (a, b) = (mesh(&scene, 0), mesh(&plain, 0));
        assert_eq!((&a.positions, &a.triangles), (&b.positions, &b.triangles), "{i}");
        assert!(a.normals.is_empty() && a.uvs.is_empty() && a.colours.is_empty());
        assert_eq!(scene.warnings, [""; 0]);
    }
    let scene = obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\no Kn\xf6pfe\nf 1 2 3\n").unwrap();
    assert_eq!(scene.objects[0].name, "Kn\u{f6}pfe");
    // Lines are not polygons.
    let scene = obj(format!("{TRIANGLE}l 1 2 3\np 1\nf 1 2\nf 1 2 3\n")).unwrap();
    assert_eq!(scene.triangle_count(), 1);
    warned(&scene, 1, &["3 statements of points and lines"]);
    // Colours of some vertices.
    let scene = obj("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nf 1 2 3\n").unwrap();
    let colours: Vec<Vec3> = mesh(&scene, 0).colours.iter().map(|c| c.truncate()).collect();
    assert_eq!(colours, [Vec3::X, Vec3::ONE, Vec3::Z]);
    let scene = obj("v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    warned(&scene, 1, &["only some vertices have colours"]);
}

#[test]
fn corners_without_texture_coordinates_or_normals_are_filled_in() {
    let text = format!(
        "{TRIANGLE}v 1 1 0\nv 0 0 -1\nvt 0.25 0.75\nvn 1 0 0\n\
         f 1/1/1 2/1/1 3/1/1\nf 2 4 3\nf 1//1 2/1 5\n"
    );
    let scene = obj(text).unwrap();
    let mesh = mesh(&scene, 0);
    let corners = |t: usize| mesh.triangles[t].map(|i| i as usize);
    let count = mesh.positions.len();
    assert_eq!((mesh.uvs.len(), mesh.normals.len()), (count, count));
    assert_eq!(corners(0).map(|i| mesh.uvs[i]), [Vec2::new(0.25, 0.25); 3]);
    assert_eq!(corners(0).map(|i| mesh.normals[i]), [Vec3::X; 3]);
    assert_eq!(corners(1).map(|i| mesh.uvs[i]), [Vec2::new(0.0, 1.0); 3]);
    assert_eq!(corners(1).map(|i| mesh.normals[i]), [Vec3::Z; 3]);
    assert_eq!(corners(2).map(|i| mesh.normals[i]), [Vec3::X, Vec3::Y, Vec3::Y]);
    assert_eq!(corners(2).map(|i| mesh.uvs[i].x), [0.0, 0.25, 0.0]);
    assert_eq!(corners(2).map(|i| mesh.positions[i]), [Vec3::ZERO, Vec3::X, Vec3::NEG_Z]);
}

#[test]
fn alpha_maps_are_linear() {
    let grey8 = png(image::GrayImage::from_pixel(2, 2, image::Luma([128])));
    let rgb8 = png(image::RgbImage::from_pixel(2, 2, image::Rgb([128; 3])));
    let grey16 =
        png(image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(2, 2, image::Luma([0x8080])));
    let rgb16 =
        png(image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(2, 2, image::Rgb([0x8080; 3])));
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    for mask in [grey8, rgb8, grey16, rgb16] {
        let mtl = b"newmtl m\nmap_Kd b.png\nmap_d a.png\n";
        let files: [(&str, &[u8]); 4] =
            [("a.obj", text.as_bytes()), ("a.mtl", mtl), ("a.png", &mask), ("b.png", &mask)];
        let scene = load_in(folder(&files).path(), "a.obj").unwrap();
        let material = &scene.materials[0];
        let texel = |t: screendoor::scene::TextureUse| {
            scene.textures[t.texture].sample(Vec2::splat(0.5), Vec2::ZERO, Vec2::ZERO).x
        };
        let (colour, alpha) = (material.base_texture.unwrap(), material.alpha_texture.unwrap());
        assert!((texel(alpha) - 128.0 / 255.0).abs() < 1e-4, "{}", texel(alpha));
        assert!((texel(colour) - 0.2159).abs() < 1e-4, "{}", texel(colour));
    }
}

#[test]
fn textures_have_a_limit() {
    let large = png(image::GrayImage::new(8193, 8192));
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let files: [(&str, &[u8]); 3] =
        [("a.obj", text.as_bytes()), ("a.mtl", b"newmtl m\nmap_Kd a.png\n"), ("a.png", &large)];
    let folder = folder(&files);
    let mut scene = load_in(folder.path(), "a.obj").unwrap();
    warned(&scene, 1, &["a.png", "8193 x 8192 texels", "67108864"]);
    let error = scene.apply_texture(&folder.path().join("a.png")).unwrap_err().to_string();
    assert!(error.contains("67108864"), "{error}");
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let text = format!("mtllib /dev/zero\n{TRIANGLE}f 1 2 3\n");
    let mut scene = obj(&text).unwrap();
    warned(&scene, 1, &["/dev/zero: it is no regular file"]);
    let error = scene.apply_texture(Path::new("/dev/zero")).unwrap_err().to_string();
    assert_eq!(error, "cannot read /dev/zero: it is no regular file: name one");
    let scene = with_mtl("newmtl m\nmap_Kd /dev/zero\n");
    warned(&scene, 1, &["/dev/zero: it is no regular file"]);

    let folder = folder(&[]);
    for name in ["a.obj", "a.gltf"] {
        // A pipe: opening it would wait for its other end.
        let path = folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let error = load_in(folder.path(), name).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("no regular file"), "{error}");
    }
}

/// A glTF scene of one textured triangle, changed by `edit`.
fn gltf(edit: impl Fn(&mut Value)) -> Result<Scene, Error> {
    let image = png(image::RgbImage::from_pixel(2, 2, image::Rgb([255; 3])));
    let files: [(&str, &[u8]); 2] = [
        (
            "a.gltf",
            &hostile::gltf(|j| {
                textured(j);
                edit(j)
            }),
        ),
        ("a.png", &image),
    ];
    load_in(folder(&files).path(), "a.gltf")
}

fn textured(json: &mut Value) {
    json["images"] = json!([{ "uri": "a.png" }]);
    json["textures"] = json!([{ "source": 0 }]);
    json["materials"] = json!([{ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } }]);
    json["meshes"][0]["primitives"][0]["material"] = 0.into();
}

#[test]
fn application_specific_attributes_are_ignored() {
    let scene = gltf(|j| {
        let attributes = &mut j["meshes"][0]["primitives"][0]["attributes"];
        attributes["_FOO"] = 0.into();
        attributes["_BATCH_ID"] = 0.into();
    });
    assert_eq!(scene.unwrap().triangle_count(), 1);
    // A byte order mark is not in the way.
    let bytes = [b"\xef\xbb\xbf", &hostile::gltf(|_| ())[..]].concat();
    assert!(load_in(folder(&[("a.gltf", &bytes)]).path(), "a.gltf").is_ok());
}

#[test]
fn images_that_say_nothing_are_warnings() {
    let scene = gltf(|j| j["images"] = json!([{}])).unwrap();
    warned(&scene, 1, &["image 0: it names neither a file nor a buffer view"]);
    // The format stands in the bytes, whether the file says it or not.
    let scene = gltf(|j| j["images"] = json!([{ "bufferView": 0 }])).unwrap();
    warned(&scene, 1, &["image 0: the texture cannot be decoded"]);
    // Without its texture the material would glow all over.
    assert_eq!(scene.materials[0].emissive, Vec3::ZERO);
}

#[test]
fn emissive_textures_keep_their_transform() {
    let scene = gltf(|j| {
        let material = &mut j["materials"][0];
        material["emissiveTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "offset": [0.5, 0.25], "scale": [2, 4] } });
        material["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
        j["extensionsUsed"] = json!(["KHR_texture_transform"]);
    });
    let scene = scene.unwrap();
    let transform = scene.materials[0].emissive_texture.unwrap().transform;
    assert_eq!(transform.transform_point2(Vec2::ONE), Vec2::new(2.5, 4.25));
    assert_eq!(scene.warnings, [""; 0]);

    let scene = gltf(|j| {
        let material = &mut j["materials"][0];
        material["emissiveTexture"]["texCoord"] = 1.into();
        material["pbrMetallicRoughness"] = json!({ "baseColorTexture": { "index": 0 } });
    });
    warned(&scene.unwrap(), 1, &["material ''", "texture coordinates 1"]);
}

#[test]
fn findings_of_the_library_are_errors_of_one_line() {
    let error = gltf(|j| j["accessors"][0]["componentType"] = 7.into()).unwrap_err().to_string();
    let wanted = "a.gltf, accessors[0].componentType: its value is not one that glTF allows; \
                  export the file again";
    assert!(error.ends_with(wanted), "{error}");
    for (key, version) in [("version", "9.0"), ("version", "1.0"), ("minVersion", "3.0")] {
        let error = gltf(|j| j["asset"][key] = version.into()).unwrap_err().to_string();
        assert!(error.ends_with(&format!("it wants glTF {version}; export it as glTF 2.0")));
    }
    assert!(gltf(|j| j["asset"]["version"] = "2.1".into()).is_ok());
}

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

#[test]
fn damaged_files_load_or_give_one_error() {
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
    let good: [(&str, &[u8]); 5] = [
        ("a.obj", text.as_bytes()),
        ("a.mtl", mtl),
        ("a.png", &image),
        ("a.gltf", &full),
        ("a.glb", &glb),
    ];
    let folder = folder(&good);
    for name in ["a.obj", "a.gltf", "a.glb"] {
        load_in(folder.path(), name).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    // SCREENDOOR_MUTATIONS: for a longer search, how many changes to each file.
    let rounds: u32 =
        std::env::var("SCREENDOOR_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(80);
    let mut failed = 0;
    for (kind, (name, bytes)) in good.into_iter().enumerate() {
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
    assert!((rounds..4 * rounds).contains(&failed), "{failed} of {}", 5 * rounds);
}

/// A GLB file of a document.
fn glb(json: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |n: usize| (n as u32).to_le_bytes();
    [b"glTF\x02\0\0\0", &length(json.len() + 20)[..], &length(json.len()), b"JSON", &json].concat()
}

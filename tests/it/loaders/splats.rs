//! Gaussian splats and meshes in PLY, splats in `.splat` and SPZ.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{Quat, Vec3};
use screendoor::error::Error;
use screendoor::scene::{Axes, LoadOptions, Scene, Shape, Splats, load_with};

use super::{folder, load_in, warned};

/// A file of one chunk in the box from −1 to 3 with sizes from e⁻² to 1, of splats of
/// a packed place, rotation, scale and colour each.
pub fn splats(splats: &[[u32; 4]]) -> Vec<u8> {
    file(&header(splats.len()), splats)
}

fn header(count: usize) -> String {
    let mut text = "ply\nformat binary_little_endian 1.0\ncomment made by a test\n".to_string();
    text += &format!("element chunk {}\n", count.div_ceil(256));
    for names in [["x", "y", "z"], ["scale_x", "scale_y", "scale_z"], ["r", "g", "b"]] {
        for end in ["min", "max"] {
            names.iter().for_each(|name| text += &format!("property float {end}_{name}\n"));
        }
    }
    text += &format!("element vertex {count}\n");
    for name in ["position", "rotation", "scale", "color"] {
        text += &format!("property uint packed_{name}\n");
    }
    text + "end_header\n"
}

fn file(header: &str, splats: &[[u32; 4]]) -> Vec<u8> {
    let chunk = [[-1.0_f32; 3], [3.0; 3], [-2.0; 3], [0.0; 3], [0.0; 3], [1.0; 3]].concat();
    let mut bytes = header.as_bytes().to_vec();
    for _ in 0..splats.len().div_ceil(256) {
        bytes.extend(chunk.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes.extend(splats.iter().flatten().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// No turn: the quaternion's real part is left out, the others are next to 0.
const STRAIGHT: u32 = 512 << 20 | 512 << 10 | 512;
/// In the middle of the chunk's upper end, e⁰ wide along x, red and half opaque.
pub const SPLAT: [u32; 4] = [u32::MAX, STRAIGHT, 0x7ff << 21, 0xff00_0080];

fn load(name: &str, bytes: &[u8]) -> Result<Scene, Error> {
    load_in(folder(&[(name, bytes)]).path(), name)
}

/// The splats of a scene that is nothing else.
pub fn found(scene: &Scene) -> &Splats {
    match &scene.shapes[..] {
        [Shape::Splats(splats)] => splats,
        other => panic!("{other:?}"),
    }
}

/// What splats of degree 0 show, encoded.
fn colours(splats: &Splats) -> Vec<[f32; 3]> {
    let each = splats.harmonics.chunks_exact(splats.coefficients());
    each.map(|c| c[0].map(|v| 0.5 + 0.282_094_8 * v)).collect()
}

#[track_caller]
fn near(a: &[f32], b: &[f32], by: f32) {
    let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(a.len() == b.len() && off <= by, "{a:?} {b:?}");
}

#[test]
fn compressed_splats_are_unpacked() {
    let grey = [0, STRAIGHT, 0, 0x8080_80ff];
    let scene = load("a.ply", &splats(&[SPLAT, grey, [0, 0, 0, 0xffff_ff00]])).unwrap();
    let found = found(&scene);
    // The third is wholly transparent, and keeps its number.
    assert_eq!(found.means, [Vec3::splat(3.0), Vec3::splat(-1.0), Vec3::splat(-1.0)]);
    near(&found.scales[0].to_array(), &[1.0, (-2.0_f32).exp(), (-2.0_f32).exp()], 1e-6);
    assert!(found.rotations[0].abs_diff_eq(Quat::IDENTITY, 2e-3));
    near(&found.opacities, &[128.0 / 255.0, 1.0, 0.0], 1e-6);
    // As they are encoded: that is how splats are blended.
    near(&colours(found)[0], &[1.0, 0.0, 0.0], 1e-5);
    near(&colours(found)[1], &[128.0 / 255.0; 3], 1e-5);
    // Up is down in the file.
    let place = scene.objects[0].place;
    assert_eq!(place.transform_point3(glam::DVec3::Y), -glam::DVec3::Y);
    assert_eq!((scene.files.len(), scene.warnings.len()), (1, 0));
}

#[test]
fn every_256_splats_have_a_chunk() {
    let scene = load("a.ply", &splats(&vec![SPLAT; 300])).unwrap();
    assert_eq!(found(&scene).means, vec![Vec3::splat(3.0); 300]);
}

#[test]
fn bytes_of_harmonics_are_coefficients() {
    let mut text = header(1).replace("end_header\n", "element sh 1\n");
    (0..9).for_each(|i| text += &format!("property uchar f_rest_{i}\n"));
    let mut bytes = file(&(text + "end_header\n"), &[SPLAT]);
    bytes.extend([0, 255, 127, 128, 1, 2, 3, 4, 5]);
    let scene = load("a.ply", &bytes).unwrap();
    let splats = found(&scene);
    assert_eq!((splats.degree, splats.coefficients()), (1, 4));
    // All of red comes first.
    let value = |b: f32| ((b + 0.5) / 256.0 - 0.5) * 8.0;
    assert_eq!(splats.harmonics[1], [-4.0, value(128.0), value(3.0)]);
    assert_eq!(splats.harmonics[2], [4.0, value(1.0), value(4.0)]);
    assert_eq!(splats.harmonics[3], [value(127.0), value(2.0), value(5.0)]);
}

/// The properties of trained splats of degree 1, in an order of their own, and others.
const TRAINED: [&str; 26] = [
    "opacity", "x", "y", "z", "nx", "ny", "nz", "f_rest_0", "f_rest_1", "f_rest_2", "f_rest_3",
    "f_rest_4", "f_rest_5", "f_rest_6", "f_rest_7", "f_rest_8", "rot_0", "rot_1", "rot_2", "rot_3",
    "scale_0", "scale_1", "scale_2", "f_dc_0", "f_dc_1", "f_dc_2",
];

/// Two of them: of the opacity 1/2 and turned by half about z, and one that is broken.
fn rows() -> [[f32; 26]; 2] {
    let mut first = [0.0; 26];
    first[1..4].copy_from_slice(&[1.0, 2.0, 3.0]);
    (0..9).for_each(|i| first[7 + i] = i as f32);
    first[16..20].copy_from_slice(&[0.0, 0.0, 0.0, 2.0]);
    first[20..23].copy_from_slice(&[0.0, 2.0_f32.ln(), -1.0]);
    first[23..26].copy_from_slice(&[0.5, 0.0, -0.5]);
    let mut second = first;
    second[2] = f32::NAN;
    [first, second]
}

/// A file of trained splats in an encoding of PLY.
pub fn trained(encoding: &str) -> Vec<u8> {
    let mut text = format!("ply\nformat {encoding} 1.0\nelement vertex 2\n");
    TRAINED.iter().for_each(|name| text += &format!("property float {name}\n"));
    text += "end_header\n";
    let values = rows().concat();
    let mut bytes = text.into_bytes();
    match encoding {
        "ascii" => values.iter().for_each(|v| bytes.extend(format!("{v}\n").bytes())),
        "binary_big_endian" => values.iter().for_each(|v| bytes.extend(v.to_be_bytes())),
        _ => values.iter().for_each(|v| bytes.extend(v.to_le_bytes())),
    }
    bytes
}

#[test]
fn trained_splats_are_the_same_in_all_encodings() {
    for encoding in ["binary_little_endian", "binary_big_endian", "ascii"] {
        let scene = load("a.ply", &trained(encoding)).unwrap();
        let splats = found(&scene);
        assert_eq!(splats.means[0], Vec3::new(1.0, 2.0, 3.0), "{encoding}");
        near(&splats.scales[0].to_array(), &[1.0, 2.0, (-1.0_f32).exp()], 1e-6);
        assert_eq!(splats.rotations[0], Quat::from_xyzw(0.0, 0.0, 1.0, 0.0));
        assert_eq!(splats.opacities, [0.5, 0.0]);
        assert_eq!(splats.degree, 1);
        let harmonics = [[0.5, 0.0, -0.5], [0.0, 3.0, 6.0], [1.0, 4.0, 7.0], [2.0, 5.0, 8.0]];
        assert_eq!(splats.harmonics[..4], harmonics);
        // The broken one shows nothing and keeps its number.
        warned(&scene, 1, &["1 splats have no finite place"]);
    }
}

/// A file of two splats as antimatter15 packs them.
pub fn packed() -> Vec<u8> {
    let mut bytes = Vec::new();
    for place in [1.0_f32, -1.0] {
        let reals = [place, 2.0, 3.0, 0.5, 0.25, 0.125];
        bytes.extend(reals.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([255, 128, 0, 51, 128, 128, 128, 255]);
    }
    bytes
}

#[test]
fn packed_splats_are_read() {
    let scene = load("a.splat", &packed()).unwrap();
    let splats = found(&scene);
    assert_eq!(splats.means[1], Vec3::new(-1.0, 2.0, 3.0));
    assert_eq!(splats.scales[0], Vec3::new(0.5, 0.25, 0.125));
    assert_eq!(splats.rotations[0], Quat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    near(&splats.opacities, &[0.2; 2], 1e-7);
    near(&colours(splats)[0], &[1.0, 128.0 / 255.0, 0.0], 1e-6);
    let error = load("a.splat", &packed()[..63]).unwrap_err().to_string();
    assert!(error.contains("63 bytes"), "{error}");
}

/// An SPZ file of three splats of degree 1.
pub fn spz(version: u32, antialiased: bool) -> Vec<u8> {
    const COUNT: usize = 3;
    let position: &[u8] = match version {
        // Half precision: 1, 2, −1; else 24 bits, of which 12 are after the point.
        1 => &[0x00, 0x3c, 0x00, 0x40, 0x00, 0xbc],
        _ => &[0, 0x10, 0, 0, 0x20, 0, 0, 0xf0, 0xff],
    };
    let rotation: Vec<u8> = match version {
        1 | 2 => vec![128, 128, 255],
        // w left out, z greatest of the others with the magnitude 1/√2.
        _ => (3_u32 << 30 | 511).to_le_bytes().to_vec(),
    };
    let arrays: [Vec<u8>; 6] = [
        position.repeat(COUNT),
        vec![51; COUNT],
        [255, 128, 0].repeat(COUNT),
        [160, 144, 176].repeat(COUNT),
        rotation.repeat(COUNT),
        [0, 128, 255, 1, 2, 3, 4, 5, 6].repeat(COUNT),
    ];
    let mut head = [&b"NGSP"[..], &version.to_le_bytes(), &(COUNT as u32).to_le_bytes()].concat();
    head.extend([1, 12, u8::from(antialiased)]);
    if version < 4 {
        head.push(0);
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&[head, arrays.concat()].concat()).unwrap();
        return encoder.finish().unwrap();
    }
    head.push(6);
    head.extend(32_u32.to_le_bytes());
    head.extend([0; 12]);
    let frames: Vec<Vec<u8>> =
        arrays.iter().map(|array| zstd::encode_all(&array[..], 3).unwrap()).collect();
    for (frame, array) in frames.iter().zip(&arrays) {
        head.extend((frame.len() as u64).to_le_bytes());
        head.extend((array.len() as u64).to_le_bytes());
    }
    head.extend(frames.concat());
    head
}

#[test]
fn all_versions_of_spz_say_the_same() {
    for version in 1..=4 {
        let scene = load("a.spz", &spz(version, version > 2)).unwrap();
        // Which way is up the format says and its writers do not heed.
        warned(&scene, 1, &["say as its axes"]);
        let splats = found(&scene);
        assert_eq!((splats.means.len(), splats.degree), (3, 1), "{version}");
        assert_eq!(splats.means[2], Vec3::new(1.0, 2.0, -1.0));
        near(&splats.opacities, &[0.2; 3], 1e-7);
        near(&splats.scales[0].to_array(), &[1.0, (-1.0_f32).exp(), 1.0_f32.exp()], 1e-6);
        let [r, g, b] = [255.0, 128.0, 0.0].map(|c: f32| (c / 255.0 - 0.5) / 0.15);
        near(&splats.harmonics[0], &[r, g, b], 1e-6);
        assert_eq!(splats.harmonics[1], [-1.0, 0.0, 127.0 / 128.0]);
        let turn = match version {
            1 | 2 => Quat::from_xyzw(0.0, 0.0, 1.0, 0.0),
            _ => Quat::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt()),
        };
        assert!(splats.rotations[0].abs_diff_eq(turn, 6e-3), "{:?}", splats.rotations[0]);
        assert_eq!(splats.antialiased, version > 2);
    }
}

#[test]
fn damaged_spz_is_one_error() {
    let says = |bytes: &[u8], part: &str| {
        let error = load("a.spz", bytes).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.spz"), "{error}");
        assert!(!error.contains('\n'), "{error}");
    };
    let plain = |version: u32, splats: u32, rest: &[u8]| {
        let head = [&b"NGSP"[..], &version.to_le_bytes(), &splats.to_le_bytes(), rest].concat();
        [head, vec![0; 20]].concat()
    };
    let zipped = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    says(b"", "no SPZ file");
    says(b"NGSP", "no SPZ file");
    says(&plain(2, 1, &[0, 12, 0, 0]), "not compressed by gzip");
    says(&plain(9, 1, &[0, 12, 0, 0]), "version 9");
    says(&plain(4, u32::MAX, &[0, 12, 0, 5]), "claims 4294967295 splats");
    says(&plain(4, 1, &[5, 12, 0, 5]), "degree 5");
    says(&plain(4, 1, &[0, 25, 0, 5]), "25 of 24 bits");
    says(&plain(4, 1, &[0, 12, 0, 4]), "4 arrays");
    says(&zipped(&plain(4, 1, &[0, 12, 0, 5])), "within a gzip stream");
    says(&zipped(&plain(3, 9, &[0, 12, 0, 0])), "9 splats take 180 bytes, and it has 20");
    says(&zipped(&plain(3, 1, &[4, 12, 0, 0])), "degree 4");
    says(&zipped(&[plain(3, 1, &[0, 12, 0, 0]), vec![0; 9]].concat()), "after its last array");
    says(&zipped(b"NGSP"), "cannot be decompressed");
    let whole = spz(3, false);
    says(&whole[..whole.len() / 2], "cannot be decompressed");
    let whole = spz(3, false);
    says(&[&whole[..], &[0, 1]].concat(), "2 bytes after its gzip stream");
    let whole = spz(4, false);
    says(&whole[..whole.len() - 1], "needs");
    says(&[&whole[..], &[0]].concat(), "1 bytes after its last array");
    let mut other = whole.clone();
    other[40] += 1;
    says(&other, "an array of it has");
    let mut other = whole;
    let last = other.len() - 9;
    other[last..].fill(0xff);
    says(&other, "an array of it");
}

#[test]
fn which_way_is_up_can_be_said() {
    let folder = folder(&[("a.ply", &trained("ascii")[..]), ("a.gltf", b"{}")]);
    let up = |name: &str, axes| {
        let source = folder.path().join(name).display().to_string();
        load_with(&source, &LoadOptions { axes: Some(axes), ..LoadOptions::default() })
    };
    for (axes, own) in
        [(Axes::YUp, glam::DVec3::Y), (Axes::YDown, -glam::DVec3::Y), (Axes::ZUp, glam::DVec3::Z)]
    {
        let scene = up("a.ply", axes).unwrap();
        assert_eq!(scene.objects[0].place.transform_vector3(own), glam::DVec3::Y);
        assert_eq!(scene.world, scene.objects[0].place);
    }
    let error = up("a.gltf", Axes::ZUp).unwrap_err().to_string();
    assert!(error.contains("leave the axes out"), "{error}");
    let axes = LoadOptions { axes: Some(Axes::ZUp), ..LoadOptions::default() };
    assert!(load_with("builtin:cloth", &axes).is_err());
}

/// A mesh of a square with a corner of each colour, as text.
pub const MESH: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nproperty uchar alpha\nproperty float s\nproperty float t\n\
    element face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 255 0 0 255 0 0\n1 0 0 0 255 0 255 1 0\n1 1 0 0 0 255 255 1 1\n\
    0 1 0 128 128 128 51 0 1\n4 0 1 2 3\n";

#[test]
fn meshes_are_read_with_their_colours() {
    let scene = load("a.ply", MESH.as_bytes()).unwrap();
    let mesh = super::mesh(&scene, 0);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh.uvs[2], glam::Vec2::new(1.0, 0.0));
    near(&mesh.colours[0].to_array(), &[1.0, 0.0, 0.0, 1.0], 0.0);
    near(&mesh.colours[3].to_array(), &[0.215_9, 0.215_9, 0.215_9, 0.2], 1e-4);
    assert_eq!(scene.materials[0].alpha_mode, screendoor::scene::AlphaMode::Blend);
    assert!(scene.warnings.is_empty());
    // The same in bytes.
    let (text, rows) = MESH.split_once("end_header\n").unwrap();
    let text = text.replace("ascii", "binary_big_endian") + "end_header\n";
    let mut bytes = text.into_bytes();
    for row in rows.lines() {
        let values: Vec<f32> = row.split(' ').map(|v| v.parse().unwrap()).collect();
        match values[..] {
            [x, y, z, r, g, b, a, s, t] => {
                bytes.extend([x, y, z].iter().flat_map(|v: &f32| v.to_be_bytes()));
                bytes.extend([r, g, b, a].map(|v: f32| v as u8));
                bytes.extend([s, t].iter().flat_map(|v: &f32| v.to_be_bytes()));
            }
            _ => {
                bytes.push(4);
                bytes.extend(values[1..].iter().flat_map(|v| (*v as i32).to_be_bytes()));
            }
        }
    }
    let same = load("a.ply", &bytes).unwrap();
    assert_eq!(format!("{:?}", same.shapes), format!("{:?}", scene.shapes));
}

#[test]
fn what_of_a_mesh_is_not_read_is_told() {
    let edited = |changes: &[(&str, &str)]| {
        let text = changes.iter().fold(MESH.to_string(), |text, (from, to)| text.replace(from, to));
        load("a.ply", text.as_bytes()).unwrap()
    };
    let plain = edited(&[]);
    // Short names of colours, and opacities, say the same.
    let mut short = vec![("uchar red", "uchar r"), ("uchar green", "uchar g")];
    short.extend([("uchar blue", "uchar b"), ("uchar alpha", "uchar opacity")]);
    let scene = edited(&short);
    assert_eq!(super::mesh(&scene, 0).colours, super::mesh(&plain, 0).colours);
    let lists = "uchar int vertex_indices\nproperty list uchar float texcoord";
    let row = ("4 0 1 2 3\n", "4 0 1 2 3 2 0 1\n");
    warned(&edited(&[("uchar int vertex_indices", lists), row]), 1, &["'texcoord' is not read"]);
    let comment = ("element vertex", "comment TextureFile my skin.png\nelement vertex");
    warned(&edited(&[comment]), 1, &["texture 'my skin.png' is not read"]);
}

#[test]
fn normals_that_are_no_numbers_are_none() {
    let text = |last: &str| {
        let properties = "property float nx\nproperty float ny\nproperty float nz\n";
        let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                      property float z\n";
        let rows = format!("0 0 0 1 0 0\n1 0 0 0 1 0\n0 1 0 {last}\n3 0 1 2\n");
        let faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
        [header, properties, faces, &rows].concat()
    };
    let normals = |last: &str| {
        let scene = load("a.ply", text(last).as_bytes()).unwrap();
        let mesh = super::mesh(&scene, 0);
        mesh.triangles[0].map(|i| mesh.normals[i as usize])
    };
    assert_eq!(normals("0 1 0"), [Vec3::X, Vec3::Y, Vec3::Y]);
    // That of the triangle stands in its place, as in OBJ.
    assert_eq!(normals("nan nan nan"), [Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(normals("0 inf 0"), [Vec3::X, Vec3::Y, Vec3::Z]);
}

#[test]
fn faces_beside_splats_are_told_of() {
    let text = String::from_utf8(trained("ascii")).unwrap().replace("NaN", "1");
    let face = "element face 1\nproperty list uchar int vertex_index\nend_header";
    let text = text.replace("end_header", face) + "3 0 1 0\n";
    let scene = load("a.ply", text.as_bytes()).unwrap();
    assert_eq!(found(&scene).means.len(), 2);
    warned(&scene, 1, &["1 faces are not drawn beside its splats"]);
}

#[test]
fn what_a_ply_file_does_not_hold_is_one_error() {
    let says = |bytes: &[u8], part: &str| {
        let error = load("a.ply", bytes).expect_err(part).to_string();
        assert!(error.contains(part) && error.contains("a.ply"), "{error}");
        assert!(!error.contains('\n'), "{error}");
    };
    let edited = |from: &str, to: &str| file(&header(1).replace(from, to), &[SPLAT]);
    let mesh = |from: &str, to: &str| MESH.replacen(from, to, 1).into_bytes();
    says(&mesh("element face 1", "element face 0"), "5 numbers more");
    let warned_of = |from: &str, to: &str, what: &str| {
        warned(&load("a.ply", &mesh(from, to)).unwrap(), 1, &[what]);
    };
    warned_of("uchar red", "int red", "for 0 to 255");
    warned_of("uchar red", "float red", "for 0 to 255");
    let two = MESH.replacen("face 1", "face 2", 1) + "2 0 1\n";
    warned(&load("a.ply", two.as_bytes()).unwrap(), 1, &["1 faces of fewer than three"]);
    says(&mesh("4 0 1 2 3\n", "4 0 1 2 7\n"), "4 vertices and names vertex 7");
    says(&mesh("4 0 1 2 3\n", "4 0 1 2 -1\n"), "names vertex -1");
    says(&mesh("4 0 1 2 3\n", "-4 0 1 2 3\n"), "a list of -4 values");
    says(&mesh("4 0 1 2 3\n", "9 0 1 2 3\n"), "ends within its element 'face'");
    says(&mesh("4 0 1 2 3\n", "4 0 1 two 3\n"), "'two' where a number");
    says(&mesh("vertex_indices", "corners"), "no list 'vertex_indices'");
    says(&mesh("property float x", "property float u"), "lack x, y or z");
    says(&mesh("element face 1", "element tristrips 1"), "strips");
    says(&mesh("element face 1", "element edge 1"), "neither Gaussian splats nor faces");
    says(&edited("element vertex 1", "element vertex 18446744073709551615"), "bytes are left");
    says(&edited("element vertex 1", "element vertex 99999999999999999999"), "line 23");
    says(&mesh("property float y", "property float x"), "'vertex' has two properties 'x'");
    says(&mesh("element face 1", "element vertex 1"), "two elements 'vertex'");
    let long = format!("comment {}\n", "long ".repeat(20_000)).repeat(12) + "element vertex 4";
    says(&mesh("element vertex 4", &long), "header is longer than 1 MiB");
    says(&edited("comment made", "rubbish\x07"), "line 3 of its PLY header cannot be read");
    says(&edited("element chunk 1", "element chunk 0"), "bytes more");
    says(&edited("property uint packed_color\n", ""), "bytes more");
    says(&edited("end_header\n", ""), "PLY header cannot be read");
    says(&splats(&[]), "no splats");
    says(b"", "PLY header cannot be read");
    let mut bytes = splats(&[SPLAT]);
    bytes.pop();
    says(&bytes, "15 bytes are left");
    bytes = file(&header(1).replace("element chunk 1", "element chunk 2"), &[SPLAT]);
    bytes.extend([0; 72]);
    says(&bytes, "2 chunks of 256 for 1 splats");
    // All of them beyond what is finite.
    let at = header(1).len() + 9 * 4;
    bytes = splats(&[SPLAT]);
    bytes[at..at + 4].copy_from_slice(&1e9_f32.to_le_bytes());
    says(&bytes, "none of its 1 splats has a finite");
    let text = |from: &str, to: &str| {
        String::from_utf8(trained("ascii")).unwrap().replacen(from, to, 1).into_bytes()
    };
    says(&text("float opacity", "float opacities"), "no property 'opacity'");
    says(&text("float scale_2", "float scale_3"), "no property 'scale_2'");
    says(&text("float f_rest_8", "float g_rest_8"), "8 properties 'f_rest_'");
    says(&text("float f_rest_8", "float f_rest_9"), "no 'f_rest_8'");
    let mut bytes = trained("ascii");
    bytes.extend([0xff, 0xfe]);
    says(&bytes, "is no text");
}

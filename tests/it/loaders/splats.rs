//! Compressed Gaussian splats.

use glam::{Vec3, Vec4};
use screendoor::error::Error;
use screendoor::scene::Scene;

use super::{folder, load_in, particles, warned};

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

fn load(bytes: &[u8]) -> Result<Scene, Error> {
    load_in(folder(&[("a.ply", bytes)]).path(), "a.ply")
}

#[test]
fn splats_become_ellipsoids() {
    let grey = [0, STRAIGHT, 0, 0x8080_80ff];
    let scene = load(&splats(&[SPLAT, grey, [0, 0, 0, 0xffff_ff00]])).unwrap();
    let found = particles(&scene);
    // The third is wholly transparent.
    assert_eq!(found.centres, [Vec3::splat(3.0), Vec3::splat(-1.0)]);
    let cutoff = 8.0_f32.sqrt();
    let (x, y) = (found.axes[0].x_axis, found.axes[0].y_axis);
    assert!((x - Vec3::X * cutoff).length() < 0.02, "{x}");
    assert!((y - Vec3::Y * cutoff * (-2.0_f32).exp()).length() < 0.02, "{y}");
    assert!((found.sizes[0] - cutoff).abs() < 1e-5);
    // Colours are sRGB, alphas are not.
    assert_eq!(found.colours[0], Vec4::new(1.0, 0.0, 0.0, 128.0 / 255.0));
    assert!((found.colours[1] - Vec4::new(0.2159, 0.2159, 0.2159, 1.0)).length() < 1e-3);
    assert!(scene.materials[0].unlit);
    // Up is down in the file.
    let place = scene.objects[0].place;
    assert_eq!(place.transform_point3(glam::DVec3::Y), -glam::DVec3::Y);
    assert_eq!((scene.files.len(), scene.warnings.len()), (1, 0));
}

/// A file of one splat with spherical harmonics.
pub fn with_harmonics() -> Vec<u8> {
    let header =
        header(1).replace("end_header", "element sh 1\nproperty uchar f_rest_0\nend_header");
    let mut bytes = file(&header, &[SPLAT]);
    bytes.push(7);
    bytes
}

#[test]
fn spherical_harmonics_are_a_warning() {
    warned(&load(&with_harmonics()).unwrap(), 1, &["direction of view"]);
}

#[test]
fn every_256_splats_have_a_chunk() {
    let scene = load(&splats(&vec![SPLAT; 300])).unwrap();
    assert_eq!(particles(&scene).centres, vec![Vec3::splat(3.0); 300]);
}

#[test]
fn other_ply_files_are_one_error() {
    let says = |bytes: &[u8], part: &str| {
        let error = load(bytes).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.ply"), "{error}");
        assert!(!error.contains('\n'), "{error}");
    };
    let edited = |from: &str, to: &str| file(&header(1).replace(from, to), &[SPLAT]);
    let mesh = "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\n\
                element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    says(mesh.as_bytes(), "no compressed Gaussian splats");
    says(&mesh.replace("list uchar int", "int").into_bytes(), "no compressed Gaussian splats");
    says(&edited("binary_little_endian", "ascii"), "stored as ascii");
    says(&edited("binary_little_endian", "binary_big_endian"), "stored as binary_big_endian");
    says(&edited("element vertex 1", "element vertex 18446744073709551615"), "bytes are left");
    says(&edited("element vertex 1", "element vertex 99999999999999999999"), "line 23");
    says(&edited("comment made", "rubbish\x07"), "line 3 of its PLY header cannot be read");
    says(&edited("element chunk 1", "element chunk 0"), "bytes more");
    says(&edited("property uint packed_color\n", ""), "bytes more");
    says(&edited("end_header\n", ""), "PLY header cannot be read");
    says(&splats(&[]), "no triangles");
    says(b"", "PLY header cannot be read");
    let mut bytes = splats(&[SPLAT]);
    bytes.pop();
    says(&bytes, "15 bytes are left");
    bytes = file(&header(1).replace("element chunk 1", "element chunk 2"), &[SPLAT]);
    bytes.extend([0; 72]);
    says(&bytes, "2 chunks of 256 for 1 splats");
    let at = header(1).len() + 9 * 4;
    bytes = splats(&[SPLAT]);
    bytes[at..at + 4].copy_from_slice(&1e9_f32.to_le_bytes());
    says(&bytes, "splat 0 has a size, place or colour not finite");
}

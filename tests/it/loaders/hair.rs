//! Cem Yuksel's hair, and STL.

use glam::{Vec3, Vec4};
use screendoor::error::Error;
use screendoor::scene::{AlphaMode, Scene, Shape, Strands};

use super::{folder, load_in, mesh, warned};

/// A file of two strands of three and two points with the arrays of `arrays`; `edit` changes
/// the words of its header.
pub fn hair(arrays: u32, edit: impl Fn(&mut [u32; 32])) -> Vec<u8> {
    let mut head = [0; 32];
    // HAIR, strands, points, arrays, segments, thickness, transparency, colour.
    head[..6].copy_from_slice(&[0x5249_4148, 2, 5, arrays, 2, 0.5_f32.to_bits()]);
    head[6] = 0.25_f32.to_bits();
    head[7..10].copy_from_slice(&[1.0_f32, 0.5, 0.0].map(f32::to_bits));
    edit(&mut head);
    let mut bytes: Vec<u8> = head.iter().flat_map(|w| w.to_le_bytes()).collect();
    if arrays & 1 != 0 {
        bytes.extend([2, 0, 1, 0]);
    }
    let mut floats = |bit: u32, values: &[f32]| {
        if arrays & bit != 0 {
            bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        }
    };
    let points: Vec<f32> = (0..5).flat_map(|i| [i as f32, 1.0, 2.0]).collect();
    floats(2, &points);
    floats(4, &[0.1, 0.2, 0.3, 0.4, 0.5]);
    floats(8, &[0.0, 0.1, 0.2, 0.3, 0.4]);
    let colours: Vec<f32> = (0..5).flat_map(|i| [i as f32 / 4.0, 0.0, 1.0]).collect();
    floats(16, &colours);
    bytes
}

fn load(name: &str, bytes: &[u8]) -> Result<Scene, Error> {
    load_in(folder(&[(name, bytes)]).path(), name)
}

pub fn strands(scene: &Scene) -> &Strands {
    match &scene.shapes[0] {
        Shape::Strands(strands) => strands,
        other => panic!("{other:?}"),
    }
}

#[test]
fn hair_has_what_its_arrays_say() {
    let scene = load("a.hair", &hair(31, |_| ())).unwrap();
    let found = strands(&scene);
    assert_eq!((&found.starts[..], found.points[4]), (&[0, 3, 5][..], Vec3::new(4.0, 1.0, 2.0)));
    assert_eq!(found.radii, [0.05, 0.1, 0.15, 0.2, 0.25]);
    // Colours as they are shown, alphas as they are, at each point.
    let decoded = 0.214_041_14;
    assert!((found.colours[2] - Vec4::new(decoded, 0.0, 1.0, 0.8)).length() < 1e-6);
    assert_eq!(scene.materials[0].alpha_mode, AlphaMode::Blend);
    assert!(scene.warnings.is_empty());
}

#[test]
fn hair_without_arrays_has_the_header_s_defaults() {
    let five = |head: &mut [u32; 32]| (head[1], head[4]) = (1, 4);
    let scene = load("a.hair", &hair(2, five)).unwrap();
    let found = strands(&scene);
    assert_eq!((&found.starts[..], &found.radii[..]), (&[0, 5][..], &[0.25; 5][..]));
    assert!((found.colours[3] - Vec4::new(1.0, 0.214_041_14, 0.0, 0.75)).length() < 1e-6);
    // What a strand of one point leaves is told.
    let mut bytes = hair(3, |_| ());
    bytes[128..132].copy_from_slice(&[3, 0, 0, 0]);
    warned(&load("a.hair", &bytes).unwrap(), 1, &["1 strands of a single point"]);
}

#[test]
fn bad_hair_is_one_error() {
    let says = |bytes: &[u8], part: &str| {
        let error = load("a.hair", bytes).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.hair"), "{error}");
        assert!(!error.contains('\n'), "{error}");
    };
    says(b"HAIR", "does not begin with 'HAIR'");
    says(&hair(2, |head| head[0] += 1), "does not begin with 'HAIR'");
    says(&hair(1, |_| ()), "has no points");
    says(&hair(2, |_| ()), "more than its 5 points");
    says(&hair(2, |head| head[1] = 1), "3 of its 5 points");
    says(&hair(31, |head| head[2] = 6), "and needs");
    says(&hair(2, |head| head[2] = u32::MAX), "4294967295 points");
    let five = |head: &mut [u32; 32]| (head[1], head[4]) = (1, 4);
    says(
        &hair(2, |head| {
            five(head);
            head[5] = f32::NAN.to_bits();
        }),
        "thickness",
    );
    says(
        &hair(2, |head| {
            five(head);
            head[6] = f32::NAN.to_bits();
        }),
        "transparency",
    );
    let mut bytes = hair(2, five);
    bytes[128..132].copy_from_slice(&f32::NAN.to_le_bytes());
    says(&bytes, "not finite");
}

/// Two triangles as text and as bytes.
pub const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
    vertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 1 0 0\n\
    vertex 1 1 0.5\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

pub fn stl(attribute: u8) -> Vec<u8> {
    let mut bytes = b"solid, and yet bytes".to_vec();
    bytes.resize(80, 0);
    bytes.extend(2_u32.to_le_bytes());
    let numbers = STL.split_ascii_whitespace().filter_map(|word| word.parse::<f32>().ok());
    let numbers: Vec<f32> = numbers.collect();
    for triangle in numbers.chunks_exact(12) {
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([attribute, 0]);
    }
    bytes
}

#[test]
fn stl_is_the_same_as_text_and_as_bytes() {
    let scenes = [load("a.stl", STL.as_bytes()).unwrap(), load("a.stl", &stl(0)).unwrap()];
    for scene in &scenes {
        assert_eq!(mesh(scene, 0).triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(mesh(scene, 0).positions[4], Vec3::new(1.0, 1.0, 0.5));
        assert!(scene.warnings.is_empty());
    }
    warned(&load("a.stl", &stl(7)).unwrap(), 1, &["2 triangles say of colours"]);
    let says = |bytes: &[u8], part: &str| {
        let error = load("a.stl", bytes).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.stl"), "{error}");
    };
    says(b"", "shorter than a header");
    says(&stl(0)[..183], "2 triangles take 184 bytes, and it has 183");
    says(&stl(0)[20..], "its");
    says(b"solid a\nfacet\nvertex 1 2\nvertex 3 4 5\nendsolid", "'vertex' where a number");
    says(&STL.as_bytes()[..STL.len() - 11], "does not end with 'endsolid'");
    says(b"solid a\nvertex 1 2 3\nendsolid a", "in no facet");
    says(STL.replacen("endfacet\n", "", 2).as_bytes(), "does not end");
    // Several solids are one scene.
    let two = load("a.stl", STL.repeat(2).as_bytes()).unwrap();
    assert_eq!(mesh(&two, 0).triangles.len(), 4);
    says(STL.replacen("vertex 0 0 0\n", "", 1).as_bytes(), "a facet of it has 2 corners");
    says(b"solid a\nendsolid a", "no triangles");
}

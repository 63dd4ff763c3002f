//! Small scenes that programs get wrong, and what is right, as fragments.

use std::path::Path;

use screendoor::capture::{CameraOptions, Capture, CaptureOptions, PatternKind};
use screendoor::scene::{LoadOptions, Scene, load_with};
use screendoor::trace::{ColourFormat, Fragment};

use super::{load_in, warned};

/// What white that faces the camera comes out as.
const LIT: f32 = 0.6559;

fn input(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/inputs");
    load_in(&folder, name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The fragments of a scene seen from its front, in parallel lines.
pub fn fragments(scene: &Scene, options: CaptureOptions) -> Vec<Fragment> {
    let camera = CameraOptions {
        angle: Some([0.0; 2]),
        field_of_view: Some(0.0),
        ..CameraOptions::default()
    };
    let options = CaptureOptions { colour: ColourFormat::F32, camera, ..options };
    let trace = Capture::new(scene, &options).unwrap().to_memory(|_, _| ()).unwrap();
    let batches: Vec<_> = trace.batches().map(Result::unwrap).collect();
    batches.iter().flat_map(|batch| batch.iter()).collect()
}

fn small(scene: &Scene) -> Vec<Fragment> {
    let options = CaptureOptions { width: 32, height: 32, samples: 4, ..CaptureOptions::default() };
    fragments(scene, options)
}

/// The colour and alpha of the only fragment at a pixel.
#[track_caller]
pub fn at(scene: &Scene, x: u16, y: u16) -> [f32; 4] {
    let all = small(scene);
    let here: Vec<&Fragment> = all.iter().filter(|f| (f.x, f.y) == (x, y)).collect();
    let [only] = here[..] else { panic!("{} fragments", here.len()) };
    let [r, g, b] = only.colour;
    [r, g, b, only.alpha]
}

#[track_caller]
fn shows(scene: &Scene, wanted: [f32; 4]) {
    let found = at(scene, 16, 16);
    let near = found.iter().zip(wanted).all(|(f, w)| (f - w).abs() < 1e-3);
    assert!(near, "{found:?} and not {wanted:?}");
}

#[test]
fn polygons_of_any_shape_have_one_layer() {
    // Fragments at 200 × 200 pixels, one in each pixel that is inside.
    let cases = [
        ("concave_star.obj", 10_910),
        ("concave_dart_quad.obj", 12_240),
        ("concave.obj", 26_500),
        ("keyhole.obj", 26_500),
    ];
    for (name, count) in cases {
        let options = CaptureOptions {
            width: 200,
            height: 200,
            samples: 1,
            pattern: PatternKind::Centre,
            alpha: Some(0.5),
            ..CaptureOptions::default()
        };
        let found = fragments(&input(name), options);
        let mut places: Vec<(u16, u16)> = found.iter().map(|f| (f.x, f.y)).collect();
        places.sort_unstable();
        let layers = places.len();
        places.dedup();
        assert_eq!(places.len(), layers, "{name}: more than one layer");
        assert!(layers.abs_diff(count) < count / 50, "{name}: {layers} fragments");
        if name == "keyhole.obj" {
            assert!(!places.contains(&(100, 100)), "the hole is filled");
        }
    }
}

#[test]
fn transparency_of_one_is_told() {
    let scene = input("tr1.obj");
    assert!(small(&scene).is_empty());
    warned(&scene, 1, &["tr1.mtl, line 3 ('Tr 1.0')", "the whole scene", "'m'", "'d 1'"]);
}

#[test]
fn maps_multiply_what_they_belong_to() {
    shows(&input("mapke.obj"), [0.0, 0.0, 0.0, 1.0]);
    let scene = input("kd0.obj");
    shows(&scene, [0.0, LIT, 0.0, 1.0]);
    warned(&scene, 1, &["kd0.mtl, line 2 ('Kd 0 0 0')", "map_Kd"]);
    shows(&input("mapd_alpha.obj"), [LIT, LIT, LIT, 64.0 / 255.0]);
    assert!((at(&input("tga.obj"), 16, 16)[3] - 128.0 / 255.0).abs() < 1e-3);
}

#[test]
fn vertex_colours_are_srgb() {
    shows(&input("vcol.obj"), [0.140, 0.140, 0.140, 1.0]);
    shows(&input("vcol_rgba.obj"), [LIT, 0.0, 0.0, 0.5]);
}

#[test]
fn what_is_not_drawn_is_named() {
    let scene = input("nurbs.obj");
    assert_eq!(scene.primitive_count(), 2);
    warned(&scene, 1, &["curves and surfaces are not drawn", "surf in line 12"]);
}

#[test]
fn normals_that_are_none_are_those_of_the_triangle() {
    for name in ["normal_zero.obj", "nan_ind.obj"] {
        let scene = input(name);
        assert_eq!(scene.warnings, [""; 0]);
        shows(&scene, [LIT, LIT, LIT, 1.0]);
        assert_eq!(scene.primitive_count(), 2);
    }
}

#[test]
fn utf16_is_read() {
    assert_eq!(input("utf16.obj").primitive_count(), 1);
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    let (far, near) = (small(&input("utm.obj")), small(&input("utm0.obj")));
    assert!(near.len() > 100);
    let seen = |all: &[Fragment]| -> Vec<_> {
        all.iter().map(|f| (f.x, f.y, f.coverage, f.colour.map(f32::to_bits))).collect()
    };
    assert_eq!(seen(&far), seen(&near));
}

#[test]
fn files_of_other_machines_are_found_beside_the_scene() {
    let scene = input("path_abs.obj");
    shows(&scene, [0.0, LIT, 0.0, 1.0]);
    warned(&scene, 1, &["C:\\projects\\plants\\textures\\green.png", "'green.png' in it is used"]);
    let scene = input("path_quoted.obj");
    shows(&scene, [0.0, LIT, 0.0, 1.0]);
    shows(&input("quoted.obj"), [LIT, 0.0, 0.0, 0.25]);
    // Nothing of that name is anywhere in the folder.
    let scene = input("mtlabs.obj");
    warned(&scene, 1, &["path_comment.mtl", "leads out of the scene's folder", "--allow-outside"]);
}

#[test]
fn options_of_maps_are_applied() {
    // (0.61, 0.39) of the surface, right below its middle, is (0.72, 0.78) of the texture, whose
    // upper right quarter is green; its lower right one is white.
    let scene = input("mapopt.obj");
    assert_eq!(scene.warnings, [""; 0]);
    let [r, g, b, alpha] = at(&scene, 19, 19);
    assert!(r < 1e-3 && (g - LIT).abs() < 1e-3 && b < 1e-3 && alpha == 1.0, "{r} {g} {b} {alpha}");
}

#[test]
fn scenes_may_be_allowed_to_name_files_outside() {
    let outside = super::folder(&[("out.mtl", b"newmtl m\nKd 1 0 0\n")]);
    let path = outside.path().join("out.mtl").display().to_string();
    let text = format!("mtllib {path}\n{}usemtl m\nf 1 2 3\n", super::TRIANGLE);
    let folder = super::folder(&[("a.obj", text.as_bytes())]);
    let source = folder.path().join("a.obj").display().to_string();
    let base = |allow_outside| {
        let scene =
            load_with(&source, &LoadOptions { allow_outside, ..LoadOptions::default() }).unwrap();
        scene.materials[super::mesh(&scene, 0).material].base
    };
    assert_eq!(base(true), glam::Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert_eq!(base(false), glam::Vec4::ONE);
}

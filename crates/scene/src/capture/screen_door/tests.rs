use std::collections::BTreeSet;

use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3, Vec4};

use super::*;
use crate::capture::{CameraOptions, Capture, CaptureOptions, Order};
use crate::scene::{AlphaMode, Material, Mesh, Shape, load};

/// Squares of the side 2 in two triangles each, turned about the horizontal axis by so many degrees,
/// one behind the other.
fn squares(angles: &[f64], alpha: f32) -> Scene {
    let mut scene = load("builtin:foliage").unwrap();
    scene.objects.clear();
    scene.shapes.clear();
    scene.materials = vec![Material {
        base: Vec4::new(1.0, 1.0, 1.0, alpha),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    }];
    for (i, angle) in angles.iter().enumerate() {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let place = DAffine3::from_rotation_translation(
            DQuat::from_rotation_x(angle.to_radians()),
            DVec3::new(0.0, 0.0, -3.0 * i as f64),
        );
        let at = |(x, y): (f64, f64)| place.transform_point3(DVec3::new(x, y, 0.0)).as_vec3();
        let mesh = Mesh {
            positions: corners.map(at).to_vec(),
            normals: vec![Vec3::Z; 4],
            uvs: vec![Vec2::ZERO; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        scene.add("square", Shape::Mesh(mesh));
    }
    scene
}

fn straight_ahead(spec: Option<&str>) -> CaptureOptions {
    CaptureOptions {
        width: 220,
        height: 220,
        samples: 1,
        camera: CameraOptions {
            angle: Some([0.0, 0.0]),
            field_of_view: Some(0.0),
            ..CameraOptions::default()
        },
        screen_door: spec.map(|spec| ScreenDoor::parse(spec).unwrap()),
        ..CaptureOptions::default()
    }
}

fn fragments(scene: &Scene, options: &CaptureOptions) -> Vec<Fragment> {
    let trace = Capture::new(scene, options).unwrap().to_memory(|_, _| ()).unwrap();
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

fn pixels(fragments: &[Fragment]) -> BTreeSet<(u16, u16)> {
    fragments.iter().map(|f| (f.x, f.y)).collect()
}

/// The share of the pixels that the scene covers that a screen door makes opaque.
fn opacity(scene: &Scene, options: &CaptureOptions) -> f64 {
    let found = fragments(scene, options);
    assert!(found.iter().all(|f| f.alpha == 1.0));
    let plain = CaptureOptions { screen_door: None, ..options.clone() };
    let all = pixels(&fragments(scene, &plain));
    assert!(all.len() > 2000, "{}", all.len());
    pixels(&found).intersection(&all).count() as f64 / all.len() as f64
}

#[test]
fn opacity_follows_the_angle_where_points_or_all_texels_count() {
    let even = |cos: f64| 1.0 - 0.5_f64.powf(1.0 / cos);
    let independent = |cos: f64| 1.0 - (-0.5 / cos).exp();
    for angle in [0.0, 45.0, 60.0, 75.0] {
        let scene = squares(&[angle], 0.5);
        let of = |spec: &str| opacity(&scene, &straight_ahead(Some(spec)));
        let cos = angle.to_radians().cos();
        let points = of("points");
        let between = independent(cos) - 0.02..even(cos) + 0.02;
        assert!(between.contains(&points), "{angle}: {points}, {between:?}");
        let most = of("mask-max");
        assert!((most - even(cos)).abs() < 0.05, "{angle}: {most}");
        for spec in ["mask", "stipple", "stipple-random"] {
            let found = of(spec);
            assert!((found - 0.5).abs() < 0.03, "{spec} {angle}: {found}");
        }
    }
}

#[test]
fn layers_of_one_stipple_hide_each_other() {
    let scene = squares(&[0.0, 20.0], 0.5);
    // What the nearer one leaves of the pixels in which both are.
    let of = |spec: &str| {
        let options = straight_ahead(Some(spec));
        let all = fragments(&scene, &CaptureOptions { screen_door: None, ..options.clone() });
        let object = |all: &[Fragment], object: u32| {
            pixels(&all.iter().filter(|f| f.object == object).copied().collect::<Vec<_>>())
        };
        let both: BTreeSet<_> = object(&all, 0).intersection(&object(&all, 1)).copied().collect();
        let found = pixels(&fragments(&scene, &options));
        found.intersection(&both).count() as f64 / both.len() as f64
    };
    assert!((of("stipple") - 0.5).abs() < 0.02, "{}", of("stipple"));
    assert!((of("mask") - 0.75).abs() < 0.03, "{}", of("mask"));
    // Of eight patterns two triangles have the same one in an eighth of the cases.
    let seeds = 0..16;
    let mean = seeds.map(|seed| of(&format!("stipple-random:seed={seed}"))).sum::<f64>() / 16.0;
    assert!((mean - (0.75 - 0.25 / 8.0)).abs() < 0.04, "{mean}");
}

#[test]
fn a_fixed_number_of_points_fails_near_by() {
    let scene = squares(&[0.0], 0.5);
    let of = |spec: &str, distance: f64| {
        let mut options = straight_ahead(Some(spec));
        options.camera.field_of_view = Some(45.0);
        options.camera.distance = Some(distance);
        opacity(&scene, &options)
    };
    for spec in ["points", "mask"] {
        let [near, far] = [1.2, 5.0].map(|distance| of(spec, distance));
        assert!((near - far).abs() < 0.05, "{spec}: {near} {far}");
    }
    let [near, far] = [1.2, 5.0].map(|distance| of("points-static:side=100", distance));
    assert!(near < 0.25 && far > 0.4, "{near} {far}");
}

#[test]
fn no_order_of_triangles_changes_what_is_drawn() {
    let scene = load("builtin:cloth").unwrap();
    for spec in SCREEN_DOORS.map(|model| model.name) {
        let options = CaptureOptions {
            width: 60,
            height: 50,
            samples: 4,
            screen_door: Some(ScreenDoor::parse(spec).unwrap()),
            ..CaptureOptions::default()
        };
        let sorted = |options: &CaptureOptions| {
            let mut all = fragments(&scene, options);
            all.sort_by_key(|f| (f.primitive, f.y, f.x, f.depth.z.0, f.colour.map(f32::to_bits)));
            all
        };
        let api = sorted(&options);
        assert!(api.len() > 200, "{spec}: {}", api.len());
        let random = CaptureOptions { order: Order::Random, order_seed: 3, ..options };
        assert!(sorted(&random) == api, "{spec}");
    }
}

#[test]
fn what_is_opaque_stays_as_it_is() {
    let scene = squares(&[30.0], 1.0);
    let plain = fragments(&scene, &straight_ahead(None));
    for spec in SCREEN_DOORS.map(|model| model.name) {
        assert!(fragments(&scene, &straight_ahead(Some(spec))) == plain, "{spec}");
    }
}

#[test]
fn screen_doors_are_read_as_they_are_written_and_refused_by_name() {
    for model in SCREEN_DOORS {
        let door = ScreenDoor::parse(&format!("{}:seed=7", model.name)).unwrap();
        assert_eq!(ScreenDoor::parse(&door.spec()).unwrap(), door);
    }
    for (spec, word) in [
        ("door", "unknown screen door 'door'"),
        ("mask:side=3", "side"),
        ("points-static:side=0", "side"),
        ("stipple-random:patterns=1", "patterns"),
    ] {
        let error = ScreenDoor::parse(spec).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
    // Near enough, a triangle has more points than are waited for.
    let scene = squares(&[0.0], 0.5);
    let mut options = straight_ahead(Some("points"));
    options.camera = CameraOptions { distance: Some(1e-3), ..CameraOptions::default() };
    let error = Capture::new(&scene, &options).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("would have") && error.contains("points"), "{error}");
}

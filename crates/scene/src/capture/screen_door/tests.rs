mod scenes;

use std::collections::BTreeSet;

use glam::{DAffine3, Vec2, Vec3, Vec4};

use super::*;
use crate::capture::geometry::Vertex;
use crate::capture::screen_door::tests::scenes::{
    add_rectangle, empty, splat, squares, strips, textured,
};
use crate::capture::{CameraOptions, Capture, CaptureOptions, Order};
use crate::scene::{AlphaMode, Shape, Texture, load};
use screendoor_trace::picture::Space;

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

/// Opacities of evenly spread points, and of independent ones.
fn laws(alpha: f64, degrees: f64) -> [f64; 2] {
    let cos = degrees.to_radians().cos();
    [1.0 - (1.0 - alpha).powf(1.0 / cos), 1.0 - (-alpha / cos).exp()]
}

#[test]
fn opacity_follows_the_angle_where_points_or_all_texels_count() {
    for (alpha, angle) in
        [(0.5, 0.0), (0.5, 45.0), (0.5, 60.0), (0.5, 75.0), (0.2, 0.0), (0.2, 60.0)]
    {
        let scene = squares(&[angle], alpha as f32);
        let of = |spec: &str| opacity(&scene, &straight_ahead(Some(spec)));
        let [even, independent] = laws(alpha, angle);
        let points = of("points");
        if angle == 0.0 || angle == 60.0 {
            // A whole number of points a pixel, along the pixels.
            assert!((points - even).abs() < 0.02, "{alpha} {angle}: {points} {even}");
        } else {
            let between = independent - 0.02..even + 0.02;
            assert!(between.contains(&points), "{alpha} {angle}: {points}, {between:?}");
        }
        let most = of("mask-max");
        assert!((most - even).abs() < 0.05, "{alpha} {angle}: {most}");
        for spec in ["mask", "stipple", "stipple-random"] {
            let found = of(spec);
            assert!((found - alpha).abs() < 0.03, "{spec} {alpha} {angle}: {found}");
        }
    }
}

#[test]
fn a_grid_that_does_not_lie_on_the_pixels_is_between_the_laws() {
    let mut scene = empty(0.5);
    add_rectangle(&mut scene, [[-1.0; 2], [1.0; 2]], DAffine3::from_rotation_z(0.5));
    let found = opacity(&scene, &straight_ahead(Some("points")));
    let [even, independent] = laws(0.5, 0.0);
    assert!((independent + 0.01..even - 0.01).contains(&found), "{found}");
}

#[test]
fn points_are_spread_evenly_on_slivers_too() {
    // Some 50, 3 and 0.4 pixels wide.
    for count in [4, 64, 512] {
        let found = opacity(&strips(count), &straight_ahead(Some("points")));
        assert!((0.37..0.52).contains(&found), "{count}: {found}");
    }
}

#[test]
fn a_texture_of_holes_keeps_its_opacity_in_points() {
    // Fields of 4 by 4 texels, of which a pixel has more than one.
    let fields = |x: u32, y: u32| if (x / 4 + y / 4).is_multiple_of(2) { 1.0 } else { 0.0 };
    let alpha = |a: f32| Vec4::new(1.0, 1.0, 1.0, a);
    let scene = textured(Texture::from_fn(1024, 1024, |x, y| alpha(fields(x, y))));
    let found = opacity(&scene, &straight_ahead(Some("points")));
    assert!((0.37..0.52).contains(&found), "{found}");
    // What is wide enough to be opaque in a pixel stays, up to its edge.
    let scene = textured(Texture::from_fn(64, 64, |x, _| alpha(if x < 32 { 1.0 } else { 0.5 })));
    let [plain, cut] = [None, Some("points")].map(|door| fragments(&scene, &straight_ahead(door)));
    let opaque = |all: &[Fragment]| -> Vec<Fragment> {
        all.iter().filter(|f| f.alpha == 1.0).copied().collect()
    };
    let found = pixels(&cut);
    let kept = opaque(&plain);
    assert!(kept.len() > 5000 && kept.iter().all(|f| found.contains(&(f.x, f.y))));
    let beside: Vec<_> = plain.iter().filter(|f| (0.9..1.0).contains(&f.alpha)).copied().collect();
    let share = pixels(&beside).intersection(&found).count() as f64 / beside.len() as f64;
    assert!(beside.len() > 100 && share > 0.5, "{} {share}", beside.len());
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
    let halved = [5.0, 2.5, 1.25];
    for spec in ["points", "mask"] {
        let found = halved.map(|distance| of(spec, distance));
        assert!(found.iter().all(|one| (one - found[0]).abs() < 0.03), "{spec}: {found:?}");
    }
    let [far, middle, near] = halved.map(|distance| of("points-static:side=100", distance));
    assert!(near < middle - 0.05 && middle < far - 0.05, "{near} {middle} {far}");
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
}

#[test]
fn what_has_no_number_of_points_that_can_be_drawn_is_refused() {
    let refused = |scene: &Scene| {
        let mut options = straight_ahead(Some("points"));
        options.camera.field_of_view = None;
        options.camera.distance = Some(1e-3);
        Capture::new(scene, &options).map(|_| ()).err().map(|error| error.to_string())
    };
    let error = refused(&squares(&[0.0], 0.5)).unwrap();
    assert!(error.contains("would have") && error.contains("points"), "{error}");
    // What is opaque has no points, nor has what shows its back and is not drawn.
    let mut opaque = squares(&[0.0], 0.5);
    opaque.materials[0].alpha_mode = AlphaMode::Opaque;
    let mut back = squares(&[180.0], 0.5);
    back.materials[0].double_sided = false;
    assert_eq!([opaque, back].map(|scene| refused(&scene)), [None, None]);
    // Beside a surface, too, splats have none.
    let mut splats = squares(&[0.0], 0.5);
    splats.add("splat", Shape::Splats(splat()));
    for spec in SCREEN_DOORS.map(|model| model.name) {
        let space = Some(Space::Linear);
        let options = CaptureOptions { space, ..straight_ahead(Some(spec)) };
        let error = Capture::new(&splats, &options).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains("splats have no surface"), "{error}");
    }
}

#[test]
fn a_triangle_beside_the_viewer_counts_from_where_it_is_in_sight() {
    let scene = squares(&[0.0], 0.5);
    let options = CameraOptions::default();
    let camera = Camera::frame(&scene, &options, &Default::default(), [100, 100]).unwrap();
    let eye = camera.eye.unwrap();
    // Its middle is all but in the viewer's plane.
    let vertices = [(10.0, -1.0), (10.0, 1.0), (-20.0 + 1e-9, 0.0)].map(|(ahead, aside)| Vertex {
        position: eye - camera.back * ahead + camera.right * aside,
        normal: Vec3::Z,
        uvs: [Vec2::ZERO; 2],
        colour: Vec4::ONE,
    });
    let triangle = Triangle { vertices, material: 0, object: 0, primitive: 0 };
    let found = pixels_per_unit(&triangle, &camera);
    let wanted = camera.focal[1] / 10.0;
    assert!((found / wanted - 1.0).abs() < 1e-6, "{found} {wanted}");
}

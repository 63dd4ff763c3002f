//! The view of a trace: what captures say of it, and what designs make of that.

use glam::{DMat4, DVec3, Vec3};
use screendoor::capture::{CameraOptions, Capture, CaptureOptions, Faces};
use screendoor::gpu::{self, GpuOptions};
use screendoor::rop::{Frame, ReplayOptions, ViewDepth};
use screendoor::scene::{Mesh, Scene, Shape};
use screendoor::trace::{Fragment, Header, Projection, Trace, Unorm32, View};

use crate::gpu::{differing, pictures};
use crate::util::{self, design, gpu, header, layered, picture, trace};

const SIDE: u32 = 256;

/// Cameras of both kinds, framed and not.
fn cameras() -> Vec<CameraOptions> {
    let angles = [[0.0, 0.0], [35.0, 20.0], [-120.0, -50.0]];
    let lenses = [(0.0, None), (35.0, None), (90.0, None), (60.0, Some(2.5))];
    let all = angles.iter().flat_map(|angle| lenses.iter().map(move |lens| (*angle, *lens)));
    all.map(|(angle, (fov, distance))| CameraOptions {
        angle: Some(angle),
        field_of_view: Some(fov),
        distance,
        ..CameraOptions::default()
    })
    .collect()
}

/// The corners of a parallelogram that faces none of the cameras and none from its edge.
fn corners() -> [DVec3; 3] {
    let (a, b, c) = ([-3.0, -1.0, 2.0], [4.0, 0.5, -1.0], [-2.0, 3.0, 0.5]);
    [a, b, c].map(DVec3::from)
}

/// That parallelogram, in a box that widens the depth range.
fn scene() -> Scene {
    let mut scene = Scene { materials: vec![Default::default()], ..Scene::default() };
    let [a, b, c] = corners();
    let positions = [a, b, c, b + c - a].map(|p| p.as_vec3()).to_vec();
    let quad = Mesh { positions, triangles: vec![[0, 1, 2], [1, 3, 2]], ..Mesh::default() };
    scene.add("quad", Shape::Mesh(quad));
    let speck = |at: Vec3| vec![at, at + Vec3::X * 0.01, at + Vec3::Y * 0.01];
    for at in [Vec3::new(0.0, -4.0, 5.0), Vec3::new(1.0, 5.0, -6.0)] {
        let speck = Mesh { positions: speck(at), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        scene.add("speck", Shape::Mesh(speck));
    }
    scene
}

fn capture(scene: &Scene, side: u32, camera: CameraOptions) -> Trace {
    let options = CaptureOptions {
        width: side,
        height: side,
        samples: 8,
        faces: Faces::Both,
        camera,
        ..CaptureOptions::default()
    };
    Capture::new(scene, &options).unwrap().to_memory(|_, _| ()).unwrap()
}

fn by_camera(trace: &Trace) -> ViewDepth {
    let frame = Frame::of(trace, 8, 0).unwrap();
    ViewDepth::of(design("wboit:lens=camera").values(), &frame).unwrap()
}

#[test]
fn view_depth_is_the_distance_of_known_points() {
    let scene = scene();
    let [a, b, c] = corners();
    let mut kinds = [0, 0];
    for camera in cameras() {
        let trace = capture(&scene, SIDE, camera.clone());
        let view = trace.header().view.unwrap();
        kinds[view.projection as usize] += 1;
        let fragments: Vec<Fragment> =
            trace.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>()).collect();
        let depth = by_camera(&trace);
        let to_view = DMat4::from_cols_array(&view.world_to_view);
        let to_clip = DMat4::from_cols_array(&view.view_to_clip);
        let mut met = 0;
        for (u, v) in [(0.3, 0.3), (0.25, 0.6), (0.7, 0.6), (0.4, 0.8)] {
            let point = to_view.transform_point3(a + (b - a) * u + (c - a) * v);
            let ndc = to_clip.project_point3(point);
            // As docs/TRACE_FORMAT.md maps pixels.
            let place = [0.5 + ndc.x * 0.5, 0.5 - ndc.y * 0.5].map(|s| s * f64::from(SIDE));
            let [x, y] = place.map(|s| s.floor() as u16);
            let at = |f: &&Fragment| (f.x, f.y, f.object) == (x, y, 0);
            // Where the camera stands within the scene, some lie outside its frame.
            let Some(f) = fragments.iter().find(at) else { continue };
            let [dx, dy] = [place[0] - f64::from(x) - 0.5, place[1] - f64::from(y) - 0.5];
            let plane = f64::from(f.depth.z.0)
                + f64::from(f.depth.dzdx) * dx
                + f64::from(f.depth.dzdy) * dy;
            let (found, right) = (depth.at(Unorm32(plane as u32)), -point.z);
            // Corners are snapped to 1/256 of a pixel, of which the plane is some hundred wide.
            let off = (found - right).abs() / (view.far - view.near);
            assert!(off < 1e-4, "{camera:?}: {found} is {right}");
            met += 1;
        }
        assert!(met >= 2, "{camera:?}");
    }
    assert!(kinds.iter().all(|n| *n > 0));
}

/// What says the same of a trace in numbers of its own.
fn spelt_out(view: &View) -> String {
    let lens = match view.projection {
        Projection::Perspective => "perspective",
        Projection::Orthographic => "parallel",
    };
    format!("lens={lens},near={:?},range={:?}", view.near, view.far - view.near)
}

#[test]
fn the_camera_s_lens_is_its_planes_spelt_out() {
    let scene = screendoor::scene::load("builtin:glass").unwrap();
    for field_of_view in [Some(0.0), Some(50.0)] {
        let trace = capture(&scene, 64, CameraOptions { field_of_view, ..Default::default() });
        let said = spelt_out(&trace.header().view.unwrap());
        for name in ["wboit", "mboit"] {
            let hash = |settings: &str| {
                let design = design(&format!("{name}:{settings}"));
                assert_eq!(design.asks_for_view(), settings == "lens=camera");
                picture(&design, &trace, 8, 0).hash()
            };
            assert_eq!(hash("lens=camera"), hash(&said), "{name}:{said}");
            assert_ne!(hash("lens=camera"), picture(&design(name), &trace, 8, 0).hash());
        }
    }
}

#[test]
fn a_gpu_takes_view_depths_from_the_camera_too() {
    let Some(gpu) = gpu() else { return };
    let scene = screendoor::scene::load("builtin:glass").unwrap();
    for field_of_view in [Some(0.0), Some(50.0)] {
        let trace = capture(&scene, 64, CameraOptions { field_of_view, ..Default::default() });
        for spec in ["wboit:lens=camera,colour=32", "wboit:lens=camera,weight=eq8,colour=32"] {
            let design = design(spec);
            let options = GpuOptions::default();
            assert_eq!(differing(&pictures(gpu, &design, &trace, 8, &options))[0], 0, "{spec}");
        }
    }
    let bare = trace(&Header { view: None, ..header(8, 8, 8) }, &[]);
    let camera = design("wboit:lens=camera");
    let error = gpu::replay(gpu, &camera, &bare, 8, 0, &GpuOptions::default()).unwrap_err();
    assert!(error.to_string().contains("lens=camera"), "{error}");
}

#[test]
fn a_view_changes_no_picture_that_does_not_ask_for_it() {
    let with = header(8, 8, 4);
    let fragments = layered(&with, 5, |i| ((5 - i) << 28, [i as f32 / 5.0, 0.5, 1.0], 0.3));
    let without = trace(&Header { view: None, ..with.clone() }, &fragments);
    let with = trace(&with, &fragments);
    assert!(with.header().view.is_some());
    assert_eq!(with.content(), without.content());
    for design in util::all_variants().iter().filter(|design| !design.asks_for_view()) {
        let [a, b] = [&with, &without].map(|trace| picture(design, trace, 4, 1).hash());
        assert_eq!(a, b, "{}", design.label());
    }
}

#[test]
fn planes_that_no_formula_can_take_are_refused() {
    let parallel = |near: f64, far: f64| {
        let mut view = View { projection: Projection::Orthographic, near, far, ..util::view() };
        (view.view_to_clip[10], view.view_to_clip[11]) = (-1.0 / (far - near), 0.0);
        (view.view_to_clip[14], view.view_to_clip[15]) = (-near / (far - near), 1.0);
        let trace = trace(&Header { view: Some(view), ..header(4, 4, 4) }, &[]);
        let options = ReplayOptions::default();
        design("mboit:lens=camera").replay(&trace, 4, 0, &options).map(|_| ())
    };
    for (near, far) in [(-1.0, 1.0), (0.0, 1.0), (1e-7, 1.0), (1.0, 1e7)] {
        let error = parallel(near, far).unwrap_err();
        assert!(error.is_config());
        let error = error.to_string();
        assert!(error.contains(&format!("{near:?} and {far:?}; lens=camera takes")), "{error}");
    }
    parallel(1e-6, 1e6).unwrap();
}

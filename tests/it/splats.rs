//! Gaussian splats drawn: by their formula, and against other renderers' pictures where there
//! are any.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{DVec3, Quat, Vec3};
use screendoor::capture::{CameraOptions, Capture, CaptureOptions, Pose, SplatRules};
use screendoor::picture::{Picture, Space};
use screendoor::scene::{Axes, LoadOptions, Scene, Shape, Splats, load_with};
use screendoor::trace::{ColourFormat, Fragment, Trace};

use crate::util::{design, picture};

/// A camera at the origin that looks along z, x to the right and y down.
fn pose() -> Pose {
    Pose {
        name: "test".into(),
        eye: DVec3::ZERO,
        axes: [DVec3::X, DVec3::Y, DVec3::Z],
        focal: [40.0; 2],
        principal: [16.5, 16.5],
        size: [33, 33],
    }
}

fn options(rules: &str, pose: Pose) -> CaptureOptions {
    CaptureOptions {
        width: pose.size[0],
        height: pose.size[1],
        samples: 4,
        colour: ColourFormat::F32,
        camera: CameraOptions { pose: Some(pose), ..CameraOptions::default() },
        splats: SplatRules::parse(rules).unwrap(),
        ..CaptureOptions::default()
    }
}

fn trace(scene: &Scene, options: &CaptureOptions) -> Trace {
    Capture::new(scene, options).unwrap().to_memory(|_, _| ()).unwrap()
}

fn fragments(scene: &Scene, options: &CaptureOptions) -> Vec<Fragment> {
    let trace = trace(scene, options);
    let batches: Vec<_> = trace.batches().map(Result::unwrap).collect();
    batches.iter().flat_map(|batch| batch.iter()).collect()
}

/// A scene of splats at places, of sizes along x and y, all of one opacity and grey.
fn scene(splats: &[(Vec3, Vec3, f32)]) -> Scene {
    let mut all = Splats::default();
    for (mean, scale, opacity) in splats {
        all.means.push(*mean);
        all.scales.push(*scale);
        all.rotations.push(Quat::IDENTITY);
        all.opacities.push(*opacity);
        all.harmonics.push([0.0; 3]);
    }
    let mut scene = Scene { materials: vec![Default::default()], ..Scene::default() };
    scene.add("splats", Shape::Splats(all));
    scene
}

#[test]
fn a_splat_is_one_fragment_a_pixel_with_the_alpha_of_its_centre() {
    let scene = scene(&[(Vec3::new(0.0, 0.0, 4.0), Vec3::new(0.3, 0.1, 0.2), 0.8)]);
    let found = fragments(&scene, &options("inria", pose()));
    // On the frame: 3 and 1 pixels, dilated.
    let variance = [9.0 + 0.3, 1.0 + 0.3];
    let mut expected = 0;
    for (x, y) in (0..33).flat_map(|y| (0..33).map(move |x| (x, y))) {
        let (dx, dy) = (f64::from(x) - 16.0, f64::from(y) - 16.0);
        let alpha = 0.8 * (-(dx * dx / variance[0] + dy * dy / variance[1]) / 2.0).exp();
        let own: Vec<&Fragment> =
            found.iter().filter(|f| (f.x, f.y) == (x as u16, y as u16)).collect();
        if alpha < 1.0 / 255.0 {
            assert!(own.is_empty(), "{x} {y}");
            continue;
        }
        expected += 1;
        let [f] = own[..] else { panic!("{x} {y}: {own:?}") };
        assert!((f64::from(f.alpha) - alpha).abs() < 1e-6, "{x} {y}: {} {alpha}", f.alpha);
        assert_eq!((f.coverage.0, f.primitive, f.colour), (0b1111, 0, [0.5; 3]));
        assert_eq!((f.depth.dzdx, f.depth.dzdy, f.depth.z), (0, 0, found[0].depth.z));
    }
    assert_eq!(found.len(), expected);
}

#[test]
fn the_trace_says_in_what_space_it_is_blended() {
    let mut scene = scene(&[(Vec3::new(0.0, 0.0, 4.0), Vec3::splat(0.5), 0.9)]);
    let mut options = options("inria", pose());
    options.background = Some([1.0, 0.214_041_14, 0.0]);
    let encoded = trace(&scene, &options);
    assert_eq!(encoded.header().space, Space::Encoded);
    let background = encoded.header().background;
    assert!(background[0] == 1.0 && (background[1] - 0.5).abs() < 1e-5, "{background:?}");
    let exact = picture(&design("exact"), &encoded, 4, 0);
    assert_eq!(exact.space(), Space::Encoded);
    // A grey of 1/2 over black and white lie halfway between, as numbers of a display.
    let [r, g, b] = exact.get(16, 16);
    let alpha = 0.9;
    for (found, behind) in [(r, 1.0), (g, 0.5), (b, 0.0)] {
        let wanted = 0.5 * alpha + behind * (1.0 - alpha);
        assert!((found - wanted).abs() < 1e-5, "{found} {wanted}");
    }
    // Pictures convert: what is written is light in an EXR, and as it is in a PNG.
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let layers = [screendoor::picture::Layer { name: "beauty", picture: &exact }];
    screendoor::picture::write_exr(path("a.exr"), &layers).unwrap();
    screendoor::picture::write_png(path("a.png"), &exact).unwrap();
    let [light, shown] =
        ["a.exr", "a.png"].map(|name| screendoor::picture::read(path(name), None).unwrap());
    let decoded = Space::Encoded.to_linear(g);
    assert!((light.get(16, 16)[1] - decoded).abs() < 1e-6);
    assert!((Space::Linear.to_encoded(shown.get(16, 16)[1]) - g).abs() < 0.5 / 255.0 + 1e-9);

    // Both kinds in one scene: somebody has to say.
    let triangle = screendoor::scene::Mesh {
        positions: vec![
            Vec3::new(-1.0, -1.0, 5.0),
            Vec3::new(1.0, -1.0, 5.0),
            Vec3::new(0.0, 1.0, 5.0),
        ],
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    scene.add("triangle", Shape::Mesh(triangle));
    let error = Capture::new(&scene, &options).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("say as its space"), "{error}");
    for space in [Space::Linear, Space::Encoded] {
        options.space = Some(space);
        let both = fragments(&scene, &options);
        let splat = both.iter().find(|f| f.object == 0).unwrap().colour[0];
        let wanted = if space == Space::Linear { Space::Encoded.to_linear(0.5) } else { 0.5 };
        assert!((f64::from(splat) - wanted).abs() < 1e-6, "{splat}");
        assert!(both.iter().any(|f| f.object == 1));
    }
}

#[test]
fn alphas_of_samples_are_those_of_their_places() {
    let scene = scene(&[(Vec3::new(0.01, 0.02, 4.0), Vec3::splat(0.02), 0.9)]);
    let options = options("inria:alpha=sample,cut=0", pose());
    let trace = trace(&scene, &options);
    let positions = trace.header().pattern.positions.clone();
    let batch: Vec<_> = trace.batches().map(Result::unwrap).collect();
    let found: Vec<Fragment> = batch.iter().flat_map(|b| b.iter()).collect();
    let variance = 0.2 * 0.2 + 0.3;
    let centre = [40.0 * 0.01 / 4.0 + 16.5, 40.0 * 0.02 / 4.0 + 16.5];
    assert!(found.len() > 8);
    for f in &found {
        assert_eq!(f.coverage.count(), 1);
        let s = f.coverage.iter().next().unwrap();
        let at = [0, 1].map(|i| {
            let pixel = [f.x, f.y][i];
            f64::from(pixel) + 0.5 + f64::from(positions[s][i]) / 16.0 - centre[i]
        });
        let alpha = 0.9 * (-(at[0] * at[0] + at[1] * at[1]) / variance / 2.0).exp();
        // Perspective: the mean is off the axis, by next to nothing.
        assert!((f64::from(f.alpha) - alpha).abs() < 1e-4, "{} {alpha}", f.alpha);
    }
}

#[test]
fn the_plane_without_popping_is_where_sight_lines_come_nearest() {
    let mut scene = scene(&[(Vec3::new(0.3, -0.2, 4.0), Vec3::new(0.4, 0.1, 0.2), 0.9)]);
    let Shape::Splats(splats) = &mut scene.shapes[0] else { unreachable!() };
    splats.rotations[0] = Quat::from_euler(glam::EulerRot::XYZ, 0.5, 0.8, -0.3);
    let capture = options("inria:depth=plane", pose());
    let header = Capture::new(&scene, &capture).unwrap().header().clone();
    let view = header.view.unwrap();
    let found = fragments(&scene, &capture);
    let axes = glam::DMat3::from_quat(splats_of(&scene).rotations[0].as_dquat())
        * glam::DMat3::from_diagonal(DVec3::new(0.4, 0.1, 0.2));
    let inverse = (axes * axes.transpose()).inverse();
    let mean = splats_of(&scene).means[0].as_dvec3();
    assert!(found.len() > 20);
    for f in &found {
        let ray = DVec3::new(
            (f64::from(f.x) + 0.5 - 16.5) / 40.0,
            (f64::from(f.y) + 0.5 - 16.5) / 40.0,
            1.0,
        );
        // Of t·ray the nearest to the mean in the splat's measure.
        let t = ray.dot(inverse * mean) / ray.dot(inverse * ray);
        let wanted = mean.dot(inverse * mean) / ray.dot(inverse * mean);
        // The same plane only through the mean; elsewhere the plane of those points' pole.
        let depth = |z: f64| view.far / (view.far - view.near) * (1.0 - view.near / z);
        let found = f64::from(f.depth.z.0) / f64::from(u32::MAX);
        assert!((found - depth(wanted)).abs() < 1e-6, "{found} {} {t}", depth(wanted));
        assert!(f.depth.dzdx != 0 && f.depth.dzdy != 0);
    }
}

fn splats_of(scene: &Scene) -> &Splats {
    match &scene.shapes[0] {
        Shape::Splats(splats) => splats,
        other => panic!("{other:?}"),
    }
}

#[test]
fn order_by_distance_and_by_depth_differ_beside_the_axis() {
    // The one aside is further from the eye and nearer along the axis.
    let both = [
        (Vec3::new(1.5, 0.0, 3.9), Vec3::splat(0.3), 0.9),
        (Vec3::new(0.0, 0.0, 4.0), Vec3::splat(0.3), 0.9),
    ];
    let scene = scene(&both);
    let first = |rules: &str| {
        let found = fragments(&scene, &options(rules, pose()));
        let z = |primitive| found.iter().find(|f| f.primitive == primitive).unwrap().depth.z;
        z(0) < z(1)
    };
    assert!(first("inria") && !first("inria:distance=eye") && !first("spark"));
}

#[test]
fn opacity_is_never_raised_by_what_a_splat_is_limited_to() {
    // Far larger than the frame: PlayCanvas' rules limit its size, not what is known of it.
    let scene = scene(&[(Vec3::new(0.0, 0.0, 4.0), Vec3::splat(40.0), 0.5)]);
    for rules in ["playcanvas:factor=always", "playcanvas", "inria:factor=always"] {
        let options = options(rules, pose());
        let [(_, splat)] = &Capture::new(&scene, &options).unwrap().splats_on_frame()[..] else {
            panic!("{rules}")
        };
        assert!(splat.opacity <= 0.5 && splat.opacity > 0.49, "{rules}: {}", splat.opacity);
    }
}

#[test]
fn what_lies_far_off_or_shows_nothing_cuts_nothing_away() {
    let near = (Vec3::new(0.0, 0.0, 4.0), Vec3::splat(0.3), 0.9);
    let drawn = |others: &[(Vec3, Vec3, f32)]| {
        let all = [&[near], others].concat();
        let found = fragments(&scene(&all), &options("inria", pose()));
        found.iter().filter(|f| f.primitive == 0).count()
    };
    let alone = drawn(&[]);
    assert!(alone > 20);
    for other in [
        (Vec3::new(0.0, 0.0, 1e6), Vec3::splat(0.1), 0.9),
        (Vec3::new(0.0, 0.0, 1e6), Vec3::splat(1e5), 0.9),
        (Vec3::new(0.0, 0.0, -1e6), Vec3::splat(1e6), 0.9),
        (Vec3::new(1.0, 0.0, 0.3), Vec3::splat(1e5), 1e-9),
    ] {
        assert_eq!(drawn(&[other]), alone, "{other:?}");
    }
}

#[test]
fn distances_from_the_eye_are_told_apart_up_to_the_frame_s_corner() {
    // Aside by 45 degrees the eye is further away than the far plane of depths would be.
    let wide = Pose { focal: [14.0; 2], ..pose() };
    let splats = [
        (Vec3::new(9.0, 0.0, 9.0), Vec3::splat(0.5), 0.9),
        (Vec3::new(10.0, 0.0, 10.0), Vec3::splat(0.5), 0.9),
        (Vec3::new(0.0, 0.0, 5.0), Vec3::splat(0.5), 0.9),
    ];
    let found = fragments(&scene(&splats), &options("khr", wide));
    let z = |primitive| found.iter().find(|f| f.primitive == primitive).unwrap().depth.z;
    assert!(z(2) < z(0) && z(0) < z(1) && z(1).0 < u32::MAX, "{:?} {:?} {:?}", z(0), z(1), z(2));
}

#[test]
fn what_leaves_no_fragment_is_told_of_splats_too() {
    let behind = scene(&[(Vec3::new(0.0, 0.0, 4.0), Vec3::splat(0.1), 0.001)]);
    let capture = options("inria", pose());
    let capture = Capture::new(&behind, &capture).unwrap();
    capture.to_memory(|_, _| ()).unwrap();
    let unseen = capture.unseen();
    assert!(unseen[0].reason.contains("its one splat is wholly transparent"), "{unseen:?}");
    // Nothing that could be seen at all is an error.
    let near = scene(&[(Vec3::new(0.0, 0.0, 0.1), Vec3::splat(0.1), 0.9)]);
    let error = Capture::new(&near, &options("inria", pose())).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("nearer than splats are drawn"), "{error}");
}

/// The folder of splats and other renderers' pictures of them.
fn folder() -> PathBuf {
    std::env::var_os("SCREENDOOR_SPLATS").expect("SCREENDOOR_SPLATS names the folder").into()
}

/// An array of a `.npz` file: its shape and its values.
struct Array {
    shape: Vec<usize>,
    values: Vec<f64>,
}

/// The arrays of a `.npz` file.
fn arrays(path: &Path) -> HashMap<String, Array> {
    let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    let names: Vec<String> = archive.file_names().map(|name| name.unwrap().into_owned()).collect();
    let array = |name: String| {
        let mut bytes = Vec::new();
        archive.by_name(&name).unwrap().read_to_end(&mut bytes).unwrap();
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let head = String::from_utf8(bytes[10..10 + length].to_vec()).unwrap();
        let between = |from: &str, to: &str| {
            head.split_once(from).unwrap().1.split_once(to).unwrap().0.to_string()
        };
        let shape = between("'shape': (", ")");
        let shape = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
        let data = &bytes[10 + length..];
        let values = match &between("'descr': '", "'")[..] {
            "<f4" => data
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes(b.try_into().unwrap()).into())
                .collect(),
            "<f8" => {
                data.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
            }
            "|b1" => data.iter().map(|b| f64::from(*b)).collect(),
            other => panic!("{other}"),
        };
        (name.trim_end_matches(".npy").to_string(), Array { shape, values })
    };
    names.into_iter().map(array).collect()
}

/// The camera of a reference picture, in the space of the PLY file.
fn reference_pose(name: &str) -> Pose {
    let text = std::fs::read_to_string(folder().join(format!("reference/{name}.json"))).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let camera = &json["camera"];
    let vector = |v: &serde_json::Value| DVec3::from([0, 1, 2].map(|i| v[i].as_f64().unwrap()));
    let number = |key: &str| camera[key].as_f64().unwrap();
    Pose {
        name: name.into(),
        eye: vector(&camera["eye"]),
        axes: [0, 1, 2].map(|row| vector(&camera["world_to_camera_rows"][row])),
        focal: [number("fx"), number("fy")],
        principal: [number("cx"), number("cy")],
        size: ["width", "height"].map(|side| number(side) as u32),
    }
}

/// A file of splats as its own axes have it, so that the camera's are the file's.
fn open(path: &str, axes: Option<Axes>) -> Scene {
    let source = folder().join(path).display().to_string();
    load_with(&source, &LoadOptions { axes, ..LoadOptions::default() }).unwrap()
}

/// The greatest difference of a replay from a reference, and the share of pixels that are
/// further off than 1e-3.
fn difference(scene: &Scene, options: &CaptureOptions, reference: &Array) -> (f64, f64) {
    let trace = trace(scene, options);
    let exact: Picture = picture(&design("exact"), &trace, 1, 0);
    let (width, height) = (reference.shape[1], reference.shape[0]);
    assert_eq!([exact.width() as usize, exact.height() as usize], [width, height]);
    let (mut most, mut off) = (0.0_f64, 0);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let found = exact.get(x as u32, y as u32);
        let wanted = &reference.values[(y * width + x) * reference.shape[2]..][..3];
        let by = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        most = most.max(by);
        off += usize::from(by > 1e-3);
    }
    (most, off as f64 / (width * height) as f64)
}

/// The scenes with references.
const REFERENCES: [&str; 5] =
    ["train-1000", "train-1000-sh0", "train-1000-sh1", "train-1000-sh2", "guitar-crop"];

#[test]
#[ignore = "needs SCREENDOOR_SPLATS"]
fn projections_are_those_of_the_reference() {
    for name in REFERENCES {
        let scene = open(&format!("ply/{name}.ply"), Some(Axes::YUp));
        let wanted = arrays(&folder().join(format!("reference/{name}_projected.npz")));
        let options = options("inria:cut=0", reference_pose(name));
        let found = Capture::new(&scene, &options).unwrap().splats_on_frame();
        assert!(found.len() > splats_of(&scene).means.len() * 9 / 10, "{name} {}", found.len());
        let mut most: f64 = 0.0;
        for (i, splat) in found {
            let i = i as usize;
            let value = |key: &str| wanted[key].values[i];
            let colour = |c: usize| wanted["col"].values[3 * i + c];
            let pairs = [
                (splat.centre.x, value("px")),
                (splat.centre.y, value("py")),
                (splat.distance, value("z")),
                (splat.covariance[0], value("a")),
                (splat.covariance[1], value("b")),
                (splat.covariance[2], value("c")),
                (splat.opacity, value("op")),
                (f64::from(splat.colour[0]), colour(0)),
                (f64::from(splat.colour[1]), colour(1)),
                (f64::from(splat.colour[2]), colour(2)),
            ];
            // What is near 0 is measured beside what stands next to it.
            let scale = splat.covariance[0].max(splat.covariance[2]);
            for (k, (found, wanted)) in pairs.into_iter().enumerate() {
                let size = if k == 4 { scale } else { wanted.abs().max(1e-2) };
                let off = (found - wanted).abs() / size;
                assert!(off < 1e-5, "{name}, splat {i}, {k}: {found} for {wanted}");
                most = most.max(off);
            }
        }
        println!("{name}: projections within {most:.1e}");
    }
}

#[test]
#[ignore = "needs SCREENDOOR_SPLATS"]
fn pictures_are_those_of_the_reference_by_each_of_the_rules() {
    const RULES: [(&str, &str); 7] = [
        ("inria", "trace"),
        ("inria:cap=1", "nostop"),
        ("inria:factor=always", "mip03"),
        ("mip", "mip01"),
        ("inria:dilation=0", "nodilate"),
        ("playcanvas", "playcanvas"),
        ("splat-transform", "splat_transform"),
    ];
    for name in REFERENCES {
        let scene = open(&format!("ply/{name}.ply"), Some(Axes::YUp));
        let references = arrays(&folder().join(format!("reference/{name}.npz")));
        for (rules, key) in RULES {
            let mut options = options(rules, reference_pose(name));
            options.samples = 1;
            options.colour = ColourFormat::F16;
            let (most, off) = difference(&scene, &options, &references[key]);
            println!("{name}, {rules}: {most:.1e} at most, {:.2} % beyond 1e-3", 100.0 * off);
            // Where an alpha straddles the cut, a pixel may be off by that much.
            assert!(most < 5e-3 && off < 2e-3, "{name}, {rules}: {most} {off}");
        }
        let mut options = options("inria", reference_pose(name));
        options.samples = 1;
        options.space = Some(Space::Linear);
        let (most, off) = difference(&scene, &options, &references["trace_linear_light"]);
        println!("{name}, linear light: {most:.1e}, {:.2} %", 100.0 * off);
        assert!(most < 5e-3 && off < 1e-3, "{name}: {most} {off}");
    }
}

#[test]
#[ignore = "needs SCREENDOOR_SPLATS"]
fn all_formats_of_the_same_splats_draw_the_same() {
    // What a format's own rounding leaves, as a root mean square: of 8-bit colours, scales and
    // harmonics; `.splat` has clamped colours and no harmonics.
    let cases = [
        ("guitar-crop", "splat/guitar-crop.splat", Some(Axes::YUp), 0.01),
        ("guitar-crop", "spz/guitar-crop-v3.spz", Some(Axes::YUp), 0.004),
        ("guitar-crop", "spz/guitar-crop-v4.spz", Some(Axes::YUp), 0.004),
        ("guitar-crop", "gltf/guitar-crop.glb", None, 2e-4),
        ("train-1000", "spz/train-1000-v3.spz", Some(Axes::YUp), 0.004),
        ("train-1000", "spz/train-1000-v4.spz", Some(Axes::YUp), 0.004),
        ("train-1000", "gltf/train-1000.glb", None, 2e-4),
    ];
    for (name, path, axes, most) in cases {
        let mut scene = open(path, axes);
        if axes.is_none() {
            // The writer turned them by half about z.
            scene.world = glam::DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0));
        }
        let mut options = options("inria", reference_pose(name));
        options.samples = 1;
        let wanted = &arrays(&folder().join(format!("reference/{name}.npz")))["trace"];
        let trace = trace(&scene, &options);
        let exact = picture(&design("exact"), &trace, 1, 0);
        let mut square = 0.0;
        for (i, wanted) in wanted.values.chunks_exact(4).enumerate() {
            let (x, y) = (i as u32 % exact.width(), i as u32 / exact.width());
            let found = exact.get(x, y);
            square += found.iter().zip(wanted).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        }
        let rms = (square / (wanted.values.len() / 4 * 3) as f64).sqrt();
        println!("{path}: {rms:.1e} rms");
        assert!(rms < most, "{path}: {rms}");
    }
}

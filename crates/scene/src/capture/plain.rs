//! What is drawn in vectors, held against the plain text: of random triangles and of scenes,
//! with all instructions that this machine has.

use glam::{Vec2, Vec3, Vec4};

use super::geometry::Geometry;
use super::job::{Drawn, Tools, cut_into_jobs};
use super::lanes::levels;
use super::{CameraOptions, Capture, CaptureOptions, Light, Opacity};
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, TextureUse, load};
use screendoor_trace::random::Stream;
use screendoor_trace::trace::Fragment;

/// The fragments of triangles by [`Raster::row`](super::raster::Raster::row) and
/// [`Shader::shade`](super::shade::Shader::shade).
fn plain(drawn: &[Drawn], tools: &Tools<'_>) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    for drawn in drawn {
        let Drawn::Triangle { triangle, pieces } = drawn else { continue };
        for piece in pieces.iter() {
            let raster = tools.raster(piece);
            let (first, last) = raster.rows();
            for y in first..=last {
                raster.row(y, |hit| {
                    let weights = raster.weights(hit.shade_at);
                    let Some(shaded) = tools.shader.shade(triangle, &weights) else {
                        return;
                    };
                    let mut fragment = Fragment {
                        x: hit.x,
                        y: hit.y,
                        coverage: hit.coverage,
                        depth: hit.depth,
                        primitive: triangle.primitive,
                        object: triangle.object,
                        ..Fragment::default()
                    };
                    shaded.put(&mut fragment);
                    fragments.push(fragment);
                });
            }
        }
    }
    fragments
}

/// Holds all levels to the plain text; tells how many fragments there are.
fn check(scene: &Scene, options: &CaptureOptions) -> usize {
    let capture = Capture::new(scene, options).unwrap();
    let geometry = Geometry::new(scene, &capture.camera);
    let mut tools = capture.tools();
    let prepare = |i| capture.prepare(geometry.primitive(i), &tools);
    let drawn: Vec<Drawn> = (0..geometry.len()).map(prepare).collect();
    let wanted = plain(&drawn, &tools);
    for level in levels() {
        tools.level = level;
        let mut found = Vec::new();
        for job in cut_into_jobs(&drawn, &tools) {
            job.run(&drawn, &tools, &mut found);
        }
        assert_eq!(found.len(), wanted.len(), "{level:?}, {}", scene.source);
        for (found, wanted) in found.iter().zip(&wanted) {
            assert_eq!(found, wanted, "{level:?}, {}", scene.source);
        }
    }
    wanted.len()
}

#[test]
fn scenes_are_drawn_as_the_plain_text_says() {
    let scenes = ["engine:rows=1,detail=2", "foliage", "glass", "smoke:puffs=20", "ramps", "cloth"];
    for (i, name) in scenes.into_iter().enumerate() {
        let scene = load(&format!("builtin:{name}")).unwrap();
        for samples in [64, 1 << i] {
            let alpha = (i % 2 == 1 && samples < 64).then_some(0.5);
            let options = CaptureOptions {
                width: 40,
                height: 30,
                samples,
                alpha,
                opacity: Opacity::parse(
                    ["constant", "thickness", "crow", "crow-printed:power=3"][i % 4],
                )
                .unwrap(),
                light: [None, Some(Light::Key), Some(Light::Directional([70.0, 20.0]))][i % 3],
                ..CaptureOptions::default()
            };
            assert!(check(&scene, &options) > 100, "{name}");
        }
    }
}

/// Triangles of all sizes and shapes, with all that shading looks at.
fn random_scene(random: &mut Stream, material: Material) -> Scene {
    let mut real = |reach: f32| (random.word() as f32 / 2_147_483_648.0 - 1.0) * reach;
    let mut scene = load("builtin:foliage").unwrap();
    scene.objects.clear();
    scene.shapes.clear();
    scene.materials = vec![material];
    let mut mesh = Mesh::default();
    for i in 0..150 {
        let start = Vec3::new(real(1.0), real(1.0), real(1.0));
        // From far below a pixel to beyond the frame; slivers, and corners that meet.
        let size = [0.003, 0.03, 0.3, 5.0, 400.0][i % 5];
        let thin = [1.0, 1.0, 0.001, 0.0][i % 4];
        for k in 0..3 {
            let reach = if k == 2 { size * thin } else { size };
            mesh.positions.push(start + Vec3::new(real(reach), real(reach), real(reach)));
            mesh.normals.push(Vec3::new(real(1.0), real(1.0), real(1.0)) * (i % 7) as f32);
            mesh.uvs.push(Vec2::new(real(3.0), real(3.0)));
            mesh.colours.push(Vec4::new(real(2.0), real(2.0), real(2.0), real(1.2)));
        }
        let first = 3 * i as u32;
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    scene.add("random", Shape::Mesh(mesh));
    scene
}

#[test]
fn random_triangles_are_drawn_as_the_plain_text_says() {
    let mut random = Stream::new([0xba7c4]);
    let mut fragments = 0;
    for round in 0..14 {
        let texture = (round % 3 != 0).then(|| TextureUse::plain(0));
        let material = Material {
            base: Vec4::new(0.9, 0.6, 0.3, 0.8),
            base_texture: texture,
            alpha_texture: texture.filter(|_| round % 2 == 0),
            alpha_mode: [AlphaMode::Blend, AlphaMode::Opaque, AlphaMode::Mask { cutoff: 0.4 }]
                [round % 3],
            transmission: [0.0, 0.7][round / 2 % 2],
            transmission_texture: texture.filter(|_| round % 4 == 3),
            emissive: Vec3::splat(0.2),
            emissive_texture: texture.filter(|_| round % 5 == 1),
            unlit: round % 4 == 1,
            ..Material::default()
        };
        let scene = random_scene(&mut random, material);
        // Far away, from within, and along parallel lines.
        let camera = CameraOptions {
            distance: [None, Some(0.002), None][round % 3],
            field_of_view: [None, None, Some(0.0)][round % 3],
            ..CameraOptions::default()
        };
        let options = CaptureOptions {
            width: 37,
            height: 23,
            samples: 1 << (round % 7),
            camera,
            ..CaptureOptions::default()
        };
        fragments += check(&scene, &options);
    }
    assert!(fragments > 5000, "{fragments}");
}

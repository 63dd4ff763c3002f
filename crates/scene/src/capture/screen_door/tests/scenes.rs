//! Scenes that screen doors are cut into.

use glam::{DAffine3, DQuat, DVec3, Quat, Vec2, Vec3, Vec4};

use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape, Splats, Texture, TextureUse, load};

/// A scene of one material of this alpha, that shows both sides, without objects.
pub(super) fn empty(alpha: f32) -> Scene {
    let mut scene = load("builtin:foliage").unwrap();
    scene.objects.clear();
    scene.shapes.clear();
    scene.materials = vec![Material {
        base: Vec4::new(1.0, 1.0, 1.0, alpha),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    }];
    scene
}

/// A rectangle in two triangles, from the texture's one corner to the other.
pub(super) fn add_rectangle(scene: &mut Scene, [low, high]: [[f64; 2]; 2], place: DAffine3) {
    let corners = [[low[0], low[1]], [high[0], low[1]], high, [low[0], high[1]]];
    let at = |[x, y]: [f64; 2]| place.transform_point3(DVec3::new(x, y, 0.0)).as_vec3();
    let mesh = Mesh {
        positions: corners.map(at).to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    scene.add("rectangle", Shape::Mesh(mesh));
}

/// Squares of the side 2, turned about the horizontal axis by so many degrees, one behind the other.
pub(super) fn squares(angles: &[f64], alpha: f32) -> Scene {
    let mut scene = empty(alpha);
    for (i, angle) in angles.iter().enumerate() {
        let turn = DQuat::from_rotation_x(angle.to_radians());
        let at = DVec3::new(0.0, 0.0, -3.0 * i as f64);
        let place = DAffine3::from_rotation_translation(turn, at);
        add_rectangle(&mut scene, [[-1.0; 2], [1.0; 2]], place);
    }
    scene
}

/// A square of the side 2 in upright strips.
pub(super) fn strips(count: u32) -> Scene {
    let mut scene = empty(0.5);
    for i in 0..count {
        let at = |i: u32| 2.0 * f64::from(i) / f64::from(count) - 1.0;
        add_rectangle(&mut scene, [[at(i), -1.0], [at(i + 1), 1.0]], DAffine3::IDENTITY);
    }
    scene
}

/// A square of the side 2 with the texture's alphas.
pub(super) fn textured(texture: Texture) -> Scene {
    let mut scene = squares(&[0.0], 1.0);
    scene.materials[0].base_texture = Some(TextureUse::plain(0));
    scene.textures = vec![texture];
    scene
}

/// One splat.
pub(super) fn splat() -> Splats {
    Splats {
        means: vec![Vec3::ZERO],
        scales: vec![Vec3::splat(0.1)],
        rotations: vec![Quat::IDENTITY],
        opacities: vec![0.5],
        harmonics: vec![[1.0; 3]],
        ..Splats::default()
    }
}

//! Object-space screen-door transparency (2003): how opaque squares and a ball are that screen doors are
//! cut into, by angle, over each other, by distance and by the size of their triangles.
//!
//! No study: nothing here depends on a design, since what is captured is opaque.

use std::collections::BTreeSet;

use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};
use serde::Serialize;

use crate::study::measure::averaged;
use crate::study::publications::NamedPicture;
use screendoor_designs::{REFERENCE, configure};
use screendoor_rop::ReplayOptions;
use screendoor_scene::capture::{
    CameraOptions, Capture, CaptureOptions, Order, SCREEN_DOORS, ScreenDoor,
};
use screendoor_scene::scene::{self, AlphaMode, Material, Mesh, Scene, Shape};
use screendoor_trace::error::Result;
use screendoor_trace::picture::Picture;
use screendoor_trace::trace::Fragment;

/// The opacity that all surfaces are given.
pub const ALPHA: f64 = 0.5;
/// How far the square is turned, in degrees.
pub const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 80.0];
/// Bounds of the angles of the ball's surface, in degrees.
pub const BINS: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0];
/// Distances of the viewer, in radii of the scene.
pub const DISTANCES: [f64; 4] = [1.2, 2.0, 4.0, 8.0];
/// Along how many parts each side of the square is cut.
pub const PARTS: [u32; 5] = [1, 4, 16, 64, 256];
/// Seeds of what depends on which patterns meet.
const SEEDS: u32 = 32;
/// Frame side in pixels.
const SIDE: u32 = 440;

/// What is measured of screen doors. Opacities are shares of the pixels that the surface covers.
#[derive(Debug, Serialize)]
pub struct ScreenDoors {
    /// By angle of a square, and of a ball's surface.
    pub angles: Vec<ByAngle>,
    /// Two squares, one behind the other.
    pub layers: Vec<Layers>,
    /// By distance, each of [`DISTANCES`].
    pub distances: Vec<(String, Vec<f64>)>,
    /// By the size of triangles, each of [`PARTS`].
    pub sizes: Vec<(String, Vec<f64>)>,
    /// Whether another order of triangles gave the same fragments.
    pub ordered: Vec<(&'static str, bool)>,
    /// Figure 1.
    #[serde(skip)]
    pub pictures: Vec<NamedPicture>,
}

/// The opacity of a screen door by angle.
#[derive(Debug, Serialize)]
pub struct ByAngle {
    /// The screen door.
    pub door: &'static str,
    /// Of a square at each of [`ANGLES`].
    pub square: Vec<f64>,
    /// Of a ball between each two of [`BINS`].
    pub ball: Vec<f64>,
}

/// The opacity of two layers together.
#[derive(Debug, Serialize)]
pub struct Layers {
    /// The screen door.
    pub door: &'static str,
    /// Mean over seeds where both are alike and parallel.
    pub alike: f64,
    /// And where the farther one is turned by 20 degrees.
    pub turned: f64,
}

/// Measures all of them.
///
/// # Errors
/// As [`Capture::new`] and [`Capture::draw`].
pub fn screen_doors() -> Result<ScreenDoors> {
    let square = |angle: f64| squares(&[angle], 1);
    let mut angles = Vec::new();
    for model in SCREEN_DOORS {
        let of = |angle: &f64| opacity(&square(*angle)?, &straight_ahead(Some(model.name))?);
        angles.push(ByAngle {
            door: model.name,
            square: ANGLES.iter().map(of).collect::<Result<_>>()?,
            ball: of_ball(model.name)?,
        });
    }
    let near = |door: &str| -> Result<(String, Vec<f64>)> {
        let of = |distance: &f64| {
            let mut options = straight_ahead(Some(door))?;
            options.camera.field_of_view = Some(45.0);
            options.camera.distance = Some(*distance);
            opacity(&square(0.0)?, &options)
        };
        Ok((door.to_string(), DISTANCES.iter().map(of).collect::<Result<_>>()?))
    };
    let cut = |door: &str| -> Result<(String, Vec<f64>)> {
        let of = |parts: &u32| opacity(&squares(&[0.0], *parts)?, &straight_ahead(Some(door))?);
        Ok((door.to_string(), PARTS.iter().map(of).collect::<Result<_>>()?))
    };
    let doors = || SCREEN_DOORS.iter().map(|model| model.name);
    Ok(ScreenDoors {
        angles,
        layers: doors().map(layers).collect::<Result<_>>()?,
        distances: doors().map(near).collect::<Result<_>>()?,
        sizes: doors().map(cut).collect::<Result<_>>()?,
        ordered: doors().map(|door| Ok((door, is_ordered(door)?))).collect::<Result<_>>()?,
        pictures: pictures()?,
    })
}

/// A scene of white surfaces that show both sides.
fn empty(double_sided: bool) -> Result<Scene> {
    // Any whose frame follows what is in it.
    let mut scene = scene::load("builtin:foliage")?;
    scene.objects.clear();
    scene.shapes.clear();
    scene.materials = vec![Material {
        base: Vec4::new(1.0, 1.0, 1.0, ALPHA as f32),
        alpha_mode: AlphaMode::Blend,
        double_sided,
        ..Material::default()
    }];
    Ok(scene)
}

/// Squares of the side 2 of so many parts along each side, turned about the horizontal axis by so many
/// degrees, one behind the other.
fn squares(angles: &[f64], parts: u32) -> Result<Scene> {
    let mut scene = empty(true)?;
    for (i, angle) in angles.iter().enumerate() {
        let place = DAffine3::from_rotation_translation(
            DQuat::from_rotation_x(angle.to_radians()),
            DVec3::new(0.0, 0.0, -3.0 * i as f64),
        );
        let step = |k: u32| 2.0 * f64::from(k) / f64::from(parts) - 1.0;
        let at = |x: u32, y: u32| place.transform_point3(DVec3::new(step(x), step(y), 0.0));
        let number = |x: u32, y: u32| y * (parts + 1) + x;
        let mut mesh = Mesh::default();
        for (x, y) in (0..=parts).flat_map(|y| (0..=parts).map(move |x| (x, y))) {
            mesh.positions.push(at(x, y).as_vec3());
            if x < parts && y < parts {
                let [a, b] = [number(x, y), number(x + 1, y)];
                let [c, d] = [number(x + 1, y + 1), number(x, y + 1)];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        scene.add("square", Shape::Mesh(mesh));
    }
    Ok(scene)
}

/// A ball, which shows its front alone where its material does.
fn ball(centre: Vec3, radius: f32, material: usize) -> Shape {
    const AROUND: u32 = 128;
    const DOWN: u32 = 64;
    let mut mesh = Mesh { material, ..Mesh::default() };
    let number = |x: u32, y: u32| y * (AROUND + 1) + x;
    for (x, y) in (0..=DOWN).flat_map(|y| (0..=AROUND).map(move |x| (x, y))) {
        let turn = |k: u32, of: u32, whole: f64| libm::sincos(whole * f64::from(k) / f64::from(of));
        let (sin, cos) = turn(x, AROUND, std::f64::consts::TAU);
        let (ring, height) = turn(y, DOWN, std::f64::consts::PI);
        let normal = Vec3::new((ring * cos) as f32, height as f32, (ring * sin) as f32);
        mesh.positions.push(centre + radius * normal);
        mesh.normals.push(normal);
        if x < AROUND && y < DOWN {
            let [a, b] = [number(x, y), number(x + 1, y)];
            let [c, d] = [number(x + 1, y + 1), number(x, y + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Shape::Mesh(mesh)
}

/// Figure 1: balls by blending and by three screen doors, averaged over blocks of 16 by 16 pixels.
fn pictures() -> Result<Vec<NamedPicture>> {
    const SHOWN: u32 = 128;
    const BLOCK: u32 = 16;
    let mut scene = empty(true)?;
    let colours = [Vec4::new(0.9, 0.3, 0.15, 0.5), Vec4::new(0.2, 0.6, 0.25, 0.5)];
    let colours = colours.into_iter().chain([Vec4::new(0.2, 0.35, 0.9, 0.5)]);
    let material = scene.materials[0].clone();
    scene.materials = colours.map(|base| Material { base, ..material.clone() }).collect();
    let places =
        [Vec3::new(-0.5, -0.3, 0.0), Vec3::new(0.5, -0.3, -0.6), Vec3::new(0.0, 0.5, -1.2)];
    for (i, centre) in places.into_iter().enumerate() {
        scene.add("ball", ball(centre, 0.7, i));
    }
    let drawn = |door: Option<&str>, side: u32, samples: u32| -> Result<Picture> {
        let (width, height) = (side, side);
        let background = Some([0.9; 3]);
        let plain = straight_ahead(door)?;
        let options = CaptureOptions { width, height, samples, background, ..plain };
        let trace = Capture::new(&scene, &options)?.to_memory(|_, _| ())?;
        let exact = configure(REFERENCE, &[])?;
        Ok(exact.replay(&trace, samples, 0, &ReplayOptions::default())?.picture)
    };
    let mut pictures = vec![("screen-door-exact", drawn(None, SHOWN, 64)?)];
    let doors = [
        ("screen-door-stipple", "stipple"),
        ("screen-door-mask", "mask"),
        ("screen-door-points", "points"),
    ];
    for (name, door) in doors {
        pictures.push((name, averaged(&drawn(Some(door), SHOWN * BLOCK, 1)?, BLOCK)));
    }
    Ok(pictures)
}

fn straight_ahead(door: Option<&str>) -> Result<CaptureOptions> {
    Ok(CaptureOptions {
        width: SIDE,
        height: SIDE,
        samples: 1,
        camera: CameraOptions {
            angle: Some([0.0, 0.0]),
            field_of_view: Some(0.0),
            ..CameraOptions::default()
        },
        screen_door: door.map(ScreenDoor::parse).transpose()?,
        ..CaptureOptions::default()
    })
}

fn fragments(scene: &Scene, options: &CaptureOptions) -> Result<Vec<Fragment>> {
    let trace = Capture::new(scene, options)?.to_memory(|_, _| ())?;
    let mut all = Vec::new();
    for batch in trace.batches() {
        all.extend(batch?.iter());
    }
    Ok(all)
}

type Pixels = BTreeSet<(u16, u16)>;

fn pixels<'a>(fragments: impl IntoIterator<Item = &'a Fragment>) -> Pixels {
    fragments.into_iter().map(|f| (f.x, f.y)).collect()
}

/// The share of some pixels that are among others.
fn share(of: &Pixels, among: &Pixels) -> f64 {
    of.intersection(among).count() as f64 / of.len().max(1) as f64
}

/// The share of the pixels that a scene covers that a screen door makes opaque.
fn opacity(scene: &Scene, options: &CaptureOptions) -> Result<f64> {
    let plain = CaptureOptions { screen_door: None, ..options.clone() };
    Ok(share(&pixels(&fragments(scene, &plain)?), &pixels(&fragments(scene, options)?)))
}

/// The opacity of a ball by the angle of its surface.
fn of_ball(door: &str) -> Result<Vec<f64>> {
    let mut scene = empty(false)?;
    scene.add("ball", ball(Vec3::ZERO, 1.0, 0));
    let opaque = pixels(&fragments(&scene, &straight_ahead(Some(door))?)?);
    let all = pixels(&fragments(&scene, &straight_ahead(None)?)?);
    // The frame is centred on the ball, whose rim is where its pixels end.
    let middle = f64::from(SIDE) / 2.0;
    let from = |c: u16| f64::from(c) + 0.5 - middle;
    let radius = all.iter().map(|(x, _)| from(*x).abs()).fold(0.0, f64::max) + 0.5;
    let angle = |(x, y): &(u16, u16)| {
        let distance = libm::hypot(from(*x), from(*y)) / radius;
        libm::asin(distance.min(1.0)).to_degrees()
    };
    let bins = BINS.windows(2).map(|bin| {
        let own = all.iter().filter(|p| (bin[0]..bin[1]).contains(&angle(p))).copied().collect();
        share(&own, &opaque)
    });
    Ok(bins.collect())
}

/// Two squares together, over all seeds.
fn layers(door: &'static str) -> Result<Layers> {
    let mean = |angle: f64| -> Result<f64> {
        let scene = squares(&[0.0, angle], 1)?;
        let plain = fragments(&scene, &straight_ahead(None)?)?;
        let object = |object: u32| pixels(plain.iter().filter(|f| f.object == object));
        let both: Pixels = object(0).intersection(&object(1)).copied().collect();
        let mut sum = 0.0;
        for seed in 0..SEEDS {
            let options = straight_ahead(Some(&format!("{door}:seed={seed}")))?;
            sum += share(&both, &pixels(&fragments(&scene, &options)?));
        }
        Ok(sum / f64::from(SEEDS))
    };
    Ok(Layers { door, alike: mean(0.0)?, turned: mean(20.0)? })
}

/// Whether another order of triangles gives the same fragments.
fn is_ordered(door: &str) -> Result<bool> {
    let scene = scene::load("builtin:cloth")?;
    let sorted = |order: Order| -> Result<Vec<Fragment>> {
        let options = CaptureOptions {
            width: 96,
            height: 96,
            samples: 4,
            order,
            order_seed: 1,
            screen_door: Some(ScreenDoor::parse(door)?),
            ..CaptureOptions::default()
        };
        let mut all = fragments(&scene, &options)?;
        all.sort_by_key(|f| (f.primitive, f.y, f.x, f.depth.z.0, f.colour.map(f32::to_bits)));
        Ok(all)
    };
    Ok(sorted(Order::Api)? == sorted(Order::Random)?)
}

//! TressFX hair.

use glam::Vec3;
use screendoor::error::Error;
use screendoor::scene::{Scene, Shape, Strands};

use super::{folder, load_in, warned};

/// A file of strands that stand beside each other, each a little longer than the
/// last; `edit` changes the words of its header.
pub fn tfx(strands: u32, points: u32, edit: impl Fn(&mut [u32; 40])) -> Vec<u8> {
    let mut head = [0; 40];
    head[..4].copy_from_slice(&[4.0_f32.to_bits(), strands, points, 160]);
    edit(&mut head);
    let mut bytes: Vec<u8> = head.iter().flat_map(|w| w.to_le_bytes()).collect();
    for strand in 0..strands {
        for k in 0..points {
            let y = k as f32 * (1.0 + strand as f32 * 0.25);
            let point = [strand as f32, y, 0.0, f32::from(k > 1)];
            bytes.extend(point.iter().flat_map(|v| v.to_le_bytes()));
        }
    }
    bytes
}

fn load(bytes: &[u8]) -> Result<Scene, Error> {
    load_in(folder(&[("a.tfx", bytes)]).path(), "a.tfx")
}

fn strands(scene: &Scene) -> &Strands {
    match &scene.shapes[0] {
        Shape::Strands(strands) => strands,
        other => panic!("{other:?}"),
    }
}

#[test]
fn strands_are_read() {
    let scene = load(&tfx(3, 4, |_| ())).unwrap();
    let hair = strands(&scene);
    assert_eq!(hair.starts, [0, 4, 8, 12]);
    assert_eq!(hair.points[7], Vec3::new(1.0, 3.75, 0.0));
    // Thinner towards the tip, and the same for hair of any size.
    assert!(hair.radii[0] > hair.radii[3] && hair.radii[0] == hair.radii[4]);
    assert_eq!(scene.materials[0].base.w, 0.5);
    assert_eq!((scene.files.len(), scene.warnings.len()), (1, 0));

    // Behind the points comes what is not read.
    let mut bytes = tfx(3, 4, |head| (head[4], head[6]) = (352, 376));
    bytes.extend([0; 36]);
    warned(&load(&bytes).unwrap(), 1, &["thicknesses are not read"]);
}

#[test]
fn bad_hair_is_one_error() {
    let says = |bytes: &[u8], part: &str| {
        let error = load(bytes).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.tfx"), "{error}");
    };
    let good = tfx(3, 4, |_| ());
    says(&good[..100], "shorter than the header");
    says(&good[..good.len() - 1], "truncated");
    says(&tfx(3, 4, |head| head[0] = 3.0_f32.to_bits()), "TressFX version 3");
    says(&tfx(3, 4, |head| head[1] = 0), "0 strands");
    says(&tfx(3, 1, |_| ()), "3 strands of 1 points");
    says(&tfx(3, 4, |head| head[1] = u32::MAX), "are the most");
    says(&tfx(3, 4, |head| head[1] = 1 << 20), "needs");
    says(&tfx(3, 4, |head| head[3] = u32::MAX), "beyond its end");
    says(&tfx(3, 4, |head| head[3] = 4), "lie in its header");
    let mut bytes = good.clone();
    bytes[160..164].copy_from_slice(&f32::NAN.to_le_bytes());
    says(&bytes, "no finite place");
    says(&[&good[..160], &[0; 192]].concat(), "no finite length");
}

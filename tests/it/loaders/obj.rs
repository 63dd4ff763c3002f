//! OBJ with MTL, and textures.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use screendoor::error::Error;
use screendoor::scene::{AlphaMode, Scene};

use super::{TRIANGLE, folder, load_in, mesh, png, warned};

/// The scene of an OBJ file.
fn obj(text: impl AsRef<[u8]>) -> Result<Scene, Error> {
    load_in(folder(&[("a.obj", text.as_ref())]).path(), "a.obj")
}

/// The scene of a triangle of the material `m` that the MTL file defines.
fn with_mtl(mtl: impl AsRef<[u8]>) -> Scene {
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let folder = folder(&[("a.obj", text.as_bytes()), ("a.mtl", mtl.as_ref())]);
    load_in(folder.path(), "a.obj").unwrap()
}

#[test]
fn a_bad_mtl_statement_costs_only_itself() {
    let bad = [
        "Kd",
        "Kd 1 2",
        "Kd spectral f.rfl",
        "Kd -1 0 0",
        "Kd nan 0 0",
        "Ke",
        "Ke 1 2",
        "map_Kd",
        "map_d -s 1 1",
        "d",
        "d 2",
        "d -1",
        "d nan",
        "Tr 3",
        "newmtl",
    ];
    for statement in bad {
        let scene =
            with_mtl(format!("# made by hand\nnewmtl m\nd 0.25\nKd .1 .2 .3\n{statement}\n"));
        let material = &scene.materials[mesh(&scene, 0).material];
        assert_eq!(material.base, Vec4::new(0.1, 0.2, 0.3, 0.25), "{statement}");
        assert_eq!(material.alpha_mode, AlphaMode::Blend);
        warned(&scene, 1, &["a.mtl, line 5", &format!("('{statement}')")]);
    }
    // What is not drawn may say what it likes, and short colours are greys.
    let scene = with_mtl("newmtl m\nKa 1\nKs\nillum 99999999999\nNs x\nKd .5\nKe 1\nd -halo 0.5\n");
    let material = &scene.materials[0];
    assert_eq!((material.base, material.emissive), (Vec4::splat(0.5), Vec3::ONE));
    warned(&scene, 1, &["a.mtl, line 8", "halo"]);
    let scene = with_mtl("\u{feff}newmtl m\r\nTr 0.75\r\nKd 1 \\\r\n 0 0\r\n");
    assert_eq!(scene.materials[0].base, Vec4::new(1.0, 0.0, 0.0, 0.25));
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn mtl_files_are_found_or_named() {
    let text = format!(
        "mtllib a.mtl b.mtl\nmtllib gone.mtl\nmtllib c d.mtl\n{TRIANGLE}\
         usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl d #2\nf 1 2 3\n"
    );
    let files: [(&str, &[u8]); 4] = [
        ("a.obj", text.as_bytes()),
        ("a.mtl", b"newmtl a\nKd 1 0 0\n"),
        ("b.mtl", b"newmtl b\nKd 0 1 0\n"),
        ("c d.mtl", b"newmtl d #2\nKd 0 0 1\n"),
    ];
    let scene = load_in(folder(&files).path(), "a.obj").unwrap();
    let base = |i| scene.materials[mesh(&scene, i).material].base.truncate();
    assert_eq!([base(0), base(1), base(2)], [Vec3::X, Vec3::Y, Vec3::Z]);
    warned(&scene, 1, &["cannot read", "gone.mtl"]);

    let scene = obj(format!("{TRIANGLE}usemtl zzz\nf 1 2 3\n")).unwrap();
    warned(&scene, 1, &["a.obj, line 4", "'zzz'"]);
}

#[test]
fn files_of_ordinary_exporters_are_read() {
    let plain = obj(format!("{TRIANGLE}f 1 2 3\n")).unwrap();
    let same: [&[u8]; 8] = [
        b"# Sch\xf6n\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"v 0 0 0 # origin\nv 1 0 0 #1\nv 0 1 0\nf 1 2 3 # all\n",
        b"v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\r\n 2 \\  \n 3\n",
        b"# in C:\\models\\\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3",
        b"v 0 0 0 2\nv 2 0 0 2\nv 0 1 0 1\nf -3 -2 -1\n",
        b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3/3\n",
    ];
    for (i, text) in same.into_iter().enumerate() {
        let scene = obj(text).unwrap_or_else(|e| panic!("{i}: {e}"));
        let (a, b) = (mesh(&scene, 0), mesh(&plain, 0));
        assert_eq!((&a.positions, &a.triangles), (&b.positions, &b.triangles), "{i}");
        assert!(a.normals.is_empty() && a.uvs.is_empty() && a.colours.is_empty());
        assert_eq!(scene.warnings, [""; 0]);
    }
    let scene = obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\no Kn\xf6pfe\nf 1 2 3\n").unwrap();
    assert_eq!(scene.objects[0].name, "Kn\u{f6}pfe");
    // Points are not polygons.
    let scene = obj(format!("{TRIANGLE}p 1\nf 1 2\nf 1 2 3\n")).unwrap();
    assert_eq!(scene.primitive_count(), 1);
    warned(&scene, 1, &["2 points, lines of one and faces of fewer"]);
    // Colours of some vertices, whichever.
    let scene = obj("v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0 0 0 1\nv 9 9 9\nf 1 2 3\n").unwrap();
    let colours: Vec<Vec3> = mesh(&scene, 0).colours.iter().map(|c| c.truncate()).collect();
    assert_eq!(colours, [Vec3::ONE, Vec3::X, Vec3::Z]);
    warned(&scene, 1, &["2 of 4 vertices have no colour"]);
}

#[test]
fn corners_without_texture_coordinates_or_normals_are_filled_in() {
    let text = format!(
        "{TRIANGLE}v 1 1 0\nv 0 0 -1\nvt 0.25 0.75\nvn 1 0 0\n\
         f 1/1/1 2/1/1 3/1/1\nf 2 4 3\nf 1//1 2/1 5\n"
    );
    let scene = obj(text).unwrap();
    let mesh = mesh(&scene, 0);
    let corners = |t: usize| mesh.triangles[t].map(|i| i as usize);
    let count = mesh.positions.len();
    assert_eq!((mesh.uvs.len(), mesh.normals.len()), (count, count));
    assert_eq!(corners(0).map(|i| mesh.uvs[i]), [Vec2::new(0.25, 0.25); 3]);
    assert_eq!(corners(0).map(|i| mesh.normals[i]), [Vec3::X; 3]);
    assert_eq!(corners(1).map(|i| mesh.uvs[i]), [Vec2::new(0.0, 1.0); 3]);
    assert_eq!(corners(1).map(|i| mesh.normals[i]), [Vec3::Z; 3]);
    assert_eq!(corners(2).map(|i| mesh.normals[i]), [Vec3::X, Vec3::Y, Vec3::Y]);
    assert_eq!(corners(2).map(|i| mesh.uvs[i].x), [0.0, 0.25, 0.0]);
    assert_eq!(corners(2).map(|i| mesh.positions[i]), [Vec3::ZERO, Vec3::X, Vec3::NEG_Z]);
}

#[test]
fn attributes_that_are_no_numbers_count_as_none() {
    let scene = obj(format!("{TRIANGLE}vt inf 0\nvn nan nan nan\nf 1/1/1 2/1/1 3/1/1\n")).unwrap();
    let mesh = mesh(&scene, 0);
    assert!(mesh.normals.is_empty() && mesh.uvs.is_empty());
    assert!(obj(format!("{TRIANGLE}vn 0 x 1\nf 1 2 3\n")).is_err());
}

#[test]
fn attributes_may_come_after_their_corners() {
    let scene = obj(format!("{TRIANGLE}f 1/1 2/1 3/1\nvt 0.5 0.25\n")).unwrap();
    assert_eq!(
        (&mesh(&scene, 0).uvs[..], scene.warnings.len()),
        (&[Vec2::new(0.5, 0.75); 3][..], 0)
    );
    // Where there are none at all, nothing is missed.
    assert!(obj(format!("{TRIANGLE}f 1/1 2/1 3/1\n")).unwrap().warnings.is_empty());
}

#[test]
fn keywords_of_mtl_have_no_case() {
    let scene = with_mtl("NEWMTL other\nKD 1 0 0\nNewmtl m\nkd 0 1 0\nD 0.5\n");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let materials = scene.materials.iter().map(|m| (&*m.name, m.base));
    let expected = [("other", Vec4::new(1.0, 0.0, 0.0, 1.0)), ("m", Vec4::new(0.0, 1.0, 0.0, 0.5))];
    assert_eq!(materials.take(2).collect::<Vec<_>>(), expected);
}

#[test]
fn alpha_maps_are_linear() {
    let grey8 = png(image::GrayImage::from_pixel(2, 2, image::Luma([128])));
    let rgb8 = png(image::RgbImage::from_pixel(2, 2, image::Rgb([128; 3])));
    let grey16 =
        png(image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(2, 2, image::Luma([0x8080])));
    let rgb16 =
        png(image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(2, 2, image::Rgb([0x8080; 3])));
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    for mask in [grey8, rgb8, grey16, rgb16] {
        let mtl = b"newmtl m\nmap_Kd b.png\nmap_d a.png\n";
        let files: [(&str, &[u8]); 4] =
            [("a.obj", text.as_bytes()), ("a.mtl", mtl), ("a.png", &mask), ("b.png", &mask)];
        let scene = load_in(folder(&files).path(), "a.obj").unwrap();
        let material = &scene.materials[0];
        let texel = |t: screendoor::scene::TextureUse| {
            scene.textures[t.texture].sample(Vec2::splat(0.5), Vec2::ZERO, Vec2::ZERO).x
        };
        let (colour, alpha) = (material.base_texture.unwrap(), material.alpha_texture.unwrap());
        assert!((texel(alpha) - 128.0 / 255.0).abs() < 1e-4, "{}", texel(alpha));
        assert!((texel(colour) - 0.2159).abs() < 1e-4, "{}", texel(colour));
    }
}

#[test]
fn textures_have_a_limit() {
    let large = png(image::GrayImage::new(8193, 8192));
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let files: [(&str, &[u8]); 3] =
        [("a.obj", text.as_bytes()), ("a.mtl", b"newmtl m\nmap_Kd a.png\n"), ("a.png", &large)];
    let folder = folder(&files);
    let mut scene = load_in(folder.path(), "a.obj").unwrap();
    warned(&scene, 1, &["a.png", "8193 x 8192 texels", "67108864"]);
    let error = scene.apply_texture(&folder.path().join("a.png")).unwrap_err().to_string();
    assert!(error.contains("67108864"), "{error}");
}

#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    use screendoor::scene::{LoadOptions, load_with};
    let text = format!("mtllib /dev/zero\nmtllib a.mtl\n{TRIANGLE}f 1 2 3\n");
    let mtl = b"newmtl m\nmap_Kd /dev/zero\n";
    let here = folder(&[("a.obj", text.as_bytes()), ("a.mtl", mtl)]);
    let mut scene = load_in(here.path(), "a.obj").unwrap();
    warned(&scene, 2, &["its materials: '/dev/zero': it leads out of the scene's folder"]);
    // Nor where it is allowed.
    let source = here.path().join("a.obj").display().to_string();
    let allowed =
        load_with(&source, &LoadOptions { allow_outside: true, ..LoadOptions::default() }).unwrap();
    warned(&allowed, 2, &["its materials: cannot read /dev/zero: it is no regular file"]);
    let error = scene.apply_texture(Path::new("/dev/zero")).unwrap_err().to_string();
    assert_eq!(error, "cannot read /dev/zero: it is no regular file: name one");

    let folder = folder(&[]);
    for name in ["a.obj", "a.gltf"] {
        // A pipe: opening it would wait for its other end.
        let path = folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        let error = load_in(folder.path(), name).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("no regular file"), "{error}");
    }
}

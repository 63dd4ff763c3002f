//! The tables of `docs/SCENES.md`, row by row: each has a file here that does what it says.

use std::collections::BTreeMap;
use std::fmt::Write;

use glam::{DVec3, Vec2, Vec3, Vec4};
use image::ImageFormat;
use screendoor::error::Error;
use screendoor::scene::{Scene, Shape};

use super::hair::{self, stl};
use super::inputs::at;
use super::pictures::{encoded, with_packed};
use super::splats::{self, splats};
use super::tfx::tfx;
use super::vdb::Written;
use super::{TRIANGLE, folder, load_in, mesh, particles, png};

const DOCUMENT: &str = include_str!("../../../docs/SCENES.md");

/// The files of a case; the first is the scene.
type Files = Vec<(&'static str, Vec<u8>)>;

/// What a row's file does.
enum Does {
    /// It loads without a warning, and is as it should be.
    Shows(Files, fn(&Scene)),
    /// It loads without a warning as the second scene does.
    Like(Files, Files),
    /// Its one warning, or its error, has these words.
    Says(Files, &'static str),
}
use Does::{Like, Says, Shows};

struct Case {
    section: &'static str,
    feature: &'static str,
    does: Does,
}

/// Rows by section and feature: what becomes of them.
fn rows() -> BTreeMap<(String, String), String> {
    let mut rows = BTreeMap::new();
    let mut section = "";
    for line in DOCUMENT.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            section = title;
        }
        let Some(cells) = line.strip_prefix('|') else { continue };
        let cells: Vec<&str> = cells.split('|').map(str::trim).collect();
        let [feature, is, ..] = cells[..] else { panic!("{line}") };
        if feature != "feature" && !feature.starts_with("---") {
            let key = (section.to_string(), feature.to_string());
            assert!(rows.insert(key, is.to_string()).is_none(), "twice: {line}");
        }
    }
    rows
}

fn load(files: &Files) -> Result<Scene, Error> {
    let written: Vec<(&str, &[u8])> = files.iter().map(|(name, b)| (*name, &b[..])).collect();
    load_in(folder(&written).path(), files[0].0)
}

/// What is drawn of a scene.
fn drawn(scene: &Scene) -> String {
    format!("{:?} {:?} {:?}", scene.objects, scene.shapes, scene.materials)
}

#[test]
fn every_row_is_kept() {
    let mut rows = rows();
    assert!(rows.len() > 70, "{}", rows.len());
    for Case { section, feature, does } in cases() {
        let is = rows.remove(&(section.to_string(), feature.to_string()));
        let is = is.unwrap_or_else(|| panic!("no row '{feature}' in '{section}'"));
        let place = format!("{section}, {feature}");
        match (&*is, does) {
            ("read" | "approximated", Shows(files, check)) => {
                let scene = load(&files).unwrap_or_else(|e| panic!("{place}: {e}"));
                assert_eq!(scene.warnings, [""; 0], "{place}");
                check(&scene);
            }
            ("passed", Like(files, others)) => {
                let [scene, other] = [files, others].map(|f| load(&f).unwrap());
                assert_eq!(scene.warnings, [""; 0], "{place}");
                assert_eq!(drawn(&scene), drawn(&other), "{place}");
            }
            ("warned of", Says(files, words)) => {
                let scene = load(&files).unwrap_or_else(|e| panic!("{place}: {e}"));
                let [warning] = &scene.warnings[..] else {
                    panic!("{place}: {:?}", scene.warnings)
                };
                assert!(warning.contains(words), "{place}: {warning}");
            }
            ("refused", Says(files, words)) => {
                let error = load(&files).expect_err(&place).to_string();
                assert!(error.contains(words), "{place}: {error}");
            }
            (is, _) => panic!("{place} is '{is}', and its case is for something else"),
        }
    }
    assert!(rows.is_empty(), "rows without a case: {:?}", rows.keys());
}

fn cases() -> Vec<Case> {
    [obj_cases(), mtl_cases(), texture_cases(), other_cases()].into_iter().flatten().collect()
}

fn obj(text: impl AsRef<[u8]>) -> Files {
    vec![("a.obj", text.as_ref().to_vec())]
}

/// The triangle and its one face, with something before.
fn after(text: &str) -> Files {
    obj(format!("{text}\n{TRIANGLE}f 1 2 3\n"))
}

fn area(scene: &Scene) -> f32 {
    let mesh = mesh(scene, 0);
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    mesh.triangles.iter().map(of).sum()
}

/// A polygon that zigzags as a saw of that many corners.
fn saw(corners: usize) -> String {
    let mut text = format!("v {corners} -1 0\nv 0 -1 0\n");
    (2..corners).for_each(|i| writeln!(text, "v {i} {} 0", i % 2).unwrap());
    text + "f" + &(1..=corners).map(|i| format!(" {i}")).collect::<String>() + "\n"
}

/// A convex polygon: corners on a parabola.
fn round(corners: usize) -> String {
    let mut text = String::new();
    (0..corners).for_each(|i| writeln!(text, "v {i} {} 0", i * i).unwrap());
    text + "f" + &(1..=corners).map(|i| format!(" {i}")).collect::<String>() + "\n"
}

fn obj_cases() -> Vec<Case> {
    let case = |feature, does| Case { section: "OBJ", feature, does };
    let one = |scene: &Scene| assert_eq!((scene.primitive_count(), area(scene)), (1, 0.5));
    let coloured = |a: &str| obj(format!("v 0 0 0 {a}\nv 1 0 0 {a}\nv 0 1 0 {a}\nf 1 2 3\n"));
    let utf16: Vec<u8> =
        format!("\u{feff}{TRIANGLE}f 1 2 3\n").encode_utf16().flat_map(u16::to_be_bytes).collect();
    let surface = "cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 3\nend";
    vec![
        case(
            "`v x y z`",
            Shows(obj("v 5e6 9 0\nv 5000000.125 9 0\nv 5e6 9.125 0\nf 1 2 3\n"), |scene| {
                let size = mesh(scene, 0).positions.iter().map(|p| p.abs().max_element());
                assert!(size.fold(0.0, f32::max) == 0.0625);
                let at = scene.objects[0].place.transform_point3(DVec3::splat(-0.0625));
                assert_eq!(at.truncate(), glam::DVec2::new(5e6, 9.0));
            }),
        ),
        case("`v x y z w`", Shows(obj("v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 2\nf 1 2 3\n"), one)),
        case(
            "`v x y z r g b`",
            Shows(coloured("1 0.5 0"), |scene| {
                let [r, g, b, a] = mesh(scene, 0).colours[0].to_array();
                assert!((r, b, a) == (1.0, 0.0, 1.0) && (g - 0.214).abs() < 1e-3, "{g}");
            }),
        ),
        case(
            "`v x y z r g b a`",
            Shows(coloured("1 1 1 0.5"), |scene| assert_eq!(at(scene, 12, 20)[3], 0.5)),
        ),
        case(
            "colours of some vertices",
            Says(
                obj("v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                "2 of 3 vertices have no colour",
            ),
        ),
        case(
            "vertex colours above 2",
            Says(coloured("255 0 0"), "up to 255; they are taken as 0 to 255"),
        ),
        case("vertex colours above 1", Says(coloured("1.5 0 0"), "up to 1.5; they are cut off")),
        case("a vertex at no finite place", Says(after("v 1 nan 0"), "line 1 ('v 1 nan 0')")),
        case(
            "`vt u v w`",
            Shows(obj(format!("vt 0.25 0.5 9\nvt 0.5\n{TRIANGLE}f 1/1 2/1 3/2\n")), |scene| {
                let uvs = &mesh(scene, 0).uvs;
                assert_eq!((uvs[0], uvs[2]), (Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0)));
            }),
        ),
        case(
            "`vn x y z`",
            Shows(obj(format!("vn 0 1 0\n{TRIANGLE}f 1//1 2//1 3//1\n")), |scene| {
                assert_eq!(mesh(scene, 0).normals, [Vec3::Y; 3]);
            }),
        ),
        case(
            "a normal or texture coordinate that is no number (`-nan(ind)`)",
            Shows(
                obj(format!(
                    "vn -nan(ind) 0 1\nvn 1.#QNAN 0 0\nvt nan 0\n{TRIANGLE}f 1/1/1 2/1/2 3/1/1\n"
                )),
                |scene| assert!(mesh(scene, 0).normals.is_empty() && mesh(scene, 0).uvs.is_empty()),
            ),
        ),
        case(
            "`f v/vt/vn`",
            Shows(obj(format!("f 1 2 3\n{TRIANGLE}f -3 -2 -1\n")), |scene| {
                assert_eq!((scene.primitive_count(), area(scene)), (2, 1.0));
            }),
        ),
        case(
            "a corner without a normal (`f 1//0`, `f 1`)",
            Shows(obj(format!("vn 1 0 0\n{TRIANGLE}f 1//1 2//0 3\n")), |scene| {
                let normals = &mesh(scene, 0).normals;
                assert!(normals.contains(&Vec3::X) && normals.contains(&Vec3::Z));
            }),
        ),
        case(
            "a corner without a texture coordinate",
            Shows(obj(format!("vt 0.5 0.5\n{TRIANGLE}f 1/1 2 3\n")), |scene| {
                assert!(mesh(scene, 0).uvs.contains(&Vec2::new(0.0, 1.0)));
            }),
        ),
        case(
            "a corner that names what is not there",
            Says(after("vn 0 0 1\nf 1//2 2//1 3//1"), "line 2 ('f 1//2 2//1 3//1'): normal 2"),
        ),
        case(
            "a concave polygon",
            Shows(obj("v 0 0 0\nv 2 1 0\nv 0 2 0\nv 0.5 1 0\nf 1 2 3 4\n"), |scene| {
                assert_eq!((scene.primitive_count(), area(scene)), (2, 1.5));
            }),
        ),
        case(
            "a hole that a bridge joins to the outline",
            Shows(
                obj("v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\n\
                     f 1 2 3 4 1 5 6 7 8 5\n"),
                |scene| assert!((area(scene) - 8.0).abs() < 1e-5),
            ),
        ),
        case(
            "a polygon that crosses itself",
            Shows(
                obj("v 0 0 0 1 0 0\nv 2 2 0 0 0 1\nv 2 0 0 0 0 1\nv 0 2 0 1 0 0\nf 1 2 3 4\n"),
                |scene| {
                    assert!((area(scene) - 2.0).abs() < 1e-5);
                    // Where it crosses is a vertex half way between.
                    let mesh = mesh(scene, 0);
                    let middle = mesh.positions.iter().position(|p| *p == Vec3::new(1.0, 1.0, 0.0));
                    let colour = mesh.colours[middle.unwrap()];
                    assert!((colour - Vec4::new(0.5, 0.0, 0.5, 1.0)).length() < 1e-5, "{colour}");
                },
            ),
        ),
        case(
            "a polygon that is not plane",
            Shows(obj("v 0 0 0\nv 2 1 0.25\nv 0 2 0\nv 0.5 1 0.25\nf 1 2 3 4\n"), |scene| {
                assert_eq!(scene.primitive_count(), 2);
                assert_eq!(mesh(scene, 0).positions.iter().filter(|p| p.z == 0.25).count(), 2);
            }),
        ),
        case(
            "a polygon of more than 65536 corners",
            Shows(obj(round(70_000)), |scene| assert_eq!(scene.primitive_count(), 69_998)),
        ),
        case(
            "a polygon of more than 65536 corners that is no such fan",
            Says(obj(saw(70_000)), "line 70001: a face of 70000 corners"),
        ),
        case(
            "`o`, `g`",
            Shows(
                obj(format!("o a\n{TRIANGLE}f 1 2 3\ng b c\nf 1 2 3\nf 1 2 3\no d\n")),
                |scene| {
                    let names: Vec<&str> = scene.objects.iter().map(|o| &*o.name).collect();
                    assert_eq!(names, ["a", "b c"]);
                },
            ),
        ),
        case("`usemtl`", Shows(mtl("Kd 1 0 0"), red)),
        case(
            "`usemtl` in another case",
            Says(with_mtl("newmtl M\nKd 1 0 0\n"), "spelt otherwise in the MTL file: m in line 5"),
        ),
        case("`usemtl` of what no file defines", Says(after("usemtl zzz"), "'zzz'")),
        case(
            "`mtllib` with several files",
            Shows(
                vec![
                    (
                        "a.obj",
                        format!(
                            "mtllib c.mtl a b.mtl\nmtllib a b.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n"
                        )
                        .into(),
                    ),
                    ("c.mtl", b"newmtl n\n".to_vec()),
                    ("a", b"newmtl o\n".to_vec()),
                    ("b.mtl", b"newmtl p\n".to_vec()),
                    ("a b.mtl", b"newmtl m\nKd 1 0 0\n".to_vec()),
                ],
                |scene| {
                    assert_eq!(scene.materials.len(), 5);
                    red(scene);
                },
            ),
        ),
        case("`mtllib` of a file that is not there", Says(after("mtllib gone.mtl"), "gone.mtl")),
        case("`mtllib` out of the folder", Says(after("mtllib ../../a.mtl"), "leads out")),
        case(
            "`s` with normals",
            Like(
                obj(format!("s 1\nvn 0 1 0\n{TRIANGLE}f 1//1 2//1 3//1\n")),
                obj(format!("vn 0 1 0\n{TRIANGLE}f 1//1 2//1 3//1\n")),
            ),
        ),
        case("`s` without normals", Says(after("s 1"), "1 faces of smoothing groups lack normals")),
        case("`l` beside faces", Says(after("l 1 2 3"), "2 lines beside surfaces are not drawn")),
        case(
            "`l` without faces",
            Says(obj(format!("{TRIANGLE}l 1 2 3\n")), "how wide its 2 lines are"),
        ),
        case(
            "`p`, lines of one point, faces of two corners",
            Says(
                obj(format!("{TRIANGLE}p 1\nl 2\nf 1 2\nf 1 2 3\n")),
                "3 points, lines of one and faces of fewer than three corners are not drawn",
            ),
        ),
        case(
            "`curv`, `curv2`, `surf` and what belongs to them",
            Says(
                after(surface),
                "curves and surfaces are not drawn (cstype in line 1, deg in line 2, surf in line 3",
            ),
        ),
        case(
            "other statements (`bevel`, `lod`, `usemap`, `call` …)",
            Says(
                after("bevel on\nlod 3\nbevel off\ncall b.obj"),
                "bevel 2 times from line 1 on, lod in line 2, call in line 4",
            ),
        ),
        case(
            "lines that end in a backslash",
            Shows(obj("v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 3\n"), one),
        ),
        case(
            "old line ends (a carriage return alone)",
            Shows(obj("# old\rv 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3"), one),
        ),
        case("UTF-16, with or without a byte order mark", Shows(obj(&utf16[2..]), one)),
        case(
            "Latin-1",
            Shows(obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\no Kn\xf6pfe\nf 1 2 3\n"), |scene| {
                assert_eq!(scene.objects[0].name, "Kn\u{f6}pfe");
            }),
        ),
    ]
}

fn with_mtl(text: &str) -> Files {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nvt 0.5 0.5\nf 1/1 2/1 3/1\n");
    vec![("a.obj", obj.into()), ("a.mtl", text.into())]
}

/// The triangle of a material with these statements.
fn mtl(statements: &str) -> Files {
    with_mtl(&format!("newmtl m\n{statements}\n"))
}

fn and(mut files: Files, name: &'static str, bytes: Vec<u8>) -> Files {
    files.push((name, bytes));
    files
}

/// With a picture `a.png` of one texel.
fn and_texel(statements: &str, texel: [u8; 4]) -> Files {
    let image = image::RgbaImage::from_pixel(1, 1, image::Rgba(texel));
    and(mtl(statements), "a.png", png(image))
}

fn red(scene: &Scene) {
    assert_eq!(scene.materials[mesh(scene, 0).material].base, Vec4::new(1.0, 0.0, 0.0, 1.0));
}

/// The colour and alpha of the triangle, lit white being 0.6559.
fn seen(scene: &Scene) -> [f32; 4] {
    at(scene, 12, 20)
}

fn near(found: f32, wanted: f32) {
    assert!((found - wanted).abs() < 2e-3, "{found} and not {wanted}");
}

/// A picture whose left half is black and whose right half is white.
fn halves() -> Vec<u8> {
    let white = |x, _| image::Rgb([if x < 4 { 0 } else { 255 }; 3]);
    png(image::RgbImage::from_fn(8, 8, white))
}

fn mtl_cases() -> Vec<Case> {
    const LIT: f32 = 0.6559;
    let case = |feature, does| Case { section: "MTL", feature, does };
    vec![
        case("`Kd r g b`", Shows(mtl("Kd 0.5 0 0"), |scene| near(seen(scene)[0], 0.5 * LIT))),
        case(
            "`Kd 0 0 0` with `map_Kd`",
            Says(and_texel("Kd 0 0 0\nmap_Kd a.png", [255; 4]), "a.mtl, line 2 ('Kd 0 0 0')"),
        ),
        case("`Kd spectral`, `Kd xyz`", Says(mtl("Kd spectral f.rfl"), "a.mtl, line 2")),
        case("`d`", Shows(mtl("Tr 0.1\nd 0.25"), |scene| near(seen(scene)[3], 0.25))),
        case("`d -halo`", Says(mtl("d -halo 0.5"), "the halo is ignored")),
        case("`Tr`", Shows(mtl("Tr 0.25"), |scene| near(seen(scene)[3], 0.75))),
        case(
            "a material in use that is wholly transparent",
            Says(
                with_mtl("newmtl n\nTr 1\nnewmtl m\nTr 1\n"),
                "a.mtl, line 4 ('Tr 1') says so of 'm'",
            ),
        ),
        case("`Ke`", Shows(mtl("Kd 0 0 0\nKe 0.5 0 0"), |scene| near(seen(scene)[0], 0.5))),
        case(
            "`map_Kd`",
            Shows(and_texel("Kd 0.5 1 1\nmap_Kd a.png", [255, 188, 0, 255]), |scene| {
                let [r, g, b, _] = seen(scene);
                near(r, 0.5 * LIT);
                near(g, 0.503 * LIT);
                near(b, 0.0);
            }),
        ),
        case(
            "alpha of `map_Kd`",
            Shows(and_texel("d 0.5\nmap_Kd a.png\nmap_d a.png", [255, 255, 255, 51]), |scene| {
                near(seen(scene)[3], 0.1);
            }),
        ),
        case(
            "`map_d` with an alpha below 1",
            Shows(
                and(
                    and_texel("map_Kd b.png\nmap_d a.png", [0, 0, 0, 51]),
                    "b.png",
                    png(image::RgbaImage::from_pixel(1, 1, image::Rgba([255, 255, 255, 102]))),
                ),
                // The alpha of the other texture does not count twice.
                |scene| near(seen(scene)[3], 0.2),
            ),
        ),
        case(
            "`map_d` without",
            Shows(and_texel("map_d a.png", [255, 0, 0, 255]), |scene| near(seen(scene)[3], 0.2126)),
        ),
        case(
            "`map_Ke`",
            Shows(and_texel("Kd 0 0 0\nKe 0.5 0.5 0.5\nmap_Ke a.png", [255, 0, 0, 51]), |scene| {
                let [r, g, ..] = seen(scene);
                near(r, 0.5);
                near(g, 0.0);
            }),
        ),
        case(
            "`-s`, `-o`",
            Shows(and(mtl("map_Kd -s 0.25 1 1 -o 0.75 0 0 a.png"), "a.png", halves()), |scene| {
                near(seen(scene)[0], LIT);
                let transform = scene.materials[0].base_texture.unwrap().transform;
                assert_eq!(transform.transform_point2(Vec2::new(0.5, 0.5)), Vec2::new(0.875, 0.5));
            }),
        ),
        case(
            "`-clamp on`",
            Shows(and(mtl("map_Kd -clamp on -o 1 0 0 a.png"), "a.png", halves()), |scene| {
                near(seen(scene)[0], LIT);
            }),
        ),
        case(
            "`-imfchan r`, `g`, `b`, `m`, `l` of `map_d`",
            Shows(and_texel("map_d -imfchan g a.png", [0, 102, 0, 51]), |scene| {
                near(seen(scene)[3], 0.4)
            }),
        ),
        case(
            "`-t`, `-mm`, `-bm`, `-blendu` and other options",
            Says(
                and_texel("map_Kd -mm 0 2 -t 1 1 1 a.png", [255; 4]),
                "options of maps that are not applied: -mm in line 2, -t in line 2",
            ),
        ),
        case(
            "names with quotes, backslashes or another machine's path",
            Says(
                and_texel("map_Kd \"C:\\work\\a.png\"\nmap_Ke \".\\a.png\"", [255; 4]),
                "'a.png' in it is used",
            ),
        ),
        case(
            "a texture that is not there, or cannot be read",
            Says(mtl("map_Kd gone.png"), "gone.png"),
        ),
        case("a texture that is a folder", Says(mtl("map_Kd ."), "it is a folder")),
        case(
            "`Ka`, `Ks`, `Ns`, `Ni`, `illum`, `sharpness`, `refl` and their maps",
            Like(
                mtl(
                    "Ka 1 0 0\nKs 1 1 1\nNs 9\nNi 1.5\nillum 4\nsharpness 9\nrefl a.png\nmap_Ka b.png\nmap_Ks b.png\nmap_Ns b.png",
                ),
                mtl(""),
            ),
        ),
        case(
            "`Pr`, `Pm`, `Ps`, `Pc`, `aniso` and their maps",
            Like(
                mtl("Pr 1\nPm 1\nPs 1\nPc 1\nPcr 1\naniso 1\nmap_Pr a.png\nmap_Pm a.png"),
                mtl(""),
            ),
        ),
        case("`Tf`", Says(mtl("Tf 1 1 1\nTf 1 0 0"), "not read: Tf in line 3")),
        case(
            "`bump`, `map_bump`, `norm`, `disp`, `decal` and what is not known",
            Says(
                mtl("map_Bump a.png\nnorm a.png\nzzz 1"),
                "map_Bump in line 2, norm in line 3, zzz in line 4",
            ),
        ),
        case(
            "a statement that cannot be read",
            Says(mtl("Kd 1 0 x"), "a.mtl, line 2 ('Kd 1 0 x')"),
        ),
        case(
            "a statement before the first `newmtl`",
            Says(
                with_mtl("Kd 1 0 0\nnewmtl m\n"),
                "1 statements from line 1 on belong to no material",
            ),
        ),
        case(
            "a file without `newmtl`",
            Says(
                vec![
                    ("a.obj", format!("mtllib a.mtl\n{TRIANGLE}f 1 2 3\n").into()),
                    ("a.mtl", b"Kd 1 0 0\n".to_vec()),
                ],
                "it defines no material",
            ),
        ),
    ]
}

fn texture_cases() -> Vec<Case> {
    let case = |feature, does| Case { section: "Textures", feature, does };
    let named = |name: &'static str, bytes| and(mtl(&format!("map_Kd {name}")), name, bytes);
    let mut five =
        mtl("map_Kd a.png\nmap_d b.webp\nmap_Ke c.bmp\nnewmtl n\nmap_Kd d.tga\nmap_d e.jpg");
    for (name, format) in [
        ("a.png", ImageFormat::Png),
        ("b.webp", ImageFormat::WebP),
        ("c.bmp", ImageFormat::Bmp),
        ("d.tga", ImageFormat::Tga),
        ("e.jpg", ImageFormat::Jpeg),
    ] {
        five.push((name, encoded(format, [255; 4])));
    }
    let mut claims = encoded(ImageFormat::Bmp, [255; 4]);
    claims[18..26].copy_from_slice(&[9999_u32.to_le_bytes(), 9_u32.to_le_bytes()].concat());
    let plain = png(image::RgbaImage::from_pixel(2, 2, image::Rgba([9, 9, 9, 99])));
    vec![
        case(
            "PNG, JPEG, WebP, BMP, TGA",
            Shows(five, |scene| {
                assert_eq!(scene.textures.len(), 5);
                near(seen(scene)[0], 1.6559);
            }),
        ),
        case(
            "colour profiles and texts in PNG",
            Like(named("a.png", with_packed(b"iCCP", b"p\0\0", 1 << 20)), named("a.png", plain)),
        ),
        case(
            "other formats (DDS, KTX, PSD, GIF, TIFF, EXR …)",
            Says(named("a.dds", b"DDS \x7c\0\0\0".to_vec()), "it is a DDS"),
        ),
        case(
            "more than 16384 texels on a side, or 2^26 in all",
            Says(named("a.png", png(image::GrayImage::new(16385, 1))), "16385 x 1 texels"),
        ),
        case(
            "more texels than the file can hold",
            Says(named("a.bmp", claims), "bytes hold no 9999 x 9"),
        ),
    ]
}

fn other_cases() -> Vec<Case> {
    let ply = |feature, does| Case { section: "PLY", feature, does };
    let tressfx = |feature, does| Case { section: "TressFX", feature, does };
    let vdb = |feature, does| Case { section: "OpenVDB", feature, does };
    let file = |name: &'static str, bytes: Vec<u8>| -> Files { vec![(name, bytes)] };
    let written = |written: Written| file("a.vdb", written.bytes());
    let splat = |feature, does| Case { section: "Splats", feature, does };
    let of_stl = |feature, does| Case { section: "STL", feature, does };
    let of_hair = |feature, does| Case { section: "Hair", feature, does };
    let mut single = hair::hair(3, |_| ());
    single[128..132].copy_from_slice(&[3, 0, 0, 0]);
    let edited = |from: &str, to: &str| file("a.ply", splats::MESH.replace(from, to).into());
    let trained = |from: &str, to: &str| {
        let text = String::from_utf8(splats::trained("ascii")).unwrap().replace(from, to);
        file("a.ply", text.into_bytes())
    };
    // A triangle whose corners have these normals along x, or none.
    let with_normal = |x: &str| {
        let names = if x.is_empty() {
            ""
        } else {
            "property float nx\nproperty float ny\nproperty float nz\n"
        };
        let row = if x.is_empty() { String::new() } else { format!(" {x} 0 1") };
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{names}element face 1\nproperty list uchar int vertex_index\n\
             end_header\n0 0 0{row}\n1 0 0{row}\n0 1 0{row}\n3 0 1 2\n"
        );
        file("a.ply", text.into_bytes())
    };
    let raw = [&b"NGSP\x02\0\0\0\x01\0\0\0\0\x0c\0\0"[..], &[0; 19]].concat();
    let thick = |word: usize| {
        let mut bytes = tfx(3, 4, |head| head[word] = 352);
        bytes.extend([0; 36]);
        file("a.tfx", bytes)
    };
    let narrow = [&[2.0, 3.0, 4.0], &[0.0; 12][..]].concat();
    let half = Written { packing: 6, half: true, ..super::vdb::full() };
    let [level_set, unnamed] = super::vdb::level_sets();
    let fog = Written { name: "smoke", ..Written::default() };
    vec![
        ply(
            "compressed Gaussian splats (PlayCanvas)",
            Shows(file("a.ply", splats(&[splats::SPLAT; 3])), |scene| {
                assert_eq!(splats::found(scene).means.len(), 3);
            }),
        ),
        ply(
            "text, bytes in either order",
            Shows(trained("NaN", "1"), |scene| {
                let same = load(&vec![("a.ply", splats::trained("binary_big_endian"))]).unwrap();
                let [one, other] = [scene, &same].map(splats::found);
                assert_eq!((one.means[0], one.degree), (other.means[0], other.degree));
            }),
        ),
        ply(
            "trained Gaussian splats",
            Shows(trained("NaN", "1"), |scene| assert_eq!(splats::found(scene).degree, 1)),
        ),
        ply(
            "splats with a place, size, turn, opacity or colour that is not finite",
            Says(trained("", ""), "1 splats have no finite place"),
        ),
        ply(
            "splats of a number of harmonics that is no degree's",
            Says(trained("float f_rest_8", "float nothing"), "8 properties 'f_rest_'"),
        ),
        ply(
            "splats without opacities",
            Says(trained("float opacity", "float nothing"), "no property 'opacity'"),
        ),
        ply(
            "meshes: faces of any number of corners, normals, texture coordinates",
            Shows(edited("property float s", "property float u"), |scene| {
                assert_eq!(mesh(scene, 0).triangles.len(), 2);
            }),
        ),
        ply(
            "colours and alphas of vertices",
            Shows(edited("", ""), |scene| assert_eq!(mesh(scene, 0).colours[1].y, 1.0)),
        ),
        ply(
            "colours of faces",
            Says(
                edited(
                    "end_header",
                    "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header",
                )
                .into_iter()
                .map(|(name, mut bytes)| {
                    bytes.extend(b"1 2 3\n");
                    (name, bytes)
                })
                .collect(),
                "faces' own colours",
            ),
        ),
        ply(
            "texture coordinates of faces",
            Says(
                edited("", "")
                    .into_iter()
                    .map(|(name, bytes)| {
                        let list = "vertex_indices\nproperty list uchar float texcoord";
                        let text = String::from_utf8(bytes).unwrap();
                        let text = text.replace("vertex_indices", list);
                        (name, text.replace("4 0 1 2 3", "4 0 1 2 3 0").into_bytes())
                    })
                    .collect(),
                "'texcoord' is not read",
            ),
        ),
        ply(
            "textures that comments name",
            Says(
                edited("element vertex", "comment TextureFile a.png\nelement vertex"),
                "texture 'a.png'",
            ),
        ),
        ply("normals that are not finite", Like(with_normal("nan"), with_normal(""))),
        ply(
            "faces beside splats",
            Says(
                trained("NaN", "1")
                    .into_iter()
                    .map(|(name, bytes)| {
                        let face =
                            "element face 1\nproperty list uchar int vertex_index\nend_header";
                        let text = String::from_utf8(bytes).unwrap();
                        (name, (text.replace("end_header", face) + "3 0 1 0\n").into_bytes())
                    })
                    .collect(),
                "faces are not drawn",
            ),
        ),
        ply(
            "two elements or properties of one name",
            Says(edited("property float t", "property float s"), "two properties 's'"),
        ),
        ply(
            "headers of more than 1 MiB, more than 2^28 numbers in text or beside lists",
            Says(
                edited(
                    "element vertex",
                    &format!("{}element vertex", "comment no\n".repeat(1 << 17)),
                ),
                "longer than 1 MiB",
            ),
        ),
        ply("triangle strips", Says(edited("element face", "element tristrips"), "in strips")),
        ply("point clouds", Says(edited("element face", "element edge"), "faces of a mesh")),
        splat(
            "`.splat` (antimatter15)",
            Shows(file("a.splat", splats::packed()), |scene| {
                assert_eq!(splats::found(scene).means.len(), 2);
            }),
        ),
        splat(
            "`.spz` of versions 1 to 4",
            Says(file("a.spz", splats::spz(3, false)), "say as its axes"),
        ),
        splat(
            "`.spz` of versions 1 to 3 that is not compressed",
            Says(file("a.spz", raw), "not compressed by gzip"),
        ),
        of_stl(
            "text, bytes",
            Shows(file("a.stl", stl(0)), |scene| assert_eq!(mesh(scene, 0).triangles.len(), 2)),
        ),
        of_stl("colours", Says(file("a.stl", stl(7)), "say of colours")),
        of_hair(
            "segments, points, thicknesses, transparencies, colours, and defaults in their place",
            Shows(file("a.hair", hair::hair(31, |_| ())), |scene| {
                assert_eq!(hair::strands(scene).colours.len(), 5);
            }),
        ),
        of_hair(
            "strands of a single point",
            Says(file("a.hair", single), "1 strands of a single point"),
        ),
        tressfx(
            "points of strands",
            Shows(file("a.tfx", tfx(3, 4, |_| ())), |scene| {
                let Shape::Strands(strands) = &scene.shapes[0] else { panic!() };
                assert!(strands.strand_count() == 3 && strands.radii[0] > strands.radii[3]);
                assert_eq!(scene.materials[0].base.w, 0.5);
            }),
        ),
        tressfx("thicknesses, colours", Says(thick(6), "thicknesses are not read")),
        tressfx("texture coordinates", Like(thick(4), thick(5))),
        tressfx(
            "other versions than 4",
            Says(file("a.tfx", tfx(3, 4, |head| head[0] = 3.0_f32.to_bits())), "TressFX version 3"),
        ),
        vdb(
            "a grid of densities, of floats or doubles",
            Shows(written(Written::default()), |scene| {
                assert_eq!(particles(scene).centres.len(), 2)
            }),
        ),
        vdb(
            "half floats, zlib, Blosc, masks of active values",
            Shows(written(half), |scene| assert_eq!(particles(scene).centres.len(), 512)),
        ),
        vdb(
            "tiles",
            Shows(written(Written { tile: Some(0.25), ..Written::default() }), |scene| {
                assert_eq!(particles(scene).centres.len(), 514);
            }),
        ),
        vdb(
            "linear transformations",
            Shows(written(Written { map: ("ScaleMap", narrow), ..Written::default() }), |scene| {
                assert_eq!(scene.objects[0].place.matrix3.y_axis, DVec3::new(0.0, 3.0, 0.0));
            }),
        ),
        vdb(
            "other transformations (frustum)",
            Says(
                written(Written {
                    map: ("NonlinearFrustumMap", vec![0.0; 30]),
                    ..Written::default()
                }),
                "'NonlinearFrustumMap'",
            ),
        ),
        vdb(
            "several grids",
            Says(file("a.vdb", super::vdb::file(&[level_set, fog])), "only 'smoke' is drawn"),
        ),
        vdb("level sets, also by their values", Says(written(unnamed), "level sets: 'surface'")),
        vdb(
            "negative densities",
            Says(
                written(Written {
                    voxels: vec![([0, 0, 0], 1.0), ([0, 0, 1], -0.5)],
                    ..Written::default()
                }),
                "negative",
            ),
        ),
        vdb(
            "no grid of real numbers",
            Says(written(Written { kind: "Tree_vec3s_5_4_3", ..Written::default() }), "no grid of"),
        ),
        vdb(
            "formats before 222 and after 224",
            Says(written(Written { version: 221, ..Written::default() }), "format 221"),
        ),
    ]
}

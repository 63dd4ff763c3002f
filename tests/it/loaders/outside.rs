//! What lies outside a scene's folder is not opened, and nobody's lines are shown.

use std::fs;
use std::path::Path;

use screendoor::scene::Scene;
use serde_json::json;
use tempfile::TempDir;

use super::{TRIANGLE, folder, load_in, png, warned};
use crate::hostile;

const SECRET: &str = "password swordfish";

/// A folder `scene` with the files, beside one called `outside` with a picture and an MTL
/// file that shows it, and one with a secret.
fn scene(files: &[(&str, &[u8])]) -> TempDir {
    let all = tempfile::tempdir().unwrap();
    for name in ["outside", "scene"] {
        fs::create_dir(all.path().join(name)).unwrap();
    }
    let red = png(image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0])));
    let outside: [(&str, &[u8]); 4] = [
        ("red.png", &red),
        ("out.mtl", b"newmtl m\nd 0.25\n"),
        ("secret", SECRET.as_bytes()),
        ("points.bin", &[0; 36]),
    ];
    for (name, bytes) in outside {
        fs::write(all.path().join("outside").join(name), bytes).unwrap();
    }
    for (name, bytes) in files {
        let path = all.path().join("scene").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    all
}

fn load(all: &TempDir, name: &str) -> Result<Scene, screendoor::error::Error> {
    load_in(&all.path().join("scene"), name)
}

/// All names by which `file` outside may be called.
fn ways_out(all: &Path, file: &str) -> Vec<String> {
    let absolute = all.join("outside").join(file).display().to_string();
    vec![
        format!("../outside/{file}"),
        format!("./x/../../outside/{file}"),
        format!("..\\outside\\{file}"),
        format!("\"../outside/{file}\""),
        absolute.clone(),
        format!("\"{absolute}\""),
        absolute.replace('/', "\\"),
        format!("link-{file}"),
        format!("folder/{file}"),
        format!("folder/../../outside/{file}"),
    ]
}

/// Links out of the folder: to a file, and to the whole other folder.
#[cfg(unix)]
fn link(all: &Path, file: &str) {
    let scene = all.join("scene");
    let _ = fs::create_dir(scene.join("x"));
    let target = all.join("outside");
    std::os::unix::fs::symlink(target.join(file), scene.join(format!("link-{file}"))).unwrap();
    let _ = std::os::unix::fs::symlink(Path::new("../outside"), scene.join("folder"));
}

#[cfg(unix)]
#[test]
fn no_way_leads_out_of_the_folder() {
    let all = scene(&[]);
    ["out.mtl", "red.png", "secret", "points.bin"].iter().for_each(|file| link(all.path(), file));
    let here = all.path().join("scene");
    for way in ways_out(all.path(), "out.mtl") {
        fs::write(here.join("a.obj"), format!("mtllib {way}\n{TRIANGLE}usemtl m\nf 1 2 3\n"))
            .unwrap();
        let scene = load(&all, "a.obj").unwrap();
        assert_eq!(scene.materials.len(), 1, "{way}");
        warned(&scene, 1, &["leads out of the scene's folder"]);
    }
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    fs::write(here.join("a.obj"), text).unwrap();
    for keyword in ["map_Kd", "map_d", "map_Ke"] {
        for way in ways_out(all.path(), "red.png") {
            fs::write(here.join("a.mtl"), format!("newmtl m\n{keyword} {way}\n")).unwrap();
            let scene = load(&all, "a.obj").unwrap();
            assert!(scene.textures.is_empty(), "{keyword} {way}");
            warned(&scene, 1, &["leads out of the scene's folder"]);
        }
    }
    for way in ways_out(all.path(), "red.png") {
        let json = hostile::gltf(|j| {
            super::gltf::textured(j);
            j["images"] = json!([{ "uri": way }]);
        });
        fs::write(here.join("a.gltf"), json).unwrap();
        let scene = load(&all, "a.gltf").unwrap();
        assert!(scene.textures.is_empty(), "{way}");
        assert!(scene.warnings.iter().any(|w| w.contains("leads out")), "{:?}", scene.warnings);
    }
    for way in ways_out(all.path(), "points.bin") {
        let json = hostile::gltf(|j| j["buffers"][0]["uri"] = way.clone().into());
        fs::write(here.join("a.gltf"), json).unwrap();
        let error = load(&all, "a.gltf").unwrap_err().to_string();
        assert!(error.contains("leads out of the scene's folder"), "{way}: {error}");
    }
}

/// Links that stay inside are followed.
#[cfg(unix)]
#[test]
fn links_inside_the_folder_are_followed() {
    let text = format!("mtllib b.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let all = scene(&[("a.obj", text.as_bytes()), ("in/a.mtl", b"newmtl m\nd 0.5\n")]);
    let link = all.path().join("scene/b.mtl");
    std::os::unix::fs::symlink(Path::new("in/a.mtl"), link).unwrap();
    let scene = load(&all, "a.obj").unwrap();
    assert_eq!((scene.materials[0].base.w, scene.warnings.len()), (0.5, 0));
}

#[test]
fn files_that_are_no_mtl_are_not_shown() {
    let text = format!("mtllib secret.txt\nmtllib late.mtl\n{TRIANGLE}f 1 2 3\n");
    let late = format!("{SECRET}\n{SECRET}\nnewmtl m\n");
    let folder = folder(&[
        ("a.obj", text.as_bytes()),
        ("secret.txt", SECRET.as_bytes()),
        ("late.mtl", late.as_bytes()),
    ]);
    let scene = load_in(folder.path(), "a.obj").unwrap();
    warned(&scene, 2, &["secret.txt: it defines no material"]);
    warned(&scene, 2, &["late.mtl: 2 statements from line 1 on belong to no material"]);
    assert!(!scene.warnings.concat().contains("swordfish"), "{:?}", scene.warnings);
}

#[test]
fn names_are_found_by_their_last_parts_and_in_any_case() {
    let red = png(image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0])));
    let ways = [
        ("Leaf.PNG", "leaf.png"),
        ("TEX\\Leaf.png", "Tex/leaf.png"),
        ("D:\\work\\tex\\leaf.png", "tex/leaf.png"),
        ("/home/x/leaf.png", "some/where/leaf.png"),
        ("gone/leaf.png", "leaf.png"),
        ("\\\\server\\share\\leaf.png", "leaf.png"),
    ];
    for (name, file) in ways {
        let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
        let mtl = format!("newmtl m\nmap_Kd {name}\n");
        let all = scene(&[("a.obj", text.as_bytes()), ("a.mtl", mtl.as_bytes()), (file, &red)]);
        let scene = load(&all, "a.obj").unwrap();
        assert_eq!(scene.textures.len(), 1, "{name}");
        let file = Path::new(file).display().to_string();
        warned(&scene, 1, &[name, &format!("'{file}' in it is used")]);
    }
}

/// Every file that the program opens is in the scene's folder, or its own, or the system's.
#[cfg(target_os = "linux")]
#[test]
fn the_system_sees_no_file_outside_opened() {
    use std::process::Command;
    let Ok(version) = Command::new("strace").arg("-V").output() else {
        eprintln!("skipped: there is no strace");
        return;
    };
    assert!(version.status.success());
    let all = scene(&[]);
    link(all.path(), "out.mtl");
    let here = all.path().join("scene");
    let lines: Vec<String> =
        ways_out(all.path(), "out.mtl").iter().map(|way| format!("mtllib {way}\n")).collect();
    let text = format!("{}{TRIANGLE}usemtl m\nf 1 2 3\n", lines.concat());
    fs::write(here.join("a.obj"), text).unwrap();
    let log = all.path().join("log");
    let traced = Command::new("strace")
        .args(["-f", "-y", "-e", "trace=open,openat,openat2", "-o"])
        .arg(&log)
        .arg(env!("CARGO_BIN_EXE_screendoor"))
        .args(["capture", "a.obj", "-o", "t.arrow", "--size", "8x8", "--samples", "1"])
        .current_dir(&here)
        .output()
        .unwrap();
    let log = fs::read_to_string(&log).unwrap_or_default();
    if log.is_empty() {
        eprintln!("skipped: strace may not trace here");
        return;
    }
    assert!(traced.status.success(), "{}", String::from_utf8_lossy(&traced.stderr));
    // With -y the log has the paths of what was opened behind the numbers of the files.
    let out = all.path().join("outside").canonicalize().unwrap().display().to_string();
    let opened =
        |line: &&str| line.rsplit(" = ").next().is_some_and(|result| result.contains(&out));
    assert!(log.lines().any(|line| line.contains("a.obj") && line.contains(" = ")), "{log}");
    let found: Vec<&str> = log.lines().filter(opened).collect();
    assert!(found.is_empty(), "{found:?}");
}

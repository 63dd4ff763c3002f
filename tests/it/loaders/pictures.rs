//! Pictures of textures: formats, what they cost, and what they are not.

use std::io::{Cursor, Write};

use image::{DynamicImage, ImageFormat, Rgba, RgbaImage};
use screendoor::scene::{Scene, Texture};

use super::{TRIANGLE, folder, load_in, png, warned};

/// The scene of a triangle with a texture in a file of that name.
pub fn textured(name: &str, bytes: &[u8]) -> Scene {
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    let mtl = format!("newmtl m\nmap_Kd {name}\n");
    let files: [(&str, &[u8]); 3] =
        [("a.obj", text.as_bytes()), ("a.mtl", mtl.as_bytes()), (name, bytes)];
    load_in(folder(&files).path(), "a.obj").unwrap()
}

/// A picture of one colour in some format.
pub fn encoded(format: ImageFormat, texel: [u8; 4]) -> Vec<u8> {
    let image = DynamicImage::ImageRgba8(RgbaImage::from_pixel(4, 4, Rgba(texel)));
    let image = if format == ImageFormat::Jpeg { image.into_rgb8().into() } else { image };
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
    bytes
}

#[test]
fn all_formats_give_the_same_texture() {
    use glam::{Vec2, Vec4};
    let formats = [
        ("a.png", ImageFormat::Png),
        ("a.webp", ImageFormat::WebP),
        ("a.tga", ImageFormat::Tga),
        ("a.bmp", ImageFormat::Bmp),
        ("a.jpg", ImageFormat::Jpeg),
    ];
    for (name, format) in formats {
        let alpha = if format == ImageFormat::Jpeg { 255 } else { 51 };
        let scene = textured(name, &encoded(format, [255, 0, 0, alpha]));
        assert_eq!(scene.warnings, [""; 0], "{name}");
        let found = scene.textures[0].sample(Vec2::splat(0.5), Vec2::ZERO, Vec2::ZERO);
        let wanted = Vec4::new(1.0, 0.0, 0.0, f32::from(alpha) / 255.0);
        assert!((found - wanted).abs().max_element() < 0.01, "{name}: {found}");
    }
}

#[test]
fn other_formats_are_named() {
    let cases: [(&str, &[u8], &str); 5] = [
        ("a.dds", b"DDS \x7c\0\0\0\x07\x10", "it is a DDS"),
        ("a.ktx2", b"\xabKTX 20\xbb\r\n\x1a\n", "it is a KTX2"),
        ("a.psd", b"8BPS\0\x01", "it is a PSD"),
        ("a.gif", b"GIF89a\x01\0\x01\0", "it is a GIF"),
        ("a.txt", b"leaf", "its format is not known"),
    ];
    for (name, bytes, says) in cases {
        warned(&textured(name, bytes), 1, &[name, says, "PNG, JPEG, WebP, BMP and TGA are read"]);
    }
}

#[test]
fn a_folder_is_no_texture_and_no_end() {
    let text = format!("mtllib a.mtl\n{TRIANGLE}usemtl m\nf 1 2 3\n");
    for name in ["tex", ".", "tex/"] {
        let mtl = format!("newmtl m\nmap_Kd {name}\n");
        let folder = folder(&[("a.obj", text.as_bytes()), ("a.mtl", mtl.as_bytes())]);
        std::fs::create_dir(folder.path().join("tex")).unwrap();
        let scene = load_in(folder.path(), "a.obj").unwrap();
        warned(&scene, 1, &["it is a folder"]);
        // What is no file is none of the scene's files: capture would refuse it as an input.
        assert_eq!(scene.files.len(), 2);
    }
}

/// A chunk of a PNG.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let named = [&kind[..], data].concat();
    let mut crc = flate2::Crc::new();
    crc.update(&named);
    [&(data.len() as u32).to_be_bytes()[..], &named, &crc.sum().to_be_bytes()].concat()
}

/// A small PNG with a chunk of zeros that are packed a thousand times smaller.
pub fn with_packed(kind: &[u8; 4], before: &[u8], zeros: usize) -> Vec<u8> {
    let mut packed = flate2::write::ZlibEncoder::new(before.to_vec(), flate2::Compression::best());
    let block = vec![0; 1 << 20];
    (0..zeros >> 20).for_each(|_| packed.write_all(&block).unwrap());
    let mut bytes = png(RgbaImage::from_pixel(2, 2, Rgba([9, 9, 9, 99])));
    // Behind the signature and the header.
    bytes.splice(33..33, chunk(kind, &packed.finish().unwrap()));
    bytes
}

/// The most memory that this process has had at once, in bytes.
#[cfg(target_os = "linux")]
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

#[test]
fn what_no_texel_needs_takes_no_memory() {
    const ZEROS: usize = 1 << 30;
    #[cfg(target_os = "linux")]
    let before = peak();
    for (kind, before) in
        [(b"iCCP", &b"p\0\0"[..]), (b"zTXt", b"k\0\0"), (b"iTXt", b"k\0\x01\0\0\0")]
    {
        let bytes = with_packed(kind, before, ZEROS);
        let texture = Texture::decode(&bytes, "a.png").unwrap();
        assert_eq!((texture.width(), texture.has_alpha()), (2, true));
    }
    // Other tests of the process may take some at the same time, but not as much.
    #[cfg(target_os = "linux")]
    assert!(peak().saturating_sub(before) < ZEROS as u64 / 2);
}

#[test]
fn claims_of_texels_are_checked_first() {
    // 8000 × 8000 texels of which nothing follows.
    let mut bmp = encoded(ImageFormat::Bmp, [1, 2, 3, 255]);
    let mut tga = encoded(ImageFormat::Tga, [1, 2, 3, 255]);
    bmp[18..26].copy_from_slice(&[8000_u32.to_le_bytes(), 8000_u32.to_le_bytes()].concat());
    tga[12..16].copy_from_slice(&[8000_u16.to_le_bytes(), 8000_u16.to_le_bytes()].concat());
    for (bytes, name) in [(bmp, "a.bmp"), (tga, "a.tga")] {
        let error = Texture::decode(&bytes, name).unwrap_err().to_string();
        assert!(error.contains("bytes hold no 8000 x 8000 texels"), "{error}");
    }
}

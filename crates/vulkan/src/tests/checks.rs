//! What was recorded against the program's picture, of which a few lines of their own say what it
//! must be.

use super::*;
use crate::Check;

const ALL: [i32; 4] = [0, 0, 4, 4];

fn check(made: &Made) -> Check {
    let captures = made.captures();
    let options = ConvertOptions { background: Some([0.0; 3]), ..ConvertOptions::default() };
    let conversion = Conversion::new(&captures, options).unwrap();
    conversion.check(&mut |_, _| ()).unwrap()
}

/// What 8 bits hold of a number.
fn bits(v: f64) -> f64 {
    (v.clamp(0.0, 1.0) * 255.0).round() / 255.0
}

/// What a target of 8 bits holds after one colour over another.
fn over_it(held: [f64; 4], [r, g, b, a]: [f64; 4]) -> [f64; 4] {
    let mix = |s: f64, d: f64| bits(s * a + d * (1.0 - a));
    // Alpha has no blend here: its factors are 0 and 0, as numbers of Vulkan's.
    [mix(r, held[0]), mix(g, held[1]), mix(b, held[2]), 0.0]
}

fn bytes(pixels: &[[f64; 4]]) -> Vec<[u8; 4]> {
    pixels.iter().map(|p| p.map(|v| (v * 255.0).round() as u8)).collect()
}

/// Fragments over a clear, and what the target must hold after them.
fn drawn() -> (Made, Vec<[u8; 4]>) {
    let mut made = Made::new();
    let clear = [0.2, 0.4, 0.6, 1.0];
    let mut pixels = vec![clear.map(bits); 16];
    let colours = [[1.0, 0.0, 0.3, 0.3], [0.1, 0.9, 0.7, 0.8], [0.4, 0.4, 0.1, 0.05]];
    let mut records = Vec::new();
    for (x, pixel) in pixels.iter_mut().enumerate().take(3) {
        for (primitive, colour) in colours.iter().enumerate().take(x + 1) {
            records.push(record(0, primitive as u32, x as u32, colour.map(|v: f64| v as f32)));
            *pixel = over_it(*pixel, *colour);
        }
    }
    // As a GPU may append them.
    records.reverse();
    let mut blend = over(0);
    blend.state.source_alpha = vk::BlendFactor::ZERO.as_raw();
    let cleared = clear.map(|v| v as f32);
    made.submit(vec![begin(pass(CLEAR, cleared)), draw(blend)], records);
    (made, bytes(&pixels))
}

#[test]
fn a_picture_that_is_as_it_must_be_is_exact() {
    let (mut made, pixels) = drawn();
    made.picture(0, true, &pixels);
    let found = check(&made);
    assert_eq!((found.incomparable.as_deref(), found.caveats.len()), (None, 0));
    assert_eq!((found.pixels, found.exact, found.greatest), (16, 16, 0.0));
}

#[test]
fn what_differs_is_counted_by_how_much() {
    let (mut made, mut pixels) = drawn();
    pixels[0][1] += 1;
    pixels[5][0] += 3;
    pixels[9][2] -= 9;
    made.picture(0, true, &pixels);
    let found = check(&made);
    assert_eq!((found.pixels, found.exact), (16, 13));
    assert!((found.greatest - 9.0).abs() < 1e-3);
    let beyond: Vec<_> = found.beyond.iter().map(|b| (b.units, b.pixels)).collect();
    assert_eq!(beyond, [(0.6, 3), (1.6, 2), (4.0, 1)]);
}

#[test]
fn additions_masks_and_clears_of_parts_are_done_again() {
    let mut made = Made::new();
    let mut adding = blended(0, vk::BlendFactor::ONE, vk::BlendFactor::ONE);
    adding.state.source_alpha = vk::BlendFactor::ONE.as_raw();
    adding.state.destination_alpha = vk::BlendFactor::ONE.as_raw();
    let mut green = opaque(1);
    green.state.mask = 2;
    let events = vec![
        begin(pass(CLEAR, [0.2, 0.0, 0.0, 0.0])),
        draw(adding),
        clear([0.0, 0.0, 0.8, 0.0], [0, 0, 1, 4]),
        draw(green),
    ];
    let records = vec![
        record(0, 0, 0, [0.4, 0.4, 0.4, 0.4]),
        record(0, 0, 1, [0.4, 0.4, 0.4, 0.4]),
        record(1, 0, 0, [1.0, 0.6, 1.0, 1.0]),
        record(1, 0, 2, [1.0, 0.6, 1.0, 1.0]),
    ];
    made.submit(events, records);
    let mut pixels = vec![[51, 0, 0, 0]; 16];
    for row in 0..4 {
        pixels[4 * row] = [0, 0, 204, 0];
    }
    pixels[0][1] = 153;
    pixels[1] = [153, 102, 102, 102];
    pixels[2][1] = 153;
    made.picture(0, true, &pixels);
    assert_eq!((check(&made).exact, check(&made).greatest), (16, 0.0));
}

#[test]
fn samples_are_tested_and_their_mean_is_compared() {
    let mut made = Made::with(UNORM, 4);
    made.image(3, UNORM, 1, 4);
    let pass = Pass { resolve: Some(attachment(3, LOAD, [0.0; 4])), ..pass(CLEAR, [0.0; 4]) };
    let less = |slot| testing(opaque(slot), vk::CompareOp::LESS, true);
    let events = vec![begin(with_depth(pass, 1.0)), draw(less(0)), draw(less(1))];
    let colour = [0.8, 0.4, 0.0, 1.0];
    let records = vec![
        // Two samples, then all that is left of it.
        Record { coverage: 0b0011, z: 0.25, ..record(0, 0, 0, colour) },
        Record { coverage: 0b0111, z: 0.5, ..record(1, 0, 0, [0.0, 0.0, 1.0, 0.0]) },
    ];
    made.submit(events, records);
    let mut pixels = [[0; 4]; 16];
    // A mean of half of a colour and a quarter of another.
    pixels[0] = [102, 51, 64, 128];
    made.picture_of(3, 0, true, &pixels.concat());
    let found = check(&made);
    // Means of bytes lie between bytes.
    assert!(found.greatest < 0.51, "{}", found.greatest);
    assert_eq!((found.pixels, found.exact, found.beyond[0].pixels), (16, 15, 0));
    made.pictures[4] = 200;
    assert_eq!(check(&made).beyond[2].pixels, 1);
    // Without a pass that resolves there is nothing to compare with.
    let mut made = Made::with(UNORM, 4);
    made.submit(vec![begin(super::pass(CLEAR, [0.0; 4])), draw(opaque(0))], Vec::new());
    assert!(check(&made).incomparable.unwrap().contains("not resolved"));
}

#[test]
fn what_was_loaded_is_below() {
    let mut made = Made::new();
    let mut pixels: Vec<[u8; 4]> = (0..16).map(|i| [i * 10, 255 - i, i, 9]).collect();
    made.submit(vec![begin(pass(LOAD, [0.0; 4])), draw(opaque(0))], vec![grey(0, 3, 1.0)]);
    made.picture(0, false, &pixels);
    pixels[3] = [128, 128, 128, 255];
    made.picture(0, true, &pixels);
    assert_eq!(check(&made).exact, 16);
    // Not known.
    let mut made = Made::new();
    made.submit(vec![begin(pass(LOAD, [0.0; 4])), draw(opaque(0))], vec![grey(0, 3, 1.0)]);
    made.picture(0, true, &pixels);
    assert!(check(&made).incomparable.unwrap().contains("before the first draw"));
}

#[test]
fn what_cannot_be_done_again_is_said() {
    let (made, _) = drawn();
    assert!(check(&made).incomparable.unwrap().contains("capture with --check"));
    let (mut made, pixels) = drawn();
    made.submit(vec![begin(pass(LOAD, [0.0; 4])), clear([0.0; 4], ALL)], Vec::new());
    made.picture(0, true, &pixels);
    assert!(check(&made).incomparable.unwrap().contains("no picture of it after submission 1"));

    let mut made = Made::new();
    let mut stencil = opaque(0);
    stencil.state.stencil = true;
    let second = blended(1, vk::BlendFactor::ONE, vk::BlendFactor::SRC1_ALPHA);
    let none = Draw { refused: "no".into(), ..opaque(u32::MAX) };
    let events = vec![
        begin(pass(CLEAR, [0.0; 4])),
        draw(stencil),
        draw(second),
        draw(none),
        write_to(1, "vkCmdCopyImage"),
    ];
    made.submit(events, Vec::new());
    made.picture(0, true, &[[0; 4]; 16]);
    let found = check(&made);
    let expected = [
        "draws that left no records: 1",
        "draws with a second colour: 1",
        "draws with a stencil test: 1",
        "writes by vkCmdCopyImage: 1",
    ];
    assert_eq!(found.caveats, expected);
    assert_eq!(found.exact, 16);
}

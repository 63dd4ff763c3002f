//! Wyman 2016, figures 2 and 3, step by step: a pixel of 16 samples, and a red, a blue and a green
//! fragment of alpha 0.5, green before red before blue.

use screendoor::rop::{Contents, Site};
use screendoor::trace::Trace;

use crate::util::{design, header, layered, trace};

/// A depth and a colour.
type Surface = (u32, [f32; 3]);
const RED: Surface = (2 << 30, [1.0, 0.0, 0.0]);
const BLUE: Surface = (3 << 30, [0.0, 0.0, 1.0]);
const GREEN: Surface = (1 << 30, [0.0, 1.0, 0.0]);

fn drawn() -> Trace {
    let header = header(16, 16, 16);
    let layer = |i: u32| {
        let (z, colour) = [RED, BLUE, GREEN][i as usize];
        (z, colour, 0.5)
    };
    trace(&header, &layered(&header, 3, layer))
}

/// What a pixel holds after each of the first three fragments.
fn after(trace: &Trace, spec: &str, (x, y): (u16, u16)) -> Vec<Contents> {
    let told = design(spec).explain(trace, 16, 0, Site { x, y }, &|_, _| ()).unwrap();
    told.steps.into_iter().take(3).map(|step| step.contents).collect()
}

#[test]
fn stochastic_transparency_stores_the_depth_of_a_fragment_many_times() {
    let trace = drawn();
    let (mut blue, mut red) = (0, 0);
    for pixel in (0..16).flat_map(|x| (0..16).map(move |y| (x, y))) {
        let steps = after(&trace, "enderton:among=covered", pixel);
        let hold = |step: &Contents, (z, colour): Surface| {
            step.samples.iter().filter(|s| s.depth.0 == z && s.colour == colour).count()
        };
        // Red has half of the samples; blue half of those that it covers, but none of red's; green
        // half, and takes them from whoever was there.
        assert_eq!(hold(&steps[0], RED), 8);
        let behind = hold(&steps[1], BLUE);
        assert!(hold(&steps[1], RED) == 8 && behind <= 8);
        assert_eq!(hold(&steps[2], GREEN), 8, "its depth is stored 8 times");
        assert!(hold(&steps[2], BLUE) <= behind && hold(&steps[2], RED) <= 8);
        blue += behind;
        red += hold(&steps[2], RED);
    }
    // On average blue is left a quarter of the pixel before green comes, and red a quarter after.
    for (found, of) in [(blue, "blue"), (red, "red")] {
        let mean = f64::from(u32::try_from(found).unwrap()) / 256.0;
        // Of 8 drawn among 16 without return the deviation is 1: five of them over 256 pixels.
        assert!((mean - 4.0).abs() < 5.0 * 1.1 / 16.0, "{of}: {mean}");
    }
}

#[test]
fn slab_stores_each_depth_once_and_with_two_layers_loses_the_farthest() {
    let trace = drawn();
    let depths = |step: &Contents| -> Vec<String> {
        let (_, layers) = step.fields.iter().find(|(name, _)| *name == "layers").unwrap();
        layers.split("; ").map(|l| l.split(" rgb ").nth(1).unwrap()[..11].to_string()).collect()
    };
    let masks = |step: &Contents| -> Vec<u32> {
        let (_, bits) = step.fields.iter().find(|(name, _)| *name == "bits").unwrap();
        let mask = |m: &str| u32::from_str_radix(m.trim_start_matches("0x"), 16).unwrap();
        bits.split(' ').map(|m| mask(m).count_ones()).collect()
    };
    let [red, blue, green] = ["1.000 0.000", "0.000 0.000", "0.000 1.000"];
    let spec =
        |layers: u32| format!("slab:layers={layers},bits=16,opacity=discrete,normalise=none");
    let mut whole = 0;
    for pixel in (0..16).flat_map(|x| (0..16).map(move |y| (x, y))) {
        let [three, two] = [3, 2].map(|layers| after(&trace, &spec(layers), pixel));
        // Blue shows with the probability that its mask is not wholly hidden behind red's.
        if depths(&three[2]).len() < 3 {
            continue;
        }
        whole += 1;
        assert_eq!(depths(&three[0]), [red]);
        assert_eq!(depths(&three[1]), [red, blue]);
        assert_eq!(depths(&three[2]), [green, red, blue]);
        assert_eq!(masks(&three[2]), [8, 8, 8], "a depth and a mask each");
        assert_eq!(depths(&two[1]), [red, blue]);
        assert_eq!(depths(&two[2]), [green, red], "blue is discarded");
    }
    assert!(whole > 200, "{whole}");
}

use super::*;
use crate::configure;
use screendoor_rop::NoProbe;
use screendoor_trace::tile::TileGrid;

const SITE: Site = Site { x: 0, y: 0 };

fn frame(seed: u32) -> Frame {
    Frame {
        grid: TileGrid::new(1, 1),
        positions: [[-4, -4], [4, -4], [-4, 4], [4, 4]].into(),
        background: [0.0; 3],
        space: Default::default(),
        seed,
        colour_bits: 96,
        view: None,
        opaque: false,
        primitive_depths: None,
        columns: Default::default(),
    }
}

fn design(settings: &str, seed: u32) -> MergingAt<4> {
    let separator = if settings.is_empty() { "" } else { ":" };
    let design = configure(&format!("merging{separator}{settings}"), &[]).unwrap();
    MergingAt::of(design.values(), &frame(seed))
}

fn shown(settings: &str, seed: u32, fragments: &[Fragment]) -> [f64; 3] {
    let design = design(settings, seed);
    let mut sheets = design.clear(SITE);
    for fragment in fragments {
        design.draw(0, SITE, &mut sheets, fragment, &mut NoProbe);
    }
    design.resolve(SITE, &sheets, &[[0.0; 3]; 4])
}

fn fragment(z: u32, mask: u64, colour: [f32; 3], alpha: f32) -> Fragment {
    Fragment {
        coverage: SampleMask(mask),
        depth: DepthPlane { z: Unorm32(z), dzdx: 0, dzdy: 0 },
        colour,
        alpha,
        primitive: z,
        ..Fragment::default()
    }
}

#[test]
fn slopes_keep_ten_bits() {
    for v in [0, 1, -1, 1023, -1024, 1025, 12_345, -87_654_321, i32::MAX, i32::MIN] {
        let (kept, v) = (i64::from(slope(v)), i64::from(v));
        assert!((kept - v).abs() * 1024 <= v.abs().max(1), "{v}: {kept}");
        assert_eq!(i64::from(slope(kept as i32)), kept);
    }
}

#[test]
fn neighbours_that_nothing_parts_are_merged_exactly() {
    // Three layers of one mask, the last two nearer to each other: room for two.
    let layers = [(10, 1.0), (20, 0.0), (21, 1.0)];
    let three = layers.map(|(z, c)| fragment(z << 20, 15, [c; 3], 0.5));
    for settings in ["layers=2", "layers=2,place=heavier", "layers=2,slopes=false"] {
        // 0.5 + 0.5·(0 + 0.5·0.5·1).
        let [shown, ..] = shown(settings, 1, &three);
        assert!((shown - 0.625).abs() < 1e-6, "{settings}: {shown}");
    }
}

#[test]
fn masks_that_differ_are_kept_apart_where_there_is_room() {
    let [a, b] = [fragment(10, 3, [1.0; 3], 1.0), fragment(20, 12, [0.5; 3], 0.5)];
    assert_eq!(shown("layers=2", 1, &[a, b]), [0.5 + 0.125; 3]);
    // As one layer over both: (2 + 1)/4 of it shows, of the mean colour.
    let one = shown("layers=1", 1, &[a, b]);
    assert!((one[0] - 0.625).abs() < 1e-6, "{one:?}");
}

/// Near and far are merged, and then something comes between them: how much of it shows
/// is right on average, and the far one's colour shows too much, the near one's too little,
/// by α·near·far/(near + far).
#[test]
fn the_bias_is_towards_the_far_colour() {
    let near = fragment(1 << 28, 15, [1.0, 0.0, 0.0], 0.5);
    let far = fragment(3 << 28, 15, [0.0, 1.0, 0.0], 0.5);
    let between = fragment(2 << 28, 15, [0.0, 0.0, 1.0], 0.25);
    const SEEDS: u32 = 4000;
    let mut mean = [0.0; 3];
    for seed in 0..SEEDS {
        let design = design("", seed);
        let [near, far, between] = [&near, &far, &between].map(|f| design.rules.sheet(f));
        let mut list =
            design.rules.listed([design.rules.merged(&near, &far, hash([seed]))].into_iter());
        design.rules.insert(&mut list, between, 0, &mut NoProbe);
        let [r, g, b] = design.resolve(SITE, &list, &[[0.0; 3]; 4]);
        mean = [mean[0] + r, mean[1] + g, mean[2] + b];
    }
    let [r, g, b] = mean.map(|sum| sum / f64::from(SEEDS));
    // Exactly: 0.5; 0.5·0.25 = 0.125; 0.5·0.75·0.5 = 0.1875. near·far/(near + far) = 1/6.
    let bias = 0.25 / 6.0;
    // A deviation of 0.25·0.5 at most, six of them over the root of 4000.
    let near = |found: f64, expected: f64| (found - expected).abs() < 0.012;
    assert!(near(b, 0.125), "{b}");
    assert!(near(r, 0.5 - bias) && near(g, 0.1875 + bias), "{r} {g}");
    assert!(r < 0.5 - bias / 2.0 && g > 0.1875 + bias / 2.0, "{r} {g}");
}

#[test]
fn the_cheapest_are_those_that_are_hidden() {
    // Behind what is opaque nothing matters, however far apart.
    let design = design("", 0);
    let layers = [(10, 0.5), (11, 1.0), (4000, 0.5)];
    let sheet = |(z, a): (u32, f32)| design.rules.sheet(&fragment(z << 20, 15, [1.0; 3], a));
    assert_eq!(Listed::cheapest(&design.rules.listed(layers.map(sheet).into_iter())), 1);
}

//! Shading on traces made by hand.

use super::*;
use glam::{DMat4, DVec3};
use screendoor_rop::visibility::Taps;
use screendoor_trace::edit;
use screendoor_trace::trace::{
    DepthPlane, Projection as Lines, SampleMask, SamplePattern, TraceWriter, View, WriteOptions,
};

fn trace(header: Header, fragments: &[Fragment]) -> Trace {
    let mut writer = TraceWriter::new(Vec::new(), "t", header, WriteOptions::default()).unwrap();
    writer.push_all(fragments).unwrap();
    Trace::from_bytes(writer.finish().unwrap().0, "t").unwrap()
}

fn header(light: bool) -> Header {
    let mut header = Header { width: 16, height: 16, ..Header::default() };
    header.pattern = SamplePattern::standard(8).unwrap();
    header.colour = screendoor_trace::trace::ColourFormat::F32;
    if light {
        header.optional = DIRECT.into_iter().collect();
    }
    // The light stands where the camera does, so that a receiver lies where its fragment does.
    header.view = Some(View {
        projection: Lines::Orthographic,
        near: 0.0,
        far: 1.0,
        world_to_view: DMat4::IDENTITY.to_cols_array(),
        view_to_clip: DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)).to_cols_array(),
    });
    header
}

/// Layers of these depths and alphas over the whole map.
fn light(layers: &[(u32, f32)]) -> Trace {
    let mut fragments = Vec::new();
    for (i, (z, alpha)) in layers.iter().enumerate() {
        for pixel in 0..256_u16 {
            fragments.push(Fragment {
                x: pixel % 16,
                y: pixel / 16,
                coverage: SampleMask::first(8),
                depth: DepthPlane { z: Unorm32(*z), dzdx: 0, dzdy: 0 },
                alpha: *alpha,
                primitive: i as u32,
                ..Fragment::default()
            });
        }
    }
    trace(header(false), &fragments)
}

/// A receiver at each pixel, at the depth `z` of the map.
fn camera(z: u32) -> Trace {
    let fragments = (0..256_u16).map(|pixel| {
        let mut f = Fragment {
            x: pixel % 16,
            y: pixel / 16,
            coverage: SampleMask::first(8),
            colour: [1.0, 0.75, 0.5],
            alpha: 0.5,
            primitive: 7,
            ..Fragment::default()
        };
        f.depth.z = Unorm32(z);
        f.optional.direct_r = 0.5;
        f.optional.direct_g = 0.25;
        f
    });
    trace(header(true), &fragments.collect::<Vec<_>>())
}

fn options(design: &str) -> ShadowOptions {
    let filter = Filter { bias: 0.0, slope_bias: 0.0, ..Filter::default() };
    let design = configure(design, &[]).unwrap();
    ShadowOptions { design, samples: 8, seed: 1, rounds: 1, filter, measure: true }
}

fn shade(camera: &Trace, light: &Trace, options: &ShadowOptions) -> (Trace, VisibilityError) {
    let shade = Shade::new(camera, light, options, &ReplayOptions::default()).unwrap();
    let mut writer =
        TraceWriter::new(Vec::new(), "s", shade.header().clone(), WriteOptions::default()).unwrap();
    edit::write(&shade, &mut writer, &mut |_, _| ()).unwrap();
    let bytes = writer.finish().unwrap().0;
    (Trace::from_bytes(bytes, "s").unwrap(), shade.error().unwrap())
}

fn fragments(trace: &Trace) -> Vec<Fragment> {
    trace.batches().flat_map(|batch| batch.unwrap().iter().collect::<Vec<_>>()).collect()
}

const LAYERS: [(u32, f32); 3] = [(1 << 30, 0.5), (2 << 30, 0.5), (3 << 30, 1.0)];

#[test]
fn what_light_reaches_is_as_bright_as_it_was_and_the_rest_loses_its_direct_part() {
    let light = light(&LAYERS);
    for (z, seen) in
        [(5, 1.0), (1 << 30, 1.0), ((1 << 30) + 1, 0.5), (3 << 30, 0.25), (u32::MAX, 0.0)]
    {
        let camera = camera(z);
        let (shaded, error) = shade(&camera, &light, &options("exact"));
        assert_eq!((error.queries, error.rmse, error.truth), (256, 0.0, seen));
        for (old, new) in fragments(&camera).iter().zip(fragments(&shaded)) {
            let colour = [1.0 - 0.5 * (1.0 - seen), 0.75 - 0.25 * (1.0 - seen), 0.5];
            assert_eq!(new.colour.map(f64::from), colour, "{z}");
            // All else is as it was, but for what was of the light.
            let optional = old.optional.only(KEPT);
            assert_eq!(Fragment { colour: old.colour, ..new }, Fragment { optional, ..*old });
        }
        assert!(DIRECT.iter().all(|id| !shaded.header().has(*id)));
        assert!(shaded.header().source.contains("shadows by exact at 8 samples"));
    }
}

#[test]
fn random_samples_are_right_on_average_and_rounds_and_taps_lessen_their_noise() {
    // No multiples of an eighth, of which masks would be exact.
    let (light, camera) = (light(&[(1 << 30, 0.3), (2 << 30, 0.45)]), camera(u32::MAX));
    let error = |options: &ShadowOptions| shade(&camera, &light, options).1;
    let single = error(&options("lk"));
    // 256 pixels: a deviation of 0.1 a pixel at most; 6 σ.
    assert!(single.mean.abs() < 6.0 * 0.1 / 16.0 && single.rmse > 0.02, "{single:?}");
    assert!((single.truth - 0.7 * 0.55).abs() < 1e-7, "{}", single.truth);
    let rounds = error(&ShadowOptions { rounds: 16, ..options("lk") });
    assert!(rounds.rmse < 0.5 * single.rmse, "{} {}", rounds.rmse, single.rmse);
    let filter = Filter { taps: 16, radius: 2.0, ..options("lk").filter };
    let wide = error(&ShadowOptions { filter, ..options("lk") });
    assert!(wide.rmse < 0.5 * single.rmse, "{} {}", wide.rmse, single.rmse);
    let kind = Taps::Stochastic;
    let filter = Filter { taps: 16, radius: 2.0, kind, ..filter };
    let stochastic = error(&ShadowOptions { filter, ..options("lk") });
    assert!(stochastic.rmse < 0.7 * single.rmse, "{} {}", stochastic.rmse, single.rmse);
}

#[test]
fn errors_are_told_by_depth_and_of_what_was_asked_alone() {
    let light = light(&[(1 << 31, 0.3)]);
    let mut all = fragments(&camera(1 << 28));
    let behind = fragments(&camera(u32::MAX));
    all.extend(behind.iter().take(10));
    // Not without light.
    let mut dark = behind[0];
    (dark.optional.direct_r, dark.optional.direct_g) = (0.0, 0.0);
    all.push(dark);
    let camera = trace(header(true), &all);
    let (shaded, error) = shade(&camera, &light, &options("lk"));
    let parts: Vec<(f64, u64)> = error.by_depth.iter().map(|p| (p.from, p.queries)).collect();
    assert_eq!(parts, [(0.0, 256), (0.875, 10)]);
    assert_eq!(error.by_depth[0].rmse, 0.0);
    assert!(error.by_depth[1].rmse > 0.0 && error.queries == 266);
    let shaded = fragments(&shaded);
    assert!(shaded[266..].iter().all(|f| f.colour == behind[0].colour));
}

#[test]
fn threads_change_nothing() {
    let (light, camera) = (light(&LAYERS), camera(u32::MAX - 5));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (trace, error) = pool.install(|| shade(&camera, &light, &options("enderton")));
        (trace.content().unwrap().to_string(), error)
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn what_cannot_be_shaded_is_refused() {
    let (light, camera) = (light(&LAYERS), camera(9));
    let refused = |camera: &Trace, options: &ShadowOptions| {
        let made = Shade::new(camera, &light, options, &ReplayOptions::default());
        made.map(|_| ()).unwrap_err().to_string()
    };
    let plain = trace(header(false), &[]);
    let error = refused(&plain, &options("lk"));
    assert!(error.contains("'direct_r'") && error.contains("--light"), "{error}");
    let encoded = trace(Header { space: Space::Encoded, ..header(true) }, &[]);
    assert!(refused(&encoded, &options("lk")).contains("linear"));
    assert!(refused(&camera, &options("wboit")).contains("'wboit'"));
    let nowhere = trace(Header { view: None, ..header(true) }, &[]);
    assert!(refused(&nowhere, &options("lk")).contains("from where"));
    let rounds = ShadowOptions { rounds: 0, ..options("lk") };
    assert!(refused(&camera, &rounds).contains("0 times"));
    let samples = ShadowOptions { samples: 16, ..options("lk") };
    assert!(refused(&camera, &samples).contains("16 samples"));
    let filter = Filter { taps: 5, ..Filter::default() };
    assert!(refused(&camera, &ShadowOptions { filter, ..options("lk") }).contains("5 taps"));
}

//! Views in metadata: there and back, and what is refused.

use std::collections::BTreeMap;

use super::*;
use crate::trace::header::WITH_VIEW;
use crate::trace::{Fragment, Header, SampleMask, SamplePattern, Trace, TraceWriter, WriteOptions};

/// The view of the example of `docs/TRACE_FORMAT.md`: from 10 before the origin, 90 degrees
/// from top to bottom, over a frame twice as wide as high.
fn example() -> View {
    let (near, far) = (5.0, 20.0);
    let (scale, offset) = (-far / (far - near), -far * near / (far - near));
    View {
        projection: Projection::Perspective,
        near,
        far,
        world_to_view: [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., -10., 1.],
        view_to_clip: [0.5, 0., 0., 0., 0., 1., 0., 0., 0., 0., scale, -1., 0., 0., offset, 0.],
    }
}

/// The same frame by parallel lines of sight.
fn parallel() -> View {
    let (near, far) = (-5.0, 20.0);
    let mut view = View { projection: Projection::Orthographic, near, far, ..example() };
    view.view_to_clip[10] = -1.0 / (far - near);
    view.view_to_clip[11] = 0.0;
    view.view_to_clip[14] = -near / (far - near);
    view.view_to_clip[15] = 1.0;
    view
}

fn header(view: Option<View>) -> Header {
    let pattern = SamplePattern { name: "one".into(), positions: vec![[0, 0]], nested: false };
    Header { width: 400, height: 200, pattern, view, ..Header::default() }
}

fn read(map: &BTreeMap<String, String>) -> Result<Option<View>> {
    Ok(Header::from_metadata(map, "t.arrow")?.view)
}

/// What is said of a view: when it is written and when it is read.
fn said(view: View) -> [String; 2] {
    let written = header(Some(view)).check().unwrap_err();
    assert!(written.is_config());
    let map = header(Some(view)).to_metadata();
    [written.to_string(), read(&map).unwrap_err().to_string()]
}

/// World space to clip space.
fn clip(view: &View, point: [f64; 3]) -> [f64; 4] {
    let times = |m: &[f64; 16], p: [f64; 4]| {
        std::array::from_fn(|row| (0..4).map(|column| m[4 * column + row] * p[column]).sum())
    };
    let [x, y, z] = point;
    times(&view.view_to_clip, times(&view.world_to_view, [x, y, z, 1.0]))
}

#[test]
fn a_view_comes_back_bit_for_bit() {
    let mut odd = example();
    // A turn by an angle that is no fraction of anything, and the signs of nothing.
    let (sin, cos) = libm::sincos(0.7);
    (odd.world_to_view[0], odd.world_to_view[2]) = (cos, -sin);
    (odd.world_to_view[8], odd.world_to_view[10]) = (sin, cos);
    (odd.world_to_view[1], odd.world_to_view[12]) = (-0.0, 1e-300);
    // Off the axis, as half of a frame for two eyes is.
    odd.view_to_clip[8] = 1.0 / 3.0;
    for view in [example(), parallel(), odd] {
        view.check().unwrap();
        let map = header(Some(view)).to_metadata();
        assert_eq!(map["screendoor.version"], WITH_VIEW);
        let found = read(&map).unwrap().unwrap();
        let bits = |v: &View| v.world_to_view.map(f64::to_bits);
        assert!(found == view && bits(&found) == bits(&view));
    }
}

#[test]
fn without_one_metadata_are_as_they_were() {
    let map = header(None).to_metadata();
    assert_eq!(map["screendoor.version"], "1.0");
    assert!(!map.keys().any(|key| key.contains("view")));
    assert_eq!(read(&map).unwrap(), None);
}

#[test]
fn matrices_in_single_precision_are_taken() {
    let single = |v: View, near: f32, far: f32| {
        let mut view = View { near: near.into(), far: far.into(), ..v };
        view.view_to_clip[10] = f64::from(-far / (far - near));
        view.view_to_clip[14] = f64::from(-(far * near) / (far - near));
        view.view_to_clip[0] = f64::from(1.0 / 3.0_f32);
        view.world_to_view[0] = f64::from(0.999_999_6_f32);
        view
    };
    for (near, far) in [(0.1, 1000.0), (0.01, 1e5), (0.3, 0.7), (99.0, 101.0), (999.0, 1001.0)] {
        single(example(), near, far).check().unwrap_or_else(|e| panic!("{near} {far}: {e}"));
    }
    // The whole of it in other units is the same projection.
    let mut scaled = example();
    scaled.view_to_clip.iter_mut().for_each(|v| *v *= 0.3);
    scaled.check().unwrap();
}

#[test]
fn what_contradicts_itself_is_refused_by_the_key_that_does() {
    type Change = fn(&mut View);
    let refused: [(&str, &str, Change); 17] = [
        ("near", "20.0 are no range", |v| v.near = 20.0),
        ("near", "-1.0 are no range", |v| v.far = -1.0),
        ("near", "NaN is not finite", |v| v.near = f64::NAN),
        ("near", "not before the eye", |v| v.near = 0.0),
        ("near", "1.7e308 are no range", |v| (v.near, v.far) = (-1.7e308, 1.7e308)),
        ("far", "inf is not finite", |v| v.far = f64::INFINITY),
        ("world_to_view", "-inf is not finite", |v| v.world_to_view[12] = f64::NEG_INFINITY),
        ("world_to_view", "turn, mirror and move", |v| v.world_to_view[0] = 1.001),
        ("world_to_view", "turn, mirror and move", |v| v.world_to_view[5] = 0.0),
        ("world_to_view", "turn, mirror and move", |v| v.world_to_view[3] = 1e-3),
        ("view_to_clip", "NaN is not finite", |v| v.view_to_clip[9] = f64::NAN),
        ("view_to_clip", "singular", |v| v.view_to_clip[5] = 0.0),
        ("view_to_clip", "singular", |v| v.view_to_clip[0..2].fill(1e-200)),
        ("view_to_clip", "not fit a projection that is persp", |v| v.view_to_clip[11] = 1.0),
        ("view_to_clip", "more than the distance", |v| v.view_to_clip[6] = 0.1),
        ("view_to_clip", "the plane at 5.001 the depth", |v| v.near = 5.001),
        ("view_to_clip", "the plane at 20.01 the depth", |v| v.far = 20.01),
    ];
    for (field, words, change) in refused {
        let mut view = example();
        change(&mut view);
        let [written, read] = said(view);
        assert!(written.contains(&format!("'{field}'")) && written.contains(words), "{written}");
        let place = format!("t.arrow, metadata 'screendoor.view.{field}': ");
        assert!(read.starts_with(&place) && read.contains(words), "{read}");
    }
    // Depth the other way round, as some programs store it, and a projection of another kind.
    let mut reversed = example();
    (reversed.view_to_clip[10], reversed.view_to_clip[14]) = (5.0 / 15.0, 100.0 / 15.0);
    assert!(said(reversed)[1].contains("the plane at 5.0 the depth"), "{:?}", said(reversed));
    let orthographic = View { projection: Projection::Orthographic, ..example() };
    assert!(said(orthographic)[1].contains("not fit a projection that is orthographic"));
}

#[test]
fn numbers_are_numbers_and_matrices_have_16() {
    let good = header(Some(example())).to_metadata();
    for (field, text, words) in [
        ("projection", "fisheye", "'fisheye' is not perspective or orthographic"),
        ("near", "5 metres", "'5 metres' is not a number"),
        ("far", "", "'' is not a number"),
        ("world_to_view", "1 0 0", "'1 0 0' is not 16 numbers"),
        ("view_to_clip", "a 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0", "is not 16 numbers"),
    ] {
        let mut map = good.clone();
        map.insert(format!("screendoor.view.{field}"), text.into());
        let error = read(&map).unwrap_err().to_string();
        let place = format!("t.arrow, metadata 'screendoor.view.{field}': ");
        assert!(error.starts_with(&place) && error.contains(words), "{error}");
    }
}

#[test]
fn the_content_is_the_same_with_and_without() {
    let content = |view| {
        let options = WriteOptions::default();
        let mut writer = TraceWriter::new(Vec::new(), "t", header(view), options).unwrap();
        writer.push(&Fragment { coverage: SampleMask(1), ..Fragment::default() }).unwrap();
        let (bytes, written) = writer.finish().unwrap();
        let trace = Trace::from_bytes(bytes, "t").unwrap();
        assert_eq!(trace.header().view, view);
        assert_eq!(trace.verify(|_| ()).unwrap(), written.content);
        written.content
    };
    assert_eq!(content(None), content(Some(example())));
    assert_eq!(content(None), content(Some(parallel())));
}

#[test]
fn the_documentation_s_example_is_as_it_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/TRACE_FORMAT.md");
    let text = std::fs::read_to_string(path).unwrap();
    for (key, value) in example().to_metadata() {
        let line = format!("{key}={value}\n");
        assert!(text.contains(&line), "docs/TRACE_FORMAT.md should have {line}");
    }
    let [x, y, z, w] = clip(&example(), [4.0, 2.0, 0.0]);
    let pixel = [(x / w * 0.5 + 0.5) * 400.0, (0.5 - y / w * 0.5) * 200.0];
    let depth = z / w * f64::from(u32::MAX);
    let line = format!("pixel {} {}, depth {depth:.0}, view depth {w}", pixel[0], pixel[1]);
    assert!(text.contains(&line), "docs/TRACE_FORMAT.md should have {line}");
}

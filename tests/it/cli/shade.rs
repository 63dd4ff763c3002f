//! `capture --light` and `shade`.

use serde_json::Value;

use super::Workplace;

/// A camera's trace and its light's.
fn lit() -> Workplace {
    let place = Workplace::with_trace();
    let capture = ["capture", "builtin:engine:rows=1,detail=2", "-o", "c.arrow", "--size", "64x64"];
    let light = ["--light", "directional:yaw=-50,pitch=40", "--light-trace", "l.arrow"];
    place.good(&[&capture[..], &light, &["--light-size", "96x80"]].concat());
    place
}

fn json(place: &Workplace, arguments: &[&str]) -> Value {
    serde_json::from_str(&place.good(&[arguments, &["--json", "-"][..]].concat())).unwrap()
}

#[test]
fn a_light_gives_shadows_and_its_error_falls_with_samples() {
    let place = lit();
    let shade = |samples: &str, more: &[&str]| {
        let all = ["shade", "c.arrow", "l.arrow", "-o", "s.arrow", "--samples", samples];
        json(&place, &[&all[..], more].concat())
    };
    let error = |document: &Value| document["error"]["rmse"].as_f64().unwrap();
    let [few, many] = ["1", "16"].map(|samples| shade(samples, &[]));
    assert!(error(&many) < 0.7 * error(&few) && error(&few) > 0.01, "{few} {many}");
    let queries = many["error"]["queries"].as_u64().unwrap();
    assert!(queries > 1000 && many["fragments"] == many["fragments_before"], "{many}");
    assert_eq!(many["cost"]["passes"], 1);
    // By rounds and by taps too.
    let rounds = shade("1", &["--rounds", "16"]);
    assert!(error(&rounds) < 0.7 * error(&few), "{rounds}");
    assert_eq!(rounds["cost"]["passes"], 16);
    assert!(error(&shade("1", &["--pcf", "16"])) < 0.7 * error(&few));
    // The exact answer is right, and a light that is all shadow leaves less than there was.
    let exact = shade("8", &["--design", "exact"]);
    assert_eq!((error(&exact), &exact["cost"]["state_bits"]), (0.0, &Value::Null));
    assert_eq!(many["cost"]["state_bits"], 16 * 32 + 48);
    let mean = |trace: &str| {
        place.good(&["replay", trace, "--design", "exact", "--samples", "8", "-o", "a.exr"]);
        let picture = screendoor::picture::read(place.path("a.exr"), None).unwrap();
        let pixels = (0..64).flat_map(|x| (0..64).map(move |y| (x, y)));
        let colours: Vec<[f64; 3]> = pixels.map(|(x, y)| picture.get(x, y)).collect();
        [0, 1, 2].map(|c| colours.iter().map(|colour| colour[c]).sum::<f64>())
    };
    let [dark, bright] = ["s.arrow", "c.arrow"].map(mean);
    assert!((0..3).all(|c| dark[c] < 0.98 * bright[c]), "{dark:?} {bright:?}");
    let none = shade("8", &["--no-error"]);
    assert_eq!(none["error"], Value::Null);
    let text = place.good(&["shade", "c.arrow", "l.arrow", "-o", "s.arrow", "--samples", "8"]);
    assert!(text.contains("visibility: RMSE") && text.contains("bits a pixel"), "{text}");
    assert!(place.good(&["info", "s.arrow"]).contains("shadows by lk at 8 samples"));
}

#[test]
fn what_cannot_be_shaded_is_refused_and_nothing_is_written() {
    let place = lit();
    let light = ["--light-trace", "l.arrow"];
    let capture = ["capture", "builtin:glass", "-o", "x.arrow", "--size", "8x8"];
    let cases: &[(&[&str], &str)] = &[
        (&["shade", "t.arrow", "l.arrow", "-o", "x.arrow"], "capture it with --light"),
        (&["shade", "c.arrow", "l.arrow", "-o", "x.arrow", "-d", "wboit"], "these designs tell it"),
        (&["shade", "c.arrow", "l.arrow", "-o", "x.arrow", "--pcf", "5"], "4 or 9"),
        (&["shade", "c.arrow", "l.arrow", "-o", "x.arrow", "--rounds", "0"], "1 to 64 times"),
        (&["shade", "c.arrow", "l.arrow", "-o", "x.arrow", "--bias", "2"], "[0, 1]"),
        (&["shade", "c.arrow", "l.arrow", "-o", "l.arrow"], "l.arrow"),
        (&[&capture[..], &["--light", "lamp"]].concat(), "directional"),
        (&[&capture[..], &["--light", "directional:pitch=100"]].concat(), "pitch"),
        (&[&capture[..], &["--light", "key", "--space", "encoded"]].concat(), "linear"),
        (&[&capture[..], &light].concat(), "--light <LIGHT>"),
        (&[&capture[..], &["--light", "key", "--light-trace", "x.arrow"]].concat(), "x.arrow"),
    ];
    let before = std::fs::read(place.path("l.arrow")).unwrap();
    for (arguments, says) in cases {
        let (_, error) = place.bad(arguments);
        assert!(error.contains(says), "{arguments:?}: {error}");
        assert!(!place.path("x.arrow").exists(), "{arguments:?}");
    }
    assert!(std::fs::read(place.path("l.arrow")).unwrap() == before);
}

#[test]
fn without_a_light_a_trace_is_what_it_was_but_for_nothing() {
    let place = Workplace::with_trace();
    let capture = |name: &str, more: &[&str]| {
        let all = ["capture", "builtin:cloth:cells=16", "-o", name, "--size", "32x32"];
        place.good(&[&all[..], more].concat());
    };
    capture("a.arrow", &[]);
    capture("b.arrow", &["--light", "key"]);
    let text = place.good(&["info", "a.arrow"]);
    assert!(!text.contains("direct") && !text.contains("light"), "{text}");
    // The same fragments but for what is recorded beside them.
    let trimmed = |name: &str| {
        let trace = screendoor::trace::Trace::open(place.path(name)).unwrap();
        let all = trace.batches().flat_map(|b| b.unwrap().iter().collect::<Vec<_>>());
        let bare = all.map(|f| screendoor::trace::Fragment {
            optional: screendoor::trace::OptionalValues::default(),
            ..f
        });
        bare.collect::<Vec<_>>()
    };
    assert!(trimmed("a.arrow") == trimmed("b.arrow"));
}

//! What study files may say, and what is said of those that do not.

use super::*;
use screendoor_rop::layers::LAYERS;

const SMALL: &str = "name = 'a'\ndesigns = ['lk', 'kbuffer:layers={n}']\nsamples = [4, 8]\n\
    [[scene]]\nname = 'engine'\nsource = 'builtin:engine'\n";

fn message(from: &str, to: &str) -> String {
    let text = SMALL.replace(from, to);
    assert_ne!(text, SMALL);
    Study::parse(&text, "a.toml").unwrap_err().to_string()
}

#[test]
fn what_is_left_out_has_its_default_and_is_written() {
    let study = Study::parse(SMALL, "a.toml").unwrap();
    assert_eq!((study.seeds, study.baseline.as_str()), (8, "lk"));
    assert_eq!(study.design("kbuffer:layers={n}", 8).unwrap().values().get(LAYERS), 8);
    let text = study.to_toml();
    assert!(text.contains("seeds = 8"), "{text}");
    assert_eq!(Study::parse(&text, "b.toml").unwrap(), study);
}

#[test]
fn what_is_left_out_never_contradicts_what_is_given() {
    // Without the design that takes no count.
    let any = SMALL.replace(", 'kbuffer:layers={n}'", "");
    for count in [1, 2, 4, 8, 16, 32, 64] {
        let text = any.replace("[4, 8]", &format!("[{count}]"));
        assert_eq!(Study::parse(&text, "a.toml").unwrap().pictures, [count]);
    }
    for (samples, pictures) in [("[4, 16]", 4), ("[64, 2]", 2), ("[4, 8, 16]", 8)] {
        let text = any.replace("[4, 8]", samples);
        assert_eq!(Study::parse(&text, "a.toml").unwrap().pictures, [pictures]);
    }
    let none = SMALL.replace("samples =", "pictures = []\nsamples =");
    assert!(Study::parse(&none, "a.toml").unwrap().pictures.is_empty());
    let standard = SMALL.replace("[4, 8]", "[8]") + "pattern = 'standard'\n";
    assert_eq!(Study::parse(&standard, "a.toml").unwrap().scenes[0].captured_samples, 8);
}

#[test]
fn the_default_study_is_one() {
    let study = Study::preset().unwrap();
    assert_eq!(study.baseline, "enderton");
    assert!(study.scenes.iter().all(|s| s.source.as_deref().unwrap().starts_with("builtin:")));
}

#[test]
fn publications_are_measured_once() {
    let of = |list: &str| {
        let text = SMALL.replace("[[scene]]", &format!("publications = [{list}]\n[[scene]]"));
        Study::parse(&text, "a.toml").unwrap().publications_to_measure()
    };
    assert_eq!(of("'slab', 'lk', 'slab'"), [Publication::LaineKarras, Publication::Slab]);
    assert_eq!(of("'slab', 'comparison'"), [Publication::Comparison]);
}

#[test]
fn a_wrong_key_or_name_says_where_and_the_nearest() {
    assert_eq!(
        message("samples =", "sampels ="),
        "unknown key in a.toml, line 3: 'sampels'; did you mean 'samples'?"
    );
    assert_eq!(
        message("source =", "sorce ="),
        "unknown key in a.toml, line 6: 'sorce'; did you mean 'source'?"
    );
    assert_eq!(
        message("name = 'a'", "name = 'a'\nmetrics = ['flop']"),
        "unknown name in a.toml, line 2: 'flop'; did you mean 'flip'?"
    );
    assert!(message("samples =", "Samples =").ends_with("did you mean 'samples'?"));
    assert!(message("'lk'", "'LK'").contains("did you mean 'lk'?"));
    assert_eq!(
        message("name = 'a'", "name = 'a'\nengines = ['gpo']"),
        "unknown name in a.toml, line 2: 'gpo'; did you mean 'gpu'?"
    );
    let wrong = message("'lk'", "'endertn'");
    assert!(wrong.contains("unknown design 'endertn'; did you mean 'enderton'?"), "{wrong}");
    let wrong = message("layers={n}", "layer={n}");
    assert!(wrong.contains("did you mean 'layers'?"), "{wrong}");
}

#[test]
fn what_cannot_be_is_refused() {
    for (from, to, says) in [
        ("[4, 8]", "[4, 5]", "'samples' cannot be 5"),
        ("[4, 8]", "[4, 4]", "'4' is named twice"),
        ("name = 'a'", "name = 'a'\npictures = [16]", "pictures are kept of 16 samples"),
        ("[4, 8]", "[]", "'samples' is empty"),
        ("'engine'", "'a/b'", "is no name for a scene"),
        ("'engine'", "'..'", "is no name for a scene"),
        ("name = 'engine'", "name = 'engine'\npixel = [3, 512]", "'pixel' cannot be 3, 512"),
        ("name = 'engine'", "name = 'engine'\ncaptured_samples = 8", "do not serve 4"),
        ("source = 'builtin:engine'", "", "needs either a source or a trace"),
        ("name = 'a'", "name = 'a'\nseeds = 0", "'seeds' cannot be 0"),
        ("name = 'a'", "name = 'a'\nbaseline = 'slab'", "unknown design as a baseline"),
        ("name = 'a'", "name = 'a", "line 1"),
    ] {
        let wrong = message(from, to);
        assert!(wrong.contains(says), "{wrong}");
    }
}

#[test]
fn a_study_of_traces_has_what_they_serve() {
    let place = |name: &str| {
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../traces").join(name)
    };
    let study = Study::of_traces(&[place("ramps.arrow"), place("glass.arrow")]).unwrap();
    assert_eq!(study.samples, [4, 8, 16]);
    assert_eq!(study.designs, Study::preset().unwrap().designs);
    assert!(study.publications.is_empty());
    let names: Vec<&str> = study.scenes.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names, ["ramps", "glass"]);
    assert!(study.scenes.iter().all(|s| s.trace.is_some() && s.source.is_none()));
    // One of four samples a pixel serves no more.
    let study = Study::of_traces(&[place("ramps.arrow"), place("glass-gpu.arrow")]).unwrap();
    assert_eq!((&study.samples[..], &study.pictures[..]), (&[4][..], &[4][..]));
    let twice = Study::of_traces(&[place("ramps.arrow"), place("./ramps.arrow")]);
    assert!(twice.unwrap_err().to_string().contains("two of the traces are called ramps"));
    assert!(Study::of_traces(&[place("none.arrow")]).is_err());
}

/// A study of one scene whose light's shadows have these keys.
fn with_shadow(keys: &str) -> String {
    format!("{SMALL}light = 'key'\n[scene.shadow]\n{keys}\n")
}

#[test]
fn of_shadows_with_several_values_each_combination_is_a_scene() {
    let text = with_shadow("design = ['lk', 'mlab:layers={n}']\nsamples = [1, 4]\npcf = [1, 9]");
    let study = Study::parse(&text, "a.toml").unwrap();
    let names: Vec<&str> = study.scenes.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(names.len(), 8);
    assert_eq!(
        [names[0], names[1], names[2], names[7]],
        ["engine-lk-1-1", "engine-lk-1-9", "engine-lk-4-1", "engine-mlab-layers-4-4-9"]
    );
    let last = study.scenes[7].shadow.as_ref().unwrap().options().unwrap();
    assert_eq!((last.design.label().as_str(), last.samples), ("mlab:layers=4", 4));
    assert_eq!((last.filter.taps, last.filter.radius, last.rounds), (9, 1.5, 1));
    assert_eq!(Study::parse(&study.to_toml(), "b.toml").unwrap(), study);
    // One value of each is no sweep.
    let one = Study::parse(&with_shadow("design = 'lk'\nsamples = [4]"), "a.toml").unwrap();
    assert_eq!((one.scenes.len(), one.scenes[0].name.as_str()), (1, "engine"));
    let count = one.scenes[0].shadow.as_ref().unwrap().samples();
    assert_eq!((count, one.scenes[0].light.as_deref()), (4, Some("key")));
}

#[test]
fn shadows_that_cannot_be_are_refused() {
    for (keys, says) in [
        ("design = 'blend'", "does not tell how much light"),
        ("design = ['lk', 'blend']", "does not tell how much light"),
        ("design = 'lkk'", "did you mean 'lk'?"),
        ("design = []", "'design' of scene 'engine' is empty"),
        ("design = 'lk'\nsamples = 3", "cannot have 3 samples"),
        ("design = 'lk'\nsamples = 'many'", "neither a value of this key nor a list"),
        ("design = 'lk'\npcf = [1, 5]", "do not lie on a square grid"),
        ("design = 'lk'\nrounds = 65", "cannot be drawn 65 times"),
        ("design = 'lk'\nsize = [0, 4]", "cannot be 0 pixels wide"),
        ("design = 'lk'\nbias = -1.0", "the bias of a filter cannot be -1"),
        ("design = 'lk'\ntap = 4", "did you mean 'taps'?"),
        ("samples = 8", "design"),
    ] {
        let wrong = Study::parse(&with_shadow(keys), "a.toml").unwrap_err().to_string();
        assert!(wrong.contains(says), "{keys}: {wrong}");
        assert!(wrong.matches("correct it").count() <= 1, "{wrong}");
    }
    let refused = |change: (&str, &str)| {
        let text = with_shadow("design = 'lk'").replace(change.0, change.1);
        Study::parse(&text, "a.toml").unwrap_err().to_string()
    };
    let wrong = refused(("light = 'key'\n", ""));
    assert!(wrong.contains("scene 'engine' has a shadow and no light"), "{wrong}");
    assert!(refused(("'key'", "'lamp'")).contains("unknown light 'lamp'"));
    let wrong = refused(("source = 'builtin:engine'", "trace = 'a.arrow'"));
    assert!(wrong.contains("a trace, and a light beside it"), "{wrong}");
    let wrong = refused(("light =", "captured_samples = 4\nlight ="));
    assert!(wrong.contains("captured with 4 samples, which do not serve 8"), "{wrong}");
}

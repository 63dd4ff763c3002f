//! What is said of shaders, against what their sources say.

use screendoor_vulkan_layer::spirv::{Facts, Options, Output, fragment, inputs, outputs, vertex};

use crate::corpus::module;

const PLAIN: Facts = Facts {
    early_tests: false,
    per_sample: false,
    writes_depth: false,
    writes_mask: false,
    output: Output::Float(4),
};

fn at(name: &str, entry: &str, location: u32) -> Result<Facts, String> {
    let options = Options { set: 3, location, ..Options::default() };
    fragment(&module(name).words, entry, &options).map(|(_, facts)| facts)
}

fn main_at_0(name: &str) -> Facts {
    at(name, "main", 0).unwrap_or_else(|reason| panic!("{name}: {reason}"))
}

#[test]
fn facts_are_what_the_sources_say() {
    let plain =
        ["plain.frag", "discard.frag", "demote.frag", "helper.frag", "busy.frag", "own.frag"];
    for name in plain {
        assert_eq!(main_at_0(name), PLAIN, "{name}");
    }
    for name in ["asm_unwritten.frag", "dual.frag", "zink_09"] {
        let early_tests = name == "zink_09";
        assert_eq!(main_at_0(name), Facts { early_tests, ..PLAIN }, "{name}");
    }
    let sampled = [
        "sample_id.frag",
        "sample_position.frag",
        "sample_block.frag",
        "sample_unused.frag",
        "zink_07",
    ];
    for name in sampled {
        assert_eq!(main_at_0(name), Facts { per_sample: true, ..PLAIN }, "{name}");
    }
    let both = Facts { per_sample: true, writes_mask: true, ..PLAIN };
    assert_eq!(main_at_0("sample_in.frag"), both);
    for name in ["depth.frag", "depth_less.frag", "zink_03"] {
        assert_eq!(main_at_0(name), Facts { writes_depth: true, ..PLAIN }, "{name}");
    }
    for name in ["mask.frag", "zink_05", "asm_initialized.frag"] {
        assert_eq!(main_at_0(name), Facts { writes_mask: true, ..PLAIN }, "{name}");
    }
    for name in ["early.frag", "early_depth.frag", "post_depth.frag"] {
        assert_eq!(main_at_0(name), Facts { early_tests: true, ..PLAIN }, "{name}");
    }
    let late = Facts { early_tests: true, writes_depth: true, ..PLAIN };
    assert_eq!(main_at_0("asm_early_and_late.frag"), late);
    let grouped = Facts { per_sample: true, writes_depth: true, ..PLAIN };
    assert_eq!(main_at_0("asm_groups.frag"), grouped);
    let cut = Facts { writes_depth: true, writes_mask: true, ..PLAIN };
    assert_eq!(main_at_0("hlsl_cut.frag"), cut);

    let entries = [
        ("masked", Facts { writes_mask: true, ..PLAIN }),
        ("only_out", Facts { writes_mask: true, ..PLAIN }),
        ("each", Facts { per_sample: true, ..PLAIN }),
        ("interpolated", Facts { per_sample: true, ..PLAIN }),
    ];
    for (entry, facts) in entries {
        assert_eq!(at("naga_multisample", entry, 0), Ok(facts), "{entry}");
    }
    assert_eq!(at("naga_outputs", "depth", 0), Ok(Facts { writes_depth: true, ..PLAIN }));
}

#[test]
fn outputs_are_found_at_their_locations() {
    let output = |name, location| at(name, "main", location).map(|facts| facts.output);
    let cases = [
        ("nothing.frag", 0, Output::None),
        ("plain.frag", 1, Output::None),
        ("scalar.frag", 0, Output::Float(1)),
        ("scalar.frag", 1, Output::None),
        ("scalar.frag", 2, Output::Float(3)),
        ("targets.frag", 0, Output::Float(4)),
        ("targets.frag", 1, Output::Float(2)),
        ("targets.frag", 2, Output::Float(2)),
        ("targets.frag", 3, Output::Integer),
        ("targets.frag", 4, Output::None),
        ("integer.frag", 0, Output::Integer),
        // Of three components the third is not there; two begin at the second.
        ("components.frag", 0, Output::Float(4)),
        ("components.frag", 1, Output::Float(3)),
        ("components.frag", 2, Output::Float(3)),
        ("components.frag", 3, Output::None),
        ("half.frag", 0, Output::Half(4)),
        ("half.frag", 1, Output::Half(1)),
        ("half_arithmetic.frag", 0, Output::Half(3)),
        ("asm_half_storage.frag", 0, Output::Half(2)),
        ("asm_half_storage.frag", 1, Output::Half(1)),
        ("asm_specialized.frag", 0, Output::Float(4)),
        ("asm_specialized.frag", 4, Output::Float(4)),
        ("zink_11", 0, Output::Float(4)),
        ("zink_11", 1, Output::Float(4)),
        ("hlsl_cut.frag", 1, Output::Float(4)),
    ];
    for (name, location, expected) in cases {
        assert_eq!(output(name, location), Ok(expected), "{name} at {location}");
    }
    let unknown = "an array of outputs has a specialization constant's length";
    assert_eq!(output("asm_specialized.frag", 1), Err(unknown.into()));
    assert_eq!(at("naga_outputs", "targets", 2).map(|f| f.output), Ok(Output::Integer));
    assert_eq!(at("naga_half", "half", 0).map(|f| f.output), Ok(Output::Half(4)));
    assert_eq!(at("naga_dual", "both", 0).map(|f| f.output), Ok(Output::Float(4)));
}

#[test]
fn locations_are_counted() {
    let written = [
        ("plain.vert", 4),
        ("nothing.vert", 0),
        ("block.vert", 11),
        ("members.vert", 16),
        ("block_array.vert", 11),
        ("doubles.vert", 12),
        ("instance.vert", 1),
        ("feedback.vert", 1),
        ("asm_block_locations.vert", 12),
        ("hlsl_corner.vert", 6),
        // One colour, two vectors packed into one, a matrix of two columns into one.
        ("zink_00", 3),
        ("zink_02", 2),
        ("zink_08", 0),
    ];
    for (name, n) in written {
        assert_eq!(outputs(&module(name).words, "main"), Ok(n), "{name}");
    }
    let read = [
        ("plain.frag", 1),
        ("nothing.frag", 0),
        ("block.frag", 11),
        ("sample_block.frag", 4),
        ("per_vertex.frag", 3),
        ("clip.frag", 0),
        ("busy.frag", 2),
        ("own.frag", 1),
        ("asm_groups.frag", 5),
        ("asm_member_inputs.frag", 0),
        ("zink_01", 3),
    ];
    for (name, n) in read {
        assert_eq!(inputs(&module(name).words, "main"), Ok(n), "{name}");
    }
    assert_eq!(outputs(&module("naga_scene").words, "corner"), Ok(6));
    assert_eq!(outputs(&module("naga_scene").words, "plain"), Ok(0));
    assert_eq!(inputs(&module("naga_scene").words, "holes"), Ok(6));
    let specialized = "an array between stages has a specialization constant's length";
    assert_eq!(outputs(&module("specialized.vert").words, "main"), Err(specialized.into()));
}

#[test]
fn refusals_are_told() {
    let plain = module("plain.frag").words;
    let with = |options: Options| fragment(&plain, "main", &options).unwrap_err();
    let options = Options { set: 3, ..Options::default() };
    assert_eq!(
        fragment(&plain, "x", &options).unwrap_err(),
        "the module has no entry point 'x' of this stage"
    );
    assert_eq!(
        vertex(&plain, "main", 0).unwrap_err(),
        "the module has no entry point 'main' of this stage"
    );
    assert_eq!(
        with(Options { instance: Some(0), ..options.clone() }),
        "location 0 is the shader's own: the first free is 1"
    );
    assert_eq!(
        vertex(&module("plain.vert").words, "main", 3).unwrap_err(),
        "location 3 is the shader's own: the first free is 4"
    );
    assert_eq!(
        fragment(&module("busy.frag").words, "main", &Options { set: 1, ..options }).unwrap_err(),
        "descriptor set 1 is the module's own"
    );
    assert_eq!(outputs(&[], "main").unwrap_err(), "this is no SPIR-V module");
}

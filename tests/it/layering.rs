//! The crates lie along the one-way flow of `docs/ARCHITECTURE.md`, and the files of the
//! contract of designs need each other in no circle. That a crate cannot name what lies above
//! it is the compiler's to say; here it is held what lies above what.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

type Graph = BTreeMap<String, BTreeSet<String>>;

/// What can be reached from `start`, itself left out unless a circle leads back to it.
fn reached(graph: &Graph, start: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut open = vec![start.to_string()];
    while let Some(node) = open.pop() {
        for next in graph.get(&node).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    found
}

/// The crates of the workspace, and which of them each depends on.
fn crates() -> Graph {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut graph = Graph::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let manifest = fs::read_to_string(path.join("Cargo.toml")).unwrap();
        // What tests need may lie anywhere.
        let manifest = manifest.split("[dev-dependencies]").next().unwrap();
        let needs = manifest.lines().filter_map(|line| line.strip_prefix("screendoor-"));
        let needs = needs.map(|l| l.split(['.', ' ', '=']).next().unwrap().to_string()).collect();
        graph.insert(path.file_name().unwrap().to_string_lossy().into_owned(), needs);
    }
    graph
}

#[test]
fn crates_know_only_what_lies_below_them() {
    let graph = crates();
    // A crate may know those that its row reaches, none else.
    let order =
        ["vulkan-layer", "trace", "vulkan", "scene", "rop", "designs", "gpu", "study", "report"];
    for (i, name) in order.iter().enumerate() {
        let above: BTreeSet<String> = order[i..].iter().map(|n| n.to_string()).collect();
        let wrong: Vec<_> = reached(&graph, name).intersection(&above).cloned().collect();
        assert!(wrong.is_empty(), "screendoor-{name} reaches {wrong:?}");
    }
    // Designs know no device and no scene, devices no study; and nothing but the command line
    // knows of captures of other programs.
    for (name, none_of) in [
        ("designs", ["scene", "gpu"]),
        ("rop", ["scene", "designs"]),
        ("trace", ["vulkan", "vulkan-layer"]),
        ("report", ["vulkan", "vulkan-layer"]),
    ] {
        let reached = reached(&graph, name);
        assert!(none_of.iter().all(|n| !reached.contains(*n)), "{name} reaches {reached:?}");
    }
    // What lives in other programs knows nothing of ours, and what reads its files knows traces.
    assert!(reached(&graph, "vulkan-layer").is_empty());
    let below = ["trace", "vulkan-layer"].map(str::to_string);
    assert_eq!(reached(&graph, "vulkan"), below.into());
    let aside = ["vulkan", "vulkan-layer", "xtask"];
    let known: BTreeSet<&str> = order.into_iter().chain(aside).collect();
    assert_eq!(graph.keys().map(String::as_str).collect::<BTreeSet<_>>(), known);
}

/// Which files of `folder` each of them imports, by `use {prefix}::FILE::`.
fn files(folder: &Path, prefix: &str) -> Graph {
    let mut graph = Graph::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "rs") {
            continue;
        }
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        graph.insert(name, imports(&fs::read_to_string(&path).unwrap(), prefix));
    }
    graph
}

fn imports(source: &str, prefix: &str) -> BTreeSet<String> {
    let code = source.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code = code.collect::<Vec<_>>().join("\n");
    let after = code.split(prefix).skip(1).filter_map(|rest| rest.strip_prefix("::"));
    let name = |rest: &str| -> String {
        rest.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '_').collect()
    };
    after.map(name).filter(|name| !name.is_empty()).collect()
}

/// The files that need themselves by way of others.
fn circles(graph: &Graph) -> Vec<&String> {
    graph.keys().filter(|name| reached(graph, name).contains(*name)).collect()
}

#[test]
fn the_contract_of_designs_has_no_circle() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/rop/src/contract");
    let graph = files(&folder, "crate::contract");
    assert!(graph["port"].contains("design"), "imports are found: {graph:?}");
    assert_eq!(circles(&graph), Vec::<&String>::new());
    // Nor does it know what stands on it.
    for file in graph.keys() {
        let source = fs::read_to_string(folder.join(file).with_extension("rs")).unwrap();
        let known = imports(&source, "crate");
        let below = ["contract", "lanes", "resolve", "shader", "Shader"];
        let above: Vec<_> = known.iter().filter(|n| !below.contains(&n.as_str())).collect();
        assert!(above.is_empty(), "contract/{file}.rs imports {above:?}");
    }
}

#[test]
fn a_planted_circle_is_found() {
    let planted = [("a", "use crate::kit::b::B;"), ("b", "// x\nuse crate::kit::c::C;"), ("c", "")];
    let mut graph: Graph =
        planted.iter().map(|(n, t)| (n.to_string(), imports(t, "crate::kit"))).collect();
    assert_eq!(circles(&graph), Vec::<&String>::new());
    graph.insert("b".to_string(), imports("use crate::kit::a::A;", "crate::kit"));
    assert_eq!(circles(&graph), ["a", "b"]);
}

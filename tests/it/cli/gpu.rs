//! The program with a GPU, and without.

use std::process::Command;

use serde_json::Value;

use super::{PROGRAM, Workplace};
use crate::measured::Run;
use crate::util::gpu;

#[test]
fn a_gpu_and_the_processor_give_one_picture() {
    if gpu().is_none() {
        return;
    }
    let place = Workplace::with_trace();
    let replay = |engine: &str| -> Value {
        let arguments =
            ["replay", "t.arrow", "--samples", "8", "--engine", engine, "--json", "-", "--exact"];
        serde_json::from_str(&place.good(&arguments)).unwrap()
    };
    let (of_gpu, of_cpu) = (replay("gpu"), replay("fast"));
    for same in ["picture", "fragments", "touched_tiles", "errors", "state_bits"] {
        assert_eq!(of_gpu[same], of_cpu[same], "{same}");
    }
    assert!(of_gpu["events"].is_null() && of_cpu["gpu"].is_null());
    assert!(of_gpu["gpu"]["adapter"]["name"].as_str().is_some_and(|name| !name.is_empty()));
    let text = place.good(&["replay", "t.arrow", "--engine", "gpu"]);
    assert!(text.contains("upload ") && text.contains("not counted on a GPU"), "{text}");
}

#[test]
fn throughput_is_measured_side_by_side() {
    let place = Workplace::with_trace();
    let engines = if gpu().is_some() { "fast,reference,gpu" } else { "fast,reference" };
    let arguments = ["throughput", "t.arrow", "--designs", "lk:sort=false,compact=false,exact"];
    let arguments = [&arguments[..], &["--samples", "4,8", "--engines", engines, "--runs", "2"]];
    let arguments = arguments.concat();
    let json = place.good(&[&arguments[..], &["--json", "-"]].concat());
    let document: Value = serde_json::from_str(&json).unwrap();
    let results = document["results"].as_array().unwrap();
    assert_eq!(results.len(), 2 * 2 * engines.split(',').count());
    for result in results {
        let (design, engine) = (&result["design"], &result["engine"]);
        if design == "exact" && engine == "gpu" {
            // A fact, and no figure.
            assert_eq!(result["missing"], "no port to GPUs");
            assert!(result["whole"].is_null());
            continue;
        }
        let [low, median, high] =
            ["low", "median", "high"].map(|q| result["whole"][q].as_f64().unwrap());
        assert!(0.0 < low && low <= median && median <= high);
        assert_eq!(result["kernel"].is_null(), engine != "gpu", "{result}");
        assert!(result["fragments"].as_u64().unwrap() > 1000);
    }
    let table = place.good(&arguments);
    assert!(table.contains("lk:sort=false,compact=false") && table.contains("M frag/s"), "{table}");
}

#[test]
fn a_gpu_that_is_not_there_is_told() {
    let place = Workplace::with_trace();
    // An adapter for an engine that needs none.
    let (code, error) = place.bad(&["replay", "t.arrow", "--adapter", "x"]);
    assert_eq!(code, 2);
    assert!(error.contains("add --engine gpu"), "{error}");
    let (code, error) =
        place.bad(&["throughput", "t.arrow", "--engines", "fast", "--adapter", "x"]);
    assert_eq!(code, 2);
    assert!(error.contains("add --engine gpu"), "{error}");
    let (code, error) = place.bad(&["replay", "t.arrow", "--engine", "cpu"]);
    assert_eq!(code, 2);
    assert!(error.contains("possible values") && error.contains("gpu"), "{error}");
    if cfg!(target_os = "linux") {
        // The Vulkan loader looks here alone.
        let output = Command::new(PROGRAM)
            .args(["replay", "t.arrow", "--engine", "gpu", "-o", "t.exr"])
            .current_dir(place.path("."))
            .env("VK_DRIVER_FILES", "/nowhere")
            .env("VK_ICD_FILENAMES", "/nowhere")
            .output()
            .unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.contains("no adapter was found; install a Vulkan driver"), "{error}");
        assert!(!place.path("t.exr").exists());
    }
}

/// A library below the drivers complains where no display server has set this variable.
#[test]
#[cfg(target_os = "linux")]
fn a_driver_is_quiet() {
    if gpu().is_none() {
        return;
    }
    let place = Workplace::with_trace();
    let replay = ["-q", "replay", "t.arrow", "--engine", "gpu"];
    let said = |name: &str| {
        let run = Run::changed(&place.path("."), &replay, |command| {
            command.env_remove("XDG_RUNTIME_DIR").env_remove("DISPLAY");
            command.env("WAYLAND_DISPLAY", name);
        });
        assert!(run.status.success(), "{}", run.error);
        run.error
    };
    // Whether or not there is a display's name to look for.
    assert_eq!(said(""), "");
    assert_eq!(said("wayland-0"), "");
}

#![no_main]

#[path = "../../tests/it/inputs.rs"]
mod inputs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    inputs::named("gltf").take(bytes);
});

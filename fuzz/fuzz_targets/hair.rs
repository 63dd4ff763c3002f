#![no_main]

#[path = "../../tests/it/inputs.rs"]
mod inputs;
#[path = "../limit.rs"]
mod limit;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    inputs::named("hair").take(bytes);
});

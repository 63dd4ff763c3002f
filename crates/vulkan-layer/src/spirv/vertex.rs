//! Vertex shaders that hand down the instance's number.

use super::editor::Editor;
use super::module::Module;
use super::spec::{built_in, class, decoration, model, op};

/// A vertex shader that does what it did, and writes `gl_InstanceIndex` at `location`.
///
/// Why it cannot be made is said in one line.
pub fn vertex(words: &[u32], entry: &str, location: u32) -> Result<Vec<u32>, String> {
    let module = Module::parse(words)?;
    let mut e = Editor::new(&module, model::VERTEX, entry)?;
    e.require_free(class::OUTPUT, location)?;
    if e.built_in(class::OUTPUT, built_in::PRIMITIVE_SHADING_RATE).is_some() {
        return Err("the vertex shader gives a shading rate".into());
    }
    let uint = e.uint();
    let instance = e.built_in_input(built_in::INSTANCE_INDEX, uint, false);
    let output = e.variable(class::OUTPUT, uint);
    e.decorate(output, &[decoration::LOCATION, location]);
    e.decorate(output, &[decoration::FLAT]);

    let function = e.begin();
    e.call();
    let instance = e.load_integer(class::INPUT, instance, "gl_InstanceIndex")?;
    e.put(op::STORE, &[output, instance]);
    e.finish(function)
}

//! What the shaders know of columns, made of the table of columns: the structure `Columns`
//! of where they lie, and for each the function `column_NAME` that loads its value in a row.

use std::fmt::Write;
use std::sync::LazyLock;

use screendoor_rop::Shader;
use screendoor_trace::trace::{ColumnId, ColumnKind, ValueType};

static COLUMNS: LazyLock<String> = LazyLock::new(|| {
    let member = |id: ColumnId| format!("    @align(16) {}: Column,\n", id.name());
    let members: String = ColumnId::ALL.into_iter().map(member).collect();
    format!("// uses: column\nstruct Columns {{\n{members}}}\n")
});

static LOADERS: LazyLock<String> = LazyLock::new(|| {
    let mut text = "// uses: value\n".to_string();
    for id in ColumnId::ALL {
        let (name, bytes) = (id.name(), bytes_constant(id));
        let given = format!("params.columns.{name}, {bytes}, row");
        let (to, load) = match id.kind() {
            ColumnKind::Mask => ("vec2<u32>", format!("load_mask({given})")),
            ColumnKind::Real => ("f32", format!("load_real({given})")),
            ColumnKind::Whole => match id.narrowest(1) {
                ValueType::I32 => ("i32", format!("bitcast<i32>(load_word({given}))")),
                _ => ("u32", format!("load_word({given})")),
            },
        };
        writeln!(text, "fn column_{name}(row: u32) -> {to} {{\n    return {load};\n}}")
            .expect("strings can be written to");
    }
    text
});

/// The generated text of this name, if it is one.
pub(crate) fn named(name: &str) -> Option<Shader> {
    let text: &'static str = match name {
        "columns" => &COLUMNS,
        "loaders" => &LOADERS,
        _ => return None,
    };
    Some(Shader { name: if name == "columns" { "columns" } else { "loaders" }, text })
}

/// The name of the shaders' constant that says how many bytes a column's values have: none
/// of a constant.
pub(crate) fn bytes_constant(id: ColumnId) -> String {
    format!("{}_BYTES", id.name().to_uppercase())
}

//! The texts of shaders, each beside the Rust file whose twin it is.

/// A shader file. Those that it uses it names in a line `// uses: a b`: shaders of the kits
/// ([`crate::SHADERS`]) and of the device's own (`bindings`, `fragment`, `mask`,
/// `random`, `replay`, `resolve`, `state` and others in `gpu/shaders`).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shader {
    /// Its name, that of the file.
    pub name: &'static str,
    /// Its text, in WGSL.
    pub text: &'static str,
}

impl Shader {
    /// The names of the files that it uses.
    pub fn uses(&self) -> impl Iterator<Item = &'static str> + use<> {
        let lines = self.text.lines().filter_map(|line| line.strip_prefix("// uses: "));
        lines.flat_map(str::split_whitespace)
    }
}

/// The shader `NAME.wgsl` beside this Rust file, or in the folder given before it.
#[macro_export]
macro_rules! shader {
    ($name:literal) => {
        $crate::shader!("", $name)
    };
    ($folder:literal, $name:literal) => {
        $crate::Shader { name: $name, text: include_str!(concat!($folder, $name, ".wgsl")) }
    };
}

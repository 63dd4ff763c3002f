//! The stored modules, and every way in which they are rewritten.

use std::fs;
use std::path::Path;

use screendoor_vulkan_layer::spirv::{self, Facts, Options};

/// Execution models of entry points.
pub(crate) const VERTEX: u32 = 0;
pub(crate) const FRAGMENT: u32 = 4;

pub(crate) struct Module {
    /// The file's, without the environment.
    pub(crate) name: String,
    /// In which environment it is valid, as `spirv-val` has it.
    pub(crate) environment: String,
    pub(crate) words: Vec<u32>,
}

/// All of them, by name.
pub(crate) fn modules() -> Vec<Module> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/spv");
    let mut modules: Vec<Module> = fs::read_dir(&folder)
        .expect("the corpus is there")
        .map(|entry| {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            let at = name.find(".vulkan").expect("a name ends with the environment");
            Module {
                name: name[..at].into(),
                environment: name[at + 1..].into(),
                words: words(&fs::read(&path).unwrap()),
            }
        })
        .collect();
    modules.sort_by(|a, b| (&a.name, &a.environment).cmp(&(&b.name, &b.environment)));
    modules
}

/// One of them, for the oldest environment that is there.
pub(crate) fn module(name: &str) -> Module {
    modules().into_iter().find(|m| m.name == name).unwrap_or_else(|| panic!("no module {name}"))
}

pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

impl Module {
    /// Execution models and names.
    pub(crate) fn entries(&self) -> Vec<(u32, String)> {
        let mut entries = Vec::new();
        let mut at = 5;
        while at < self.words.len() {
            let (op, n) = (self.words[at] & 0xffff, (self.words[at] >> 16) as usize);
            if op == 15 {
                let name = self.words[at + 3..at + n].iter().flat_map(|word| word.to_le_bytes());
                let name: Vec<u8> = name.take_while(|byte| *byte != 0).collect();
                entries.push((self.words[at + 1], String::from_utf8(name).unwrap()));
            }
            at += n;
        }
        entries
    }
}

/// One way to rewrite one entry point.
pub(crate) struct Rewrite {
    pub(crate) model: u32,
    pub(crate) entry: String,
    /// Of a fragment shader.
    pub(crate) options: Options,
    /// Of a vertex shader.
    pub(crate) location: u32,
}

/// Far above what the corpus uses.
pub(crate) const LOCATION: u32 = 29;

impl Rewrite {
    pub(crate) fn run(&self, words: &[u32]) -> Result<(Vec<u32>, Option<Facts>), String> {
        if self.model == VERTEX {
            Ok((spirv::vertex(words, &self.entry, self.location)?, None))
        } else {
            let (words, facts) = spirv::fragment(words, &self.entry, &self.options)?;
            Ok((words, Some(facts)))
        }
    }

    pub(crate) fn describe(&self) -> String {
        let Options { primitive_id, address, instance, .. } = self.options;
        format!(
            "{}: primitive {primitive_id}, address {address}, instance {instance:?}",
            self.entry
        )
    }
}

/// Every way to rewrite a module.
pub(crate) fn rewrites(module: &Module) -> Vec<Rewrite> {
    let mut all = Vec::new();
    for (model, entry) in module.entries() {
        let ways = match model {
            VERTEX => 1,
            FRAGMENT => 8,
            _ => 0,
        };
        for way in 0..ways {
            let options = Options {
                set: 3,
                location: 0,
                primitive_id: way & 1 != 0,
                address: way & 2 != 0,
                instance: (way & 4 != 0).then_some(LOCATION),
            };
            all.push(Rewrite { model, entry: entry.clone(), options, location: LOCATION });
        }
    }
    all
}

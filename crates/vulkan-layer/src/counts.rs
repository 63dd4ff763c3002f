//! How many descriptors layouts have, of those that devices have few of.

use ash::vk;

use crate::resources::KINDS;

/// Descriptors of the kinds that our set holds, too: all, by set and by fragment shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub dynamic_uniforms: u32,
    pub uniforms: u32,
    pub storages: u32,
    pub stage_uniforms: u32,
    pub stage_storages: u32,
    pub stage_all: u32,
    /// What a fragment shader can write.
    pub outputs: u32,
}

impl Counts {
    /// Each of them with that of another.
    pub(crate) fn with(self, other: Self, what: impl Fn(u32, u32) -> u32) -> Self {
        Self {
            dynamic_uniforms: what(self.dynamic_uniforms, other.dynamic_uniforms),
            uniforms: what(self.uniforms, other.uniforms),
            storages: what(self.storages, other.storages),
            stage_uniforms: what(self.stage_uniforms, other.stage_uniforms),
            stage_storages: what(self.stage_storages, other.stage_storages),
            stage_all: what(self.stage_all, other.stage_all),
            outputs: what(self.outputs, other.outputs),
        }
    }

    /// Of our own set.
    pub(crate) fn ours() -> Self {
        KINDS.iter().fold(Self::default(), |mut all, kind| {
            all.add(*kind, 1, true);
            all
        })
    }

    pub(crate) fn add(&mut self, kind: vk::DescriptorType, n: u32, fragment: bool) {
        use vk::DescriptorType as D;
        let stage = if fragment { n } else { 0 };
        self.stage_all += stage;
        match kind {
            D::UNIFORM_BUFFER | D::UNIFORM_BUFFER_DYNAMIC => {
                self.uniforms += n;
                self.stage_uniforms += stage;
                self.dynamic_uniforms += if kind == D::UNIFORM_BUFFER { 0 } else { n };
            }
            D::STORAGE_BUFFER | D::STORAGE_BUFFER_DYNAMIC => {
                self.storages += n;
                self.stage_storages += stage;
                self.outputs += stage;
            }
            D::STORAGE_IMAGE | D::STORAGE_TEXEL_BUFFER => self.outputs += stage,
            _ => {}
        }
    }

    pub(crate) fn fit(self, most: Self) -> bool {
        self.with(most, u32::min) == self
    }
}

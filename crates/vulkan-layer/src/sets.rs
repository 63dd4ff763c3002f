//! Which descriptor sets a command buffer has bound, and which of them our own binding disturbed.
//!
//! To bind a set with a pipeline layout disturbs what was bound before with a layout that is not
//! compatible with it up to that set (Vulkan 1.3, 14.2.2, 'Pipeline Layout Compatibility'). Programs
//! bind with the layouts that they draw with, so that it does not happen to them; our set, bound for
//! each draw with the pipeline's layout, may do so to sets that this pipeline does not use. They are
//! bound again before the next draw that can use them.

use ash::vk;

use crate::layouts::PipelineLayout;

/// A set as the program bound it.
#[derive(Clone)]
struct Bound {
    set: vk::DescriptorSet,
    layout: PipelineLayout,
    offsets: Vec<u32>,
    disturbed: bool,
}

/// What a command buffer has bound for drawing.
#[derive(Default)]
pub(crate) struct Sets {
    bound: Vec<Option<Bound>>,
}

/// A set to bind again: its place, itself, its dynamic offsets.
pub(crate) type Again = (u32, vk::DescriptorSet, Vec<u32>);

impl Sets {
    /// The program binds sets from `first` on.
    pub(crate) fn bind(
        &mut self,
        layout: &PipelineLayout,
        first: u32,
        sets: &[vk::DescriptorSet],
        mut offsets: &[u32],
    ) {
        for (set, at) in sets.iter().zip(first as usize..) {
            let dynamic = layout.sets.get(at).map_or(0, |s| s.dynamic as usize);
            let (own, rest) = offsets.split_at(dynamic.min(offsets.len()));
            offsets = rest;
            let bound = Bound {
                set: *set,
                layout: layout.clone(),
                offsets: own.to_vec(),
                disturbed: false,
            };
            self.put(at, Some(bound));
        }
    }

    /// The program pushes descriptors, which cannot be bound again.
    pub(crate) fn push(&mut self, set: u32) {
        self.put(set as usize, None);
    }

    fn put(&mut self, at: usize, bound: Option<Bound>) {
        if self.bound.len() <= at {
            self.bound.resize(at + 1, None);
        }
        self.bound[at] = bound;
    }

    /// What is to be bound again before a draw with `layout`.
    pub(crate) fn again(&mut self, layout: &PipelineLayout) -> Vec<Again> {
        let mut again = Vec::new();
        for (at, bound) in self.bound.iter_mut().enumerate() {
            let Some(bound) = bound.as_mut().filter(|bound| bound.disturbed) else { continue };
            let own = bound.layout.sets.get(at).map(|s| s.identity);
            // Else the draw cannot use it, and it stays disturbed.
            if own.is_some() && own == layout.sets.get(at).map(|s| s.identity) {
                again.push((at as u32, bound.set, bound.offsets.clone()));
                bound.layout = layout.clone();
                bound.disturbed = false;
            }
        }
        again
    }

    /// Our own set was bound with `layout`.
    pub(crate) fn disturb(&mut self, layout: &PipelineLayout) {
        for (at, bound) in self.bound.iter_mut().enumerate() {
            if let Some(bound) = bound
                && !bound.layout.compatible(layout, at)
            {
                bound.disturbed = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle;

    use super::*;
    use crate::layouts::SetLayout;

    fn layout(sets: &[u64]) -> PipelineLayout {
        let sets = sets.iter().map(|&identity| SetLayout { identity, dynamic: 1 }).collect();
        PipelineLayout { sets, ours: true, ..PipelineLayout::default() }
    }

    fn set(n: u64) -> vk::DescriptorSet {
        vk::DescriptorSet::from_raw(n)
    }

    #[test]
    fn what_another_layout_disturbs_is_bound_again_when_it_can_be_used() {
        let (a, b) = (layout(&[1, 2]), layout(&[1]));
        let mut sets = Sets::default();
        sets.bind(&a, 0, &[set(10), set(20)], &[100, 200]);
        sets.disturb(&a);
        assert!(sets.again(&a).is_empty());
        // B shares set 0 alone: set 1 is lost to whoever binds at the end of B.
        assert!(sets.again(&b).is_empty());
        sets.disturb(&b);
        assert!(sets.again(&b).is_empty());
        assert_eq!(sets.again(&a), [(1, set(20), vec![200])]);
        assert!(sets.again(&a).is_empty());
    }

    #[test]
    fn other_push_constants_disturb_all() {
        let a = layout(&[1, 2]);
        let b = PipelineLayout { push: 7, ..a.clone() };
        let mut sets = Sets::default();
        sets.bind(&a, 0, &[set(10), set(20)], &[100, 200]);
        sets.disturb(&b);
        assert_eq!(sets.again(&a).len(), 2);
        sets.bind(&a, 1, &[set(30)], &[300]);
        sets.push(0);
        sets.disturb(&b);
        assert_eq!(sets.again(&b), [(1, set(30), vec![300])]);
    }
}

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
    /// None where it was pushed: then it cannot be bound again, and is never to be disturbed.
    set: Option<vk::DescriptorSet>,
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
        self.forget_pushed(layout);
        for (set, at) in sets.iter().zip(first as usize..) {
            let dynamic = layout.sets.get(at).map_or(0, |s| s.dynamic as usize);
            let (own, rest) = offsets.split_at(dynamic.min(offsets.len()));
            offsets = rest;
            let bound = Bound {
                set: Some(*set),
                layout: layout.clone(),
                offsets: own.to_vec(),
                disturbed: false,
            };
            self.put(at, Some(bound));
        }
    }

    /// The program pushes descriptors.
    pub(crate) fn push(&mut self, layout: &PipelineLayout, set: u32) {
        self.forget_pushed(layout);
        let (layout, offsets) = (layout.clone(), Vec::new());
        self.put(set as usize, Some(Bound { set: None, layout, offsets, disturbed: false }));
    }

    /// The program binds sets with a layout that is not known.
    pub(crate) fn lose(&mut self, first: u32, n: u32) {
        (first..first + n).for_each(|at| self.put(at as usize, None));
    }

    /// What the program itself disturbs, binding with `layout`, is not ours to keep.
    fn forget_pushed(&mut self, layout: &PipelineLayout) {
        for (at, bound) in self.bound.iter_mut().enumerate() {
            let lost = |b: &mut Bound| b.set.is_none() && !b.layout.compatible(layout, at);
            bound.take_if(lost);
        }
    }

    /// Whether our set, bound with `layout`, would disturb a pushed one.
    pub(crate) fn would_lose(&self, layout: &PipelineLayout) -> bool {
        self.bound.iter().enumerate().any(|(at, bound)| {
            bound.as_ref().is_some_and(|b| b.set.is_none() && !b.layout.compatible(layout, at))
        })
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
            let Some(set) = bound.set else { continue };
            let own = bound.layout.sets.get(at).map(|s| s.identity);
            // Else the draw cannot use it, and it stays disturbed.
            if own.is_some() && own == layout.sets.get(at).map(|s| s.identity) {
                again.push((at as u32, set, bound.offsets.clone()));
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

    fn layout(sets: &[u64]) -> PipelineLayout {
        PipelineLayout::of(sets, 0)
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
        let b = PipelineLayout::of(&[1, 2], 7);
        let mut sets = Sets::default();
        sets.bind(&a, 0, &[set(10), set(20)], &[100, 200]);
        sets.disturb(&b);
        assert_eq!(sets.again(&a).len(), 2);
    }

    #[test]
    fn pushed_sets_are_not_disturbed_but_by_the_program() {
        let (a, b) = (layout(&[1, 2]), layout(&[1]));
        let mut sets = Sets::default();
        sets.bind(&a, 0, &[set(10)], &[100]);
        sets.push(&a, 1);
        assert!(!sets.would_lose(&a));
        assert!(sets.would_lose(&b));
        sets.bind(&b, 0, &[set(10)], &[100]);
        assert!(!sets.would_lose(&b));
        sets.push(&a, 1);
        sets.lose(0, 2);
        assert!(!sets.would_lose(&b));
    }
}

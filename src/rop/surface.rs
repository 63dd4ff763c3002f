//! Tracking of surfaces (Laine and Karras 2011, section 2).

use bitvec::array::BitArray;
use bitvec::order::Lsb0;

use crate::trace::{Fragment, SampleMask};

crate::options! {
    /// When a fragment starts a new surface.
    pub enum SurfaceRule {
        Bitmask = "bitmask": "when it meets a sample that the current surface holds (LK section 2)",
        EveryFragment = "every-fragment": "always: stratified within fragments only",
        Primitive = "primitive": "as bitmask, and when the primitive changes",
        Object = "object": "as bitmask, and when the object changes",
    }
}

/// One bit per sample of a pixel.
pub type CoveredMask = BitArray<[u64; 1], Lsb0>;

/// A pixel's current surface.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTracker {
    /// `p.covered`: the samples that the current surface holds.
    pub covered: CoveredMask,
    /// `p.surfaceId`.
    pub surface_id: u32,
    /// The primitive or object that drew last, where the rule asks; plus one.
    last: Option<u32>,
}

impl SurfaceTracker {
    /// LK figure 7, lines 4 to 8: starts a new surface where the rule says so.
    /// Returns the number of the surface's first sample in this fragment and
    /// whether the surface is new.
    pub fn enter(&mut self, rule: SurfaceRule, s: SampleMask, f: &Fragment) -> (u32, bool) {
        let conflict = || s.iter().any(|sample| self.covered[sample]);
        let source = match rule {
            SurfaceRule::Primitive => Some(f.primitive),
            SurfaceRule::Object => Some(f.object),
            SurfaceRule::Bitmask | SurfaceRule::EveryFragment => None,
        };
        let starts = match rule {
            SurfaceRule::Bitmask => conflict(),
            SurfaceRule::EveryFragment => true,
            SurfaceRule::Primitive | SurfaceRule::Object => {
                // The first fragment of a cleared pixel changes nothing.
                (self.last.is_some() && self.last != source) || conflict()
            }
        };
        self.last = source;
        if starts {
            // The publication's counter has no stated width; ours wraps at 2^32.
            self.surface_id = self.surface_id.wrapping_add(1);
            self.covered.fill(false);
        }
        (self.covered.count_ones() as u32, starts)
    }

    /// LK figure 7, line 18: the surface now holds these samples too.
    pub fn hold(&mut self, s: SampleMask) {
        s.iter().for_each(|sample| self.covered.set(sample, true));
    }

    /// The samples that the current surface holds.
    pub fn held(&self) -> SampleMask {
        self.covered.iter_ones().collect()
    }

    /// Bits of state per pixel of `samples` samples that a rule takes.
    pub fn state_bits(rule: SurfaceRule, samples: u32) -> u32 {
        match rule {
            SurfaceRule::Bitmask => samples + 32,
            SurfaceRule::EveryFragment => 32,
            SurfaceRule::Primitive | SurfaceRule::Object => samples + 64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::DepthPlane;

    fn fragment(primitive: u32, object: u32) -> Fragment {
        Fragment {
            x: 0,
            y: 0,
            coverage: SampleMask::first(4),
            depth: DepthPlane::default(),
            colour: [0.0; 3],
            alpha: 0.5,
            primitive,
            object,
        }
    }

    #[test]
    fn the_example_of_figure_2() {
        // Two triangles of one surface, then one that conflicts.
        let mut tracker = SurfaceTracker::default();
        let rule = SurfaceRule::Bitmask;
        let mut draw = |mask: u64| {
            let entered = tracker.enter(rule, SampleMask(mask), &fragment(0, 0));
            tracker.hold(SampleMask(mask));
            (entered, tracker.surface_id, tracker.held().0)
        };
        assert_eq!(draw(0b0011), ((0, false), 0, 0b0011));
        assert_eq!(draw(0b0100), ((2, false), 0, 0b0111));
        assert_eq!(draw(0b1100), ((0, true), 1, 0b1100));
    }

    #[test]
    fn other_rules_start_surfaces_at_changes() {
        let run = |rule, fragments: [(u32, u32, u64); 3]| {
            let mut tracker = SurfaceTracker::default();
            for (primitive, object, mask) in fragments {
                tracker.enter(rule, SampleMask(mask), &fragment(primitive, object));
                tracker.hold(SampleMask(mask));
            }
            tracker.surface_id
        };
        let apart = [(0, 0, 1), (1, 0, 2), (2, 5, 4)];
        assert_eq!(run(SurfaceRule::Bitmask, apart), 0);
        assert_eq!(run(SurfaceRule::EveryFragment, apart), 3);
        assert_eq!(run(SurfaceRule::Primitive, apart), 2);
        assert_eq!(run(SurfaceRule::Object, apart), 1);
        let same = [(3, 3, 1); 3];
        assert_eq!(run(SurfaceRule::Primitive, same), 2);
        assert_eq!(run(SurfaceRule::Object, same), 2);
    }
}

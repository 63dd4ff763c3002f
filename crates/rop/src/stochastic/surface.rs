//! Tracking of surfaces (Laine and Karras 2011, section 2).

use bitvec::array::BitArray;
use bitvec::order::Lsb0;

use screendoor_trace::trace::{Fragment, SampleMask};

screendoor_trace::options! {
    /// When a fragment starts a new surface.
    pub enum SurfaceRule {
        Bitmask = "bitmask": "when it meets a sample that the current surface holds (LK section 2)",
        EveryFragment = "every-fragment": "always: stratified within fragments only",
        Primitive = "primitive": "as bitmask, and when the primitive changes",
        Object = "object": "as bitmask, and when the object changes",
    }
}

screendoor_trace::options! {
    /// Which samples of a fragment the tracker sees.
    pub enum Tracked {
        Survivors = "survivors": "those that pass the depth test (LK figure 7): biased where surfaces share pixels",
        Covered = "covered": "all that the fragment covers: unbiased, for a counter of the numbered samples",
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
    /// How many samples of the current surface have been numbered. Where only
    /// numbered samples are held this is the number of bits in `covered`, and no
    /// state of its own.
    pub(crate) numbered: u32,
    /// The primitive or object that drew last, where the rule asks; plus one.
    pub(crate) last: Option<u32>,
}

impl SurfaceTracker {
    /// LK figure 7, lines 4 to 8: starts a new surface where the rule says so for
    /// a fragment `f` of which the tracker sees `s`. Returns the number of the
    /// surface's first sample in this fragment and whether the surface is new.
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
            self.numbered = 0;
        }
        (self.numbered, starts)
    }

    /// LK figure 7, line 18: the surface now holds the samples `s` too, `numbered`
    /// of which were numbered.
    pub fn hold(&mut self, s: SampleMask, numbered: u32) {
        s.iter().for_each(|sample| self.covered.set(sample, true));
        self.numbered += numbered;
    }

    /// The samples that the current surface holds.
    pub fn held(&self) -> SampleMask {
        self.covered.iter_ones().collect()
    }

    /// Number and samples of the current surface, for `explain`.
    pub fn fields(&self) -> Vec<(&'static str, String)> {
        let held: Vec<String> = self.held().iter().map(|s| s.to_string()).collect();
        let held = if held.is_empty() { "none".to_string() } else { held.join(" ") };
        vec![("surface", self.surface_id.to_string()), ("covered", held)]
    }

    /// Bits of state per pixel of `samples` samples that a rule takes.
    pub fn state_bits(rule: SurfaceRule, tracked: Tracked, samples: u32) -> u32 {
        let (mask, source) = match rule {
            SurfaceRule::EveryFragment => (0, 0),
            SurfaceRule::Bitmask => (samples, 0),
            SurfaceRule::Primitive | SurfaceRule::Object => (samples, 32),
        };
        // The counter runs from 0 to `samples`.
        let counter = match tracked {
            Tracked::Covered if mask > 0 => samples.ilog2() + 1,
            _ => 0,
        };
        32 + mask + source + counter
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use screendoor_trace::trace::DepthPlane;

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
            ..Fragment::default()
        }
    }

    #[test]
    fn the_example_of_figure_2() {
        // Two triangles of one surface, then one that conflicts.
        let mut tracker = SurfaceTracker::default();
        let rule = SurfaceRule::Bitmask;
        let mut draw = |mask: u64| {
            let entered = tracker.enter(rule, SampleMask(mask), &fragment(0, 0));
            tracker.hold(SampleMask(mask), mask.count_ones());
            (entered, tracker.surface_id, tracker.held().0)
        };
        assert_eq!(draw(0b0011), ((0, false), 0, 0b0011));
        assert_eq!(draw(0b0100), ((2, false), 0, 0b0111));
        assert_eq!(draw(0b1100), ((0, true), 1, 0b1100));
    }

    #[test]
    fn the_counter_goes_on_at_0_after_2_to_the_32_surfaces() {
        let mut tracker = SurfaceTracker { surface_id: u32::MAX, ..SurfaceTracker::default() };
        tracker.hold(SampleMask(0b0011), 2);
        let entered = tracker.enter(SurfaceRule::Bitmask, SampleMask(0b0110), &fragment(0, 0));
        assert_eq!((entered, tracker.surface_id), ((0, true), 0));
    }

    #[test]
    fn other_rules_start_surfaces_at_changes() {
        let run = |rule, fragments: [(u32, u32, u64); 3]| {
            let mut tracker = SurfaceTracker::default();
            for (primitive, object, mask) in fragments {
                tracker.enter(rule, SampleMask(mask), &fragment(primitive, object));
                tracker.hold(SampleMask(mask), mask.count_ones());
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

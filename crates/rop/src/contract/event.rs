//! What a raster-operations unit does, as countable events.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::contract::opacity::Threshold;
use screendoor_trace::trace::{MAX_SAMPLES, SampleMask};

/// What a raster-operations unit does.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A fragment reached the pixel, covering these samples.
    Fragment(SampleMask),
    /// Samples of the fragment were put to the depth test.
    DepthTest {
        /// Those that were.
        tested: SampleMask,
        /// Those of them that passed it.
        passed: SampleMask,
    },
    /// The fragment starts a new surface with this number.
    Surface(u32),
    /// Samples were sorted; this is their order now.
    Sorted(&'a [u8]),
    /// A sample got a reference value.
    Reference {
        /// The sample.
        sample: u8,
        /// Its number within its surface.
        number: u32,
        /// The reference value, of 2^32.
        value: u32,
        /// What it was held against.
        threshold: Threshold,
    },
    /// So many hashes were evaluated.
    Hashed(u32),
    /// The fragment was written to these samples.
    Written(SampleMask),
    /// So many comparisons were made to place, choose or remove stored layers; what
    /// counts as one is said at [`EventCounts::comparators`].
    Compared(u32),
    /// So many multiplications were made of what fragments and pixels hold; what counts as
    /// one is said at [`EventCounts::multiplications`].
    Multiplied(u32),
    /// Bits of the pixel's state were read and written.
    State {
        /// Bits read.
        read: u32,
        /// Bits written.
        written: u32,
    },
    /// What a design has to say about the fragment beside all that, for whoever reads it: one
    /// line, which is made only where it is asked for.
    Remark(Remark<'a>),
}

/// A line of words that is not made yet.
#[derive(Clone, Copy)]
pub struct Remark<'a>(pub &'a dyn Fn() -> String);

impl fmt::Debug for Remark<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&(self.0)())
    }
}

/// Who is told what a design does while it draws. With [`NoProbe`] all of it vanishes
/// from the compiled code.
///
/// There is one method, without a default, so that nobody forgets an event:
///
/// ```
/// use screendoor_rop::{Event, Listen, Probe};
///
/// struct Hashes(u32);
///
/// impl Listen for Hashes {
///     fn event(&mut self, event: Event<'_>) {
///         match event {
///             Event::Hashed(count) => self.0 += count,
///             Event::Fragment(_) | Event::DepthTest { .. } | Event::Surface(_) => {}
///             Event::Sorted(_) | Event::Reference { .. } | Event::Written(_) => {}
///             Event::Compared(_) | Event::Multiplied(_) => {}
///             Event::State { .. } | Event::Remark(_) => {}
///         }
///     }
/// }
///
/// let mut hashes = Hashes(0);
/// hashes.hashed(3);
/// hashes.compared(8);
/// assert_eq!(hashes.0, 3);
/// ```
///
/// One that leaves a kind of event out does not compile:
///
/// ```compile_fail,E0004
/// use screendoor_rop::{Event, Listen};
///
/// struct Hashes(u32);
///
/// impl Listen for Hashes {
///     fn event(&mut self, event: Event<'_>) {
///         match event {
///             Event::Hashed(count) => self.0 += count,
///             Event::Fragment(_) | Event::DepthTest { .. } | Event::Surface(_) => {}
///             Event::Sorted(_) | Event::Reference { .. } | Event::Written(_) => {}
///             // Nothing about `Event::Compared`.
///             Event::Multiplied(_) | Event::State { .. } | Event::Remark(_) => {}
///         }
///     }
/// }
/// ```
///
/// nor does one that listens to nothing:
///
/// ```compile_fail,E0046
/// struct Deaf;
///
/// impl screendoor_rop::Listen for Deaf {}
/// ```
pub trait Listen {
    /// Whether anybody is told: where not, nothing need be worked out for it.
    const LISTENS: bool = true;

    /// This happened.
    fn event(&mut self, event: Event<'_>);
}

/// How designs tell what happens: a method for each [`Event`]. All who [`Listen`] have
/// these methods, and nobody can have others of these names, so that none gets lost on
/// its way:
///
/// ```compile_fail,E0119
/// use screendoor_rop::{Event, Listen, Probe};
///
/// struct Forgetful;
///
/// impl Listen for Forgetful {
///     fn event(&mut self, _: Event<'_>) {}
/// }
///
/// impl Probe for Forgetful {
///     fn compared(&mut self, _: u32) {}
/// }
/// ```
pub trait Probe: Listen {
    /// [`Event::Fragment`].
    #[inline(always)]
    fn fragment(&mut self, covered: SampleMask) {
        self.event(Event::Fragment(covered));
    }
    /// [`Event::DepthTest`].
    #[inline(always)]
    fn depth_test(&mut self, tested: SampleMask, passed: SampleMask) {
        self.event(Event::DepthTest { tested, passed });
    }
    /// [`Event::Surface`].
    #[inline(always)]
    fn surface(&mut self, number: u32) {
        self.event(Event::Surface(number));
    }
    /// [`Event::Sorted`].
    #[inline(always)]
    fn sorted(&mut self, order: &[u8]) {
        self.event(Event::Sorted(order));
    }
    /// [`Event::Reference`].
    #[inline(always)]
    fn reference(&mut self, sample: u8, number: u32, value: u32, threshold: Threshold) {
        self.event(Event::Reference { sample, number, value, threshold });
    }
    /// [`Event::Hashed`].
    #[inline(always)]
    fn hashed(&mut self, count: u32) {
        self.event(Event::Hashed(count));
    }
    /// [`Event::Written`].
    #[inline(always)]
    fn written(&mut self, samples: SampleMask) {
        self.event(Event::Written(samples));
    }
    /// [`Event::Compared`].
    #[inline(always)]
    fn compared(&mut self, count: u32) {
        self.event(Event::Compared(count));
    }
    /// [`Event::Multiplied`].
    #[inline(always)]
    fn multiplied(&mut self, count: u32) {
        self.event(Event::Multiplied(count));
    }
    /// [`Event::State`].
    #[inline(always)]
    fn state(&mut self, read: u32, written: u32) {
        self.event(Event::State { read, written });
    }
    /// [`Event::Remark`].
    #[inline(always)]
    fn remark(&mut self, line: impl Fn() -> String) {
        if Self::LISTENS {
            self.event(Event::Remark(Remark(&line)));
        }
    }
}

impl<L: Listen + ?Sized> Probe for L {}

/// Who can be told many events at once: of what one fragment did nothing is left then.
pub(crate) trait Sum: Listen {
    /// All this happened.
    fn many(&mut self, events: &EventCounts);
}

/// Counts nothing and costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Listen for NoProbe {
    const LISTENS: bool = false;

    #[inline(always)]
    fn event(&mut self, _: Event<'_>) {}
}

impl Sum for NoProbe {
    fn many(&mut self, _: &EventCounts) {}
}

/// How often each event happened over a replay.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventCounts {
    /// Fragments drawn; over several passes each counts several times.
    pub fragments: u64,
    /// Samples put to the depth test.
    pub samples_tested: u64,
    /// Samples that passed it.
    pub samples_passed: u64,
    /// Samples written.
    pub samples_written: u64,
    /// Hashes evaluated.
    pub hashes: u64,
    /// Sorts of two or more samples; entry `i` counts those of `i` samples.
    pub sorts_by_length: Vec<u64>,
    /// New surfaces started.
    pub surfaces: u64,
    /// Comparisons that placed, chose or removed stored layers, as
    /// [`EventCounts::comparators`] says.
    pub layers_compared: u64,
    /// Multiplications of colours, opacities and errors while fragments are drawn; `None` of
    /// a design that does not say ([`Blueprint::MULTIPLICATIONS`](crate::Blueprint)).
    ///
    /// They are counted as hardware needs them, of two numbers that vary:
    ///
    /// - one for each channel that an opacity, a transmittance or an error is multiplied with;
    /// - none with a number of samples or layers, a fraction of two such, or a constant, which
    ///   are additions, shifts and tables; none within a hash; none that gives a plane's depth
    ///   at a sample, which all designs need alike; and no division;
    /// - none by what is known to be nought or one before it is multiplied: where a sample is
    ///   not covered or lets nothing pass, or no layer lies in front;
    /// - none that is made once a pixel, at the end of a pass or to resolve it, as of state.
    ///
    /// A design that works out its colours at the end of a pass, or takes logarithms, powers or
    /// roots for a fragment, would look cheap by that, and does not say.
    #[serde(default)]
    pub multiplications: Option<u64>,
    /// Bits of pixel state read.
    pub state_bits_read: u64,
    /// Bits of pixel state written.
    pub state_bits_written: u64,
}

impl Default for EventCounts {
    fn default() -> Self {
        EventCounts {
            fragments: 0,
            samples_tested: 0,
            samples_passed: 0,
            samples_written: 0,
            hashes: 0,
            sorts_by_length: vec![0; MAX_SAMPLES as usize + 1],
            surfaces: 0,
            layers_compared: 0,
            multiplications: Some(0),
            state_bits_read: 0,
            state_bits_written: 0,
        }
    }
}

impl EventCounts {
    /// How many sorts there were.
    pub fn sorts(&self) -> u64 {
        self.sorts_by_length.iter().sum()
    }

    /// Comparators at work: comparisons of two integers, nearly always depths.
    ///
    /// They are counted as hardware makes them, which holds a fragment against all that
    /// it may meet at once, and where it does one after the other cannot know beforehand
    /// which is the last:
    ///
    /// - a sample put to a depth test: 1 for each buffer that it is tested against;
    /// - a fragment that finds its place among `n` stored layers, in whatever pass,
    ///   wherever that place is and whether it is kept or not: `n`;
    /// - the least or the greatest of `n` depths or areas: `n − 1`;
    /// - `n` samples or layers that are sorted: those of Batcher's odd-even merge network
    ///   of that length.
    ///
    /// Tests for equality, of colours, alphas and reference values are none. So an
    /// implementation that stops at the first layer behind the fragment makes fewer.
    pub fn comparators(&self) -> u64 {
        let sorts = self.sorts_by_length.iter().enumerate();
        let sorting = |(length, count): (usize, &u64)| network_comparators(length) * count;
        self.samples_tested + self.layers_compared + sorts.map(sorting).sum::<u64>()
    }

    /// Bytes of pixel state read and written.
    pub fn state_bytes(&self) -> [u64; 2] {
        [self.state_bits_read.div_ceil(8), self.state_bits_written.div_ceil(8)]
    }

    /// These counts and those of another part of the same replay.
    pub fn merged(mut self, other: &Self) -> Self {
        self.add(other);
        self
    }

    /// Adds the counts of another part of the same replay.
    pub fn add(&mut self, other: &Self) {
        // Taken apart, so that nothing is forgotten.
        let EventCounts {
            fragments,
            samples_tested,
            samples_passed,
            samples_written,
            hashes,
            sorts_by_length,
            surfaces,
            layers_compared,
            multiplications,
            state_bits_read,
            state_bits_written,
        } = other;
        self.fragments += fragments;
        self.samples_tested += samples_tested;
        self.samples_passed += samples_passed;
        self.samples_written += samples_written;
        self.hashes += hashes;
        for (sum, count) in self.sorts_by_length.iter_mut().zip(sorts_by_length) {
            *sum += count;
        }
        self.surfaces += surfaces;
        self.layers_compared += layers_compared;
        self.multiplications =
            self.multiplications.zip(*multiplications).map(|(own, other)| own + other);
        self.state_bits_read += state_bits_read;
        self.state_bits_written += state_bits_written;
    }
}

/// Comparators of an odd-even merge sorting network for `length` values (Batcher 1968;
/// Knuth, The Art of Computer Programming 3, algorithm 5.2.2M).
pub fn network_comparators(length: usize) -> u64 {
    let mut count = 0;
    let top = length.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut r, mut d) = (top, 0, p);
        loop {
            count += (0..length.saturating_sub(d)).filter(|i| i & p == r).count() as u64;
            if q == p {
                break;
            }
            (d, q, r) = (q - p, q / 2, p);
        }
        p /= 2;
    }
    count
}

impl Listen for EventCounts {
    #[inline]
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Fragment(_) => self.fragments += 1,
            Event::DepthTest { tested, passed } => {
                self.samples_tested += u64::from(tested.count());
                self.samples_passed += u64::from(passed.count());
            }
            Event::Surface(_) => self.surfaces += 1,
            Event::Sorted(order) => {
                if order.len() > 1 {
                    self.sorts_by_length[order.len()] += 1;
                }
            }
            // For each there is a hash, which counts.
            Event::Reference { .. } => {}
            Event::Hashed(count) => self.hashes += u64::from(count),
            Event::Written(samples) => self.samples_written += u64::from(samples.count()),
            Event::Compared(count) => self.layers_compared += u64::from(count),
            Event::Multiplied(count) => {
                self.multiplications = self.multiplications.map(|n| n + u64::from(count));
            }
            Event::State { read, written } => {
                self.state_bits_read += u64::from(read);
                self.state_bits_written += u64::from(written);
            }
            Event::Remark(_) => {}
        }
    }
}

impl Sum for EventCounts {
    fn many(&mut self, events: &EventCounts) {
        self.add(events);
    }
}

/// Writes down what happened to one fragment, for `explain`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Record {
    /// Samples that the fragment covers.
    pub covered: SampleMask,
    /// Samples that passed the last depth test; `None` where the design makes none.
    pub passed: Option<SampleMask>,
    /// Samples put to depth tests; a design may test against several buffers.
    pub samples_tested: u32,
    /// Samples that passed them.
    pub samples_passed: u32,
    /// The new surface's number, where one was started.
    pub surface: Option<u32>,
    /// The samples' order after sorting, where they were sorted.
    pub order: Option<Vec<u8>>,
    /// The opacity tests in the order in which they were made.
    pub references: Vec<ReferenceRecord>,
    /// Samples written.
    pub written: SampleMask,
    /// Hashes evaluated.
    pub hashes: u32,
    /// Comparisons that placed, chose or removed stored layers.
    pub layers_compared: u32,
    /// Multiplications; 0 of a design that does not say.
    pub multiplications: u32,
    /// Bits of pixel state read.
    pub state_bits_read: u32,
    /// Bits of pixel state written.
    pub state_bits_written: u32,
    /// What else the design says of it, line by line.
    pub remarks: Vec<String>,
}

/// One opacity test.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferenceRecord {
    /// The sample.
    pub sample: u8,
    /// Its number within its surface.
    pub number: u32,
    /// Its reference value, as a fraction of 1.
    pub value: f64,
    /// Whether it passed.
    pub passed: bool,
}

impl Record {
    /// Whether nothing was done: a pass that does not look at the fragment.
    pub(crate) fn is_idle(&self) -> bool {
        self.samples_tested == 0
            && self.written.is_empty()
            && self.hashes == 0
            && self.layers_compared == 0
            && self.state_bits_read == 0
            && self.state_bits_written == 0
    }
}

impl Listen for Record {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Fragment(covered) => self.covered = covered,
            Event::DepthTest { tested, passed } => {
                self.passed = Some(passed);
                self.samples_tested += tested.count();
                self.samples_passed += passed.count();
            }
            Event::Surface(number) => self.surface = Some(number),
            Event::Sorted(order) => self.order = Some(order.to_vec()),
            Event::Reference { sample, number, value, threshold } => {
                self.references.push(ReferenceRecord {
                    sample,
                    number,
                    value: f64::from(value) / 4_294_967_296.0,
                    passed: threshold.passes(value),
                });
            }
            Event::Hashed(count) => self.hashes += count,
            Event::Written(samples) => self.written |= samples,
            Event::Compared(count) => self.layers_compared += count,
            Event::Multiplied(count) => self.multiplications += count,
            Event::State { read, written } => {
                self.state_bits_read += read;
                self.state_bits_written += written;
            }
            Event::Remark(Remark(line)) => self.remarks.push(line()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn networks_have_their_known_sizes() {
        // Knuth 5.3.4, table 1's row for merge exchange; 2^t: (t²−t+4)·2^(t−2) − 1.
        let known = [0, 0, 1, 3, 5, 9, 12, 16, 19, 26, 31, 37, 41, 48, 53, 59, 63];
        for (length, count) in known.into_iter().enumerate() {
            assert_eq!(network_comparators(length), count, "{length}");
        }
        assert_eq!(network_comparators(32), 191);
        assert_eq!(network_comparators(64), 543);
    }
}

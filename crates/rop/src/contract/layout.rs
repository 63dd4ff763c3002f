//! How a pixel's bits of state are made up.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Bits of state per pixel, as hardware would hold them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct StateBits {
    /// The multisample buffer: depths and colours of all samples.
    pub samples: u32,
    /// What the design keeps beside it.
    pub extra: u32,
    /// Whether it grows with the fragments: the figures are then for none.
    pub unbounded: bool,
}

impl StateBits {
    /// All bits together.
    pub fn total(&self) -> u32 {
        self.samples + self.extra
    }
}

/// Bits, and what they hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Field {
    /// How many.
    pub bits: u32,
    /// What they hold, in a word or two.
    pub what: &'static str,
}

/// The same fields several times.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Group {
    /// How often; `None` where it is once for each fragment.
    pub count: Option<u32>,
    /// Whether it is part of the multisample buffer: once for each sample, and resolved.
    pub samples: bool,
    /// What is there each time.
    pub fields: Vec<Field>,
}

/// What a pixel holds, as hardware would hold it.
///
/// As text `8 × (32 depth + 48 colour) + 40 tracking`.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Layout {
    groups: Vec<Group>,
}

impl Layout {
    /// The multisample buffer: fields, as bits and what they hold, of each sample.
    pub fn samples(count: u32, fields: &[(u32, &'static str)]) -> Self {
        Self::default().with(Some(count), true, fields)
    }

    /// Fields so many times, beside the multisample buffer.
    pub fn of(count: u32, fields: &[(u32, &'static str)]) -> Self {
        Self::default().and(count, fields)
    }

    /// Fields of each fragment: what grows with them.
    pub fn of_each_fragment(fields: &[(u32, &'static str)]) -> Self {
        Self::default().with(None, false, fields)
    }

    /// This, and more fields so many times.
    #[must_use]
    pub fn and(self, count: u32, fields: &[(u32, &'static str)]) -> Self {
        self.with(Some(count), false, fields)
    }

    /// This and another.
    #[must_use]
    pub fn joined(mut self, mut other: Layout) -> Self {
        self.groups.append(&mut other.groups);
        self
    }

    /// What takes no bits is left out.
    fn with(mut self, count: Option<u32>, samples: bool, fields: &[(u32, &'static str)]) -> Self {
        let fields = fields.iter().map(|(bits, what)| Field { bits: *bits, what });
        let fields: Vec<Field> = fields.filter(|field| field.bits > 0).collect();
        if count != Some(0) && !fields.is_empty() {
            self.groups.push(Group { count, samples, fields });
        }
        self
    }

    /// The same without the fields that hold colours: what is left where depths alone are asked
    /// for, as of a shadow map.
    pub fn without_colours(&self) -> Layout {
        let mut layout = Layout::default();
        for group in &self.groups {
            let kept = group.fields.iter().filter(|field| !field.what.ends_with("colour"));
            let kept: Vec<(u32, &'static str)> = kept.map(|f| (f.bits, f.what)).collect();
            layout = layout.with(group.count, group.samples, &kept);
        }
        layout
    }

    /// What it is made of.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// All bits, those of the multisample buffer apart.
    pub fn bits(&self) -> StateBits {
        let mut bits = StateBits::default();
        for group in &self.groups {
            let each = group.fields.iter().map(|field| field.bits).sum::<u32>();
            match group.count {
                None => bits.unbounded = true,
                Some(count) if group.samples => bits.samples += count * each,
                Some(count) => bits.extra += count * each,
            }
        }
        bits
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.groups.is_empty() {
            return f.write_str("0");
        }
        for (i, group) in self.groups.iter().enumerate() {
            let fields = group.fields.iter().map(|field| format!("{} {}", field.bits, field.what));
            let fields = fields.collect::<Vec<_>>().join(" + ");
            let plus = if i == 0 { "" } else { " + " };
            match (group.count, group.fields.len()) {
                (Some(1), _) => write!(f, "{plus}{fields}")?,
                (Some(count), 1) => write!(f, "{plus}{count} × {fields}")?,
                (Some(count), _) => write!(f, "{plus}{count} × ({fields})")?,
                (None, _) => write!(f, "{plus}fragments × ({fields})")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_and_text_by_hand() {
        let layout =
            Layout::samples(8, &[(32, "depth"), (48, "colour")]).and(1, &[(40, "tracking")]);
        assert_eq!(layout.to_string(), "8 × (32 depth + 48 colour) + 40 tracking");
        let of_depths = layout.clone().and(1, &[(48, "summed colour")]).without_colours();
        assert_eq!(of_depths.to_string(), "8 × 32 depth + 40 tracking");
        assert_eq!(layout.bits(), StateBits { samples: 640, extra: 40, unbounded: false });
        // Nothing is said of what is not there.
        let layout = Layout::of(4, &[(16, "alpha"), (0, "mask")]).and(0, &[(9, "x")]);
        assert_eq!(layout.to_string(), "4 × 16 alpha");
        assert_eq!(layout.bits().total(), 64);
        assert_eq!(Layout::default().to_string(), "0");
        let layout = layout.joined(Layout::of_each_fragment(&[(3, "a"), (4, "b")]));
        assert_eq!(layout.to_string(), "4 × 16 alpha + fragments × (3 a + 4 b)");
        assert_eq!(layout.bits(), StateBits { samples: 0, extra: 64, unbounded: true });
    }
}

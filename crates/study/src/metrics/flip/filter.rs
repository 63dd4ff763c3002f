//! Separable filters of planes; beyond an edge the plane continues as its last pixels.

/// Width and height of a frame in pixels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Size {
    pub width: usize,
    pub height: usize,
}

impl Size {
    pub(super) fn pixels(self) -> usize {
        self.width * self.height
    }
}

/// The taps of a filter in one dimension from the middle to one end.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    taps: Vec<f32>,
    /// Whether the other half has the opposite sign.
    odd: bool,
}

impl Kernel {
    /// The kernel of `half`, equal on both sides. Outer taps that are nothing beside
    /// the middle one in single precision are left out.
    pub(super) fn even(half: &[f64]) -> Self {
        let first = half.first().copied().unwrap_or(0.0).abs();
        let kept = half.iter().rposition(|t| t.abs() > 1e-8 * first).map_or(1, |last| last + 1);
        Kernel { taps: half.iter().take(kept).map(|t| *t as f32).collect(), odd: false }
    }

    /// The kernel whose other side has the opposite sign.
    pub(super) fn odd(half: &[f64]) -> Self {
        Kernel { taps: half.iter().map(|t| *t as f32).collect(), odd: true }
    }

    /// `plane` filtered along its rows.
    pub(super) fn along_rows(&self, plane: &[f32], size: Size) -> Vec<f32> {
        let mut result = vec![0.0; plane.len()];
        if plane.is_empty() {
            return result;
        }
        let reach = self.taps.len() - 1;
        // A row with its ends continued, so that the loop below has no cases.
        let mut row = vec![0.0; size.width + 2 * reach];
        let rows = plane.chunks_exact(size.width).zip(result.chunks_exact_mut(size.width));
        for (from, to) in rows {
            row[..reach].fill(from[0]);
            row[reach..reach + size.width].copy_from_slice(from);
            row[reach + size.width..].fill(from[size.width - 1]);
            let part = |at: usize| &row[at..at + size.width];
            for (k, tap) in self.taps.iter().enumerate() {
                self.add(to, k, *tap, part(reach - k), part(reach + k));
            }
        }
        result
    }

    /// `plane` filtered along its columns.
    pub(super) fn along_columns(&self, plane: &[f32], size: Size) -> Vec<f32> {
        let mut result = vec![0.0; plane.len()];
        if plane.is_empty() {
            return result;
        }
        let part = |y: usize| &plane[y * size.width..(y + 1) * size.width];
        for (y, to) in result.chunks_exact_mut(size.width).enumerate() {
            for (k, tap) in self.taps.iter().enumerate() {
                self.add(
                    to,
                    k,
                    *tap,
                    part(y.saturating_sub(k)),
                    part((y + k).min(size.height - 1)),
                );
            }
        }
        result
    }

    /// Adds tap `k` of both sides to a row.
    #[inline]
    fn add(&self, to: &mut [f32], k: usize, tap: f32, before: &[f32], after: &[f32]) {
        let both = to.iter_mut().zip(before.iter().zip(after));
        match (k, self.odd) {
            (0, _) => both.for_each(|(to, (a, _))| *to += tap * a),
            (_, false) => both.for_each(|(to, (a, b))| *to += tap * (a + b)),
            (_, true) => both.for_each(|(to, (a, b))| *to += tap * (b - a)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_their_plain_sums() {
        let size = Size { width: 5, height: 3 };
        let plane: Vec<f32> = (0..15).map(|i| (i * i % 7) as f32).collect();
        let half = [0.5, 0.25, 0.125, 0.0625];
        for kernel in [Kernel::even(&half), Kernel::odd(&half)] {
            let weight = |k: isize| {
                let sign = if k < 0 && kernel.odd { -1.0 } else { 1.0 };
                sign * half[k.unsigned_abs()] as f32
            };
            let (rows, columns) =
                (kernel.along_rows(&plane, size), kernel.along_columns(&plane, size));
            for y in 0..3_isize {
                for x in 0..5_isize {
                    let at =
                        |x: isize, y: isize| plane[(y.clamp(0, 2) * 5 + x.clamp(0, 4)) as usize];
                    let row: f32 = (-3..=3).map(|k| weight(k) * at(x + k, y)).sum();
                    let column: f32 = (-3..=3).map(|k| weight(k) * at(x, y + k)).sum();
                    let i = (y * 5 + x) as usize;
                    assert!((rows[i] - row).abs() < 1e-5 && (columns[i] - column).abs() < 1e-5);
                }
            }
        }
    }
}

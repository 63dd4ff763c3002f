//! What the order of pixels does to rows.

use crate::document::Section;
use screendoor_study::study::publications::{Publications, RowDifference};

/// The section; nothing where no orders were measured.
pub(super) fn section(p: &Publications) -> Option<Section> {
    if p.pixel_orders.is_empty() {
        return None;
    }
    let mut section = Section::new("Pixel orders");
    section.paragraph(format!(
        "LK section 3.1: a Morton curve gives even and odd rows different expectations. Difference \
         of the means of even and odd rows of one surface, alpha 0.1 to 0.6, 4 samples, 128 × 128 \
         pixels, root mean square over seeds and alphas, in 8-bit units. {}",
        morton(&p.pixel_orders)
    ));
    let row = |o: &RowDifference| [format!("`{}`", o.design), format!("{:.3}", o.difference)];
    section.table(["design", "difference"], p.pixel_orders.iter().map(row));
    Some(section)
}

/// How much further apart a Morton curve puts even and odd rows than a Hilbert curve.
fn morton(found: &[RowDifference]) -> String {
    let of = |design: &str| found.iter().find(|o| o.design == design).map(|o| o.difference);
    let times = |morton, hilbert| Some(of(morton)? / of(hilbert)?);
    let bare =
        times("lk:pixel-order=morton,reference=radical-inverse", "lk:reference=radical-inverse");
    let hashed = times("lk:pixel-order=morton", "lk");
    let Some((bare, hashed)) = bare.zip(hashed) else { return "Not measured.".to_string() };
    // Twice as far is no chance: the figures are over hundreds of frames.
    let there = |times: f64| if times > 2.0 { "the effect is there" } else { "no effect is seen" };
    format!(
        "Morton's difference ÷ Hilbert's is {bare:.1} in the unscrambled sequence ({}) and \
         {hashed:.1} with figure 4's hash ({}).",
        there(bare),
        there(hashed)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_that_parts_rows_is_told_from_one_that_does_not() {
        let of = |design: &str, difference| RowDifference { design: design.into(), difference };
        let list = |bare| {
            [
                of("lk", 0.4),
                of("lk:pixel-order=morton", 0.4),
                of("lk:reference=radical-inverse", 0.5),
                of("lk:pixel-order=morton,reference=radical-inverse", bare),
            ]
        };
        let [found, none] = [15.5, 0.5].map(|bare| morton(&list(bare)));
        assert!(
            found.contains("31.0 in the unscrambled sequence (the effect is there)"),
            "{found}"
        );
        assert!(none.contains("1.0 in the unscrambled sequence (no effect is seen)"), "{none}");
        assert_eq!(morton(&[]), "Not measured.");
    }
}

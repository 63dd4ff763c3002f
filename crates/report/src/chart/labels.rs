//! Names beside marks, where there is room.

/// A rectangle: left, top, right, bottom.
pub(super) type Area = [f64; 4];

/// A name that wants to stand by a mark.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    /// The mark.
    pub at: [f64; 2],
    /// The name.
    pub text: String,
}

/// Where a name stands: its text's start and baseline, and whether a line leads to it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Placed {
    pub x: f64,
    pub y: f64,
    pub leader: bool,
}

/// Height of a line of text, and the mean width of its letters, at 12 units.
const HEIGHT: f64 = 13.0;
const LETTER: f64 = 7.3;

/// A place for each name that overlaps no mark and no other name and lies within `frame`;
/// `None` where there is no such place: the legend names it.
pub(super) fn place(wanted: &[Wanted], marks: &[[f64; 2]], frame: Area) -> Vec<Option<Placed>> {
    let around = |[x, y]: &[f64; 2]| [x - 6.0, y - 6.0, x + 6.0, y + 6.0];
    let mut taken: Vec<Area> = marks.iter().map(around).collect();
    wanted
        .iter()
        .map(|label| {
            let width = LETTER * label.text.chars().count() as f64;
            let spots = spots(label.at, width);
            let free = spots.into_iter().find(|(_, area)| {
                let inside = area[0] >= frame[0]
                    && area[1] >= frame[1]
                    && area[2] <= frame[2]
                    && area[3] <= frame[3];
                inside && !taken.iter().any(|t| overlap(t, area))
            })?;
            taken.push(free.1);
            Some(free.0)
        })
        .collect()
}

/// Places about a mark, the nearest first.
fn spots([x, y]: [f64; 2], width: f64) -> Vec<(Placed, Area)> {
    let mut list = Vec::new();
    for (distance, leader) in [(9.0, false), (20.0, true), (34.0, true)] {
        let centre = x - width / 2.0;
        let (right, left) = (x + distance, x - distance - width);
        let diagonal = distance * 0.8;
        for (from, middle) in [
            (right, y),
            (left, y),
            (centre, y - distance - 4.0),
            (centre, y + distance + 4.0),
            (x + diagonal, y - diagonal),
            (x + diagonal, y + diagonal),
            (x - diagonal - width, y - diagonal),
            (x - diagonal - width, y + diagonal),
        ] {
            let area =
                [from - 1.0, middle - HEIGHT / 2.0, from + width + 1.0, middle + HEIGHT / 2.0];
            list.push((Placed { x: from, y: middle + 4.0, leader }, area));
        }
    }
    list
}

/// Heights for names in a column beside marks of these heights, in their order, none
/// nearer to another than a line.
pub(super) fn column(heights: &[f64], top: f64, bottom: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|a, b| heights[*a].total_cmp(&heights[*b]));
    let mut placed = heights.to_vec();
    let mut free = top;
    for i in &order {
        placed[*i] = placed[*i].max(free);
        free = placed[*i] + HEIGHT;
    }
    // What was pushed below the frame pushes back.
    let mut most = bottom;
    for i in order.iter().rev() {
        placed[*i] = placed[*i].min(most);
        most = placed[*i] - HEIGHT;
    }
    placed
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_keeps_its_order_and_distances() {
        let placed = column(&[50.0, 52.0, 10.0, 51.0, 198.0, 199.0], 0.0, 200.0);
        let mut sorted = placed.clone();
        sorted.sort_by(f64::total_cmp);
        assert!(sorted.windows(2).all(|w| w[1] - w[0] > HEIGHT - 1e-9), "{placed:?}");
        assert!(placed[2] < placed[0] && placed[0] < placed[3] && placed[3] < placed[1]);
        assert!(sorted[0] >= 0.0 && sorted[5] <= 200.0);
    }

    #[test]
    fn names_do_not_overlap_and_stay_inside() {
        let frame = [0.0, 0.0, 300.0, 200.0];
        let marks: Vec<[f64; 2]> = (0..30)
            .map(|i| [10.0 + f64::from(i) * 9.5, 100.0 + 60.0 * f64::from(i).sin()])
            .collect();
        let wanted: Vec<Wanted> =
            marks.iter().map(|at| Wanted { at: *at, text: "a design".into() }).collect();
        let placed = place(&wanted, &marks, frame);
        let areas: Vec<Area> = placed
            .iter()
            .flatten()
            .map(|p| [p.x, p.y - 9.0, p.x + 8.0 * LETTER, p.y + 2.0])
            .collect();
        assert!(areas.len() >= 8, "{}", areas.len());
        for (i, a) in areas.iter().enumerate() {
            assert!(a[0] >= 0.0 && a[2] <= 300.0);
            assert!(areas[..i].iter().all(|b| !overlap(a, b)), "{a:?}");
        }
    }
}

//! Pictures side by side.

use screendoor_trace::picture::Picture;
use screendoor_trace::tile::TileGrid;

/// A picture's part in a montage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel<'a> {
    /// The picture.
    pub picture: &'a Picture,
    /// A rectangle of it: left, top, width, height; all of it where not given.
    pub crop: Option<[u32; 4]>,
    /// How many pixels of the montage each of its pixels takes, along each side.
    pub enlarge: u32,
}

const GAP: u32 = 8;

/// Panels of one size in rows of `columns`, on white. Pixels are enlarged as they
/// are, without a filter.
///
/// # Panics
/// Where there are no panels.
pub(crate) fn montage(panels: &[Panel<'_>], columns: u32) -> Picture {
    let frames: Vec<[u32; 4]> = panels
        .iter()
        .map(|p| p.crop.unwrap_or([0, 0, p.picture.width(), p.picture.height()]))
        .collect();
    let width = panels.iter().zip(&frames).map(|(p, f)| f[2] * p.enlarge).max();
    let height = panels.iter().zip(&frames).map(|(p, f)| f[3] * p.enlarge).max();
    let (width, height) = (width.expect("panels"), height.expect("panels"));
    let columns = columns.min(panels.len() as u32);
    let rows = (panels.len() as u32).div_ceil(columns);
    let grid = TileGrid::new(columns * (width + GAP) - GAP, rows * (height + GAP) - GAP);
    let space = panels.first().expect("panels").picture.space();
    let montage = Picture::from_fn(grid, |x, y| {
        let (column, row) = (x / (width + GAP), y / (height + GAP));
        let (x, y) = (x % (width + GAP), y % (height + GAP));
        let index = (row * columns + column) as usize;
        let white = [1.0; 3];
        let Some((panel, [left, top, w, h])) = panels.get(index).zip(frames.get(index)) else {
            return white;
        };
        let (x, y) = (x / panel.enlarge, y / panel.enlarge);
        if x < *w && y < *h { panel.picture.get(left + x, top + y) } else { white }
    });
    montage.in_space(space)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_keep_their_pixels() {
        let a = Picture::from_fn(TileGrid::new(4, 3), |x, y| [f64::from(x), f64::from(y), 0.0]);
        let panel = Panel { picture: &a, crop: Some([1, 1, 2, 2]), enlarge: 3 };
        let both = montage(&[panel, panel], 2);
        assert_eq!((both.width(), both.height()), (6 + GAP + 6, 6));
        assert_eq!(both.get(0, 0), [1.0, 1.0, 0.0]);
        assert_eq!(both.get(5, 5), [2.0, 2.0, 0.0]);
        assert_eq!(both.get(6, 0), [1.0; 3]);
        assert_eq!(both.get(6 + GAP, 0), [1.0, 1.0, 0.0]);
    }
}

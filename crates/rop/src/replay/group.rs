//! Groups of tiles whose fragments fit into the memory limit, for designs whose
//! state grows with the fragments.

use crate::contract::frame::Frame;
use crate::replay::options::ReplayOptions;
use screendoor_trace::error::{Error, Result};
use screendoor_trace::tile::{TILE_PIXELS, TileGrid, TileId};
use screendoor_trace::trace::{SampleMask, Tiles, Trace};

/// Cuts the frame into groups whose fragments take at most the memory limit.
pub(super) fn group_tiles(
    frame: &Frame,
    trace: &Trace,
    bytes_per_fragment: u64,
    options: &ReplayOptions<'_>,
) -> Result<Vec<Tiles>> {
    let limit = (options.memory / bytes_per_fragment).max(1);
    if trace.rows() <= limit {
        return Ok(vec![Tiles::All]);
    }
    let grid = frame.grid;
    let mut by_tile = vec![0_u64; grid.count()];
    for_each_fragment(frame, trace, |tile, _| by_tile[tile.0 as usize] += 1)?;

    let mut groups = Vec::new();
    let (mut start, mut sum) = (0_u32, 0);
    for (tile, n) in by_tile.iter().enumerate() {
        let tile = tile as u32;
        if sum + n > limit {
            if sum > 0 {
                groups.push(Tiles::Range(start..tile));
            }
            (start, sum) = (tile, 0);
        }
        if *n <= limit {
            sum += n;
            continue;
        }
        // One tile alone is too much: cut it into ranges of pixels.
        let mut by_pixel = vec![0_u64; TILE_PIXELS];
        for_each_fragment(frame, trace, |t, within| by_pixel[within] += u64::from(t.0 == tile))?;
        let (mut first, mut in_part) = (0, 0);
        for (within, n) in by_pixel.iter().enumerate() {
            if *n > limit {
                let (x, y) = grid.pixel(TileId(tile), within);
                return Err(Error::config(
                    format_args!(
                        "pixel {x},{y} alone holds {n} fragments, which take {} MiB",
                        (n * bytes_per_fragment).div_ceil(1 << 20)
                    ),
                    "raise the memory limit (--memory)",
                ));
            }
            if in_part + n > limit {
                groups.push(Tiles::Part(TileId(tile), first..within));
                (first, in_part) = (within, 0);
            }
            in_part += n;
        }
        groups.push(Tiles::Part(TileId(tile), first..TILE_PIXELS));
        start = tile + 1;
    }
    if sum > 0 {
        groups.push(Tiles::Range(start..grid.count() as u32));
    }
    Ok(groups)
}

/// Tells the tile, and the place within it, of every fragment of the trace that
/// covers a sample of the frame.
fn for_each_fragment(
    frame: &Frame,
    trace: &Trace,
    mut each: impl FnMut(TileId, usize),
) -> Result<()> {
    let mask = SampleMask::first(frame.samples());
    for batch in trace.batches() {
        let batch = batch?;
        for i in (0..batch.len()).filter(|i| !(batch.coverage(*i) & mask).is_empty()) {
            let (x, y) = batch.pixel(i);
            each(frame.grid.tile(x, y), TileGrid::within(x, y));
        }
    }
    Ok(())
}

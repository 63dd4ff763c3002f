// What every program of the replay is given.
// uses: columns

struct Params {
    background: vec3<f32>,
    // Rows of the chunk.
    rows: u32,
    // The design's pass.
    pass_number: u32,
    // The first pixel of the page, counted over all pages, how many it holds, and how many
    // of them there are programs for: the chunk may know fewer.
    first_pixel: u32,
    pixels: u32,
    taken: u32,
    seed: u32,
    zero: u32,
    // The frame's samples.
    samples_low: u32,
    samples_high: u32,
    width: u32,
    height: u32,
    // The frame's sides are at most this power of two.
    side_bits: u32,
    tile_columns: u32,
    // The first of a pixel's fragments that is drawn now, and how many are at most.
    from_fragment: u32,
    fragments: u32,
    // The lowest bit of the digit that is sorted by, and the number of blocks of keys.
    digit_at: u32,
    blocks: u32,
    @align(16) columns: Columns,
}

@group(0) @binding(0) var<uniform> params: Params;
// The chunk's columns as they are in the file, one after the other, each from a whole word on.
@group(0) @binding(1) var<storage, read> columns: array<u32>;

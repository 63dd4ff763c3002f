//! The shapes that are drawn.

/// Triangles or squares, each instance a little further along.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    /// 3 for a triangle, 6 for a square.
    pub(crate) vertices: u32,
    pub(crate) instances: u32,
    /// Left and upper edge in clip space, size, depth.
    pub(crate) place: [f32; 4],
    pub(crate) colour: [f32; 4],
}

impl Shape {
    pub(crate) fn constants(&self) -> [f32; 8] {
        let mut all = [0.0; 8];
        all[..4].copy_from_slice(&self.place);
        all[4..].copy_from_slice(&self.colour);
        all
    }
}

/// Shapes that overlap, three deep and more, in no order of depth.
pub(crate) fn shapes() -> Vec<Shape> {
    let colours = [[0.9, 0.2, 0.1], [0.1, 0.8, 0.3], [0.2, 0.3, 0.9], [0.9, 0.8, 0.1]];
    (0..7)
        .map(|i: u8| {
            let k = f32::from(i);
            let [r, g, b] = colours[usize::from(i) % 4];
            Shape {
                vertices: if i.is_multiple_of(2) { 6 } else { 3 },
                instances: 1 + u32::from(i) % 3,
                place: [
                    k * 0.19 - 0.95,
                    f32::from(i * 3 % 7) * 0.14 - 0.85,
                    0.8,
                    f32::from(i * 5 % 7) * 0.11 + 0.1,
                ],
                colour: [r, g, b, 0.35 + 0.08 * k],
            }
        })
        .collect()
}

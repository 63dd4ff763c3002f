//! A frame's errors, channel by channel, row by row.

use screendoor_trace::picture::Picture;

/// Picture minus reference in 8-bit units: one plane a channel.
///
/// # Panics
/// Where the frames differ in size.
pub(super) fn error_planes(picture: &Picture, reference: &Picture) -> [Vec<f64>; 3] {
    assert_eq!(picture.grid(), reference.grid());
    let pixels = picture.width() as usize * picture.height() as usize;
    let mut planes = [(); 3].map(|()| Vec::with_capacity(pixels));
    for y in 0..picture.height() {
        for x in 0..picture.width() {
            let (a, b) = (picture.get(x, y), reference.get(x, y));
            for (plane, (a, b)) in planes.iter_mut().zip(a.into_iter().zip(b)) {
                plane.push((a - b) / super::UNIT);
            }
        }
    }
    planes
}

//! A part of a trace.

use std::ops::RangeInclusive;

use crate::edit::{Edit, Progress, Push, each_row};
use crate::error::{Error, Result};
use crate::trace::{ColumnId, Fragment, Header, SampleMask, SamplePattern, Scalar, Trace, View};

/// A rectangle of pixels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Area {
    /// Its first column and row.
    pub origin: [u32; 2],
    /// How many columns and rows.
    pub size: [u32; 2],
}

/// Which part of a trace is kept: what is in all of these.
#[derive(Clone, Debug, Default)]
pub struct TrimOptions {
    /// Pixels of the frame. The new frame is that rectangle.
    pub area: Option<Area>,
    /// Whether the frame stays as large as it was: fragments keep their pixels, from which
    /// designs draw randomness, so that the part is drawn as it was in the whole.
    pub keep_frame: bool,
    /// The first samples of each pixel, so many.
    pub samples: Option<u32>,
    /// Rows, from 0 on.
    pub rows: Option<RangeInclusive<u64>>,
    /// Numbers of primitives.
    pub primitives: Option<RangeInclusive<u32>>,
    /// Numbers of objects: what a capture of draws has of each draw.
    pub objects: Option<RangeInclusive<u32>>,
}

impl TrimOptions {
    /// Whether all of a trace is kept.
    pub fn is_all(&self) -> bool {
        let ranges = [self.rows.is_some(), self.primitives.is_some(), self.objects.is_some()];
        self.area.is_none() && self.samples.is_none() && !ranges.contains(&true)
    }
}

/// A part of a trace: its fragments keep their order and their numbers. Those that cover none
/// of the samples that are kept are not in it.
#[derive(Debug)]
pub struct Trim<'a> {
    trace: &'a Trace,
    options: TrimOptions,
    area: Area,
    mask: SampleMask,
    header: Header,
}

impl<'a> Trim<'a> {
    /// Checks that the trace has such a part.
    ///
    /// # Errors
    /// [`Error::Config`] for an area that the frame does not have, or a sample count that
    /// the trace's pattern does not serve.
    pub fn new(trace: &'a Trace, options: TrimOptions) -> Result<Self> {
        let old = trace.header();
        let frame = Area { origin: [0, 0], size: [old.width, old.height] };
        let area = options.area.unwrap_or(frame);
        let within = |axis: usize| {
            let end = area.origin[axis].checked_add(area.size[axis]);
            area.size[axis] > 0 && end.is_some_and(|end| end <= frame.size[axis])
        };
        if !within(0) || !within(1) {
            let ([x, y], [width, height]) = (area.origin, area.size);
            return Err(Error::config(
                format_args!("{width}x{height} pixels from {x},{y} on are no part of the frame"),
                format_args!("it has {}x{} pixels", old.width, old.height),
            ));
        }
        let samples = options.samples.unwrap_or(old.pattern.samples());
        let mask = SampleMask::first(samples);
        let mut header = old.clone();
        header.pattern = first(&old.pattern, samples)?;
        // Stored in the new count's own width, and as constant only what is one value still.
        if let Some(Scalar::Unsigned(coverage)) = header.constants.get_mut(&ColumnId::Coverage) {
            match *coverage & mask.0 {
                0 => drop(header.constants.remove(&ColumnId::Coverage)),
                left => *coverage = left,
            }
        }
        if !options.keep_frame {
            crop(&mut header, area);
        }
        header.source = format!("{}{}", old.source, said(&options));
        Ok(Trim { trace, options, area, mask, header })
    }

    /// The fragment as it is in the new trace, where it is in it.
    fn kept(&self, row: u64, fragment: Fragment) -> Option<Fragment> {
        fn has<T: PartialOrd>(range: &Option<RangeInclusive<T>>, value: T) -> bool {
            range.as_ref().is_none_or(|range| range.contains(&value))
        }
        let options = &self.options;
        let mut kept = fragment;
        let [x, y] = [(0, fragment.x), (1, fragment.y)].map(|(axis, at)| {
            let at = u32::from(at).checked_sub(self.area.origin[axis])?;
            (at < self.area.size[axis]).then_some(at as u16)
        });
        let (x, y) = (x?, y?);
        if !options.keep_frame {
            (kept.x, kept.y) = (x, y);
        }
        kept.coverage = kept.coverage & self.mask;
        let is = !kept.coverage.is_empty()
            && has(&options.rows, row)
            && has(&options.primitives, fragment.primitive)
            && has(&options.objects, fragment.object);
        is.then_some(kept)
    }
}

impl Edit for Trim<'_> {
    fn header(&self) -> &Header {
        &self.header
    }

    fn fragments(&self, push: Push<'_>, progress: Progress<'_>) -> Result<()> {
        each_row(self.trace, (0, self.trace.rows()), progress, |row, fragment| {
            self.kept(row, fragment).map_or(Ok(()), |kept| push(&kept))
        })
    }
}

/// The pattern of the first samples.
fn first(pattern: &SamplePattern, samples: u32) -> Result<SamplePattern> {
    let positions = pattern.prefix(samples).map_err(|error| match error {
        Error::Config { hint, .. } => {
            Error::config(format_args!("{samples} samples of the trace cannot be kept"), hint)
        }
        other => other,
    })?;
    let own = pattern.samples();
    let name = match pattern.name.strip_suffix(&format!("-{own}")) {
        _ if samples == own => pattern.name.clone(),
        Some(kind) => format!("{kind}-{samples}"),
        None => format!("{}, first {samples}", pattern.name),
    };
    Ok(SamplePattern { name, positions: positions.to_vec(), nested: pattern.nested })
}

/// Makes a header's frame that area: the view shows what it showed there.
fn crop(header: &mut Header, area: Area) {
    let frame = [header.width, header.height];
    [header.width, header.height] = area.size;
    for (axis, id) in [ColumnId::X, ColumnId::Y].into_iter().enumerate() {
        if let Some(Scalar::Unsigned(at)) = header.constants.get_mut(&id) {
            // Where it lies outside, there will be no fragment.
            *at = at.saturating_sub(area.origin[axis].into());
        }
    }
    if let Some(view) = &mut header.view {
        *view = cropped(view, frame, area);
    }
}

/// A view of `frame` as one of an area of it.
fn cropped(view: &View, frame: [u32; 2], area: Area) -> View {
    let mut matrix = view.view_to_clip;
    for axis in [0, 1] {
        let [whole, part] = [frame[axis], area.size[axis]].map(f64::from);
        let begin = f64::from(area.origin[axis]);
        let scale = whole / part;
        // A pixel's place p is (1 ± c) / 2 · whole in the frame, and p − begin in the part:
        // c is up where p is down.
        let shift = (whole - part - 2.0 * begin) / part * [1.0, -1.0][axis];
        for column in matrix.chunks_exact_mut(4) {
            column[axis] = scale * column[axis] + shift * column[3];
        }
    }
    View { view_to_clip: matrix, ..*view }
}

/// What was kept, for the source's name.
fn said(options: &TrimOptions) -> String {
    fn range<T: ToString>(name: &str, range: &Option<RangeInclusive<T>>) -> Option<String> {
        let range = range.as_ref()?;
        Some(format!("{name} {}-{}", range.start().to_string(), range.end().to_string()))
    }
    let area = options.area.map(|Area { origin: [x, y], size: [width, height] }| {
        format!("{width}x{height} pixels from {x},{y}")
    });
    let parts = [
        area,
        options.samples.map(|samples| format!("first {samples} samples")),
        range("rows", &options.rows),
        range("primitives", &options.primitives),
        range("objects", &options.objects),
    ];
    parts.into_iter().flatten().map(|part| format!("; {part}")).collect()
}

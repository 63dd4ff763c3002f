//! From `Blueprint::COLUMNS` to what a design is given to draw: an optional column that it
//! names, and one that it does not, by the processor and by a GPU. The feature `probe` adds
//! such a column, while no trace of the program's own has any.

use screendoor::design::{Configured, Entry};
use screendoor::error::Result;
use screendoor::gpu::{self, GpuOptions};
use screendoor::param::Values;
use screendoor::picture::Picture;
use screendoor::rop::{
    Blueprint, Contents, Declaration, Design, Family, Frame, Info, Layout, OnDevice, PixelWords,
    Port, Probe, Promises, ReplayOptions, Shader, Site,
};
use screendoor::trace::{ColumnId, ColumnSet, Fragment, Header, Scalar, Trace};

use crate::util::{gpu, header, layered, trace};

/// Shows the sum of the column over a pixel's fragments; `READS` says whether it names the
/// column among those that it reads.
struct Shown<const READS: bool>;

impl<const READS: bool> Blueprint for Shown<READS> {
    const INFO: Info = Info {
        name: "shown",
        family: Family::Blended,
        summary: "the sum of an optional column",
        citation: "",
        params: &[],
        combinations: &[],
    };

    const COLUMNS: ColumnSet =
        if READS { ColumnSet::of(&[ColumnId::Probe]) } else { ColumnSet::NONE };

    type At<const N: usize> = ShownAt;

    fn at<const N: usize>(_: &Values, _: &Frame) -> Result<ShownAt> {
        Ok(ShownAt)
    }

    const PORTED: bool = true;

    fn port<const N: usize>(values: &Values, frame: &Frame) -> Result<Option<Port>> {
        Ok(Some(Port::of(SHADER, &Self::INFO, values, frame, ShownAt)))
    }

    fn promises(_: &Values) -> Promises {
        Promises::NONE
    }
}

#[derive(Clone)]
struct ShownAt;

impl Design for ShownAt {
    type Pixel = f32;

    fn layout(&self) -> Layout {
        Layout::of(1, &[(32, "sum")])
    }

    fn clear(&self, _: Site) -> f32 {
        0.0
    }

    fn draw<P: Probe>(&self, _: u32, _: Site, sum: &mut f32, f: &Fragment, probe: &mut P) {
        *sum += f.optional.probe;
        probe.written(f.coverage);
        probe.state(32, 32);
    }

    fn resolve(&self, _: Site, sum: &f32) -> [f64; 3] {
        [f64::from(*sum); 3]
    }

    fn contents(&self, sum: &f32) -> Contents {
        Contents { samples: Vec::new(), fields: vec![("sum", sum.to_string())] }
    }
}

const SHADER: Shader = Shader {
    name: "shown",
    text: "// uses: fragment loaders replay state
var<private> sum: f32;
fn clear_pixel() {
    state_put_real(AT_SUM, 0.0);
}
fn load_pixel() {
    sum = state_real(AT_SUM);
}
fn store_pixel() {
    state_put_real(AT_SUM, sum);
}
fn draw_fragment(f: Fragment, row: u32) {
    sum += column_probe(row);
}
fn end_pixel_pass() {}
",
};

impl OnDevice<f32> for ShownAt {
    fn declare(&self, to: &mut Declaration) {
        to.field("SUM", 1);
    }

    fn read(&self, _: Site, from: &PixelWords<'_>) -> f32 {
        f32::from_bits(from.word("SUM"))
    }
}

/// How a trace has the column.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Has {
    Stored,
    Constant,
    Absent,
}

const CONSTANT: f32 = 2.25;
const DEFAULT: f32 = 0.5;
const LAYERS: u32 = 3;
const SIDE: u32 = 40;

/// A value that sums of a few have exactly.
fn stored(f: &Fragment) -> f32 {
    (u32::from(f.x) + 64 * u32::from(f.y) + 4096 * f.primitive) as f32 / 4.0
}

fn with(has: Has) -> Trace {
    let mut header = Header { optional: [ColumnId::Probe].into(), ..header(SIDE, SIDE, 8) };
    let mut fragments = layered(&header, LAYERS, |i| (i << 20, [0.5; 3], 0.25));
    match has {
        Has::Stored => fragments.iter_mut().for_each(|f| f.optional.probe = stored(f)),
        Has::Constant => {
            header.constants.insert(ColumnId::Probe, Scalar::Real(CONSTANT));
            fragments.iter_mut().for_each(|f| f.optional.probe = CONSTANT);
        }
        Has::Absent => header.optional.clear(),
    }
    trace(&header, &fragments)
}

/// What a pixel's sum should be.
fn right(has: Has, reads: bool, x: u32, y: u32) -> f64 {
    let layers = (0..LAYERS).map(|primitive| match has {
        Has::Stored if reads => {
            stored(&Fragment { x: x as u16, y: y as u16, primitive, ..Fragment::default() })
        }
        Has::Constant if reads => CONSTANT,
        _ => DEFAULT,
    });
    f64::from(layers.sum::<f32>())
}

fn check(picture: &Picture, has: Has, reads: bool) {
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let expected = [right(has, reads, x, y); 3];
        assert_eq!(picture.get(x, y), expected, "{has:?}, reads: {reads}, at {x},{y}");
    }
}

/// Every way in which a trace has the column, and a design that reads it or does not.
fn each(then: impl Fn(&Configured, &Trace, Has, bool)) {
    for has in [Has::Stored, Has::Constant, Has::Absent] {
        let trace = with(has);
        for (entry, reads) in
            [(Entry::of::<Shown<true>>(), true), (Entry::of::<Shown<false>>(), false)]
        {
            then(&entry.configure(&[]).unwrap(), &trace, has, reads);
        }
    }
}

#[test]
fn a_design_is_given_the_columns_that_it_names() {
    each(|design, trace, has, reads| {
        for window in [1 << 20, 97] {
            let options = ReplayOptions { window, ..ReplayOptions::default() };
            check(&design.replay(trace, 8, 0, &options).unwrap().picture, has, reads);
        }
    });
}

#[test]
fn an_explanation_shows_the_same() {
    each(|design, trace, has, reads| {
        let told = design.explain(trace, 8, 0, Site { x: 17, y: 3 }, &|_, _| ()).unwrap();
        assert_eq!(told.colour, [right(has, reads, 17, 3); 3], "{has:?}, reads: {reads}");
    });
}

#[test]
fn a_device_is_given_the_columns_that_a_design_names() {
    let Some(gpu) = gpu() else { return };
    each(|design, trace, has, reads| {
        // Several chunks, too.
        for rows in [u64::MAX, 700] {
            let options = GpuOptions { rows, ..GpuOptions::default() };
            check(&gpu::replay(gpu, design, trace, 8, 0, &options).unwrap().0.picture, has, reads);
        }
    });
}

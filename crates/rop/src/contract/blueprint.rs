//! A design before its parameters and its sample count are known: what a registry holds.

use fearless_simd::Level;

use crate::contract::design::Design;
use crate::contract::frame::Frame;
use crate::contract::info::Info;
use crate::contract::port::Port;
use crate::contract::promises::Promises;
use crate::contract::tiled::TiledDesign;
use crate::lanes::{Count, Width};
use screendoor_trace::error::Result;
use screendoor_trace::param::Values;
use screendoor_trace::trace::ColumnSet;

/// A design with its parameters still open: what the registry holds.
pub trait Blueprint: 'static {
    /// What a listing says about it.
    const INFO: Info;

    /// Whether it asks for [`Frame::primitive_depths`]. That takes a pass over the trace
    /// before the design is built, which is counted nowhere: it stands for what an
    /// application knows of its own primitives.
    const PRIMITIVE_DEPTHS: bool = false;

    /// The optional columns that its designs and engines read. Others are not copied to the
    /// blocks that they draw, nor to a device, and have their defaults in its fragments.
    const COLUMNS: ColumnSet = ColumnSet::NONE;

    /// Whether it tells its multiplications, whatever its parameters: a design of which
    /// [`EventCounts::multiplications`](crate::EventCounts) would not be an honest count leaves
    /// them out.
    const MULTIPLICATIONS: bool = false;

    /// The design for pixels of `N` samples.
    type At<const N: usize>: Design;

    /// Builds the design.
    ///
    /// # Errors
    /// [`screendoor_trace::error::Error::Config`] for values that contradict each other.
    fn at<const N: usize>(values: &Values, frame: &Frame) -> Result<Self::At<N>>;

    /// A faster engine that gives the same bits with the instructions of `level`, where
    /// there is one for these parameters.
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    fn fast<const N: usize>(
        _values: &Values,
        _frame: &Frame,
        _level: Level,
    ) -> Result<Option<Box<dyn TiledDesign>>>
    where
        Count<N>: Width,
    {
        Ok(None)
    }

    /// Whether it has a [`Blueprint::port`].
    const PORTED: bool = false;

    /// The design as another device runs it, where [`Blueprint::PORTED`].
    ///
    /// # Errors
    /// As [`Blueprint::at`].
    fn port<const N: usize>(_values: &Values, _frame: &Frame) -> Result<Option<Port>> {
        Ok(None)
    }

    /// What it promises with these parameters.
    fn promises(values: &Values) -> Promises;
}

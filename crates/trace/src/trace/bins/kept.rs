//! Bins kept for a trace's next replay.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::error::Result;
use crate::trace::bins::Bins;
use crate::trace::read::Trace;

/// Where a trace keeps its bins.
#[derive(Debug, Default)]
pub(crate) struct Kept(Mutex<Option<Arc<Bins>>>);

/// Tells an open trace from others.
#[derive(Clone, Debug)]
pub struct TraceMark(Weak<Kept>);

/// The trace whose bins are kept: one at a time, so that open traces take no memory.
static LAST: Mutex<Weak<Kept>> = Mutex::new(Weak::new());

impl Kept {
    fn set(&self, bins: Option<Arc<Bins>>) -> Option<Arc<Bins>> {
        std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), bins)
    }

    fn get(&self) -> Option<Arc<Bins>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Trace {
    /// The bins that are kept of all its fragments, if any.
    ///
    /// # Errors
    /// [`crate::error::Error::Invalid`] where the file has changed since it was opened.
    pub fn kept_bins(&self) -> Result<Option<Arc<Bins>>> {
        match self.kept().get() {
            Some(bins) => self.check_unchanged().map(|()| Some(bins)),
            None => Ok(None),
        }
    }

    /// What it is told by, and its clones are.
    pub fn mark(&self) -> TraceMark {
        TraceMark(Arc::downgrade(self.kept()))
    }

    /// Whether the mark is its own.
    ///
    /// # Errors
    /// As [`Trace::kept_bins`].
    pub fn is_marked(&self, mark: &TraceMark) -> Result<bool> {
        let same = std::ptr::eq(mark.0.as_ptr(), Arc::as_ptr(self.kept()));
        if same { self.check_unchanged().map(|()| true) } else { Ok(false) }
    }

    /// Keeps `bins` of all its fragments until they are forgotten, another trace's are kept,
    /// or the trace is closed.
    pub fn keep_bins(&self, bins: Arc<Bins>) {
        let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        let other = last.upgrade().filter(|other| !Arc::ptr_eq(other, self.kept()));
        let replaced = [other.and_then(|other| other.set(None)), self.kept().set(Some(bins))];
        *last = Arc::downgrade(self.kept());
        drop(last);
        drop(replaced);
    }

    /// Gives back what kept bins take, whichever trace's they are.
    pub fn forget_bins() {
        let last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        let forgotten = last.upgrade().and_then(|last| last.set(None));
        drop(last);
        drop(forgotten);
    }
}

//! Runs side by side, one a core. A short replay leaves cores idle where it begins and ends and
//! between its stages; several of them on a thread each do not.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::study::engine::Engine;
use crate::study::measure::Subject;
use crate::study::run::measure::Engines;
use screendoor_trace::error::{Error, Result};

/// Fragments of a trace whose replays are short: a second on a core, in most designs. Beyond,
/// replays keep all cores busy, and the memory of many of them would add up.
const SHORT: u64 = 1 << 22;

/// How many runs on a subject are done at a time, with a thread each; `None` where they are done
/// one after the other with all threads. It depends on no more than the subject and the engines,
/// so that all of a study's runs on it are timed alike, whatever of them was done before.
pub(super) fn cores(subject: &Subject, engines: &Engines) -> Option<usize> {
    // There is one device, and it is to be timed alone.
    let on_device = engines.iter().any(|(_, engine)| matches!(engine, Ok(Engine::Gpu(..))));
    (subject.trace.rows() <= SHORT && !on_device).then(rayon::current_num_threads)
}

/// Calls `each` for every job, in their order: with all threads, or as many at a time as there
/// are `cores`, with a thread each. After an error no other job is begun.
///
/// # Errors
/// The first of `each`; [`Error::Config`] where there are no more threads to be had.
pub(super) fn each<T: Sync>(
    jobs: &[T],
    cores: Option<usize>,
    each: impl Fn(&T) -> Result<()> + Sync,
) -> Result<()> {
    let Some(cores) = cores.map(|cores| cores.min(jobs.len())) else {
        return jobs.iter().try_for_each(each);
    };
    let alone = |_| ThreadPoolBuilder::new().num_threads(1).build();
    let pools = (0..cores).map(alone).collect::<std::result::Result<Vec<ThreadPool>, _>>();
    let pools = pools
        .map_err(|e| Error::config(e, "ask for fewer threads with --threads, or free memory"))?;
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            each(job).inspect_err(|_| next.store(jobs.len(), Ordering::Relaxed))?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let threads: Vec<_> = pools.iter().map(|pool| scope.spawn(|| pool.install(work))).collect();
        let ended = threads.into_iter().map(|t| t.join().unwrap_or_else(|p| resume_unwind(p)));
        ended.collect::<Vec<Result<()>>>().into_iter().collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn every_job_is_done_once_with_a_thread_of_its_own() {
        let done = Mutex::new(Vec::new());
        let jobs: Vec<u32> = (0..40).collect();
        let put = |job: &u32| {
            assert_eq!(rayon::current_num_threads(), 1);
            done.lock().unwrap().push(*job);
            Ok(())
        };
        each(&jobs, Some(3), put).unwrap();
        let mut done = done.into_inner().unwrap();
        done.sort_unstable();
        assert_eq!(done, jobs);
    }

    #[test]
    fn an_error_ends_it() {
        for cores in [None, Some(1), Some(2)] {
            let begun = AtomicUsize::new(0);
            let fails = |job: &usize| {
                begun.fetch_add(1, Ordering::Relaxed);
                if *job == 0 { Err(Error::config("no", "nothing")) } else { Ok(()) }
            };
            assert!(each(&(0..1000).collect::<Vec<_>>(), cores, fails).is_err());
            // Two threads may race.
            assert!(cores == Some(2) || begun.into_inner() == 1);
        }
    }
}

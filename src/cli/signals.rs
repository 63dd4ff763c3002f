//! What happens when the user or the system ends the program early.

#[cfg(unix)]
use std::io::{self, IsTerminal as _, Write as _};
#[cfg(unix)]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

type Say = Box<dyn Fn() -> String + Send>;

/// Says what an interrupted command has kept.
static KEPT: Mutex<Option<Say>> = Mutex::new(None);

/// Has the program say what `kept` gives when it is interrupted. Where no command has said
/// so, nothing was written.
pub(super) fn on_interrupt(kept: impl Fn() -> String + Send + 'static) {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(kept));
}

/// The process of a program that runs under ours, 0 where there is none.
static PROGRAM: AtomicU32 = AtomicU32::new(0);

/// Says that a program's process runs under ours, or that none does. An interruption from the
/// keyboard is the program's then, once: what it has left is what we are there for. Where we are
/// ended, it is told to end.
pub(super) fn runs_under_us(process: Option<u32>) {
    PROGRAM.store(process.unwrap_or(0), Ordering::SeqCst);
}

/// What is said of the end.
#[cfg(unix)]
fn kept() -> String {
    let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner).take();
    kept.map_or_else(|| "nothing was written".to_string(), |say| say())
}

/// Has Ctrl-C, termination and hang-up remove files under construction before
/// they end the process, as they would have, and say what was kept. So does a mapped file of which a part is gone
/// (another program cut it, its disk failed): that is told as an error like any other.
#[cfg(unix)]
pub(super) fn clean_up(quiet: bool) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR2};
    use signal_hook::iterator::Signals;

    // Who started the program may have it ignore some (nohup): that stands.
    let heeded = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| !is_ignored(*signal));
    // Without a handler, files stay behind, and nothing else is lost.
    let Ok(mut signals) = Signals::new(heeded.chain([SIGUSR2])) else { return };
    let watch = move || {
        let mut passed_on = false;
        for signal in signals.forever() {
            let program = PROGRAM.load(Ordering::SeqCst);
            if program != 0 && signal == SIGINT && !std::mem::replace(&mut passed_on, true) {
                continue;
            }
            if program != 0 {
                crate::vulkan::terminate(program);
            }
            crate::output::abandon_all();
            if HAS_FAILED.load(Ordering::SeqCst) {
                eprintln!(
                    "screendoor: error: a file that is being read was cut or cannot be read any \
                     more; leave it as it is while it is read, or restore a copy"
                );
                signal_hook::low_level::exit(1);
            }
            if !quiet {
                let mut stderr = io::stderr();
                // A progress bar may stand there.
                let cleared = if stderr.is_terminal() { "\r\u{1b}[2K" } else { "" };
                let _ = writeln!(stderr, "{cleared}screendoor: interrupted: {}", kept());
            }
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    };
    if std::thread::Builder::new().name("signals".to_string()).spawn(watch).is_ok() {
        #[cfg(target_os = "linux")]
        bus::report();
    }
}

/// Whether memory that a file is mapped to could not be read.
#[cfg(unix)]
static HAS_FAILED: AtomicBool = AtomicBool::new(false);

/// What to do then (SIGBUS). Only on Linux: elsewhere a stack that is too deep is told by
/// the same signal.
#[cfg(target_os = "linux")]
mod bus {
    use std::sync::atomic::Ordering;

    /// Has the thread that watches for signals end the process. Not by `signal_hook`, which
    /// also calls the handler that was there before: the standard library's ends the process
    /// at once.
    pub(super) fn report() {
        let handler: extern "C" fn(_, _, _) = handler;
        // SAFETY: the handler is one of three arguments; all that it does is safe in one.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            action.sa_sigaction = handler as libc::sighandler_t;
            action.sa_flags = libc::SA_ONSTACK | libc::SA_SIGINFO;
            libc::sigemptyset(&raw mut action.sa_mask);
            libc::sigaction(libc::SIGBUS, &raw const action, std::ptr::null_mut());
        }
    }

    extern "C" fn handler(
        signal: libc::c_int,
        info: *mut libc::siginfo_t,
        _context: *mut libc::c_void,
    ) {
        // SAFETY: the system gives the information; the functions may be called in a handler.
        unsafe {
            if (*info).si_code != libc::BUS_ADRERR {
                // Something else: back to it, and to what would have become of it.
                libc::signal(signal, libc::SIG_DFL);
                return;
            }
            super::HAS_FAILED.store(true, Ordering::SeqCst);
            libc::kill(libc::getpid(), libc::SIGUSR2);
            // There is nothing to go back to.
            loop {
                libc::pause();
            }
        }
    }
}

#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let mut old = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: without a new action the call only fills in the present one.
    unsafe {
        libc::sigaction(signal, std::ptr::null(), old.as_mut_ptr()) == 0
            && old.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

/// Elsewhere the system ends the process and files under construction stay.
#[cfg(not(unix))]
pub(super) fn clean_up(_quiet: bool) {}

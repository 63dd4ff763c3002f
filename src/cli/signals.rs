//! What happens when the user or the system ends the program early.

/// Has Ctrl-C, termination and hang-up remove files under construction before
/// they end the process, as they would have. So does a mapped file of which a part is gone
/// (another program cut it, its disk failed): that is told as an error like any other.
#[cfg(unix)]
pub(super) fn clean_up() {
    use signal_hook::consts::{SIGBUS, SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    // Who started the program may have it ignore some (nohup): that stands.
    let heeded = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| !is_ignored(*signal));
    // Without a handler, files stay behind, and nothing else is lost.
    let Ok(mut signals) = Signals::new(heeded.chain([SIGBUS])) else { return };
    let watch = move || {
        for signal in signals.forever() {
            crate::output::abandon_all();
            if signal == SIGBUS {
                // The thread that reads gets no further; it tries again until this ends it.
                eprintln!(
                    "screendoor: error: a file that is being read was cut or cannot be read any \
                     more; leave it as it is while it is read, or restore a copy"
                );
                signal_hook::low_level::exit(1);
            }
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    };
    let _ = std::thread::Builder::new().name("signals".to_string()).spawn(watch);
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
pub(super) fn clean_up() {}

//! Running the program itself under a fault, and seeing how it ends.

use std::ffi::OsStr;
use std::io::{self, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How a process ended.
#[derive(Clone, Debug, Default)]
pub(super) struct Ended {
    /// Its exit code, if it was not ended by a signal.
    pub code: Option<i32>,
    /// From start to end.
    pub seconds: f64,
    /// The most memory that it had at a time, in bytes; not below this process's own.
    pub peak: u64,
    /// What it said on standard error.
    pub said: String,
    /// Whether it was still running when its time was over.
    pub hung: bool,
}

impl Ended {
    /// Whether it did what it was asked.
    pub(super) fn succeeded(&self) -> bool {
        self.code == Some(0)
    }

    /// Whether it refused with one line that says why.
    pub(super) fn refused(&self) -> bool {
        let errors = self.said.lines().filter(|l| l.starts_with("screendoor: error: ")).count();
        self.code == Some(1) && errors == 1 && !self.said.contains("panicked")
    }

    /// How it ended, in words.
    pub(super) fn words(&self) -> String {
        let said = self.said.lines().last().unwrap_or("no word");
        match self.code {
            _ if self.hung => "it hangs".to_string(),
            Some(code) => format!("exit code {code}, {said}"),
            None => format!("ended by a signal, {said}"),
        }
    }
}

/// `program` with `arguments`, silent on standard output.
pub(super) fn command(program: &Path, arguments: &[&OsStr]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    // Its last words are to be its own.
    command.env("RUST_BACKTRACE", "0");
    command
}

/// A command within a limit of the shell's `ulimit`, a full disk being an error and no signal.
pub(super) fn limited(limit: &str, inner: &Command) -> Command {
    let script = format!("trap '' XFSZ; ulimit {limit} || exit 99; exec \"$0\" \"$@\"");
    let mut command = command(Path::new("sh"), &["-c".as_ref(), script.as_ref()]);
    command.arg(inner.get_program()).args(inner.get_args());
    command
}

/// Longest time that anything here may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs it to its end.
pub(super) fn run(command: &mut Command) -> io::Result<Ended> {
    let start = Instant::now();
    wait(command.spawn()?, start)
}

/// Runs it, and after a while does something to it or its files.
pub(super) fn disturbed(
    command: &mut Command,
    after: Duration,
    disturb: impl FnOnce(&mut Child) -> io::Result<()>,
) -> io::Result<Ended> {
    let start = Instant::now();
    let mut child = command.spawn()?;
    std::thread::sleep(after);
    disturb(&mut child)?;
    wait(child, start)
}

/// Asks it to end, if it has not.
#[cfg(unix)]
pub(super) fn terminate(child: &Child) {
    if let Ok(pid) = libc::pid_t::try_from(child.id()) {
        // SAFETY: it is a child that nobody has waited for: the number is its own.
        unsafe { libc::kill(pid, libc::SIGTERM) };
    }
}

/// Elsewhere nothing is asked.
#[cfg(not(unix))]
pub(super) fn terminate(_child: &Child) {}

/// Waits for its end with what it used.
#[cfg(unix)]
fn wait(mut child: Child, start: Instant) -> io::Result<Ended> {
    let pid = libc::pid_t::try_from(child.id()).map_err(io::Error::other)?;
    let mut ended = Ended::default();
    let status = loop {
        let mut status = 0;
        let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
        // SAFETY: both pointers are to memory of ours of the right type; the process is a
        // child that nobody else waits for.
        let (found, usage) = unsafe {
            let found = libc::wait4(pid, &raw mut status, libc::WNOHANG, usage.as_mut_ptr());
            (found, usage.assume_init())
        };
        match found {
            0 if start.elapsed() > PATIENCE && !ended.hung => {
                ended.hung = true;
                child.kill()?;
            }
            0 => std::thread::sleep(Duration::from_micros(500)),
            -1 => return Err(io::Error::last_os_error()),
            _ => {
                // Linux counts in KiB, others in bytes.
                let unit = if cfg!(target_os = "linux") { 1024 } else { 1 };
                ended.peak = u64::try_from(usage.ru_maxrss).unwrap_or(0) * unit;
                break status;
            }
        }
    };
    ended.seconds = start.elapsed().as_secs_f64();
    if libc::WIFEXITED(status) {
        ended.code = Some(libc::WEXITSTATUS(status));
    }
    said(&mut child, &mut ended)?;
    Ok(ended)
}

/// Elsewhere without its memory.
#[cfg(not(unix))]
fn wait(mut child: Child, start: Instant) -> io::Result<Ended> {
    let mut ended = Ended { code: child.wait()?.code(), ..Ended::default() };
    ended.seconds = start.elapsed().as_secs_f64();
    said(&mut child, &mut ended)?;
    Ok(ended)
}

/// What it said: a few lines, which a pipe holds until they are asked for.
fn said(child: &mut Child, ended: &mut Ended) -> io::Result<()> {
    let mut bytes = Vec::new();
    if let Some(mut pipe) = child.stderr.take() {
        pipe.read_to_end(&mut bytes)?;
    }
    ended.said = String::from_utf8_lossy(&bytes).trim().to_string();
    Ok(())
}

//! The program run as a process of its own, with the memory and the time that it took.

use std::fs;
use std::io::{Read, Seek};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// The program.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_screendoor");

/// MiB that a command may take beside what `--memory` says: the program itself, windows of
/// fragments for a few threads, and the touched tiles' state.
pub const BESIDE: u64 = 320;

/// The largest resident memory so far of a running process, in KiB (`proc_pid_status(5)`);
/// file pages that are mapped count too. What `wait4` tells would be no less than this
/// test's own.
fn peak(child: &Child) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Whether memory can be measured here.
pub fn has_proc() -> bool {
    let has = Path::new("/proc/self/status").exists();
    if !has {
        eprintln!("skipped: memory is measured by way of /proc");
    }
    has
}

/// What a run said, its largest resident memory in MiB, and how long it took. Where there is
/// no `/proc`, the memory is 0.
pub struct Run {
    pub status: ExitStatus,
    pub output: String,
    pub error: String,
    pub mib: u64,
    pub seconds: f64,
}

impl Run {
    /// Runs the program in `folder`, as `change` has its command.
    pub fn changed(folder: &Path, arguments: &[&str], change: impl Fn(&mut Command)) -> Self {
        // Files, not pipes: nobody reads while it runs.
        let mut said = [tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap()];
        let [output, error] = said.each_ref().map(|file| Stdio::from(file.try_clone().unwrap()));
        let mut command = Command::new(PROGRAM);
        command.args(arguments).current_dir(folder).stdout(output).stderr(error);
        change(&mut command);
        let start = Instant::now();
        let mut child = command.spawn().unwrap();
        let mut highest = 0;
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            highest = highest.max(peak(&child).unwrap_or(0));
            std::thread::sleep(Duration::from_millis(2));
        };
        let seconds = start.elapsed().as_secs_f64();
        let [output, error] = said.each_mut().map(|file| {
            let mut text = Vec::new();
            file.rewind().unwrap();
            file.read_to_end(&mut text).unwrap();
            String::from_utf8_lossy(&text).into_owned()
        });
        let run = Run { status, output, error, mib: highest >> 10, seconds };
        println!("{arguments:?}: {} MiB, {seconds:.1} s; {}", run.mib, run.error.trim());
        run
    }

    /// Runs the program with two threads.
    pub fn of(folder: &Path, arguments: &[&str]) -> Self {
        Run::changed(folder, arguments, |command| {
            command.args(["--threads", "2"]);
        })
    }

    /// Holds it to have done its work with so many MiB.
    pub fn is_good(&self, mib: u64, what: &str) {
        assert!(self.status.success(), "{what}: {}", self.error);
        assert!(self.mib <= mib, "{what}: {} MiB; {}", self.mib, self.error);
    }

    /// Holds it to a limit of memory: done within it and [`BESIDE`], or refused with what it
    /// needs.
    pub fn is_within(&self, mib: u64, what: &str) {
        let says = ["MiB", "--last"].iter().any(|what| self.error.contains(what));
        let refused = self.status.code() == Some(2) && says;
        assert!(self.status.success() || refused, "{what}: {}", self.error);
        assert!(self.mib <= mib + BESIDE, "{what}: {} MiB; {}", self.mib, self.error);
    }
}

/// The names of the program's commands, as its help lists them.
pub fn commands() -> Vec<String> {
    let help = Run::of(Path::new("."), &["--help"]).output;
    let listed = help.lines().skip_while(|l| !l.starts_with("Commands:")).skip(1);
    let names = listed.take_while(|l| l.starts_with("  ")).filter_map(|l| {
        let indent = l.len() - l.trim_start().len();
        (indent == 2).then(|| l.split_whitespace().next().unwrap().to_string())
    });
    names.filter(|name| name != "help").collect()
}

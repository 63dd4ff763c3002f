//! How a long command shows that it is at work.

use std::io::{self, IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use crate::cli::console::{grouped, shown};

/// When a line says for the first time that the command is at work, and then how often:
/// where standard error is no terminal.
const FIRST: Duration = Duration::from_secs(10);
const EVERY: Duration = Duration::from_secs(30);

/// For so long no time left is told: the first steps are no measure of it.
const UNKNOWN: Duration = Duration::from_secs(2);

/// A progress bar, or a line now and then; it vanishes when it is dropped.
pub(super) struct Progress {
    bar: ProgressBar,
    status: Arc<Mutex<Status>>,
    /// Ends the thread that writes lines.
    lines: Option<(Sender<()>, JoinHandle<()>)>,
}

/// What is told of the work.
struct Status {
    what: String,
    unit: String,
    done: u64,
    total: u64,
    since: Instant,
}

impl Status {
    fn line(&self) -> String {
        let mut line = format!("screendoor: {}", shown(&self.what));
        if self.total > 0 {
            let (done, total) = (grouped(self.done), grouped(self.total));
            line += &format!(": {done} of {total} {}", self.unit);
        }
        line + &format!(", after {:#}", HumanDuration(self.since.elapsed()))
    }
}

fn locked(status: &Mutex<Status>) -> MutexGuard<'_, Status> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Progress {
    pub fn new(quiet: bool, what: &str, unit: &str) -> Self {
        let bar = !quiet && io::stderr().is_terminal();
        let target = if bar { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let say = |line: &str| {
            // Where standard error is closed there is nobody to tell.
            let _ = writeln!(io::stderr().lock(), "{line}");
        };
        let say = (!quiet && !bar).then_some(say);
        Progress::to(target, say, [FIRST, EVERY], what, unit)
    }

    /// Drawn to `target`; lines are handed to `say`, the first after a time and others at
    /// intervals of another.
    fn to(
        target: ProgressDrawTarget,
        say: Option<impl Fn(&str) + Send + 'static>,
        [first, every]: [Duration; 2],
        what: &str,
        unit: &str,
    ) -> Self {
        let bar = ProgressBar::with_draw_target(Some(0), target);
        bar.set_style(style("{wide_msg} {elapsed}"));
        bar.set_message(what.to_string());
        if !bar.is_hidden() {
            // Long steps show that time passes.
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        let status = Arc::new(Mutex::new(Status {
            what: what.to_string(),
            unit: unit.to_string(),
            done: 0,
            total: 0,
            since: Instant::now(),
        }));
        let lines = say.and_then(|say| {
            let (end, ended) = channel();
            let status = status.clone();
            let write = move || {
                let mut wait = first;
                while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    let line = locked(&status).line();
                    say(&line);
                    wait = every;
                }
            };
            // Without the thread nothing is said, and nothing else is lost.
            let thread = std::thread::Builder::new().name("progress".to_string()).spawn(write);
            thread.ok().map(|thread| (end, thread))
        });
        Progress { bar, status, lines }
    }

    /// Shows that `done` of `total` is done.
    pub fn set(&self, done: u64, total: u64) {
        let begins = {
            let mut status = locked(&self.status);
            let begins = status.total == 0 && total > 0;
            (status.done, status.total) = (done, total);
            begins
        };
        self.bar.set_length(total);
        self.bar.set_position(done);
        if begins {
            let unit = &locked(&self.status).unit;
            // What is named is shortened where there is no room: the line never wraps.
            self.bar.set_style(style(&format!(
                "{{wide_msg}} [{{bar:8}}] {{human_pos}} of {{human_len}} {unit}{{left}}"
            )));
            // What had been done before is no measure of the time left.
            self.bar.reset_eta();
        }
    }

    /// Shows another name for what is done.
    pub fn name(&self, what: &str) {
        locked(&self.status).what = what.to_string();
        self.bar.set_message(what.to_string());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if let Some((end, thread)) = self.lines.take() {
            drop(end);
            // It has nothing to say but lines.
            let _ = thread.join();
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ")
        .with_key("left", |state: &ProgressState, to: &mut dyn std::fmt::Write| {
            let left = state.eta();
            if state.elapsed() >= UNKNOWN && left.as_secs() > 0 {
                // A terminal that takes no more is told nothing.
                let _ = write!(to, ", {:#} left", HumanDuration(left));
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::TermLike;

    /// A terminal of a width that remembers what was written to it.
    #[derive(Clone, Debug)]
    struct Screen {
        width: u16,
        text: Arc<Mutex<String>>,
    }

    impl Screen {
        fn add(&self, text: &str) -> io::Result<()> {
            *self.text.lock().unwrap() += text;
            Ok(())
        }
    }

    impl TermLike for Screen {
        fn width(&self) -> u16 {
            self.width
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> io::Result<()> {
            self.add(text)?;
            self.add("\n")
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            self.add(text)
        }
        fn clear_line(&self) -> io::Result<()> {
            self.add("\n")
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    const NOBODY: Option<fn(&str)> = None;

    #[test]
    fn the_line_fits_the_terminal_and_tells_no_time_before_it_is_known() {
        for width in [60, 80, 100, 140] {
            let screen = Screen { width, text: Arc::default() };
            let target = ProgressDrawTarget::term_like(Box::new(screen.clone()));
            let what = "slab:layers=16,bits=32,normalise=both at 64 on engine-from-behind";
            let progress = Progress::to(target, NOBODY, [FIRST, EVERY], what, "fragments");
            for done in [0, 1, 12_345_678] {
                progress.set(done, 123_456_789);
                progress.name(what);
                progress.bar.tick();
            }
            let text = screen.text.lock().unwrap().clone();
            assert!(text.contains("12,345,678 of 123,456,789 fragments"), "{text}");
            assert!(text.contains("slab") && !text.contains("left"), "{text}");
            for line in text.lines() {
                assert!(line.chars().count() <= usize::from(width), "{width}: '{line}'");
            }
        }
    }

    #[test]
    fn without_a_terminal_a_line_now_and_then_says_how_far_it_is() {
        let said: Arc<Mutex<Vec<String>>> = Arc::default();
        let to = said.clone();
        let say = move |line: &str| to.lock().unwrap().push(line.to_string());
        let often = [Duration::from_millis(5); 2];
        let progress = Progress::to(ProgressDrawTarget::hidden(), Some(say), often, "one", "runs");
        progress.set(3, 1000);
        let until = Instant::now() + Duration::from_secs(20);
        while said.lock().unwrap().len() < 2 && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
        drop(progress);
        let lines = said.lock().unwrap().clone();
        assert!(lines.len() >= 2, "{lines:?}");
        assert!(lines[1].starts_with("screendoor: one: 3 of 1 000 runs, after "), "{lines:?}");
        // Ended with the work.
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(said.lock().unwrap().len(), lines.len());
    }

    #[test]
    fn what_is_done_at_once_says_nothing() {
        let say = |line: &str| panic!("{line}");
        let target = ProgressDrawTarget::hidden();
        Progress::to(target, Some(say), [FIRST, EVERY], "one", "runs").set(1, 2);
    }
}

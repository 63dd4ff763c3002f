//! Faults of the system: what the program leaves behind when its disk is full, its files
//! fail, its memory ends, it is killed, a thread of it panics, its GPU vanishes.
//!
//! Whatever happens, a file under a name that was asked for is the old one or a whole new
//! one, and the program ends.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use serde::Serialize;
use tempfile::TempDir;

use crate::study::stress::child::{Ended, command, disturbed, limited, run, terminate};
use screendoor_designs::configure;
use screendoor_gpu::{self as gpu, Gpu, GpuOptions};
use screendoor_rop::ReplayOptions;
use screendoor_trace::error::{Error, Result, panic_text};
use screendoor_trace::output::{OutputFile, is_partial};
use screendoor_trace::trace::Trace;

/// A fault, how often it was brought about, and how often nothing was lost.
#[derive(Clone, Debug, Serialize)]
pub struct Fault {
    /// Its name.
    pub name: &'static str,
    /// What was done.
    pub what: &'static str,
    /// How often.
    pub tries: u32,
    /// How often the program did its work all the same.
    pub done: u32,
    /// How often it ended otherwise, with all files as they should be.
    pub survived: u32,
    /// What it said then, the last time.
    pub said: String,
    /// What was lost, left over or hung.
    pub failures: Vec<String>,
}

impl Fault {
    /// A fault that was not tried yet.
    pub fn new(name: &'static str, what: &'static str) -> Self {
        let said = String::new();
        Fault { name, what, tries: 0, done: 0, survived: 0, said, failures: Vec::new() }
    }

    /// Puts down how a try ended; `kept` is what is wrong with the files, if anything.
    fn add(&mut self, ended: &Ended, kept: std::result::Result<(), String>) {
        self.tries += 1;
        match kept {
            Err(why) => self.failures.push(format!("{why} ({})", ended.words())),
            Ok(()) if ended.hung => self.failures.push("it hangs".to_string()),
            Ok(()) if ended.succeeded() => self.done += 1,
            Ok(()) => {
                self.survived += 1;
                self.said = without_folders(&ended.words());
            }
        }
    }
}

/// What was said, files named without the folders that they happen to lie in.
fn without_folders(said: &str) -> String {
    let word = |word: &str| {
        let name = word.rsplit_once('/').filter(|_| word.starts_with('/')).map(|(_, name)| name);
        name.unwrap_or(word).to_string()
    };
    let said = said.replace("screendoor: error: ", "");
    said.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Where the faults happen: the program, a folder, a trace in it.
struct Place<'a> {
    program: &'a Path,
    folder: TempDir,
    trace: PathBuf,
}

/// What stands in the place of an output before.
const OLD: &[u8] = b"what stood here before";

/// The scene: some tens of thousands of fragments.
const SCENE: [&str; 4] = ["capture", "builtin:glass", "--size", "192x192"];

/// Brings them about, one after the other.
///
/// # Errors
/// [`Error::Io`] where the program cannot be run or files cannot be written.
pub(super) fn faults(program: &Path, gpu: &dyn Fn() -> Result<Option<Gpu>>) -> Result<Vec<Fault>> {
    let failed = |e| Error::io("run", program, e);
    let folder = tempfile::tempdir().map_err(failed)?;
    let place = Place { program, trace: folder.path().join("trace.arrow"), folder };
    let trace = place.trace.clone();
    run(&mut place.capture(&trace)).map_err(failed)?;
    Trace::open(&trace)?.verify(|_| ())?;
    let mut list = Vec::new();
    if cfg!(unix) {
        list.push(place.full_disk().map_err(failed)?);
        list.push(place.full_device().map_err(failed)?);
        list.push(place.killed().map_err(failed)?);
        list.push(place.terminated().map_err(failed)?);
        list.push(place.no_memory().map_err(failed)?);
        list.push(place.read_error().map_err(failed)?);
        list.push(place.shrinking().map_err(failed)?);
    }
    list.push(place.cut_files().map_err(failed)?);
    list.push(panicking(&place)?);
    list.extend(vanishing(&trace, gpu)?);
    Ok(list)
}

impl Place<'_> {
    fn command(&self, arguments: &[&OsStr]) -> Command {
        command(self.program, arguments)
    }

    fn capture(&self, output: &Path) -> Command {
        let mut command = self.command(&SCENE.map(OsStr::new));
        command.arg("-o").arg(output);
        command
    }

    fn replay_arguments<'b>(trace: &'b Path, output: &'b Path) -> Vec<&'b OsStr> {
        let [replay, design, exact, o] = ["replay", "--design", "exact", "-o"].map(OsStr::new);
        vec![replay, trace.as_ref(), design, exact, o, output.as_ref()]
    }

    /// A folder of its own with a file in the output's place.
    fn output(&self, name: &str) -> io::Result<(TempDir, PathBuf)> {
        let folder = tempfile::tempdir_in(self.folder.path())?;
        let path = folder.path().join(name);
        fs::write(&path, OLD)?;
        Ok((folder, path))
    }

    /// The output is the old one, or a whole new one if the program says so; files under
    /// construction are gone, where the program had a say in its end.
    fn kept(output: &Path, ended: &Ended, says: bool) -> std::result::Result<(), String> {
        let bytes = fs::read(output).map_err(|e| format!("the output is gone: {e}"))?;
        if ended.succeeded() && bytes == OLD {
            return Err("it claims success and wrote nothing".to_string());
        }
        if bytes != OLD {
            Self::whole(output).map_err(|e| format!("half a file under a good name: {e}"))?;
        }
        let folder = output.parent().unwrap_or(output);
        let entries = fs::read_dir(folder).map_err(|e| e.to_string())?;
        let left = entries.flatten().filter(|e| e.path() != output).map(|e| e.path());
        let left: Vec<PathBuf> = left.filter(|path| says || !is_partial(path)).collect();
        if left.is_empty() { Ok(()) } else { Err(format!("left behind: {left:?}")) }
    }

    fn whole(output: &Path) -> Result<()> {
        match output.extension().and_then(|e| e.to_str()) {
            Some("arrow") => Trace::open(output)?.verify(|_| ()).map(|_| ()),
            _ => screendoor_trace::picture::read(output, None).map(|_| ()),
        }
    }

    fn full_disk(&self) -> io::Result<Fault> {
        let what = "no file may grow beyond 0 to 4096 blocks of 512 bytes, traces and pictures";
        let mut fault = Fault::new("disk full", what);
        for blocks in [0, 1, 8, 64, 512, 1024, 2048, 4096] {
            for name in ["a.arrow", "a.exr", "a.png"] {
                let (_folder, path) = self.output(name)?;
                let ended = run(&mut limited(&format!("-f {blocks}"), &self.writing(&path)))?;
                let clear = said_clearly(ended.succeeded() || ended.refused());
                fault.add(&ended, clear.and(Self::kept(&path, &ended, true)));
            }
        }
        Ok(fault)
    }

    fn full_device(&self) -> io::Result<Fault> {
        let mut fault = Fault::new("device full", "outputs to /dev/full");
        let full = Path::new("/dev/full");
        if !full.exists() {
            fault.said = "this system has no /dev/full".to_string();
            return Ok(fault);
        }
        let ended = run(&mut self.capture(full))?;
        fault.add(&ended, said_clearly(ended.refused()));
        let json: Vec<&OsStr> = ["info", "--json", "/dev/full"]
            .iter()
            .map(OsStr::new)
            .chain([self.trace.as_ref()])
            .collect();
        let ended = run(&mut self.command(&json))?;
        fault.add(&ended, said_clearly(ended.refused()));
        Ok(fault)
    }

    /// How long the program takes undisturbed.
    fn duration(&self, name: &str) -> io::Result<Duration> {
        let (_folder, path) = self.output(name)?;
        Ok(Duration::from_secs_f64(run(&mut self.writing(&path))?.seconds))
    }

    fn writing(&self, path: &Path) -> Command {
        match path.extension().and_then(|e| e.to_str()) {
            Some("arrow") => self.capture(path),
            _ => self.command(&Self::replay_arguments(&self.trace, path)),
        }
    }

    fn killed(&self) -> io::Result<Fault> {
        let what = "SIGKILL at 24 moments of writing a trace, and of a picture";
        let mut fault = Fault::new("killed", what);
        for name in ["a.arrow", "a.exr"] {
            let whole = self.duration(name)?;
            for moment in 0..24 {
                let (_folder, path) = self.output(name)?;
                let after = whole * moment / 22;
                let ended = disturbed(&mut self.writing(&path), after, |child| {
                    // It may have ended.
                    let _ = child.kill();
                    Ok(())
                })?;
                fault.add(&ended, Self::kept(&path, &ended, false));
            }
        }
        Ok(fault)
    }

    fn terminated(&self) -> io::Result<Fault> {
        let what = "SIGTERM at 24 moments of writing a trace: nothing may be left behind";
        let mut fault = Fault::new("terminated", what);
        let whole = self.duration("a.arrow")?;
        for moment in 0..24 {
            let (_folder, path) = self.output("a.arrow")?;
            let ended = disturbed(&mut self.writing(&path), whole * moment / 22, |child| {
                terminate(child);
                Ok(())
            })?;
            fault.add(&ended, Self::kept(&path, &ended, true));
        }
        Ok(fault)
    }

    fn no_memory(&self) -> io::Result<Fault> {
        let what = "as little address space as it starts with to 128 MiB, capture and replay";
        let mut fault = Fault::new("memory ends", what);
        for mebibytes in (16..=64).step_by(2).chain([96, 128]) {
            // Where the system cannot even load it there is nothing to see.
            let limit = format!("-v {}", mebibytes * 1024);
            if !run(&mut limited(&limit, &self.command(&["--version".as_ref()])))?.succeeded() {
                continue;
            }
            for name in ["a.arrow", "a.exr"] {
                let (_folder, path) = self.output(name)?;
                let ended = run(&mut limited(&limit, &self.writing(&path)))?;
                let says = ["memory", "thread"].iter().any(|word| ended.said.contains(word));
                let clear = ended.succeeded() || says;
                // The system may end it; a file under construction then stays.
                fault.add(&ended, said_clearly(clear).and(Self::kept(&path, &ended, false)));
            }
        }
        Ok(fault)
    }

    fn read_error(&self) -> io::Result<Fault> {
        let what = "scenes, studies and pictures whose files fail to be read (EIO)";
        let mut fault = Fault::new("read error", what);
        // A regular file whose first byte cannot be read.
        let failing = Path::new("/proc/self/mem");
        if !failing.exists() {
            fault.said = "this system has no file that fails".to_string();
            return Ok(fault);
        }
        for ending in ["obj", "gltf", "glb", "ply", "tfx", "vdb", "toml", "exr", "png"] {
            let path = self.folder.path().join(format!("failing.{ending}"));
            #[cfg(unix)]
            std::os::unix::fs::symlink(failing, &path)?;
            let (_folder, output) = self.output("a.arrow")?;
            let mut command = match ending {
                "toml" => self.command(&[
                    "study".as_ref(),
                    path.as_ref(),
                    "-o".as_ref(),
                    self.folder.path().join("study").as_ref(),
                ]),
                "exr" | "png" => self.command(&["compare".as_ref(), path.as_ref(), path.as_ref()]),
                _ => self.command(&[
                    "capture".as_ref(),
                    path.as_ref(),
                    "-o".as_ref(),
                    output.as_ref(),
                ]),
            };
            let ended = run(&mut command)?;
            let clear = said_clearly(ended.refused() && ended.said.contains("os error 5"));
            fault.add(&ended, clear.and(Self::kept(&output, &ended, true)));
        }
        Ok(fault)
    }

    fn cut_files(&self) -> io::Result<Fault> {
        let mut fault =
            Fault::new("file cut short", "a trace that ends after 0 to 63 of its 64 parts");
        let bytes = fs::read(&self.trace)?;
        let path = self.folder.path().join("cut.arrow");
        for part in 0..64 {
            fs::write(&path, &bytes[..bytes.len() * part / 64])?;
            let (_folder, output) = self.output("a.exr")?;
            let ended = run(&mut self.command(&Self::replay_arguments(&path, &output)))?;
            fault.add(&ended, said_clearly(ended.refused()).and(Self::kept(&output, &ended, true)));
        }
        Ok(fault)
    }

    fn shrinking(&self) -> io::Result<Fault> {
        let what = "a trace that another program cuts while it is replayed, at 48 moments";
        let mut fault = Fault::new("cut while it is read", what);
        let bytes = fs::read(&self.trace)?;
        let path = self.folder.path().join("shrinking.arrow");
        let whole = self.duration("a.exr")?;
        let (_folder, good) = self.output("a.exr")?;
        run(&mut self.writing(&good))?;
        let good = fs::read(good)?;
        for moment in 0..48 {
            fs::write(&path, &bytes)?;
            let (_folder, output) = self.output("a.exr")?;
            let mut command = self.command(&Self::replay_arguments(&path, &output));
            let ended = disturbed(&mut command, whole * moment / 60, |_| {
                fs::File::options().write(true).open(&path)?.set_len(bytes.len() as u64 / 3)
            })?;
            let clear = said_clearly(ended.succeeded() || ended.refused());
            // What was read before is the whole trace, or the picture is not that of it.
            let same = match ended.succeeded() && fs::read(&output)? != good {
                true => Err("a picture of half a trace".to_string()),
                false => Ok(()),
            };
            fault.add(&ended, clear.and(same).and(Self::kept(&output, &ended, true)));
        }
        Ok(fault)
    }
}

fn said_clearly(clear: bool) -> std::result::Result<(), String> {
    if clear { Ok(()) } else { Err("no clear error".to_string()) }
}

/// What an attempt within this process came to, as if it had been one of its own.
fn ended(found: std::thread::Result<Result<()>>) -> Ended {
    match found {
        Ok(Ok(())) => Ended { code: Some(0), ..Ended::default() },
        Ok(Err(e)) => Ended { code: Some(1), said: e.to_string(), ..Ended::default() },
        Err(panic) => {
            let said = format!("panicked: {}", panic_text(&*panic));
            Ended { code: Some(101), said, ..Ended::default() }
        }
    }
}

/// A thread that panics in the middle of a replay whose picture is being written.
fn panicking(place: &Place<'_>) -> Result<Fault> {
    let what = "a replay that panics at its first to its last eighth, a file half written (within this process)";
    let mut fault = Fault::new("panic", what);
    let trace = Trace::open(&place.trace)?;
    let design = configure("lk", &[])?;
    let told = std::panic::take_hook();
    // It is meant to happen: nobody need be told.
    std::panic::set_hook(Box::new(|_| ()));
    for moment in 0..8 {
        let (_folder, path) =
            place.output("a.arrow").map_err(|e| Error::io("create", "a.arrow", e))?;
        let watch = |done: u64, total: u64| {
            assert!(done * 8 < total * (moment + 1), "planted");
        };
        let attempt = || -> Result<()> {
            let mut file = OutputFile::create(&path)?;
            file.write_bytes(b"half of a file")?;
            let options =
                ReplayOptions { window: 1000, progress: &watch, ..ReplayOptions::default() };
            design.replay(&trace, 8, 0, &options)?;
            file.commit()
        };
        let found = ended(catch_unwind(AssertUnwindSafe(attempt)));
        fault.add(&found, Place::kept(&path, &found, true));
    }
    std::panic::set_hook(told);
    // Whoever replays next finds all in order.
    design.replay(&trace, 8, 0, &ReplayOptions::default())?;
    Ok(fault)
}

/// A GPU that is lost before and within a replay; none where there is no GPU.
fn vanishing(path: &Path, open: &dyn Fn() -> Result<Option<Gpu>>) -> Result<Option<Fault>> {
    let what =
        "a GPU that is lost before a replay, and after its first chunk (within this process)";
    let mut fault = Fault::new("GPU vanishes", what);
    let trace = Trace::open(path)?;
    let design = configure("lk", &[])?;
    for early in [true, false] {
        let Some(gpu) = open()? else { return Ok(None) };
        if early {
            gpu.lose();
        }
        let watch = |_, _| gpu.lose();
        let options = GpuOptions { rows: 1000, progress: &watch, ..GpuOptions::default() };
        let attempt = || gpu::replay(&gpu, &design, &trace, 8, 0, &options).map(|_| ());
        let found = ended(catch_unwind(AssertUnwindSafe(attempt)));
        let lost = found.code == Some(1) && found.said.contains("lost");
        fault.add(&found, if lost { Ok(()) } else { Err("the loss is not told".to_string()) });
    }
    Ok(Some(fault))
}

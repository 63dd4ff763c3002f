//! Running a program under the layer.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use screendoor_trace::error::{Error, Result};
use screendoor_vulkan_layer::settings::{LAYER, Settings, manifest};

use crate::logs::Watch;

/// A program to be run under the layer.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its file, or its name on the `PATH`.
    pub program: OsString,
    /// What it is given.
    pub arguments: Vec<OsString>,
    /// What is captured. The folder has to be there.
    pub settings: Settings,
    /// The layer's library ([`crate::layer_library`]).
    pub library: PathBuf,
    /// Have Mesa run OpenGL on Vulkan (zink).
    pub opengl: bool,
    /// End the program as soon as all that was asked for is captured.
    pub stop: bool,
}

/// How a program ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ended {
    /// By itself, with this exit code.
    Code(i32),
    /// By a signal of this number.
    Signal(i32),
    /// By us, when all was captured.
    Stopped,
}

/// The manifest that tells Vulkan's loader of the layer. The library lies beside it.
const MANIFEST: &str = "screendoor.json";

/// How long a program that was told to end is waited for.
const PATIENCE: Duration = Duration::from_secs(10);

/// How often it is looked whether the program has ended.
const PAUSE: Duration = Duration::from_millis(20);

impl Run {
    /// Runs the program to its end, with our input and output. `started` is told the number of its
    /// process.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be started or the folder not be written.
    pub fn run(&self, started: &mut dyn FnMut(u32)) -> Result<Ended> {
        let Some(folder) = &self.settings.folder else {
            return Err(Error::config("no folder is given to capture to", "give one"));
        };
        let made = self.make_manifest(folder)?;
        let ended = self.run_in(folder, started);
        for path in made {
            // Of no use to anybody any more, and in nobody's way.
            let _ = fs::remove_file(path);
        }
        ended
    }

    fn run_in(&self, folder: &Path, started: &mut dyn FnMut(u32)) -> Result<Ended> {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments);
        for (name, value) in self.variables(folder, &|name| std::env::var_os(name)) {
            command.env(name, value);
        }
        let fail = |e| Error::io("run", &self.program, e);
        let mut child = command.spawn().map_err(fail)?;
        started(child.id());
        let mut watch = Watch::new(folder);
        let mut stopped: Option<Instant> = None;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(fail)? {
                break status;
            }
            match stopped {
                None if self.stop && watch.has_ended() => {
                    watch.end_processes(child.id());
                    stopped = Some(Instant::now());
                }
                Some(since) if since.elapsed() > PATIENCE => kill(&mut child),
                _ => {}
            }
            std::thread::sleep(PAUSE);
        };
        // Others that it started may still be drawing.
        while watch.is_any_alive() {
            if self.stop && stopped.is_none() && watch.has_ended() {
                watch.end_processes(child.id());
                stopped = Some(Instant::now());
            }
            if stopped.is_some_and(|since| since.elapsed() > PATIENCE) {
                break;
            }
            std::thread::sleep(PAUSE);
        }
        Ok(if stopped.is_some() { Ended::Stopped } else { ended(status) })
    }

    /// Writes the manifest: what was made.
    fn make_manifest(&self, folder: &Path) -> Result<[PathBuf; 2]> {
        let library = folder.join("layer").with_extension(std::env::consts::DLL_EXTENSION);
        // Beside the manifest, so that no name has to be written in JSON.
        let linked = link(&self.library, &library);
        linked.map_err(|e| Error::io("write", &library, e))?;
        let name = library.file_name().unwrap_or_default().to_string_lossy();
        let text = manifest(&format!("./{name}"));
        let place = folder.join(MANIFEST);
        fs::write(&place, text).map_err(|e| Error::io("write", &place, e))?;
        Ok([place, library])
    }

    /// What the program's environment has beside ours, as `get` gives that.
    fn variables(
        &self,
        folder: &Path,
        get: &dyn Fn(&str) -> Option<OsString>,
    ) -> Vec<(&'static str, OsString)> {
        let get = |name: &str| get(name).filter(|value| !value.is_empty());
        let mut all = self.settings.variables();
        // Where a path to look for all layers is set, the loader takes no other.
        let path =
            if get("VK_LAYER_PATH").is_some() { "VK_LAYER_PATH" } else { "VK_ADD_LAYER_PATH" };
        all.push((path, joined(Some(folder.as_os_str().to_owned()), get(path))));
        // The last one is the nearest to the driver: it sees what other layers make of the program.
        let layers = "VK_INSTANCE_LAYERS";
        all.push((layers, joined(get(layers), Some(LAYER.into()))));
        if self.opengl {
            all.push(("MESA_LOADER_DRIVER_OVERRIDE", "zink".into()));
            all.push(("GALLIUM_DRIVER", "zink".into()));
            // Screens without DRI3, such as Xvfb.
            if get("LIBGL_KOPPER_DRI2").is_none() {
                all.push(("LIBGL_KOPPER_DRI2", "true".into()));
            }
        }
        all
    }
}

/// Parts of a list of names.
fn joined(first: Option<OsString>, second: Option<OsString>) -> OsString {
    let separator = if cfg!(windows) { ";" } else { ":" };
    let parts: Vec<OsString> = first.into_iter().chain(second).collect();
    parts.join(OsStr::new(separator))
}

#[cfg(unix)]
fn link(library: &Path, place: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(library, place)
}

#[cfg(not(unix))]
fn link(library: &Path, place: &Path) -> std::io::Result<()> {
    fs::copy(library, place).map(|_| ())
}

fn kill(child: &mut Child) {
    // It may have ended by itself just now.
    let _ = child.kill();
}

fn ended(status: ExitStatus) -> Ended {
    #[cfg(unix)]
    {
        use std::os::unix::process::ExitStatusExt;
        if let Some(signal) = status.signal() {
            return Ended::Signal(signal);
        }
    }
    Ended::Code(status.code().unwrap_or(1))
}

/// Why a program that ended so may have left nothing, not even that it has a device: what is to be
/// said, and what to do.
pub fn why_nothing(program: &OsStr, ended: Ended) -> (String, String) {
    let what = "it has opened no Vulkan device under the layer".to_string();
    let file = on_path(program);
    let file = file.as_deref();
    let hint = match (file, ended) {
        (Some(file), _) if is_set_id(file) => format!(
            "{} is set-uid or set-gid, and Vulkan's loader then takes no layers: run a copy",
            file.display()
        ),
        (Some(file), _) if is_static(file) => {
            format!("{} is linked statically, without Vulkan's loader", file.display())
        }
        (_, Ended::Code(code)) if code != 0 => {
            format!("it ended with exit code {code}: see what it says above")
        }
        (_, Ended::Signal(signal)) => format!("it was ended by signal {signal}"),
        _ => "it may use OpenGL (give --opengl), or not have drawn anything, or bring a loader of \
              Vulkan from before 1.3.234 (set VK_LAYER_PATH to an empty folder)"
            .to_string(),
    };
    (what, hint)
}

/// The file that a program's name leads to.
fn on_path(program: &OsStr) -> Option<PathBuf> {
    let path = Path::new(program);
    if path.components().count() > 1 {
        return path.is_file().then(|| path.to_path_buf());
    }
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders).map(|folder| folder.join(path)).find(|file| file.is_file())
}

#[cfg(unix)]
fn is_set_id(file: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(file).is_ok_and(|m| m.permissions().mode() & 0o6000 != 0)
}

#[cfg(not(unix))]
fn is_set_id(_: &Path) -> bool {
    false
}

/// Whether a file is an ELF program that asks for no dynamic linker.
fn is_static(file: &Path) -> bool {
    use std::io::Read;
    let mut head = Vec::new();
    let read = fs::File::open(file).and_then(|f| f.take(1 << 16).read_to_end(&mut head));
    read.is_ok() && elf::asks_for_no_linker(&head).unwrap_or(false)
}

mod elf {
    /// Of a 64-bit little-endian ELF file's first bytes; `None` for anything else.
    pub(super) fn asks_for_no_linker(head: &[u8]) -> Option<bool> {
        const INTERPRETER: u32 = 3;
        let at = |from: usize, n: usize| head.get(from..from.checked_add(n)?);
        let short = |from: usize| Some(u16::from_le_bytes(at(from, 2)?.try_into().ok()?));
        if at(0, 6)? != b"\x7fELF\x02\x01" {
            return None;
        }
        let table = usize::try_from(u64::from_le_bytes(at(32, 8)?.try_into().ok()?)).ok()?;
        let (each, count) = (usize::from(short(54)?), usize::from(short(56)?));
        for i in 0..count {
            let kind = at(table.checked_add(i * each)?, 4)?;
            if u32::from_le_bytes(kind.try_into().ok()?) == INTERPRETER {
                return Some(false);
            }
        }
        Some(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run() -> Run {
        Run {
            program: "p".into(),
            arguments: Vec::new(),
            settings: Settings::default(),
            library: "/l.so".into(),
            opengl: false,
            stop: false,
        }
    }

    fn value(run: &Run, name: &str, own: &[(&str, &str)]) -> Option<String> {
        let get = |name: &str| own.iter().find(|v| v.0 == name).map(|v| v.1.into());
        let all = run.variables(Path::new("/f"), &get);
        let found = all.iter().find(|(n, _)| *n == name);
        found.map(|(_, value)| value.to_str().unwrap().to_string())
    }

    #[test]
    fn variables_that_are_there_are_kept() {
        let run = run();
        assert_eq!(value(&run, "VK_ADD_LAYER_PATH", &[]).unwrap(), "/f");
        let own = [("VK_ADD_LAYER_PATH", "/x"), ("VK_INSTANCE_LAYERS", "a:b")];
        assert_eq!(value(&run, "VK_ADD_LAYER_PATH", &own).unwrap(), "/f:/x");
        let layers = value(&run, "VK_INSTANCE_LAYERS", &own).unwrap();
        assert_eq!(layers, format!("a:b:{LAYER}"));
        // With this one the loader ignores the other.
        let own = [("VK_LAYER_PATH", "/y"), ("VK_ADD_LAYER_PATH", "/x")];
        assert_eq!(value(&run, "VK_LAYER_PATH", &own).unwrap(), "/f:/y");
        assert_eq!(value(&run, "VK_ADD_LAYER_PATH", &own), None);
        assert_eq!(value(&run, "GALLIUM_DRIVER", &[]), None);
        let opengl = Run { opengl: true, ..run };
        assert_eq!(value(&opengl, "GALLIUM_DRIVER", &[]).unwrap(), "zink");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn why_there_is_nothing_is_told() {
        use std::os::unix::fs::PermissionsExt;
        let why = |program: &OsStr, ended| why_nothing(program, ended).1;
        assert!(why(OsStr::new("sh"), Ended::Code(0)).contains("--opengl"));
        assert!(why(OsStr::new("sh"), Ended::Code(3)).contains("exit code 3"));
        assert!(why(OsStr::new("sh"), Ended::Signal(11)).contains("signal 11"));
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("p");
        fs::write(&file, "#!/bin/sh").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o4755)).unwrap();
        assert!(why(file.as_os_str(), Ended::Code(3)).contains("set-uid"));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn programs_without_a_linker_are_told() {
        let own = std::env::current_exe().unwrap();
        assert!(!is_static(&own));
        let mut head = fs::read(&own).unwrap();
        head.truncate(1 << 16);
        // No entry of its table is looked at.
        head[56..58].copy_from_slice(&[0, 0]);
        assert_eq!(elf::asks_for_no_linker(&head), Some(true));
        assert_eq!(elf::asks_for_no_linker(b"#!/bin/sh"), None);
        assert!(on_path(OsStr::new("sh")).is_some() && on_path(OsStr::new("/no/such")).is_none());
    }
}

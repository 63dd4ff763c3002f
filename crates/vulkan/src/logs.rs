//! Logs that are still being written: whether all is captured, and who writes them.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use screendoor_vulkan_layer::log::{self, Entry, MAGIC};

/// Looks at the logs of a folder.
pub(crate) struct Watch {
    folder: PathBuf,
    /// How far each was read, entry by entry.
    read: BTreeMap<PathBuf, u64>,
    has_ended: bool,
    processes: Vec<u32>,
}

impl Watch {
    pub(crate) fn new(folder: &Path) -> Self {
        Watch {
            folder: folder.to_path_buf(),
            read: BTreeMap::new(),
            has_ended: false,
            processes: Vec::new(),
        }
    }

    /// Whether a log says that all that was asked for is captured.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.look();
        self.has_ended
    }

    /// Reads what is new. What cannot be read is looked at again later.
    fn look(&mut self) {
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|e| e == "log") {
                let from = self.read.get(&path).copied().unwrap_or(0);
                if let Some(to) = self.look_at(&path, from) {
                    self.read.insert(path, to);
                }
            }
        }
    }

    fn look_at(&mut self, path: &Path, from: u64) -> Option<u64> {
        if fs::metadata(path).ok()?.len() <= from {
            return None;
        }
        let mut file = File::open(path).ok()?;
        let from = from.max(MAGIC.len() as u64);
        file.seek(SeekFrom::Start(from)).ok()?;
        let mut bytes = MAGIC.to_vec();
        file.read_to_end(&mut bytes).ok()?;
        // Only whole entries.
        let mut end = MAGIC.len();
        while let Some(length) = bytes[end..].first_chunk() {
            let next = end.checked_add(4)?.checked_add(u32::from_le_bytes(*length) as usize)?;
            if next > bytes.len() {
                break;
            }
            end = next;
        }
        let (entries, _) = log::entries(&bytes[..end])?;
        for entry in entries {
            match entry {
                Entry::End(_) => self.has_ended = true,
                Entry::Device(device) => self.processes.push(device.process),
                _ => {}
            }
        }
        Some(from + (end - MAGIC.len()) as u64)
    }

    /// Whether a process that writes here lives.
    pub(crate) fn is_any_alive(&mut self) -> bool {
        self.look();
        let folder = self.folder.clone();
        self.processes.iter().any(|process| is_ours(*process, &folder))
    }

    /// Tells those that write here to end, and `child`.
    pub(crate) fn end_processes(&self, child: u32) {
        let others = self.processes.iter().filter(|p| **p != child);
        others.filter(|p| is_ours(**p, &self.folder)).for_each(|p| terminate(*p));
        terminate(child);
    }
}

/// Whether a process lives and was told of the folder: its number may be that of another process
/// by now, or one in a container.
fn is_ours(process: u32, folder: &Path) -> bool {
    let Ok(variables) = fs::read(format!("/proc/{process}/environ")) else { return false };
    let folder = folder.as_os_str().as_encoded_bytes();
    !folder.is_empty() && variables.windows(folder.len()).any(|part| part == folder)
}

/// Tells a process to end.
#[cfg(unix)]
pub fn terminate(process: u32) {
    if let Ok(process) = libc::pid_t::try_from(process)
        && process > 0
    {
        // SAFETY: the call takes two numbers.
        unsafe { libc::kill(process, libc::SIGTERM) };
    }
}

/// Elsewhere processes are not told.
#[cfg(not(unix))]
pub fn terminate(_: u32) {}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use screendoor_vulkan_layer::log::{Device, End, Note};

    use super::*;

    #[test]
    fn the_end_is_seen_when_it_is_whole() {
        let place = tempfile::tempdir().unwrap();
        let mut watch = Watch::new(place.path());
        assert!(!watch.has_ended());
        let mut file = File::create(place.path().join("1-0.log")).unwrap();
        let device = Device { process: u32::MAX, ..Device::default() };
        let entries = [
            MAGIC.to_vec(),
            Entry::Device(device).to_bytes(),
            Entry::Note(Note { text: "a".into() }).to_bytes(),
            Entry::End(End { frame: 3 }).to_bytes(),
        ];
        let all = entries.concat();
        for (i, byte) in all.iter().enumerate() {
            assert!(!watch.has_ended(), "{i}");
            file.write_all(&[*byte]).unwrap();
        }
        assert!(watch.has_ended());
        assert_eq!(watch.processes, [u32::MAX]);
        assert!(!watch.is_any_alive());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn processes_are_ours_that_know_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let mut command = std::process::Command::new("sleep");
        let mut child = command.arg("60").env("X", place.path()).spawn().unwrap();
        // The system may take a moment to show what a new process was given.
        let pause = || std::thread::sleep(std::time::Duration::from_millis(20));
        (0..500).take_while(|_| !is_ours(child.id(), place.path())).for_each(|_| pause());
        assert!(is_ours(child.id(), place.path()));
        assert!(!is_ours(child.id(), Path::new("/no/such/folder")));
        terminate(child.id());
        child.wait().unwrap();
        assert!(!is_ours(child.id(), place.path()));
    }
}

//! The program with and without the layer, and what the layer wrote.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use screendoor_vulkan_layer::log::{
    Draw, Entry, Event, Files, Image, Picture, Pipeline, RECORD_BYTES, Record, Submission, entries,
};
use screendoor_vulkan_layer::settings::{LAYER, Settings, manifest};

/// The folder of what is built beside this test.
fn deps() -> PathBuf {
    std::env::current_exe().unwrap().parent().unwrap().to_path_buf()
}

/// The test program.
fn program() -> PathBuf {
    deps().parent().unwrap().join("examples").join("raw")
}

/// What a run of the program left.
pub(crate) struct Ran {
    /// None where a signal ended it.
    pub code: Option<i32>,
    pub picture: Vec<u8>,
    /// What it and the layer said.
    pub text: String,
    pub took: Duration,
}

/// Runs a case, under the layer where there are settings.
pub(crate) fn raw(case: &str, settings: Option<&Settings>) -> Ran {
    ran(case, settings, |command| command.output().unwrap())
}

/// The same while what it says goes nowhere.
pub(crate) fn unheard(case: &str, settings: &Settings) -> Ran {
    ran(case, Some(settings), |command| {
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        child.wait_with_output().unwrap()
    })
}

fn ran(case: &str, settings: Option<&Settings>, run: impl FnOnce(&mut Command) -> Output) -> Ran {
    let folder = super::tempfile();
    let out = folder.join("out");
    let mut command = Command::new(program());
    command.arg(case).arg(&out).stdin(Stdio::null());
    if let Some(settings) = settings {
        let library = deps().join("libscreendoor_vulkan_layer.so");
        let manifest = manifest(&library.display().to_string());
        std::fs::write(folder.join("layer.json"), manifest).unwrap();
        command.env("VK_ADD_LAYER_PATH", &folder).env("VK_INSTANCE_LAYERS", LAYER);
        command.envs(settings.variables());
    }
    let start = Instant::now();
    let output = run(&mut command);
    let took = start.elapsed();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    let ran = Ran {
        code: output.status.code(),
        picture: std::fs::read(&out).unwrap_or_default(),
        text: text.into_owned(),
        took,
    };
    std::fs::remove_dir_all(&folder).unwrap();
    ran
}

/// The program's cases.
pub(crate) fn cases() -> Vec<String> {
    let output = Command::new(program()).arg("--list").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().filter_map(|l| l.split_whitespace().next()).map(str::to_string).collect()
}

/// Whether there is no driver, which is said.
pub(crate) fn skipped() -> bool {
    let ran = raw("plain", None);
    let missing = ran.code != Some(0);
    let required = std::env::var_os("SCREENDOOR_GPU").is_some_and(|v| v == "require");
    assert!(!(missing && required), "no Vulkan driver: {}", ran.text);
    if missing {
        println!("skipped: no Vulkan driver ({})", ran.text.trim());
    }
    missing
}

/// What the layer wrote of one device.
pub(crate) struct Capture {
    entries: Vec<Entry>,
    pub records: Vec<Record>,
    picture_bytes: u64,
}

macro_rules! each {
    ($($name:ident: $variant:ident, $t:ty;)*) => {$(
        #[allow(dead_code)]
        pub(crate) fn $name(&self) -> impl Iterator<Item = &$t> {
            self.entries.iter().filter_map(|e| match e {
                Entry::$variant(value) => Some(value),
                _ => None,
            })
        }
    )*};
}

impl Capture {
    each! {
        submissions: Submission, Submission;
        pictures: Picture, Picture;
        pipelines: Pipeline, Pipeline;
        images: Image, Image;
    }

    pub(crate) fn events(&self) -> impl Iterator<Item = &Event> {
        self.submissions().flat_map(|s| &s.events)
    }

    pub(crate) fn draws(&self) -> impl Iterator<Item = &Draw> {
        self.events().filter_map(|e| match e {
            Event::Draw(draw) => Some(draw),
            _ => None,
        })
    }

    pub(crate) fn notes(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().filter_map(|e| match e {
            Entry::Note(note) => Some(&*note.text),
            _ => None,
        })
    }

    pub(crate) fn ended(&self) -> bool {
        self.entries.iter().any(|e| matches!(e, Entry::End(_)))
    }

    /// All devices' of a folder.
    pub(crate) fn read_all(folder: &Path, case: &str) -> Vec<Self> {
        let mut logs: Vec<PathBuf> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|e| e == "log"))
            .collect();
        logs.sort();
        logs.iter().map(|log| Self::read(log, case)).collect()
    }

    fn read(log: &Path, case: &str) -> Self {
        let (entries, torn) = entries(&std::fs::read(log).unwrap()).expect(case);
        assert!(!torn, "{case}: the log is torn");
        assert!(matches!(entries[0], Entry::Device(_)), "{case}: {:?}", entries[0]);
        let files = Files::of(log);
        let bytes = std::fs::read(files.records).unwrap();
        let records = bytes.chunks(RECORD_BYTES).map(|b| Record::from_bytes(b).expect(case));
        let picture_bytes = files.pictures.metadata().unwrap().len();
        Self { entries, records: records.collect(), picture_bytes }
    }

    /// What is named is told before, and what is counted is there.
    pub(crate) fn check(&self, case: &str) {
        let (mut pipelines, mut images) = (BTreeSet::new(), BTreeSet::new());
        let mut at = 0;
        let mut pixels = 0;
        for entry in &self.entries {
            match entry {
                Entry::Pipeline(p) => assert!(pipelines.insert(p.number), "{case}: {p:?}"),
                Entry::Image(i) => assert!(images.insert(i.number), "{case}: {i:?}"),
                Entry::Picture(p) => {
                    assert!(images.contains(&p.image) && p.first == pixels, "{case}: {p:?}");
                    pixels += p.bytes;
                }
                Entry::Submission(s) => {
                    assert_eq!((s.first, s.needed), (at, s.records), "{case}");
                    at += s.records;
                    let of = &self.records[s.first as usize..at as usize];
                    self.check_submission(case, s, of, &pipelines, &images);
                }
                _ => {}
            }
        }
        assert_eq!(at, self.records.len() as u64, "{case}");
        assert_eq!(pixels, self.picture_bytes, "{case}");
    }

    fn check_submission(
        &self,
        case: &str,
        submission: &Submission,
        records: &[Record],
        pipelines: &BTreeSet<u64>,
        images: &BTreeSet<u64>,
    ) {
        let mut slots = BTreeSet::new();
        let mut target = None;
        for event in &submission.events {
            match event {
                Event::Pass(pass) => {
                    let all = [&pass.colour, &pass.resolve, &pass.depth];
                    let known = all.into_iter().flatten().all(|a| images.contains(&a.image));
                    assert!(known, "{case}: {pass:?}");
                    target = Some(pass);
                }
                Event::Draw(draw) => {
                    assert!(target.is_some(), "{case}: a draw outside a pass");
                    assert!(pipelines.contains(&draw.pipeline), "{case}: {draw:?}");
                    slots.insert(draw.slot);
                }
                Event::Write(write) => assert!(images.contains(&write.image), "{case}: {write:?}"),
                Event::Clear(_) => {}
            }
        }
        for record in records {
            assert!(slots.contains(&record.slot), "{case}: {record:?}");
            assert!(record.coverage & 0x7fff_ffff != 0, "{case}: {record:?}");
        }
    }
}

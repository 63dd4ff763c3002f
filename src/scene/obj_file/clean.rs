//! What stands before `tobj`: OBJ statements checked, with their line numbers,
//! and written so that it reads from them what the file means.
//!
//! `tobj` alone refuses comments behind numbers, drops the texture coordinates
//! and normals of objects where some corners have none, draws polylines as
//! polygons, and does not say which line is wrong.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::lines::{Lines, Statement, shown};
use super::mtl::Library;
use crate::error::{Error, Result, one_line};
use crate::scene::Scene;

/// A run of faces of one name and one material; each becomes an object that
/// `tobj` knows by its number.
#[derive(Clone)]
pub(super) struct Segment {
    pub name: String,
    /// Which of the scene's materials; `None` where the file says none.
    pub material: Option<usize>,
}

/// The clean text of an OBJ file, as `tobj` reads it.
pub(super) struct Cleaner<'a> {
    path: PathBuf,
    lines: Lines,
    library: Library,
    scene: &'a mut Scene,
    pub segments: Vec<Segment>,
    /// Why the reading ended before the file did.
    pub failed: Option<Error>,
    /// The first corner that names what had not been read by then.
    pub beyond: Option<Error>,
    /// How many `v`, `vt` and `vn` there have been.
    counts: [i64; 3],
    /// Whether vertices have colours: as the first of them.
    coloured: Option<bool>,
    /// Materials that no file defines: the first one's name and line; how many uses.
    undefined: Option<(String, usize, usize)>,
    not_drawn: usize,
    colours_dropped: bool,
    /// Corners that name an attribute of which there was none yet.
    too_early: [usize; 3],
    text: Vec<u8>,
    given: usize,
}

const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

impl<'a> Cleaner<'a> {
    /// One for the file at `path`; materials and warnings go to `scene`.
    ///
    /// # Errors
    /// As [`Lines::open`].
    pub fn open(path: &Path, scene: &'a mut Scene) -> Result<Self> {
        Ok(Cleaner {
            path: path.to_path_buf(),
            lines: Lines::open(path)?,
            library: Library::new(path.parent().unwrap_or(Path::new(""))),
            scene,
            segments: vec![Segment { name: "unnamed_object".to_string(), material: None }],
            failed: None,
            beyond: None,
            counts: [0; 3],
            coloured: None,
            undefined: None,
            not_drawn: 0,
            colours_dropped: false,
            too_early: [0; 3],
            // What corners without texture coordinates or normals name: `tobj`
            // wants all corners to have them, or none.
            text: b"o 0\nvt nan nan\nvn nan nan nan\n".to_vec(),
            given: 0,
        })
    }

    /// Puts the next statement's clean text into `text`; false at the end.
    fn step(&mut self) -> Result<bool> {
        let Some(statement) = self.lines.next()? else { return Ok(false) };
        let done = match statement.keyword() {
            "v" => self.vertex(&statement),
            "vt" => self.attribute(1, &statement),
            "vn" => self.attribute(2, &statement),
            "f" => self.face(&statement),
            "l" | "p" => {
                self.not_drawn += 1;
                Ok(())
            }
            "o" | "g" => {
                let name = statement.name();
                let name = if name.is_empty() { "unnamed_object" } else { name };
                self.begin(Segment { name: one_line(name), ..self.current() });
                Ok(())
            }
            "usemtl" => {
                self.use_material(&statement);
                Ok(())
            }
            "mtllib" => {
                self.library.read(statement.name(), self.scene);
                Ok(())
            }
            _ => Ok(()),
        };
        done.map_err(|what| Error::invalid(statement.place(&self.path), what, "correct the line"))?;
        Ok(true)
    }

    fn vertex(&mut self, statement: &Statement) -> Result<(), String> {
        let words: Vec<&str> = statement.words().take(7).collect();
        let numbers = words.iter().map(|w| Statement::number(w));
        let numbers = numbers.collect::<Result<Vec<f32>, _>>()?;
        let scale = match numbers.len() {
            3 | 6 => 1.0,
            4 if numbers[3] != 0.0 => numbers[3],
            4 => return Err("the vertex is divided by zero".to_string()),
            n => return Err(format!("a vertex has 3, 4 or 6 numbers, not {n}")),
        };
        let place = [0, 1, 2].map(|i| numbers[i] / scale);
        if place.iter().any(|v| !v.is_finite()) {
            return Err("the vertex is at no finite place".to_string());
        }
        self.counts[0] += 1;
        let [x, y, z] = place;
        self.write(format_args!("v {x} {y} {z}"));
        let coloured = *self.coloured.get_or_insert(numbers.len() == 6);
        match (coloured, numbers.len() == 6) {
            (true, true) => self.write(format_args!(" {}", words[3..].join(" "))),
            (true, false) => self.write(format_args!(" 1 1 1")),
            // The vertices before have none, and tobj counts colours by vertex.
            (false, true) => self.colours_dropped = true,
            (false, false) => {}
        }
        self.write(format_args!("\n"));
        Ok(())
    }

    /// A texture coordinate (`kind` 1) or a normal (`kind` 2).
    fn attribute(&mut self, kind: usize, statement: &Statement) -> Result<(), String> {
        // Exporters write normals of flat triangles that are no numbers: as good as none.
        let number = |word: &str| match word.parse::<f32>() {
            Ok(number) if !number.is_finite() => Ok(f32::NAN),
            _ => Statement::number(word),
        };
        let numbers = statement.words().take(kind + 1).map(number);
        let mut numbers = numbers.collect::<Result<Vec<f32>, _>>()?;
        if numbers.iter().any(|n| n.is_nan()) {
            numbers.fill(f32::NAN);
        }
        match (kind, &numbers[..]) {
            (1, [u]) if u.is_nan() => self.write(format_args!("vt nan nan\n")),
            // The second coordinate may be left out.
            (1, [u]) => self.write(format_args!("vt {u} 0\n")),
            (1, [u, v]) => self.write(format_args!("vt {u} {v}\n")),
            (_, [x, y, z]) => self.write(format_args!("vn {x} {y} {z}\n")),
            _ => return Err(format!("these are too few numbers for a {}", KINDS[kind])),
        }
        self.counts[kind] += 1;
        Ok(())
    }

    fn face(&mut self, statement: &Statement) -> Result<(), String> {
        let corners: Vec<&str> = statement.words().collect();
        if corners.is_empty() {
            return Err("the face has no corners".to_string());
        }
        if corners.len() < 3 {
            self.not_drawn += 1;
            return Ok(());
        }
        self.write(format_args!("f"));
        for corner in corners {
            let mut parts = corner.split('/');
            let mut index = [None; 3];
            for (kind, index) in index.iter_mut().enumerate() {
                *index = match parts.next() {
                    // Some exporters name attributes that the file does not have.
                    Some(part) if !part.is_empty() && (kind == 0 || self.counts[kind] > 0) => {
                        Some(self.index(part, kind, statement)?)
                    }
                    Some(part) if !part.is_empty() => {
                        self.too_early[kind] += 1;
                        None
                    }
                    _ => None,
                };
            }
            let (Some(v), None) = (index[0], parts.next()) else {
                return Err(format!("'{}' is no corner of a face", shown(corner)));
            };
            // The first of each is the one that stands for none.
            let [vt, vn] = [index[1], index[2]].map(|i| i.map_or(1, |i| i + 1));
            self.write(format_args!(" {v}/{vt}/{vn}"));
        }
        self.write(format_args!("\n"));
        Ok(())
    }

    /// The number, from 1, of what a part of a corner names.
    fn index(&mut self, part: &str, kind: usize, statement: &Statement) -> Result<i64, String> {
        let count = self.counts[kind];
        let what = KINDS[kind];
        let index: i64 =
            part.parse().map_err(|_| format!("'{}' is no number of a {what}", shown(part)))?;
        let absolute = if index < 0 { count.saturating_add(index) + 1 } else { index };
        // Numbers this large would overflow in tobj.
        if absolute < 1 || absolute > i64::from(u32::MAX) {
            return Err(format!("{what} {index} is not there, of {count} up to this line"));
        }
        if absolute > count && self.beyond.is_none() {
            // What follows may still bring it; else this is the error.
            let what = format!("{what} {index} is not there, of {count} up to this line");
            let place = statement.place(&self.path);
            self.beyond = Some(Error::invalid(place, what, "correct the line"));
        }
        Ok(absolute)
    }

    fn use_material(&mut self, statement: &Statement) {
        let material = self.library.find(statement.name());
        if material.is_none() {
            let line = statement.line;
            let first = || (shown(statement.name()), line, 0);
            self.undefined.get_or_insert_with(first).2 += 1;
        }
        if self.current().material != material {
            self.begin(Segment { material, ..self.current() });
        }
    }

    fn current(&self) -> Segment {
        self.segments[self.segments.len() - 1].clone()
    }

    fn begin(&mut self, segment: Segment) {
        let number = self.segments.len();
        self.segments.push(segment);
        self.write(format_args!("o {number}\n"));
    }

    fn write(&mut self, text: std::fmt::Arguments<'_>) {
        self.text.write_fmt(text).expect("memory takes all");
    }

    /// Tells the scene's user what was left out.
    pub fn warn(&mut self) {
        let source = &self.scene.source;
        let mut warnings = Vec::new();
        // Where an MTL file is missing, it has been said.
        if let Some((name, line, uses)) = self.undefined.take().filter(|_| self.library.whole) {
            let more = match uses {
                1 => String::new(),
                _ => format!(" ({} more uses of materials like it)", uses - 1),
            };
            warnings.push(format!(
                "{source}, line {line}: no MTL file defines the material '{name}'{more}; \
                 its faces are white and opaque"
            ));
        }
        if self.not_drawn > 0 {
            let n = self.not_drawn;
            warnings.push(format!("{source}: {n} statements of points and lines are not drawn"));
        }
        for kind in [1, 2] {
            // Where the file has none at all, nothing is lost.
            if self.too_early[kind] > 0 && self.counts[kind] > 0 {
                let (n, what) = (self.too_early[kind], KINDS[kind]);
                warnings.push(format!(
                    "{source}: {n} corners of faces come before the first {what}; theirs are ignored"
                ));
            }
        }
        if self.colours_dropped {
            let what = "only some vertices have colours, and the first has none; all are ignored";
            warnings.push(format!("{source}: {what}"));
        }
        self.scene.warnings.append(&mut warnings);
    }
}

impl Read for Cleaner<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while self.given == self.text.len() {
            self.text.clear();
            self.given = 0;
            match self.step() {
                Ok(true) => {}
                Ok(false) => return Ok(0),
                Err(e) => {
                    self.failed = Some(e);
                    return Err(io::Error::other("the OBJ file is wrong"));
                }
            }
        }
        let count = to.len().min(self.text.len() - self.given);
        to[..count].copy_from_slice(&self.text[self.given..self.given + count]);
        self.given += count;
        Ok(count)
    }
}

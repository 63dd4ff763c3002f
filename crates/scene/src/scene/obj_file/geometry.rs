//! The statements of OBJ files: what they define, before anything is made of it.

use std::path::Path;

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::lines::{Lines, Statement, shown};
use super::mtl::Library;
use super::unread::Unread;
use crate::scene::Scene;
use crate::scene::folder::Folder;
use screendoor_trace::error::{Error, Result, one_line};

/// What corners of faces name: vertices, texture coordinates and normals.
pub(super) const KINDS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Statements of curves and surfaces, of which no triangles are made.
const FREE_FORM: [&str; 18] = [
    "vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv",
    "sp", "end", "con", "res", "bsp", "bzp",
];

/// Vertex colours above this are numbers of bytes.
const MAX_COLOUR: f32 = 2.0;

/// A run of faces and lines of one name and one material, which becomes an object of each.
#[derive(Clone, Default)]
pub(super) struct Segment {
    pub name: String,
    /// Which of the scene's materials; `None` where the file says none.
    pub material: Option<usize>,
    /// Its first face, and its first line.
    pub first: [usize; 2],
}

/// A face: corners from where the one before ends.
pub(super) struct Face {
    /// The corner behind its last.
    pub end: usize,
    pub line: usize,
    /// Whether it belongs to a smoothing group.
    pub smooth: bool,
}

/// What an OBJ file defines.
pub(super) struct Geometry {
    pub positions: Vec<DVec3>,
    /// Empty, or one for each position, as the file has them.
    pub colours: Vec<Vec4>,
    /// NaN where the file has what is no number.
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    /// Numbers from 1 of a vertex, a texture coordinate and a normal; 0 for none.
    pub corners: Vec<[u32; 3]>,
    pub faces: Vec<Face>,
    /// Numbers from 1 of the vertices of lines.
    pub along: Vec<u32>,
    /// Lines: where each ends in these, and in which line of the file it stands.
    pub lines: Vec<(usize, usize)>,
    pub segments: Vec<Segment>,
}

/// Reads a file's statements.
pub(super) struct Reader<'f, 's> {
    path: &'f Path,
    pub geometry: Geometry,
    pub library: Library<'f>,
    scene: &'s mut Scene,
    /// The first face that names what is not there yet: its line and the text of it.
    beyond: Option<(usize, String)>,
    /// Materials that no file defines: the first one's name and line; how many uses.
    undefined: Option<(String, usize, usize)>,
    /// Materials that are found whatever the case of letters.
    respelt: Unread,
    /// Vertices with colours.
    coloured: usize,
    smooth: bool,
    /// Statements of points, and faces that are none.
    points: usize,
    free_form: Unread,
    other: Unread,
}

impl<'f, 's> Reader<'f, 's> {
    /// One for the file at `path`; materials and warnings go to `scene`.
    pub(super) fn new(path: &'f Path, folder: &'f Folder, scene: &'s mut Scene) -> Self {
        let unnamed = Segment { name: "unnamed_object".to_string(), ..Segment::default() };
        Reader {
            path,
            geometry: Geometry {
                positions: Vec::new(),
                colours: Vec::new(),
                uvs: Vec::new(),
                normals: Vec::new(),
                corners: Vec::new(),
                faces: Vec::new(),
                along: Vec::new(),
                lines: Vec::new(),
                segments: vec![unnamed],
            },
            library: Library::new(folder),
            scene,
            beyond: None,
            undefined: None,
            respelt: Unread::default(),
            coloured: 0,
            smooth: false,
            points: 0,
            free_form: Unread::default(),
            other: Unread::default(),
        }
    }

    /// Reads all of them.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Invalid`] for the first statement that is wrong.
    pub(super) fn read(&mut self, mut lines: Lines) -> Result<()> {
        while let Some(statement) = lines.next()? {
            self.take(&statement).map_err(|what| self.wrong(statement.place(self.path), what))?;
        }
        self.check_corners()
    }

    fn wrong(&self, place: String, what: String) -> Error {
        Error::invalid(place, what, "correct the line")
    }

    fn take(&mut self, statement: &Statement) -> Result<(), String> {
        match statement.keyword() {
            "v" => self.vertex(statement)?,
            "vt" => {
                // The second may be left out.
                let [u, v] = attribute(statement, KINDS[1], 1)?;
                self.geometry.uvs.push(Vec2::new(u, v));
            }
            "vn" => self.geometry.normals.push(attribute(statement, KINDS[2], 3)?.into()),
            // The second name is that of older files.
            "f" | "fo" => self.face(statement)?,
            "l" => self.line(statement)?,
            "p" => self.points += 1,
            "s" => {
                let group = statement.words().next().unwrap_or("off");
                self.smooth = !matches!(group, "off" | "0" | "null");
            }
            "o" | "g" => {
                let name = statement.name();
                let name = if name.is_empty() { "unnamed_object" } else { name };
                self.begin(Segment { name: one_line(name), ..self.current() });
            }
            "usemtl" => self.use_material(statement),
            "mtllib" => self.library.read(statement.name(), self.scene),
            // What these say of curves and surfaces comes with them.
            word if FREE_FORM.contains(&word) => self.free_form.add(word, statement.line),
            word => self.other.add(word, statement.line),
        }
        Ok(())
    }

    fn vertex(&mut self, statement: &Statement) -> Result<(), String> {
        let numbers = statement.words().take(8).map(Statement::number);
        let numbers = numbers.collect::<Result<Vec<f64>, _>>()?;
        let scale = match numbers.len() {
            3 | 6 | 7 => 1.0,
            4 if numbers[3] != 0.0 => numbers[3],
            4 => return Err("the vertex is divided by zero".to_string()),
            n => return Err(format!("a vertex has 3, 4, 6 or 7 numbers, not {n}")),
        };
        let place = DVec3::new(numbers[0], numbers[1], numbers[2]) / scale;
        if !place.is_finite() {
            return Err("the vertex is at no finite place".to_string());
        }
        let geometry = &mut self.geometry;
        if let [r, g, b, rest @ ..] = &numbers[3..] {
            let alpha = rest.first().copied().unwrap_or(1.0);
            // Those before have none.
            geometry.colours.resize(geometry.positions.len(), Vec4::ONE);
            geometry.colours.push(Vec4::from([*r, *g, *b, alpha].map(|c| c as f32)));
            self.coloured += 1;
        }
        geometry.positions.push(place);
        Ok(())
    }

    fn face(&mut self, statement: &Statement) -> Result<(), String> {
        let start = self.geometry.corners.len();
        for corner in statement.words() {
            let mut parts = corner.split('/');
            let mut index = [0; 3];
            for (kind, index) in index.iter_mut().enumerate() {
                if let Some(part) = parts.next().filter(|part| !part.is_empty()) {
                    *index = self.index(part, kind, statement)?;
                }
            }
            if index[0] == 0 || parts.next().is_some() {
                return Err(format!("'{}' is no corner of a face", shown(corner)));
            }
            self.geometry.corners.push(index);
        }
        let end = self.geometry.corners.len();
        match end - start {
            0 => Err("the face has no corners".to_string()),
            1 | 2 => {
                self.geometry.corners.truncate(start);
                self.points += 1;
                Ok(())
            }
            _ => {
                let (line, smooth) = (statement.line, self.smooth);
                self.geometry.faces.push(Face { end, line, smooth });
                Ok(())
            }
        }
    }

    fn line(&mut self, statement: &Statement) -> Result<(), String> {
        let start = self.geometry.along.len();
        for point in statement.words() {
            // Texture coordinates along a line are of no use: it is drawn without a texture.
            let vertex = point.split('/').next().unwrap_or_default();
            let number = self.index(vertex, 0, statement)?;
            self.geometry.along.push(number);
        }
        let end = self.geometry.along.len();
        match end - start {
            0 => return Err("the line has no points".to_string()),
            1 => {
                self.geometry.along.truncate(start);
                self.points += 1;
            }
            _ => self.geometry.lines.push((end, statement.line)),
        }
        Ok(())
    }

    /// How many vertices, texture coordinates or normals there are.
    fn count(&self, kind: usize) -> usize {
        let geometry = &self.geometry;
        [geometry.positions.len(), geometry.uvs.len(), geometry.normals.len()][kind]
    }

    /// The number, from 1, of what a part of a corner names; 0 for no texture coordinate or
    /// normal.
    fn index(&mut self, part: &str, kind: usize, statement: &Statement) -> Result<u32, String> {
        let (what, count) = (KINDS[kind], self.count(kind));
        let index: i64 =
            part.parse().map_err(|_| format!("'{}' is no number of a {what}", shown(part)))?;
        let absolute = if index < 0 { (count as i64).saturating_add(index) + 1 } else { index };
        // Some exporters write 0 for none, or name attributes that the file does not have.
        if kind > 0 && (index == 0 || (index < 0 && count == 0)) {
            return Ok(0);
        }
        let number = u32::try_from(absolute).ok().filter(|number| *number > 0);
        let Some(number) = number else {
            return Err(format!("{what} {index} is not there, of {count} up to this line"));
        };
        if number as usize > count && self.beyond.is_none() {
            // What follows may still bring it.
            self.beyond = Some((statement.line, statement.place(self.path)));
        }
        Ok(number)
    }

    /// Finds the first corner that names what the file does not have. Attributes that it has
    /// none of at all do not count.
    fn check_corners(&mut self) -> Result<()> {
        let counts = [0, 1, 2].map(|kind| self.count(kind));
        let mut start = 0;
        for face in &self.geometry.faces {
            let corners = &mut self.geometry.corners[start..face.end];
            start = face.end;
            for (kind, number) in corners.iter_mut().flat_map(|c| c.iter_mut().enumerate()) {
                if *number as usize <= counts[kind] {
                    continue;
                }
                if kind > 0 && counts[kind] == 0 {
                    *number = 0;
                    continue;
                }
                let (line, number) = (face.line, *number);
                return Err(self.absent(line, kind, number));
            }
        }
        let mut start = 0;
        for (end, line) in self.geometry.lines.iter().copied() {
            let along = &self.geometry.along[start..end];
            start = end;
            if let Some(number) = along.iter().copied().find(|n| *n as usize > counts[0]) {
                return Err(self.absent(line, 0, number));
            }
        }
        Ok(())
    }

    /// The error about a line of the file that names what is not there.
    fn absent(&mut self, line: usize, kind: usize, number: u32) -> Error {
        let what = format!("{} {number} is not there, of {}", KINDS[kind], self.count(kind));
        let place = match self.beyond.take() {
            Some((first, place)) if first == line => place,
            _ => format!("{}, line {line}", self.path.display()),
        };
        self.wrong(place, what)
    }

    fn use_material(&mut self, statement: &Statement) {
        let (name, line) = (statement.name(), statement.line);
        let found = self.library.find(name);
        match found {
            Some((_, true)) => {}
            Some((_, false)) => self.respelt.add(name, line),
            None => self.undefined.get_or_insert_with(|| (shown(name), line, 0)).2 += 1,
        }
        let material = found.map(|(number, _)| number);
        if self.current().material != material {
            self.begin(Segment { material, ..self.current() });
        }
    }

    fn current(&self) -> Segment {
        self.geometry.segments.last().cloned().unwrap_or_default()
    }

    fn begin(&mut self, segment: Segment) {
        let first = [self.geometry.faces.len(), self.geometry.lines.len()];
        let segments = &mut self.geometry.segments;
        // Names without faces and lines are no objects.
        if segments.last().is_some_and(|last| last.first == first) {
            segments.pop();
        }
        segments.push(Segment { first, ..segment });
    }

    /// What was read, once the scene's user has been told what was not.
    pub(super) fn finish(mut self) -> (Geometry, Library<'f>) {
        let source = self.scene.source.clone();
        let mut warn = |what: String| self.scene.warnings.push(format!("{source}{what}"));
        // Where an MTL file is missing, it has been said.
        if let Some((name, line, uses)) = self.undefined.take().filter(|_| self.library.whole) {
            let more = match uses {
                1 => String::new(),
                _ => format!(" ({} more uses of materials like it)", uses - 1),
            };
            warn(format!(
                ", line {line}: no MTL file defines the material '{name}'{more}; \
                 its faces are white and opaque"
            ));
        }
        if let Some(named) = self.respelt.named() {
            warn(format!(": materials whose names are spelt otherwise in the MTL file: {named}"));
        }
        if self.points > 0 {
            let n = self.points;
            warn(format!(
                ": {n} points, lines of one and faces of fewer than three corners are not drawn"
            ));
        }
        if let Some(named) = self.free_form.named() {
            warn(format!(
                ": curves and surfaces are not drawn ({named}); convert them to polygons"
            ));
        }
        if let Some(named) = self.other.named() {
            warn(format!(": statements that are not read: {named}"));
        }
        let vertices = self.geometry.positions.len();
        if self.coloured > 0 {
            let colours = &mut self.geometry.colours;
            colours.resize(vertices, Vec4::ONE);
            let without = vertices - self.coloured;
            if without > 0 {
                warn(format!(": {without} of {vertices} vertices have no colour; they are white"));
            }
            let greatest = colours.iter().map(|c| c.max_element()).fold(0.0, f32::max);
            if greatest > MAX_COLOUR {
                colours.iter_mut().for_each(|c| *c /= 255.0);
                warn(format!(": vertex colours go up to {greatest}; they are taken as 0 to 255"));
            } else if greatest > 1.0 {
                warn(format!(": vertex colours go up to {greatest}; they are cut off at 1"));
            }
        }
        (self.geometry, self.library)
    }
}

/// The numbers of an attribute (`what`), of which the first `least` must be there. All are
/// NaN where one is no finite number.
fn attribute<const N: usize>(
    statement: &Statement,
    what: &str,
    least: usize,
) -> Result<[f32; N], String> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for (number, word) in numbers.iter_mut().zip(statement.words()) {
        *number = if is_no_number(word) { f32::NAN } else { Statement::number(word)? as f32 };
        count += 1;
    }
    if count < least {
        return Err(format!("these are too few numbers for a {what}"));
    }
    let finite = numbers.iter().all(|n| n.is_finite());
    Ok(if finite { numbers } else { [f32::NAN; N] })
}

/// Whether a word is what programs print for a number that is none: `nan`, `-nan(ind)`,
/// `1.#QNAN`, `-inf`, `Infinity`. Exporters write such normals of flat triangles.
fn is_no_number(word: &str) -> bool {
    let word = word.trim_start_matches(['+', '-']).to_ascii_lowercase();
    word.starts_with("nan") || word.starts_with("inf") || word.starts_with("1.#")
}

//! The meshes of glTF files, in their default shape: morph targets at their default
//! weights, skins in their default pose.

use glam::{Vec2, Vec3, Vec4};

use super::Loader;
use super::accessor::{Kind, Normalised, Numbers, Type};
use super::extensions::treatment;
use super::json::{Attributes, Node, Primitive};
use super::material::{Made, SETS};
use super::pose::{Bound, Joints, Set, normal_matrix};
use super::splats;
use super::warnings::Matter;
use crate::scene::{Mesh, Shape, Strands};
use screendoor_trace::error::Result;

/// A mesh as a node shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Posed {
    mesh: usize,
    skin: Option<usize>,
    /// The node, where it has weights of morph targets of its own.
    weights_of: Option<usize>,
}

/// What is drawn of a primitive.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    /// Which of the scene's shapes, where it is drawn at all.
    pub shape: Option<usize>,
    /// How many triangles or splats it has; points or lines, where it is made of those.
    pub items: usize,
    /// What of it is not drawn as it should be.
    pub matters: Vec<Matter>,
    /// Whether the shape has the scene's coordinates, not the node's.
    pub in_scene: bool,
}

/// What a primitive's vertices say.
#[derive(Default)]
struct Vertices {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: [Vec<Vec2>; SETS],
    colours: Vec<Vec4>,
}

/// What makes up a primitive, by its mode.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    Points,
    Lines,
    Strip,
    Fan,
    Triangles,
}

const FLOAT: &[Type] = &[Type::F32];
/// What KHR_mesh_quantization allows.
const QUANTIZED: &[Type] = &[Type::F32, Type::I8, Type::U8, Type::I16, Type::U16];
const SIGNED: &[Type] = &[Type::F32, Type::I8, Type::I16];
const UNSIGNED: &[Type] = &[Type::F32, Type::U8, Type::U16];

/// The kind of an attribute; `quantized` says whether the file declares
/// KHR_mesh_quantization. `None` for those that are not read.
fn kind(name: &str, quantized: bool) -> Option<Kind> {
    use Normalised::{Always, AsSaid, Never};
    let of = |shapes, types, normalised| Some(Kind { shapes, types, normalised });
    let base = name.split('_').next().unwrap_or("");
    match (base, quantized) {
        ("POSITION", false) => of(&[("VEC3", 3)], FLOAT, Never),
        ("POSITION", true) => of(&[("VEC3", 3)], QUANTIZED, AsSaid),
        ("NORMAL", false) => of(&[("VEC3", 3)], FLOAT, Never),
        ("NORMAL", true) => of(&[("VEC3", 3)], SIGNED, Always),
        ("TEXCOORD", false) => of(&[("VEC2", 2)], UNSIGNED, Always),
        ("TEXCOORD", true) => of(&[("VEC2", 2)], QUANTIZED, AsSaid),
        ("COLOR", _) => of(&[("VEC3", 3), ("VEC4", 4)], QUANTIZED, Always),
        ("JOINTS", _) => of(&[("VEC4", 4)], &[Type::U8, Type::U16], Never),
        ("WEIGHTS", _) => of(&[("VEC4", 4)], UNSIGNED, Always),
        _ => None,
    }
}

impl Loader<'_> {
    /// What is drawn of a mesh as the node of number `index` shows it.
    pub(super) fn mesh(&mut self, mesh: usize, index: usize, node: &Node) -> Result<Vec<Drawn>> {
        let weights_of = node.weights.is_some().then_some(index);
        let posed = Posed { mesh, skin: node.skin, weights_of };
        if let Some(drawn) = self.meshes.get(&posed) {
            return Ok(drawn.clone());
        }
        let Some(said) = self.root.meshes.get(mesh) else {
            let what = format!("it names mesh {mesh}, which is not there");
            return Err(self.bad(&format!("node {index}"), what, "export the file again"));
        };
        let joints = node.skin.map(|skin| self.joints(skin)).transpose()?;
        let weights = node.weights.as_ref().or(said.weights.as_ref());
        let weights = weights.map_or(&[][..], |w| w);
        let mut drawn = Vec::new();
        for (i, primitive) in said.primitives.iter().enumerate() {
            let part = format!("mesh {mesh}, primitive {i}");
            let mut one = self.primitive(primitive, weights, joints.as_ref(), &part)?;
            one.matters.extend(self.warnings.extensions(said.extensions.names()));
            drawn.push(one);
        }
        self.meshes.insert(posed, drawn.clone());
        Ok(drawn)
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        weights: &[f32],
        joints: Option<&Joints>,
        part: &str,
    ) -> Result<Drawn> {
        let mode = match primitive.mode.unwrap_or(4) {
            0 => Mode::Points,
            1..=3 => Mode::Lines,
            4 => Mode::Triangles,
            5 => Mode::Strip,
            6 => Mode::Fan,
            other => {
                let what = format!("its mode {other} is not one that glTF allows");
                return Err(self.bad(part, what, "export the file again"));
            }
        };
        let splats = mode == Mode::Points && primitive.extensions.has(splats::NAME);
        let unit = match mode {
            Mode::Points if splats => "splat",
            Mode::Points => "point",
            Mode::Lines => "line",
            _ => "triangle",
        };
        let mut matters = self.warnings.extensions_of(unit, primitive.extensions.names());
        if splats {
            let (shape, items) = match self.splats(primitive, part)? {
                Ok(splats) => {
                    let count = splats.means.len();
                    self.scene.shapes.push(Shape::Splats(splats));
                    (Some(self.scene.shapes.len() - 1), count)
                }
                Err(missed) => {
                    matters.push(missed);
                    (None, self.claimed_items(primitive, mode))
                }
            };
            return Ok(Drawn { shape, items, matters, in_scene: false });
        }
        if primitive.extensions.has(splats::NAME) {
            let what = format_args!(
                "{} is for points: splats of another mode are not drawn",
                splats::NAME
            );
            matters.push(self.warnings.matter_of(unit, what));
            let items = self.claimed_items(primitive, mode);
            return Ok(Drawn { shape: None, items, matters, in_scene: false });
        }
        if let Some(missed) = self.not_drawn(primitive, mode, unit) {
            matters.push(missed);
            let items = self.claimed_items(primitive, mode);
            return Ok(Drawn { shape: None, items, matters, in_scene: false });
        }
        let made = self.material(primitive.material, part)?;
        matters.extend(&made.matters);
        let mut vertices = self.vertices(primitive, &made, part)?;
        matters.extend(self.missing_sets(&made, &vertices));
        self.morph(&mut vertices, primitive, &made, weights, part)?;
        let indices: Vec<u32> = match primitive.indices {
            Some(indices) => self.indices(indices, &format!("{part}, indices"))?,
            None => (0..vertices.positions.len() as u32).collect(),
        };
        let mut triangles: Vec<[u32; 3]> = match mode {
            Mode::Strip => {
                let flip = |(i, t): (usize, &[u32])| {
                    if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
                };
                indices.windows(3).enumerate().map(flip).collect()
            }
            Mode::Fan => indices.windows(2).skip(1).map(|t| [indices[0], t[0], t[1]]).collect(),
            Mode::Lines => Vec::new(),
            _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        };
        let in_scene = match joints {
            None => false,
            Some(joints) => self.bind(&mut vertices, &mut triangles, primitive, joints, part)?,
        };
        if joints.is_some() && !in_scene {
            matters.push(
                self.warnings.matter("primitives that no joint holds stand without their skin"),
            );
        }
        let material = made.material;
        let (shape, items) = if mode == Mode::Lines {
            let strands = self.curves(primitive.mode, &vertices, &indices, part)?;
            let items = strands.segment_count();
            (Shape::Strands(Strands { material, ..strands }), items)
        } else {
            let Vertices { positions, normals, uvs: [uvs, more_uvs], colours } = vertices;
            let items = triangles.len();
            let mesh = Mesh { positions, normals, uvs, more_uvs, colours, triangles, material };
            (Shape::Mesh(mesh), items)
        };
        self.scene.shapes.push(shape);
        Ok(Drawn { shape: Some(self.scene.shapes.len() - 1), items, matters, in_scene })
    }

    /// The curves of a primitive of lines, a loop or a strip. Lines that begin where the one
    /// before ends are one curve.
    fn curves(
        &mut self,
        mode: Option<u32>,
        vertices: &Vertices,
        indices: &[u32],
        part: &str,
    ) -> Result<Strands> {
        let count = vertices.positions.len();
        if let Some(index) = indices.iter().find(|i| **i as usize >= count) {
            let what = format!("it names vertex {index}, of {count}");
            return Err(self.bad(part, what, "export the file again"));
        }
        if ![0, count].contains(&vertices.colours.len()) {
            let what = format!("{} of its {count} vertices have colours", vertices.colours.len());
            return Err(self.bad(part, what, "export the file again"));
        }
        let curves: Vec<Vec<u32>> = match mode {
            Some(1) => {
                let mut curves: Vec<Vec<u32>> = Vec::new();
                for pair in indices.chunks_exact(2) {
                    match curves.last_mut() {
                        Some(last) if last.last() == pair.first() => last.push(pair[1]),
                        _ => curves.push(pair.to_vec()),
                    }
                }
                curves
            }
            Some(2) => vec![indices.iter().chain(indices.first()).copied().collect()],
            _ => vec![indices.to_vec()],
        };
        let mut strands = Strands::default();
        for curve in curves {
            let points: Vec<Vec3> = curve.iter().map(|i| vertices.positions[*i as usize]).collect();
            let colours = curve.iter().filter_map(|i| vertices.colours.get(*i as usize).copied());
            strands.add_line(&points, &colours.collect::<Vec<_>>());
        }
        Ok(strands)
    }

    /// Why nothing is drawn of a primitive, where that is so.
    fn not_drawn(
        &mut self,
        primitive: &Primitive,
        mode: Mode,
        unit: &'static str,
    ) -> Option<Matter> {
        if mode == Mode::Points {
            return Some(self.warnings.matter_of(unit, "points are not drawn"));
        }
        let position = primitive.attributes.get("POSITION");
        let packed = "KHR_draco_mesh_compression";
        let accessor = position.and_then(|p| self.root.accessors.get(*p));
        let empty = |a: &super::json::Accessor| a.buffer_view.is_none() && a.sparse.is_none();
        if primitive.extensions.has(packed) && accessor.is_none_or(empty) {
            let hint = treatment(packed).hint();
            let what = format_args!("{packed} is not read: what it packs is not drawn; {hint}");
            return Some(self.warnings.matter(what));
        }
        let what = "primitives without positions are not drawn";
        position.is_none().then(|| self.warnings.matter(what))
    }

    /// How many triangles, points or lines a primitive that is not read claims to have.
    fn claimed_items(&self, primitive: &Primitive, mode: Mode) -> usize {
        let vertices = primitive.indices.or(primitive.attributes.values().next().copied());
        let vertices = vertices.and_then(|a| self.root.accessors.get(a)).map_or(0, |a| a.count);
        match (mode, primitive.mode) {
            (Mode::Points, _) | (Mode::Lines, Some(2)) => vertices,
            (Mode::Lines, Some(1)) => vertices / 2,
            (Mode::Lines, _) => vertices.saturating_sub(1),
            (Mode::Triangles, _) => vertices / 3,
            (Mode::Strip | Mode::Fan, _) => vertices.saturating_sub(2),
        }
    }

    /// The numbers of the attribute of that name, where the primitive has it.
    fn attribute(&mut self, of: &Attributes, name: &str, part: &str) -> Result<Option<Numbers>> {
        let quantized = self.quantized();
        let Some((accessor, kind)) = of.get(name).copied().zip(kind(name, quantized)) else {
            return Ok(None);
        };
        self.numbers(accessor, kind, &format!("{part}, {name}")).map(Some)
    }

    /// Whether the file declares that its numbers may be quantized.
    fn quantized(&self) -> bool {
        let mut declared = self.root.extensions_used.iter().chain(&self.root.extensions_required);
        declared.any(|name| name == "KHR_mesh_quantization")
    }

    fn vertices(&mut self, primitive: &Primitive, made: &Made, part: &str) -> Result<Vertices> {
        let of = &primitive.attributes;
        let vec3 = |n: Numbers| n.arrays(0.0).map(Vec3::from_array).collect();
        let mut uvs: [Vec<Vec2>; SETS] = Default::default();
        for (uvs, set) in uvs.iter_mut().zip(&made.sets) {
            let read = self.attribute(of, &format!("TEXCOORD_{set}"), part)?;
            *uvs = read
                .into_iter()
                .flat_map(|n| n.arrays(0.0).map(Vec2::from_array).collect::<Vec<_>>())
                .collect();
        }
        let colours = self.attribute(of, "COLOR_0", part)?;
        Ok(Vertices {
            positions: self.attribute(of, "POSITION", part)?.map(vec3).unwrap_or_default(),
            normals: self.attribute(of, "NORMAL", part)?.map(vec3).unwrap_or_default(),
            uvs,
            colours: colours
                .map(|n| n.arrays(1.0).map(Vec4::from_array).collect())
                .unwrap_or_default(),
        })
    }

    /// What is told of textures whose coordinates a primitive does not have.
    fn missing_sets(&mut self, made: &Made, vertices: &Vertices) -> Option<Matter> {
        let missing = made.sets.iter().zip(&vertices.uvs).find(|(_, uvs)| uvs.is_empty());
        let (set, _) = missing.filter(|_| made.textured)?;
        let what =
            format_args!("the texture coordinates TEXCOORD_{set} of materials are not there");
        Some(self.warnings.matter(what))
    }

    /// Moves vertices by the morph targets, each as far as its weight says.
    fn morph(
        &mut self,
        vertices: &mut Vertices,
        primitive: &Primitive,
        made: &Made,
        weights: &[f32],
        part: &str,
    ) -> Result<()> {
        let used = primitive.targets.iter().zip(weights).enumerate();
        for (i, (target, weight)) in used.filter(|(_, (_, weight))| **weight != 0.0) {
            let part = format!("{part}, target {i}");
            let mut names = vec!["POSITION".to_string(), "NORMAL".into(), "COLOR_0".into()];
            names.extend(made.sets.iter().map(|set| format!("TEXCOORD_{set}")));
            for (k, name) in names.iter().enumerate() {
                let Some(moves) = self.attribute(target, name, &part)? else { continue };
                let count = match k {
                    0 => add(&mut vertices.positions, &moves, *weight, Vec3::from_array),
                    1 => add(&mut vertices.normals, &moves, *weight, Vec3::from_array),
                    2 => add(&mut vertices.colours, &moves, *weight, Vec4::from_array),
                    k => add(&mut vertices.uvs[k - 3], &moves, *weight, Vec2::from_array),
                };
                if let Err((has, wanted)) = count {
                    let what = format!("it moves {has} {name} of {wanted}");
                    return Err(self.bad(&part, what, "export the file again"));
                }
            }
        }
        for colour in &mut vertices.colours {
            if !primitive.targets.is_empty() {
                *colour = colour.clamp(Vec4::ZERO, Vec4::ONE);
            }
        }
        Ok(())
    }

    /// Moves vertices by the joints that hold them, into the scene's coordinates. Returns
    /// whether any hold them.
    fn bind(
        &mut self,
        vertices: &mut Vertices,
        triangles: &mut [[u32; 3]],
        primitive: &Primitive,
        joints: &Joints,
        part: &str,
    ) -> Result<bool> {
        let count = vertices.positions.len();
        let mut bound = Bound { joints, sets: Vec::new() };
        for set in 0.. {
            let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            let of = &primitive.attributes;
            let [Some(joints), Some(weights)] =
                [self.attribute(of, &names[0], part)?, self.attribute(of, &names[1], part)?]
            else {
                break;
            };
            if joints.len() != count || weights.len() != count {
                let what = format!("not all of its {count} vertices have joints and weights");
                return Err(self.bad(part, what, "export the file again"));
            }
            let (joints, weights) = (joints.arrays(0.0).collect(), weights.arrays(0.0).collect());
            bound.sets.push(Set { joints, weights });
        }
        if bound.sets.is_empty() {
            return Ok(false);
        }
        let mut mirrored = vec![0_i8; count];
        for (i, position) in vertices.positions.iter_mut().enumerate() {
            let Some(moved) = bound.at(i) else {
                let what = format!("its vertex {i} is bound to a joint that is not there");
                return Err(self.bad(part, what, "export the file again"));
            };
            *position = moved.transform_point3(position.as_dvec3()).as_vec3();
            if let Some(normal) = vertices.normals.get_mut(i) {
                let turned = normal_matrix(moved.matrix3) * normal.as_dvec3();
                *normal = turned.normalize_or_zero().as_vec3();
            }
            mirrored[i] = if moved.matrix3.determinant() < 0.0 { -1 } else { 1 };
        }
        // As for mirrored objects: what was outside stays outside.
        for triangle in triangles {
            let sides = triangle.iter().filter_map(|i| mirrored.get(*i as usize));
            if sides.copied().sum::<i8>() < 0 {
                triangle.swap(1, 2);
            }
        }
        Ok(true)
    }
}

/// Adds a share of `moves` to what there is; how many there are of both, where they differ.
/// Attributes that a primitive does not have stay away.
fn add<const N: usize, V: std::ops::AddAssign + std::ops::Mul<f32, Output = V>>(
    to: &mut [V],
    moves: &Numbers,
    weight: f32,
    vector: impl Fn([f32; N]) -> V,
) -> Result<(), (usize, usize)> {
    if to.is_empty() {
        return Ok(());
    }
    if to.len() != moves.len() {
        return Err((moves.len(), to.len()));
    }
    for (to, by) in to.iter_mut().zip(moves.arrays(0.0)) {
        *to += vector(by) * weight;
    }
    Ok(())
}

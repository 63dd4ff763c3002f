//! The meshes of glTF files.

use glam::{Vec2, Vec3, Vec4};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;

use super::Loader;
use super::material::texture_sets;
use crate::error::{Error, Result};
use crate::scene::{Mesh, Shape};

/// The most vertex attributes and indices of a file, since many primitives may
/// read the same bytes.
const MAX_ELEMENTS: usize = 1 << 28;
/// The most elements of accessors that have no bytes behind them (sparse ones).
const MAX_ZEROS: usize = 1 << 24;

impl Loader<'_> {
    pub(super) fn mesh(&mut self, mesh: &gltf::Mesh<'_>) -> Result<Vec<usize>> {
        let mut shapes = Vec::new();
        for primitive in mesh.primitives() {
            let part = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
            if let Some(shape) = self.primitive(&primitive, &part)? {
                self.scene.shapes.push(Shape::Mesh(shape));
                shapes.push(self.scene.shapes.len() - 1);
            }
        }
        Ok(shapes)
    }

    fn primitive(&mut self, primitive: &gltf::Primitive<'_>, part: &str) -> Result<Option<Mesh>> {
        use DataType::{F32, U8, U16, U32};
        let material = primitive.material();
        let texture_set = texture_sets(&material).into_iter().flatten().next().unwrap_or(0);
        for (semantic, accessor) in primitive.attributes() {
            let (dimensions, types): (&[Dimensions], &[DataType]) = match semantic {
                gltf::Semantic::Positions | gltf::Semantic::Normals => {
                    (&[Dimensions::Vec3], &[F32])
                }
                gltf::Semantic::TexCoords(_) => (&[Dimensions::Vec2], &[F32, U8, U16]),
                gltf::Semantic::Colors(_) => {
                    (&[Dimensions::Vec3, Dimensions::Vec4], &[F32, U8, U16])
                }
                _ => continue,
            };
            self.check(&accessor, dimensions, types, part)?;
            self.count(&accessor, part)?;
        }
        if let Some(indices) = primitive.indices() {
            self.check(&indices, &[Dimensions::Scalar], &[U8, U16, U32], part)?;
            self.count(&indices, part)?;
        }

        let buffers = &self.buffers;
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|b| &**b));
        let Some(positions) = reader.read_positions() else {
            return Err(self.bad(part, "it has no readable positions", "export the file again"));
        };
        let positions: Vec<Vec3> = positions.map(Vec3::from).collect();
        let normals = reader.read_normals().into_iter().flatten().map(Vec3::from).collect();
        let uvs = reader
            .read_tex_coords(texture_set)
            .into_iter()
            .flat_map(|t| t.into_f32())
            .map(Vec2::from)
            .collect();
        let colours = reader
            .read_colors(0)
            .into_iter()
            .flat_map(|c| c.into_rgba_f32())
            .map(Vec4::from)
            .collect();
        let indices: Vec<u32> = match (reader.read_indices(), primitive.indices()) {
            (Some(indices), _) => indices.into_u32().collect(),
            (None, None) => (0..positions.len() as u32).collect(),
            (None, Some(_)) => {
                return Err(self.bad(part, "its indices cannot be read", "export the file again"));
            }
        };
        let triangles = match primitive.mode() {
            Mode::Triangles => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            Mode::TriangleStrip => {
                let flip = |(i, t): (usize, &[u32])| {
                    if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }
                };
                indices.windows(3).enumerate().map(flip).collect()
            }
            Mode::TriangleFan => {
                indices.windows(2).skip(1).map(|t| [indices[0], t[0], t[1]]).collect()
            }
            mode => {
                let warning = format!("{}, {part}: {mode:?} are not drawn", self.place);
                self.scene.warnings.push(warning);
                return Ok(None);
            }
        };
        let material = self.material(&material)?;
        Ok(Some(Mesh { positions, normals, uvs, colours, triangles, material }))
    }

    /// Counts what an accessor holds, and refuses what would fill the memory.
    fn count(&mut self, accessor: &gltf::Accessor<'_>, part: &str) -> Result<()> {
        self.elements = self.elements.saturating_add(accessor.count());
        if accessor.view().is_none() {
            self.zeros = self.zeros.saturating_add(accessor.count());
        }
        let what = if self.elements > MAX_ELEMENTS {
            "there are more than 2^28 vertex attributes and indices up to here"
        } else if self.zeros > MAX_ZEROS {
            "there are more than 2^24 elements without bytes up to here"
        } else {
            return Ok(());
        };
        Err(Error::unsupported(format_args!("{}, {part}", self.place), what, "split the scene"))
    }

    /// Refuses an accessor that the reader would misread or run out of.
    fn check(
        &self,
        accessor: &gltf::Accessor<'_>,
        dimensions: &[Dimensions],
        types: &[DataType],
        part: &str,
    ) -> Result<()> {
        let part = format!("{part}, accessor {}", accessor.index());
        let bad = |what: &str| Err(self.bad(&part, what, "export the file again"));
        if !dimensions.contains(&accessor.dimensions()) || !types.contains(&accessor.data_type()) {
            return bad("its type is not one that glTF allows here");
        }
        let fits =
            |view: Option<gltf::buffer::View<'_>>, offset: usize, size: usize, count: usize| {
                let Some(view) = view else { return count <= MAX_ZEROS };
                let stride = view.stride().unwrap_or(size);
                let end = count
                    .checked_sub(1)
                    .and_then(|n| n.checked_mul(stride))
                    .and_then(|n| n.checked_add(size)?.checked_add(offset));
                let view_end = view.offset().checked_add(view.length());
                let bytes = self.buffers.get(view.buffer().index()).map_or(0, |b| b.len());
                stride >= size
                    && end.is_some_and(|end| end <= view.length())
                    && view_end.is_some_and(|end| end <= bytes)
            };
        let count = accessor.count();
        if !fits(accessor.view(), accessor.offset(), accessor.size(), count) || count == 0 {
            return bad("it reaches beyond its buffer");
        }
        match accessor.sparse() {
            None if accessor.view().is_none() => bad("it has no data"),
            None => Ok(()),
            Some(sparse) => {
                let (indices, values, n) = (sparse.indices(), sparse.values(), sparse.count());
                let index_bytes = indices.index_type().size();
                let good = n <= count
                    && fits(Some(indices.view()), indices.offset(), index_bytes, n)
                    && fits(Some(values.view()), values.offset(), accessor.size(), n);
                if good { Ok(()) } else { bad("its sparse values reach beyond their buffer") }
            }
        }
    }
}

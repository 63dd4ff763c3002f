//! OpenVDB, from files written here.

use glam::{DAffine3, DMat3, DVec3, Vec3};
use screendoor::error::Error;
use screendoor::scene::{AlphaMode, LoadOptions, Scene, load_with};

use super::{folder, load_in, particles, warned};

/// How a file is written.
#[derive(Clone)]
pub struct Written {
    pub version: u32,
    /// OpenVDB's flags: 1 zlib, 2 active values only, 4 Blosc.
    pub packing: u32,
    pub half: bool,
    pub name: &'static str,
    pub kind: &'static str,
    pub class: &'static str,
    pub map: (&'static str, Vec<f64>),
    /// Voxels of the one leaf, which begins at (8, 0, −8), and their densities.
    pub voxels: Vec<([u8; 3], f32)>,
    /// The density of a tile of 8³ voxels at (16, 0, 0).
    pub tile: Option<f32>,
    /// What each packed block claims for its length.
    pub bomb: Option<i64>,
    /// The value of all that is not stored.
    pub background: f32,
}

impl Default for Written {
    fn default() -> Self {
        Written {
            version: 224,
            packing: 2,
            half: false,
            name: "density",
            kind: "Tree_float_5_4_3",
            class: "fog volume",
            map: ("UniformScaleMap", vec![1.0; 15]),
            voxels: vec![([0, 0, 0], 1.0), ([1, 2, 3], 0.5), ([7, 7, 7], 0.001)],
            tile: None,
            bomb: None,
            background: 0.0,
        }
    }
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

fn metadata(entries: &[(&str, &str, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = (entries.len() as u32).to_le_bytes().to_vec();
    for (name, kind, value) in entries {
        bytes.extend([text(name), text(kind)].concat());
        bytes.extend((value.len() as u32).to_le_bytes());
        bytes.extend(value);
    }
    bytes
}

/// A mask with some bits set.
fn mask(count: usize, bits: &[usize]) -> Vec<u8> {
    let mut mask = vec![0; count / 8];
    bits.iter().for_each(|i| mask[i / 8] |= 1 << (i % 8));
    mask
}

/// A Blosc chunk of elements of some bytes, shuffled, of LZ4 blocks that are split
/// where Blosc would.
fn blosc(bytes: &[u8], element: usize) -> Vec<u8> {
    const BLOCK: usize = 512;
    let (mut starts, mut body) = (Vec::new(), Vec::new());
    let blocks = bytes.chunks(BLOCK).len();
    for block in bytes.chunks(BLOCK) {
        starts.extend(((16 + 4 * blocks + body.len()) as u32).to_le_bytes());
        let count = block.len() / element;
        let mut shuffled: Vec<u8> =
            (0..element).flat_map(|k| (0..count).map(move |i| block[i * element + k])).collect();
        shuffled.extend(&block[count * element..]);
        let split = block.len() == BLOCK && BLOCK / element >= 128;
        for piece in shuffled.chunks(if split { BLOCK / element } else { block.len() }) {
            let packed = lz4_flex::block::compress(piece);
            let packed = if packed.len() < piece.len() { packed } else { piece.to_vec() };
            body.extend((packed.len() as u32).to_le_bytes());
            body.extend(packed);
        }
    }
    let mut chunk = vec![2, 1, 1 | 1 << 5, element as u8];
    let block = BLOCK.min(bytes.len());
    for word in [bytes.len(), block, 16 + starts.len() + body.len()] {
        chunk.extend((word as u32).to_le_bytes());
    }
    [chunk, starts, body].concat()
}

/// A leaf full of voxels, of densities that half floats hold exactly.
pub fn full() -> Written {
    let voxel = |i: u8, j: u8| ([i >> 3, i & 7, j], f32::from(i % 32 + 1) / 32.0);
    let voxels = (0..64).flat_map(|i| (0..8).map(move |j| voxel(i, j))).collect();
    Written { voxels, ..Written::default() }
}

impl Written {
    /// A value of the grid's type.
    fn number(&self, value: f32) -> Vec<u8> {
        match self.kind.contains("double") {
            true => f64::from(value).to_le_bytes().to_vec(),
            false => value.to_le_bytes().to_vec(),
        }
    }

    fn values(&self, values: &[f32], count: usize, active: &[usize]) -> Vec<u8> {
        // All values, or the active ones and nothing of the others.
        let packed = self.packing & 2 != 0;
        let mut dense = vec![0.0; count];
        active.iter().zip(values).for_each(|(i, v)| dense[*i] = *v);
        let stored = if packed { values } else { &dense };
        let mut bytes = vec![if packed { 0 } else { 6 }];
        let block: Vec<u8> = match self.half {
            true => stored.iter().flat_map(|v| half::f16::from_f32(*v).to_le_bytes()).collect(),
            false => stored.iter().flat_map(|v| self.number(*v)).collect(),
        };
        if block.is_empty() && self.half {
            return bytes;
        }
        let (packed, length) = match self.packing & 5 {
            0 => return [bytes, block].concat(),
            _ if block.is_empty() => (block, 0),
            1 => {
                use std::io::Write;
                let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), Default::default());
                zlib.write_all(&block).unwrap();
                let packed = zlib.finish().unwrap();
                let length = packed.len() as i64;
                (packed, length)
            }
            // What is short is not packed.
            _ if block.len() < 48 => (block.clone(), -(block.len() as i64)),
            _ => {
                let packed = blosc(&block, if self.half { 2 } else { self.number(0.0).len() });
                let length = packed.len() as i64;
                (packed, length)
            }
        };
        bytes.extend(self.bomb.unwrap_or(length).to_le_bytes());
        bytes.extend(packed);
        bytes
    }

    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        file(std::slice::from_ref(self))
    }

    /// What stands before its tree, its tree, and its voxels.
    fn parts(&self) -> [Vec<u8>; 3] {
        let mut head = self.packing.to_le_bytes().to_vec();
        head.extend(metadata(&[
            ("class", "string", self.class.into()),
            ("is_saved_as_half_float", "bool", vec![u8::from(self.half)]),
        ]));
        head.extend(text(self.map.0));
        head.extend(self.map.1.iter().flat_map(|v| v.to_le_bytes()));

        // The tree: one buffer, no tiles, one child at the origin.
        let mut tree = 1_u32.to_le_bytes().to_vec();
        tree.extend(self.number(self.background));
        tree.extend([0_u32, 1, 0, 0].map(u32::to_le_bytes).concat());
        tree.extend((-4096_i32).to_le_bytes());
        // z from −4096 on: −8 lies in child 31 of 128 along z, and there in leaf 15.
        tree.extend(mask(32768, &[31]));
        tree.extend(mask(32768, &[]));
        tree.extend(self.values(&[], 32768, &[]));
        let (leaf, tile) = ((1 << 8) | 15, (2 << 8) | 15);
        let tiles: Vec<usize> = self.tile.iter().map(|_| tile).collect();
        tree.extend(mask(4096, &[leaf]));
        tree.extend(mask(4096, &tiles));
        tree.extend(self.values(&self.tile.iter().copied().collect::<Vec<_>>(), 4096, &tiles));
        let mut voxels: Vec<(usize, f32)> = self
            .voxels
            .iter()
            .map(|([x, y, z], v)| {
                (usize::from(*x) << 6 | usize::from(*y) << 3 | usize::from(*z), *v)
            })
            .collect();
        voxels.sort_by_key(|(i, _)| *i);
        let active: Vec<usize> = voxels.iter().map(|(i, _)| *i).collect();
        let densities: Vec<f32> = voxels.iter().map(|(_, v)| *v).collect();
        tree.extend(mask(512, &active));
        let mut blocks = mask(512, &active);
        blocks.extend(self.values(&densities, 512, &active));

        [head, tree, blocks]
    }

    fn load(&self) -> Result<Scene, Error> {
        load_in(folder(&[("a.vdb", &self.bytes())]).path(), "a.vdb")
    }
}

/// A file of these grids, of the version of the first.
pub fn file(grids: &[Written]) -> Vec<u8> {
    let mut file = b" BDV\0\0\0\0".to_vec();
    for word in [grids[0].version, 11, 0] {
        file.extend(word.to_le_bytes());
    }
    file.push(1);
    file.extend([b'0'; 36]);
    file.extend(metadata(&[("creator", "string", b"a test".to_vec())]));
    file.extend((grids.len() as u32).to_le_bytes());
    for grid in grids {
        file.extend([text(grid.name), text(grid.kind), text("")].concat());
        let parts = grid.parts();
        let mut at = file.len() + 24;
        let mut ends = Vec::new();
        for length in [0, parts[0].len() + parts[1].len(), parts[2].len()] {
            at += length;
            ends.extend((at as u64).to_le_bytes());
        }
        file.extend([ends, parts.concat()].concat());
    }
    file
}

/// The voxels that the particles stand in.
fn voxels(scene: &Scene) -> Vec<Vec3> {
    particles(scene).centres.iter().map(|c| (*c + 0.5).floor()).collect()
}

#[test]
fn active_voxels_become_billboards() {
    let scene = Written::default().load().unwrap();
    // The third is next to empty.
    assert_eq!(voxels(&scene), [Vec3::new(8.0, 0.0, -8.0), Vec3::new(9.0, 2.0, -5.0)]);
    let material = &scene.materials[0];
    assert_eq!((material.base.w, material.alpha_mode), (0.05, AlphaMode::Blend));
    // A round texture: full in the middle, nothing in the corners.
    let alpha = |x, y| {
        scene.textures[0].sample(glam::Vec2::new(x, y), glam::Vec2::ZERO, glam::Vec2::ZERO).w
    };
    assert!(alpha(0.5, 0.5) > 0.99 && alpha(0.02, 0.02) == 0.0);
    assert_eq!((scene.files.len(), scene.warnings.len()), (1, 0));
}

#[test]
fn every_way_of_packing_gives_the_same() {
    let plain = full();
    let expected = plain.load().unwrap();
    assert_eq!(particles(&expected).centres.len(), 512);
    for packing in [0, 1, 2, 3, 4, 6] {
        for half in [false, true] {
            for (version, kind) in
                [(222, "Tree_float_5_4_3"), (224, "Tree_float_5_4_3"), (224, "Tree_double_5_4_3")]
            {
                let scene = Written { packing, half, version, kind, ..plain.clone() }.load();
                let scene = scene.unwrap_or_else(|e| panic!("{packing}, {half}: {e}"));
                let (a, b) = (particles(&scene), particles(&expected));
                assert_eq!((&a.centres, &a.colours), (&b.centres, &b.colours), "{packing}, {half}");
            }
        }
    }
}

#[test]
fn tiles_are_their_voxels() {
    let scene = Written { tile: Some(0.25), ..Written::default() }.load().unwrap();
    assert_eq!(particles(&scene).centres.len(), 2 + 512);
    assert!(voxels(&scene).contains(&Vec3::new(23.0, 7.0, -1.0)));
    assert_eq!(
        particles(&Written { tile: Some(0.0), ..Written::default() }.load().unwrap()).centres.len(),
        2
    );
}

#[test]
fn grids_lie_where_their_maps_say() {
    let place = |name: &'static str, numbers: &[f64]| {
        Written { map: (name, numbers.to_vec()), ..Written::default() }
            .load()
            .map(|s| s.objects[0].place)
    };
    let derived = [0.0; 12];
    let scale = DAffine3::from_scale(DVec3::new(2.0, 3.0, 4.0));
    assert_eq!(place("ScaleMap", &[&[2.0, 3.0, 4.0], &derived[..]].concat()).unwrap(), scale);
    let both = [&[5.0, 6.0, 7.0, 2.0, 3.0, 4.0], &derived[..]].concat();
    let moved = DAffine3::from_translation(DVec3::new(5.0, 6.0, 7.0)) * scale;
    assert_eq!(place("ScaleTranslateMap", &both).unwrap(), moved);
    assert_eq!(place("UniformScaleTranslateMap", &both).unwrap(), moved);
    assert_eq!(
        place("TranslationMap", &[5.0, 6.0, 7.0]).unwrap(),
        DAffine3::from_translation(DVec3::new(5.0, 6.0, 7.0))
    );
    // (1, 0, 0) goes to the first row, and the last row is the translation.
    let rows = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
    let turned = DMat3::from_cols(DVec3::Y, -DVec3::X, DVec3::Z);
    let turned = DAffine3::from_mat3_translation(turned, DVec3::new(5.0, 6.0, 7.0));
    assert_eq!(place("AffineMap", &rows).unwrap(), turned);
    let error = place("NonlinearFrustumMap", &[0.0; 30]).unwrap_err().to_string();
    assert!(error.contains("'NonlinearFrustumMap'"), "{error}");
    let error =
        place("ScaleMap", &[[0.0; 3].as_slice(), &derived].concat()).unwrap_err().to_string();
    assert!(error.contains("no finite size"), "{error}");
}

#[test]
fn what_is_no_density_is_refused() {
    let says = |written: Written, part: &str| {
        let error = written.load().unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("a.vdb"), "{error}");
    };
    let plain = Written::default();
    says(Written { class: "level set", ..plain.clone() }, "level set");
    says(Written { kind: "Tree_vec3s_5_4_3", ..plain.clone() }, "'density' of Tree_vec3s_5_4_3");
    says(Written { version: 221, ..plain.clone() }, "format 221");
    says(Written { version: 300, ..plain.clone() }, "format 300");
    says(Written { packing: 8, ..plain.clone() }, "unknown way (8)");
    says(Written { voxels: vec![([0, 0, 0], 0.0)], ..plain.clone() }, "is empty");
    says(Written { voxels: vec![([0, 0, 0], f32::NAN)], ..plain.clone() }, "density NaN");
    says(Written { packing: 6, bomb: Some(1 << 61), ..plain.clone() }, "needs 2305843009213693952");
    says(Written { packing: 3, bomb: Some(i64::MIN), ..plain.clone() }, "needs");
    // Older files say so in the grid's type; a grid of another name is drawn too.
    let older = Written { kind: "Tree_float_5_4_3_HalfFloat", half: true, name: "fog", ..plain };
    let scene = older.load().unwrap();
    assert_eq!(scene.objects[0].name, "fog");
    assert_eq!(scene.warnings, [""; 0]);
}

/// A level set as it says itself, and one that does not.
pub fn level_sets() -> [Written; 2] {
    let voxels = vec![([0, 0, 0], -1.5), ([0, 0, 1], 0.5), ([0, 0, 2], 2.5)];
    let named = Written { name: "sdf", class: "level set", ..Written::default() };
    let unnamed = Written {
        name: "surface",
        class: "unknown",
        background: 3.0,
        voxels,
        ..Written::default()
    };
    [named, unnamed]
}

#[test]
fn of_several_grids_the_fog_is_drawn_or_the_one_that_is_named() {
    let [named, unnamed] = level_sets();
    let vectors = Written { name: "vel", kind: "Tree_vec3s_5_4_3", ..Written::default() };
    let heat = Written { name: "heat", class: "unknown", ..Written::default() };
    let smoke = Written { name: "smoke", voxels: vec![([4, 0, 0], 2.0)], ..Written::default() };
    let bytes = file(&[named.clone(), unnamed.clone(), vectors, heat, smoke]);
    let folder = folder(&[("a.vdb", &bytes)]);
    let path = folder.path().join("a.vdb").display().to_string();
    let load = |grid: &str| {
        let grid = (!grid.is_empty()).then(|| grid.to_string());
        load_with(&path, &LoadOptions { grid, ..LoadOptions::default() })
    };
    let scene = load("").unwrap();
    assert_eq!(voxels(&scene), [Vec3::new(12.0, 0.0, -8.0)]);
    warned(
        &scene,
        1,
        &[
            "of its 5 grids only 'smoke' is drawn, not 'sdf', a level set; 'surface' of",
            "; 'vel' of Tree_vec3s_5_4_3; 'heat' of",
        ],
    );
    let heat = load("heat").unwrap();
    assert_eq!((&heat.objects[0].name[..], &heat.source[..]), ("heat", "a.vdb, grid heat"));
    let says = |grid: &str, part: &str| {
        let error = load(grid).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    says("sdf", "distances to surfaces (level sets: 'sdf'), no density");
    says("surface", "level sets: 'surface'");
    says(
        "vel",
        "no grid of Tree_float_5_4_3 or Tree_double_5_4_3 (it has: 'vel' of Tree_vec3s_5_4_3)",
    );
    says("smok", "unknown grid 'smok'; did you mean 'smoke'?");
    let error =
        load_with("a.obj", &LoadOptions { grid: Some("a".into()), ..LoadOptions::default() })
            .unwrap_err();
    assert!(error.to_string().contains("no grids to choose from"), "{error}");
}

#[test]
fn level_sets_are_known_by_their_values_too() {
    let [named, unnamed] = level_sets();
    let both = file(&[named, unnamed.clone()]);
    let error = load_in(folder(&[("a.vdb", &both)]).path(), "a.vdb").unwrap_err().to_string();
    assert!(error.contains("level sets: 'sdf', 'surface'"), "{error}");
    // Densities that are negative here and there are none: there is nothing everywhere else.
    let scene = Written { background: 0.0, ..unnamed }.load().unwrap();
    assert_eq!(voxels(&scene).len(), 2);
    warned(&scene, 1, &["1 voxels of its grid 'surface' are negative and draw nothing"]);
}

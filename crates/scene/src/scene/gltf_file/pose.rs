//! Where things stand: transformations, skins in their default pose, instances.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::accessor::{Kind, Normalised, Numbers, Type};
use super::json::{Instancing, Node, Root};
use super::{Loader, MAX_DEPTH};
use screendoor_trace::error::Result;

const MATRICES: Kind =
    Kind { shapes: &[("MAT4", 16)], types: &[Type::F32], normalised: Normalised::Never };
const VECTORS: Kind =
    Kind { shapes: &[("VEC3", 3)], types: &[Type::F32], normalised: Normalised::Never };
const QUATERNIONS: Kind = Kind {
    shapes: &[("VEC4", 4)],
    types: &[Type::F32, Type::I8, Type::I16],
    normalised: Normalised::Always,
};

/// Each node's parent; of several the last, which a scene then refuses.
pub(super) fn parents(root: &Root) -> Vec<Option<usize>> {
    let mut parents = vec![None; root.nodes.len()];
    for (i, node) in root.nodes.iter().enumerate() {
        for child in &node.children {
            if let Some(parent) = parents.get_mut(*child) {
                *parent = Some(i);
            }
        }
    }
    parents
}

/// Which nodes animations move.
pub(super) fn animated(root: &Root) -> Vec<bool> {
    let mut animated = vec![false; root.nodes.len()];
    let channels = root.animations.iter().flat_map(|animation| &animation.channels);
    for node in channels.filter_map(|channel| channel.target.node) {
        if let Some(animated) = animated.get_mut(node) {
            *animated = true;
        }
    }
    animated
}

/// A node's own transformation.
pub(super) fn transform(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default: f64| {
        v.map_or(DVec3::splat(default), |v| DVec3::from(v.map(f64::from)))
    };
    let rotation = node.rotation.map_or(DQuat::IDENTITY, quaternion);
    let (scale, translation) = (vector(node.scale, 1.0), vector(node.translation, 0.0));
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}

/// A rotation, of unit length but for rounding.
fn quaternion(q: [f32; 4]) -> DQuat {
    let q = DQuat::from_array(q.map(f64::from));
    // One that is nearly of unit length stays as it is.
    if (q.length_squared() - 1.0).abs() < 1e-6 { q } else { q.normalize() }
}

/// A skin's joints as they move what is bound to them.
pub(super) type Joints = Vec<DAffine3>;

impl Loader<'_> {
    /// From a node's space to the scene's.
    fn global(&self, node: usize, part: &str) -> Result<DMat4> {
        let mut place = DMat4::IDENTITY;
        let mut next = Some(node);
        for _ in 0..=MAX_DEPTH + 1 {
            let Some(node) = next else { return Ok(place) };
            place = transform(&self.root.nodes[node]) * place;
            next = self.parents[node];
        }
        let what = "a joint is its own ancestor, or its ancestors are too many";
        Err(self.bad(part, what, "make the nodes a tree"))
    }

    /// Whether an animation would move a joint of the node's skin.
    pub(super) fn moves_by_skin(&self, node: &Node) -> bool {
        if self.root.animations.is_empty() {
            return false;
        }
        let skin = node.skin.and_then(|skin| self.root.skins.get(skin));
        skin.is_some_and(|skin| {
            let moved = |joint: &usize| {
                let up = |node: &usize| self.parents.get(*node).copied().flatten();
                std::iter::successors(Some(*joint), up)
                    .take(MAX_DEPTH + 1)
                    .any(|node| self.animated.get(node) == Some(&true))
            };
            skin.joints.iter().any(moved)
        })
    }

    /// The joints of a skin as the file places them.
    pub(super) fn joints(&mut self, skin: usize) -> Result<Joints> {
        let part = format!("skin {skin}");
        let Some(skin) = self.root.skins.get(skin) else {
            return Err(self.bad(&part, "it is not there", "export the file again"));
        };
        let inverse: Vec<DMat4> = match skin.inverse_bind_matrices {
            None => vec![DMat4::IDENTITY; skin.joints.len()],
            Some(accessor) => {
                let matrices = self.numbers(accessor, MATRICES, &part)?;
                let matrix = |m: [f32; 16]| DMat4::from_cols_array(&m.map(f64::from));
                matrices.arrays(0.0).map(matrix).collect()
            }
        };
        if inverse.len() < skin.joints.len() {
            let what =
                format!("it has {} matrices for {} joints", inverse.len(), skin.joints.len());
            return Err(self.bad(&part, what, "export the file again"));
        }
        let joints = skin.joints.iter().zip(inverse);
        joints
            .map(|(joint, inverse)| {
                if *joint >= self.root.nodes.len() {
                    let what = format!("its joint, node {joint}, is not there");
                    return Err(self.bad(&part, what, "export the file again"));
                }
                Ok(DAffine3::from_mat4(self.global(*joint, &part)? * inverse))
            })
            .collect()
    }

    /// Where the instances of a node's mesh stand, each seen from the node; `None` where it
    /// has none but itself.
    pub(super) fn instances(&mut self, node: &Node, part: &str) -> Result<Option<Vec<DAffine3>>> {
        const NAME: &str = "EXT_mesh_gpu_instancing";
        let Some(instancing) = self.said::<Instancing>(&node.extensions, NAME, part)? else {
            return Ok(None);
        };
        let part = format!("{part}, {NAME}");
        let mut read = |name: &str, kind| -> Result<Option<Numbers>> {
            let accessor = instancing.attributes.get(name);
            accessor.map(|a| self.numbers(*a, kind, &part)).transpose()
        };
        let translations = read("TRANSLATION", VECTORS)?;
        let rotations = read("ROTATION", QUATERNIONS)?;
        let scales = read("SCALE", VECTORS)?;
        let mut counts =
            [&translations, &rotations, &scales].into_iter().flatten().map(Numbers::len);
        let Some(count) = counts.next() else { return Ok(None) };
        if counts.any(|other| other != count) {
            let what = "its attributes have different counts";
            return Err(self.bad(&part, what, "export the file again"));
        }
        let vectors = |numbers: &Option<Numbers>, default: f64| match numbers {
            None => vec![DVec3::splat(default); count],
            Some(n) => n.arrays(0.0).map(|v: [f32; 3]| DVec3::from(v.map(f64::from))).collect(),
        };
        let (translations, scales) = (vectors(&translations, 0.0), vectors(&scales, 1.0));
        let rotations: Vec<DQuat> = match &rotations {
            None => vec![DQuat::IDENTITY; count],
            Some(n) => n.arrays(0.0).map(quaternion).collect(),
        };
        let one =
            |i| DAffine3::from_scale_rotation_translation(scales[i], rotations[i], translations[i]);
        Ok(Some((0..count).map(one).collect()))
    }
}

/// How much of a vertex each joint moves.
pub(super) struct Bound<'j> {
    pub joints: &'j [DAffine3],
    pub sets: Vec<Set>,
}

/// Four joints of each vertex, and their weights.
pub(super) struct Set {
    pub joints: Vec<[f32; 4]>,
    pub weights: Vec<[f32; 4]>,
}

impl Bound<'_> {
    /// How vertex `i` is moved; `None` where it is bound to a joint that is not there.
    /// Weights are taken as shares of their sum; a vertex without any follows the first
    /// joint.
    pub(super) fn at(&self, i: usize) -> Option<DAffine3> {
        let mut moved = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        let mut sum = 0.0;
        for Set { joints, weights } in &self.sets {
            for (joint, weight) in joints[i].into_iter().zip(weights[i]) {
                if weight == 0.0 {
                    continue;
                }
                let (joint, weight) = (self.joints.get(joint as usize)?, f64::from(weight));
                moved.matrix3 += joint.matrix3 * weight;
                moved.translation += joint.translation * weight;
                sum += weight;
            }
        }
        if sum == 0.0 {
            return self.joints.first().copied();
        }
        moved.matrix3 *= 1.0 / sum;
        moved.translation /= sum;
        Some(moved)
    }
}

/// How normals turn where points move by `matrix`: by the inverse transpose, to whose
/// direction the cofactor matrix has its sign for company.
pub(super) fn normal_matrix(matrix: DMat3) -> DMat3 {
    let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    DMat3::from_cols(y.cross(z) * sign, z.cross(x) * sign, x.cross(y) * sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_follow_their_joints_by_their_weights() {
        let joints = [DVec3::X, DVec3::Y].map(DAffine3::from_translation);
        let bound = |joint: [f32; 4], weights: [f32; 4]| {
            let sets = vec![Set { joints: vec![joint], weights: vec![weights] }];
            Bound { joints: &joints, sets }.at(0).map(|m| m.transform_point3(DVec3::Z))
        };
        let half = DVec3::new(0.5, 0.5, 1.0);
        assert_eq!(bound([0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]), Some(half));
        // Weights are shares, and those of nothing name no joint.
        assert_eq!(bound([0.0, 1.0, 9.0, 0.0], [3.0, 3.0, 0.0, 0.0]), Some(half));
        assert_eq!(bound([7.0; 4], [0.0; 4]), Some(DVec3::new(1.0, 0.0, 1.0)));
        assert_eq!(bound([2.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]), None);
    }

    #[test]
    fn normals_of_a_mirrored_and_stretched_surface() {
        let matrix = DMat3::from_diagonal(DVec3::new(-2.0, 1.0, 1.0));
        let normal = normal_matrix(matrix) * DVec3::new(1.0, 1.0, 0.0);
        // The surface x + y = 0 becomes −x/2 + y = 0.
        assert!(normal.normalize().distance(DVec3::new(-1.0, 2.0, 0.0).normalize()) < 1e-12);
    }
}

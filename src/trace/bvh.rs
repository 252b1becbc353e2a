//! A tree of boxes, eight to a node, over blocks of a mesh's triangles.
//!
//! obvhs builds a binary tree (PLOC: Meister and Bittner 2018) with one triangle a leaf; [`collapse`] makes
//! nodes and blocks of it. A block has the corners of its triangles and not their boxes: a walk computes the
//! boxes in lanes, and what it reads together lies together in memory. The walk is our own ([`super::walk`]),
//! since obvhs's is not conservative.

use super::build::{balanced, collapse, levels};
use super::node::{LEVELS, Parts, WIDTH};
use super::triangle::ends;
use super::walk;
use super::{Hit, Ray};
use crate::world::mesh::Mesh;
use glam::Vec3;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// A mesh's triangles and a tree of boxes over them.
#[derive(Debug, Clone)]
pub struct Bvh {
    parts: Parts,
    /// The corners of every triangle, in the mesh's order.
    corners: Vec<[Vec3; 3]>,
}

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize])).collect()
}

impl Bvh {
    /// The tree over a mesh.
    ///
    /// # Panics
    /// Where the mesh has 2²⁸ triangles or more.
    pub fn new(mesh: &Mesh) -> Self {
        assert!(mesh.triangles.len() < 1 << 28, "fewer triangles than a node can count");
        let corners = corners(mesh);
        let boxes: Vec<_> = corners
            .iter()
            .map(|corners| {
                let (low, high) = ends(corners);
                obvhs::aabb::Aabb::new(low.into(), high.into())
            })
            .collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Low,
            &boxes,
            indices,
            SortPrecision::U64,
            2,
        );
        ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
        let mut parts = collapse(&binary, &mesh.triangles);
        if levels(&parts.nodes) > LEVELS {
            parts = balanced(&binary.primitive_indices, &mesh.triangles);
        }
        Self::of(parts, corners)
    }

    /// The tree of these nodes and blocks over triangles of these corners.
    fn of(parts: Parts, corners: Vec<[Vec3; 3]>) -> Self {
        let mut bvh = Self { parts, corners };
        bvh.enclose();
        bvh
    }

    /// Takes the corners of `mesh`, another pose of the same triangles, and refits the boxes; the tree stays.
    /// Hits are those of a new tree; a pose far from the first makes them slower to find.
    ///
    /// # Panics
    /// Where the mesh has other triangles.
    pub fn refit(&mut self, mesh: &Mesh) {
        assert_eq!(mesh.triangles.len(), self.corners.len(), "a pose has the triangles of the first");
        self.corners = corners(mesh);
        self.enclose();
    }

    /// The corners of every triangle, in the mesh's order.
    pub fn corners(&self) -> &[[Vec3; 3]] {
        &self.corners
    }

    /// Fills the blocks and fits every box to what is in it, from the blocks up.
    fn enclose(&mut self) {
        let Parts { nodes, blocks } = &mut self.parts;
        let filled: Vec<_> = blocks.iter_mut().map(|block| block.fill(&self.corners)).collect();
        let mut hulls = vec![(Vec3::ZERO, Vec3::ZERO); nodes.len()];
        for (index, node) in nodes.iter_mut().enumerate().rev() {
            let mut boxes = [(Vec3::ZERO, Vec3::ZERO); WIDTH];
            for (place, ends) in boxes[..node.count()].iter_mut().enumerate() {
                *ends =
                    if place < node.inner() { hulls[node.node(place)] } else { filled[node.block(place)] };
            }
            hulls[index] = node.enclose(&boxes[..node.count()]);
        }
    }

    /// The nearest hit: the least t, and of those with equal t the lowest triangle.
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[expect(
                unsafe_code,
                reason = "the twin with wider instructions, for a processor that was just looked at"
            )]
            // SAFETY: the processor has AVX2.
            return unsafe { super::walk_avx2::nearest(&self.parts, ray) };
        }
        walk::portable::nearest(&self.parts, ray)
    }

    /// Whether the ray meets any triangle.
    pub fn blocked(&self, ray: &Ray) -> bool {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[expect(
                unsafe_code,
                reason = "the twin with wider instructions, for a processor that was just looked at"
            )]
            // SAFETY: the processor has AVX2.
            return unsafe { super::walk_avx2::blocked(&self.parts, ray) };
        }
        walk::portable::blocked(&self.parts, ray)
    }
}

#[cfg(test)]
mod tests {
    use super::super::node::Node;
    use super::*;
    use crate::world::shapes;

    #[test]
    #[should_panic(expected = "a pose has the triangles of the first")]
    fn a_pose_with_other_triangles_is_refused() {
        let mesh = shapes::sphere(2).unwrap();
        let mut turned = mesh.triangles.clone();
        turned.rotate_left(1);
        Bvh::new(&mesh).refit(&Mesh::new(mesh.positions, None, turned).unwrap());
    }

    #[test]
    fn a_balanced_tree_finds_the_same_hits_and_has_few_levels() {
        let mesh = shapes::torus_knot(2, 3, 0.35, 64, 8).unwrap();
        let built = Bvh::new(&mesh);
        let order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let other = Bvh::of(balanced(&order, &mesh.triangles), corners(&mesh));
        assert_eq!((levels(&other.parts.nodes), levels(&[Node::EMPTY])), (3, 1)); // 1,024 triangles
        assert!((3..=LEVELS).contains(&levels(&built.parts.nodes)), "{}", levels(&built.parts.nodes));
        let mut hits = 0;
        for (from, to) in mesh.positions.iter().zip(mesh.positions.iter().rev()) {
            let ray = Ray::new(*from * 1.5, *to - *from * 1.5);
            assert_eq!(built.nearest(&ray), other.nearest(&ray));
            hits += usize::from(other.blocked(&ray));
        }
        // A ray at a vertex of the outline may pass it by a rounding.
        assert!(hits > mesh.positions.len() * 9 / 10, "{hits}");
    }

    /// Rays of all lengths through corners, along and beside edges, parallel to axes and to boxes' planes,
    /// against meshes of which one has every triangle twice.
    #[test]
    fn the_portable_walk_finds_what_the_processors_own_finds() {
        let knot = shapes::torus_knot(2, 3, 0.35, 64, 8).unwrap();
        let twice = knot.triangles.iter().chain(&knot.triangles).copied().collect();
        let twice = Mesh::new(knot.positions.clone(), None, twice).unwrap();
        let cuboid = shapes::cuboid(Vec3::new(1.0, 0.25, 3.0), 4).unwrap();
        let tiny = cuboid.positions.iter().map(|p| *p * 1e-18).collect();
        let tiny = Mesh::new(tiny, None, cuboid.triangles.clone()).unwrap();
        for mesh in [knot, twice, cuboid, tiny] {
            let bvh = Bvh::new(&mesh);
            let radius = mesh.bounds().radius();
            let mut hits = 0;
            let count = 20_000;
            for number in 0..count {
                let corner = |step: usize| mesh.positions[(number * step + step) % mesh.positions.len()];
                let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Z][number % 6];
                let origin = corner(7) + axis * [0.0, -2.0 * radius, radius][number % 3];
                let direction = match number % 4 {
                    0 => axis,
                    1 => corner(11) - origin,
                    2 => (corner(5) + corner(6)) * 0.5 - origin,
                    _ => corner(13) + Vec3::splat(radius * 1e-3) - origin,
                };
                let direction = if direction == Vec3::ZERO { axis } else { direction };
                let far = if number % 5 == 0 { 0.7 } else { f32::INFINITY };
                let ray = Ray { origin, direction, far };
                let found = walk::portable::nearest(&bvh.parts, &ray);
                assert_eq!(found, bvh.nearest(&ray), "{ray:?}");
                let blocked = [walk::portable::blocked(&bvh.parts, &ray), bvh.blocked(&ray)];
                assert_eq!(blocked, [found.is_some(); 2], "{ray:?}");
                hits += usize::from(found.is_some());
            }
            assert!(hits > count / 4, "{hits}");
        }
    }
}

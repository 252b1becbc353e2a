//! A tree of boxes, eight to a node, over blocks of up to eight of a mesh's triangles.
//!
//! obvhs builds a binary tree (PLOC: Meister and Bittner 2018) with one triangle a leaf; [`collapse`] makes nodes and
//! blocks of it. A block has the corners of its triangles and not their boxes: a walk finds those in lanes, and what it
//! reads together lies together. The walk is ours ([`super::walk`]): obvhs's is not conservative.

use super::build::{Parts, balanced, collapse, levels};
use super::triangle::ends;
use super::walk;
use super::{Hit, Ray};
use crate::numeric::order::{max3, min3};
use crate::world::mesh::Mesh;
use glam::Vec3;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Children of a node, and triangles of a block.
pub(super) const WIDTH: usize = 8;

/// Marks a child that is a block; its other bits are the block's index and, the lowest three, its last triangle's place.
pub(super) const LEAF: u32 = 1 << 31;

/// The most levels of nodes of a tree.
pub(super) const LEVELS: usize = 64;

/// Boxes and what is in them.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the children's low and high coordinates; an absent child has an empty box.
    pub(super) bounds: [[[f32; WIDTH]; 2]; 3],
    /// A node's index, or [`LEAF`] and a block.
    pub(super) children: [u32; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self =
        Self { bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };
}

/// Triangles.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Of each corner, for each axis, the triangles' coordinates.
    pub(super) corners: [[[f32; WIDTH]; 3]; 3],
    /// The triangles; where there are fewer than eight, the last again.
    pub(super) triangles: [u32; WIDTH],
}

impl Block {
    /// The block of these triangles, one to eight, with no corners yet.
    pub(super) fn of(triangles: &[u32]) -> Self {
        let last = triangles.len() - 1;
        let triangle = |lane: usize| triangles[if lane < last { lane } else { last }];
        Self { corners: [[[0.0; WIDTH]; 3]; 3], triangles: std::array::from_fn(triangle) }
    }

    /// The corners of the triangle in a lane.
    #[inline(always)]
    pub(super) fn corners(&self, lane: usize) -> [Vec3; 3] {
        let corner = |corner: usize| {
            let [x, y, z] = &self.corners[corner];
            Vec3::new(x[lane], y[lane], z[lane])
        };
        [corner(0), corner(1), corner(2)]
    }

    /// Takes the corners of its triangles from those of all.
    fn fill(&mut self, corners: &[[Vec3; 3]]) {
        for (lane, triangle) in self.triangles.iter().enumerate() {
            for (to, from) in self.corners.iter_mut().zip(&corners[*triangle as usize]) {
                for axis in 0..3 {
                    to[axis][lane] = from[axis];
                }
            }
        }
    }

    /// The low and the high end of the box around the triangles.
    fn ends(&self) -> (Vec3, Vec3) {
        (1..WIDTH).fold(ends(&self.corners(0)), |(low, high), lane| {
            let (lower, higher) = ends(&self.corners(lane));
            (min3(low, lower), max3(high, higher))
        })
    }
}

/// A mesh's triangles and a tree of boxes over them.
#[derive(Debug, Clone)]
pub struct Bvh {
    pub(super) parts: Parts,
    /// The corners of every triangle, in the mesh's order.
    corners: Vec<[Vec3; 3]>,
}

fn corners(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|corner| mesh.positions[corner as usize])).collect()
}

impl Bvh {
    /// The tree over a mesh.
    pub fn new(mesh: &Mesh) -> Self {
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
        let mut parts = collapse(&binary);
        if levels(&parts.nodes) > LEVELS {
            parts = balanced(&binary.primitive_indices);
        }
        Self::of(parts, corners)
    }

    /// The tree of these nodes and blocks over triangles of these corners.
    fn of(parts: Parts, corners: Vec<[Vec3; 3]>) -> Self {
        let mut bvh = Self { parts, corners };
        bvh.enclose();
        bvh
    }

    /// Takes the corners of `mesh`, another pose with the same triangles, and keeps the tree with boxes that fit.
    /// Hits are those of a new tree; a pose far from the first makes them slower to find.
    ///
    /// # Panics
    /// Where the mesh has another number of triangles.
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
        for block in &mut *blocks {
            block.fill(&self.corners);
        }
        for index in (0..nodes.len()).rev() {
            for lane in 0..WIDTH {
                let child = nodes[index].children[lane];
                let (low, high) = if child & LEAF != 0 {
                    blocks[(child & !LEAF) as usize / WIDTH].ends()
                } else if child != 0 {
                    let child = &nodes[child as usize];
                    let at = |side: usize, lane: usize| {
                        Vec3::from_array([0, 1, 2].map(|axis| child.bounds[axis][side][lane]))
                    };
                    (1..WIDTH).fold((at(0, 0), at(1, 0)), |(low, high), lane| {
                        (min3(low, at(0, lane)), max3(high, at(1, lane)))
                    })
                } else {
                    continue;
                };
                for axis in 0..3 {
                    nodes[index].bounds[axis][0][lane] = low[axis];
                    nodes[index].bounds[axis][1][lane] = high[axis];
                }
            }
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
    use super::*;
    use crate::world::shapes;

    #[test]
    fn a_balanced_tree_finds_the_same_hits_and_has_few_levels() {
        let mesh = shapes::torus_knot(2, 3, 0.35, 64, 8).unwrap();
        let built = Bvh::new(&mesh);
        let order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let other = Bvh::of(balanced(&order), corners(&mesh));
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
}

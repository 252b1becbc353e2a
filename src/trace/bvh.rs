//! A tree of boxes, eight to a node, over the triangles of a mesh.
//!
//! obvhs builds a binary tree (PLOC: Meister and Bittner 2018) with one triangle a leaf; [`collapse`] makes
//! nodes of eight of it. A child is a node or one triangle, so a triangle's own box is tested with those of its neighbours.
//! The walk is ours: obvhs's is not conservative.

use super::triangle::{Shear, Slabs, ends, within};
use super::{Hit, Ray};
use crate::numeric::order::{max, max3, min, min3};
use crate::world::mesh::Mesh;
use glam::Vec3;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::mem::MaybeUninit;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Marks a child that is a triangle.
const LEAF: u32 = 1 << 31;

/// The most levels of a tree.
const LEVELS: usize = 64;

/// The most entries of a walk's stack: a node leaves at most seven more than it takes, on each level.
const STACK: usize = 7 * LEVELS + 1;

/// Boxes and what is in them.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// For each axis the children's low and high coordinates; an absent child has an empty box.
    pub(super) bounds: [[[f32; WIDTH]; 2]; 3],
    /// A node's index, or [`LEAF`] and a leaf's.
    children: [u32; WIDTH],
}

const EMPTY: Node =
    Node { bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };

/// A mesh's triangles and a tree of boxes over them.
#[derive(Debug, Clone)]
pub struct Bvh {
    /// A node comes before the nodes below it; the root is the first.
    nodes: Vec<Node>,
    /// The corners of every triangle, in the mesh's order.
    corners: Vec<[Vec3; 3]>,
    /// The triangles again in the tree's order: what a walk reads together lies together.
    leaves: Vec<([Vec3; 3], u32)>,
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
        let mut nodes = collapse(&binary);
        if levels(&nodes) > LEVELS {
            nodes = balanced(&binary.primitive_indices);
        }
        Self::of(nodes, corners)
    }

    /// The tree of `nodes`, whose leaves are numbers of triangles, over triangles of these corners.
    fn of(mut nodes: Vec<Node>, corners: Vec<[Vec3; 3]>) -> Self {
        let mut leaves = Vec::with_capacity(corners.len());
        for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
            if *child & LEAF != 0 {
                let triangle = *child & !LEAF;
                *child = LEAF | leaves.len() as u32;
                leaves.push((corners[triangle as usize], triangle));
            }
        }
        let mut bvh = Self { nodes, corners, leaves };
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
        for (corners, triangle) in &mut self.leaves {
            *corners = self.corners[*triangle as usize];
        }
        self.enclose();
    }

    /// The corners of every triangle, in the mesh's order.
    pub fn corners(&self) -> &[[Vec3; 3]] {
        &self.corners
    }

    /// Fits every box to what is in it, from the leaves up.
    fn enclose(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            for lane in 0..WIDTH {
                let node = &self.nodes[index];
                let child = node.children[lane];
                let (low, high) = if child & LEAF != 0 {
                    ends(&self.leaves[(child & !LEAF) as usize].0)
                } else if child != 0 {
                    let child = &self.nodes[child as usize];
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
                    self.nodes[index].bounds[axis][0][lane] = low[axis];
                    self.nodes[index].bounds[axis][1][lane] = high[axis];
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
            return unsafe { super::avx2::nearest(self, ray) };
        }
        nearest(self, ray, enter)
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
            return unsafe { super::avx2::blocked(self, ray) };
        }
        blocked(self, ray, enter)
    }
}

/// Nodes of eight children from nodes of two, so that a ray is expected to test the fewest boxes: the cost of a subtree
/// that may show itself as up to k children is the least over all ways to divide k among its two halves, or, as one child,
/// its box's area plus the cost of its halves as eight (Ylitie, Karras and Laine 2017, §3.1).
fn collapse(binary: &Bvh2) -> Vec<Node> {
    let children = |node: usize| {
        let first = binary.nodes[node].first_index as usize;
        [first, first + 1]
    };
    // Parents before children.
    let (mut order, mut open) = (Vec::with_capacity(binary.nodes.len()), vec![0]);
    while let Some(node) = open.pop() {
        order.push(node);
        if !binary.nodes[node].is_leaf() {
            open.extend(children(node));
        }
    }
    // For each k from 1: the least cost as up to k children, and how many of them are the first half's; 0 for fewer than k.
    let mut plans = vec![[(0.0_f32, 0_u8); WIDTH]; binary.nodes.len()];
    for node in order.iter().rev().copied().filter(|node| !binary.nodes[*node].is_leaf()) {
        let [a, b] = children(node).map(|child| plans[child]);
        for count in 2..=WIDTH {
            let divided = (1..count).map(|first| (a[first - 1].0 + b[count - first - 1].0, first as u8));
            let best =
                divided.fold((f32::INFINITY, 0), |best, next| if next.0 < best.0 { next } else { best });
            let fewer = plans[node][count - 2].0;
            plans[node][count - 1] = if count > 2 && fewer <= best.0 { (fewer, 0) } else { best };
        }
        plans[node][0] = (binary.nodes[node].aabb().half_area() + plans[node][WIDTH - 1].0, 0);
    }
    let mut nodes = vec![EMPTY];
    let mut open = vec![(0, 0)]; // a binary node and the node that it becomes
    while let Some((from, to)) = open.pop() {
        let mut shown = Vec::with_capacity(WIDTH);
        // Subtrees, and as how many children each may show itself.
        let mut parts = vec![(from, WIDTH)];
        while let Some((node, mut count)) = parts.pop() {
            while count > 2 && plans[node][count - 1].1 == 0 && !binary.nodes[node].is_leaf() {
                count -= 1;
            }
            if binary.nodes[node].is_leaf() || (count == 1 && node != from) {
                shown.push(node);
            } else {
                let first = usize::from(plans[node][count - 1].1);
                let [a, b] = children(node);
                parts.extend([(b, count - first), (a, first)]);
            }
        }
        for (lane, child) in shown.into_iter().enumerate() {
            let node = &binary.nodes[child];
            nodes[to].children[lane] = if node.is_leaf() {
                LEAF | binary.primitive_indices[node.first_index as usize]
            } else {
                nodes.push(EMPTY);
                open.push((child, nodes.len() - 1));
                nodes.len() as u32 - 1
            };
        }
    }
    nodes
}

/// The levels of a tree.
fn levels(nodes: &[Node]) -> usize {
    let mut below = vec![1; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        for child in node.children.iter().filter(|child| **child & LEAF == 0 && **child != 0) {
            below[index] = max(below[index], 1 + below[*child as usize]);
        }
    }
    below[0]
}

/// A tree of as few levels as there can be over triangles in this order: for meshes whose own tree is too deep for a
/// walk's stack. (No such mesh is known: obvhs gives no bound.)
fn balanced(order: &[u32]) -> Vec<Node> {
    let mut nodes = vec![EMPTY];
    let mut open = vec![(0..order.len(), 0_usize)];
    while let Some((range, to)) = open.pop() {
        let part = range.len().div_ceil(WIDTH);
        for (lane, first) in range.clone().step_by(max(part, 1)).enumerate() {
            nodes[to].children[lane] = if part == 1 {
                LEAF | order[first]
            } else {
                nodes.push(EMPTY);
                open.push((first..min(first + part, range.end), nodes.len() - 1));
                nodes.len() as u32 - 1
            };
        }
    }
    nodes
}

/// The boxes of a node that a ray is in, up to some t.
pub(super) struct Entered {
    /// A bit for each child.
    pub(super) mask: u32,
    /// Where the ray enters each child's box, and where it leaves it.
    pub(super) near: [f32; WIDTH],
    pub(super) far: [f32; WIDTH],
}

/// Tests a ray against the eight boxes of a node, up to `most`.
#[inline(always)]
fn enter(node: &Node, slabs: &Slabs, most: f32) -> Entered {
    let mut entered = Entered { mask: 0, near: [0.0; WIDTH], far: [0.0; WIDTH] };
    for lane in 0..WIDTH {
        let side = |flip: bool| {
            [0, 1, 2].map(|axis| node.bounds[axis][usize::from(slabs.high_first[axis] != flip)][lane])
        };
        let [near, far] = slabs.interval(side(false), side(true));
        (entered.near[lane], entered.far[lane]) = (near, far);
        entered.mask |= u32::from(near <= far && near <= most) << lane;
    }
    entered
}

/// What a walk has yet to look at: children, and the intervals of their boxes.
struct Stack {
    items: [MaybeUninit<(u32, f32, f32)>; STACK],
    length: usize,
}

impl Stack {
    /// A stack that holds the root.
    #[inline(always)]
    fn new() -> Self {
        let mut stack = Self { items: [const { MaybeUninit::uninit() }; STACK], length: 0 };
        stack.push((0, 0.0, f32::INFINITY));
        stack
    }

    /// # Panics
    /// Where the stack is full, which [`Bvh::new`] rules out.
    #[inline(always)]
    fn push(&mut self, item: (u32, f32, f32)) {
        self.items[self.length] = MaybeUninit::new(item);
        self.length += 1;
    }

    #[inline(always)]
    fn get(&self, at: usize) -> (u32, f32, f32) {
        assert!(at < self.length);
        #[expect(unsafe_code, reason = "an item that was written")]
        // SAFETY: all items below the length were written.
        unsafe {
            self.items[at].assume_init()
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(u32, f32, f32)> {
        let item = (self.length > 0).then(|| self.get(self.length - 1))?;
        self.length -= 1;
        Some(item)
    }

    /// Adds what a ray entered, so that it leaves the nearest first.
    #[inline(always)]
    fn add(&mut self, node: &Node, mut entered: Entered) {
        let bottom = self.length;
        while entered.mask != 0 {
            let lane = entered.mask.trailing_zeros() as usize & (WIDTH - 1);
            entered.mask &= entered.mask - 1;
            let item = (node.children[lane], entered.near[lane], entered.far[lane]);
            let mut at = self.length;
            self.push(item);
            while at > bottom && self.get(at - 1).1 < item.1 {
                self.items[at] = self.items[at - 1];
                at -= 1;
            }
            self.items[at] = MaybeUninit::new(item);
        }
    }
}

/// [`Bvh::nearest`] with a way to test a node.
#[inline(always)]
pub(super) fn nearest(bvh: &Bvh, ray: &Ray, enter: impl Fn(&Node, &Slabs, f32) -> Entered) -> Option<Hit> {
    let (slabs, shear) = (Slabs::new(ray), Shear::new(ray.direction));
    let origin = shear.apply(ray.origin);
    let mut best: Option<Hit> = None;
    let mut most = ray.far;
    let mut stack = Stack::new();
    'walk: while let Some((mut child, mut enters, mut leaves)) = stack.pop() {
        if enters > most {
            continue;
        }
        while child & LEAF == 0 {
            let node = &bvh.nodes[child as usize];
            let entered = enter(node, &slabs, most);
            // Most often one box is left: no need to put it on the stack.
            let lane = entered.mask.trailing_zeros() as usize & (WIDTH - 1);
            if entered.mask & entered.mask.wrapping_sub(1) != 0 {
                stack.add(node, entered);
            } else if entered.mask != 0 {
                (child, enters, leaves) = (node.children[lane], entered.near[lane], entered.far[lane]);
                continue;
            }
            continue 'walk;
        }
        let (corners, triangle) = &bvh.leaves[(child & !LEAF) as usize];
        let hit = within(&shear, origin, corners, *triangle, [enters, leaves], most);
        let nearer = |hit: &Hit| best.is_none_or(|best| hit.t < best.t || *triangle < best.triangle);
        if let Some(hit) = hit.filter(nearer) {
            best = Some(hit);
            most = hit.t;
        }
    }
    best
}

/// [`Bvh::blocked`] with a way to test a node.
#[inline(always)]
pub(super) fn blocked(bvh: &Bvh, ray: &Ray, enter: impl Fn(&Node, &Slabs, f32) -> Entered) -> bool {
    let (slabs, shear) = (Slabs::new(ray), Shear::new(ray.direction));
    let origin = shear.apply(ray.origin);
    let mut stack = Stack::new();
    while let Some((child, ..)) = stack.pop() {
        let node = &bvh.nodes[child as usize];
        let mut entered = enter(node, &slabs, ray.far);
        while entered.mask != 0 {
            let lane = entered.mask.trailing_zeros() as usize & (WIDTH - 1);
            entered.mask &= entered.mask - 1;
            let (child, interval) = (node.children[lane], [entered.near[lane], entered.far[lane]]);
            if child & LEAF == 0 {
                stack.push((child, interval[0], interval[1]));
                continue;
            }
            let (corners, _) = &bvh.leaves[(child & !LEAF) as usize];
            if within(&shear, origin, corners, 0, interval, ray.far).is_some() {
                return true;
            }
        }
    }
    false
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
        assert_eq!((levels(&other.nodes), levels(&[EMPTY])), (4, 1)); // 1,024 triangles
        assert!((4..=LEVELS).contains(&levels(&built.nodes)), "{}", levels(&built.nodes));
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

//! Nodes of eight children and blocks of eight triangles, from obvhs's binary tree.

use super::bvh::{Block, LEAF, Node, WIDTH};
use crate::numeric::order::{max, min};
use obvhs::bvh2::Bvh2;

/// What testing a ray against a block of triangles costs, testing it against a node's boxes being 1.
const BLOCK_COST: f32 = 1.2;

/// Nodes, each before those below it, the first of all the root; and the blocks.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
}

impl Parts {
    /// A new node's index.
    fn node(&mut self) -> u32 {
        self.nodes.push(Node::EMPTY);
        self.nodes.len() as u32 - 1
    }

    /// The child that is a new block of these triangles, one to eight.
    fn block(&mut self, triangles: &[u32]) -> u32 {
        let child = LEAF | (self.blocks.len() * WIDTH + triangles.len() - 1) as u32;
        self.blocks.push(Block::of(triangles));
        child
    }
}

/// How a subtree of the binary tree may be shown, at the least cost.
#[derive(Clone, Copy)]
struct Plan {
    /// For each k from 1: the cost as up to k children, and how many of them are the first half's; 0 for fewer than k.
    shown: [(f32, u8); WIDTH],
    /// Its triangles, as long as a block holds them.
    triangles: u8,
    /// Whether it is a block where it is one child.
    block: bool,
}

/// Nodes and blocks of eight from nodes of two, so that a ray is expected to do the least: the cost of a subtree that may
/// show itself as up to k children is the least over all ways to divide k among its two halves, or, as one child, its
/// box's area times the cost of a block, or that of a node and the cost of its halves as eight (Ylitie, Karras and Laine
/// 2017, §3.1).
pub(super) fn collapse(binary: &Bvh2) -> Parts {
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
    let mut plans = vec![Plan { shown: [(0.0, 0); WIDTH], triangles: 1, block: true }; binary.nodes.len()];
    for node in order.iter().rev().copied() {
        let area = binary.nodes[node].aabb().half_area();
        if binary.nodes[node].is_leaf() {
            plans[node].shown = [(area * BLOCK_COST, 0); WIDTH];
            continue;
        }
        let [a, b] = children(node).map(|child| plans[child]);
        let plan = &mut plans[node];
        for count in 2..=WIDTH {
            let divided =
                (1..count).map(|first| (a.shown[first - 1].0 + b.shown[count - first - 1].0, first as u8));
            let best =
                divided.fold((f32::INFINITY, 0), |best, next| if next.0 < best.0 { next } else { best });
            let fewer = plan.shown[count - 2].0;
            plan.shown[count - 1] = if count > 2 && fewer <= best.0 { (fewer, 0) } else { best };
        }
        plan.triangles = min(a.triangles + b.triangles, WIDTH as u8 + 1);
        let (node, block) = (area + plan.shown[WIDTH - 1].0, area * BLOCK_COST);
        plan.block = usize::from(plan.triangles) <= WIDTH && block <= node;
        plan.shown[0] = (if plan.block { block } else { node }, 0);
    }
    let mut parts = Parts::default();
    let mut open = vec![(0, parts.node())]; // a binary node and the node that it becomes
    while let Some((from, to)) = open.pop() {
        let mut shown = Vec::with_capacity(WIDTH);
        // Subtrees, and as how many children each may show itself.
        let mut subtrees = vec![(from, WIDTH)];
        while let Some((node, mut count)) = subtrees.pop() {
            while count > 2 && plans[node].shown[count - 1].1 == 0 && !binary.nodes[node].is_leaf() {
                count -= 1;
            }
            if binary.nodes[node].is_leaf() || (count == 1 && node != from) {
                shown.push(node);
            } else {
                let first = usize::from(plans[node].shown[count - 1].1);
                let [a, b] = children(node);
                subtrees.extend([(b, count - first), (a, first)]);
            }
        }
        for (lane, child) in shown.into_iter().enumerate() {
            parts.nodes[to as usize].children[lane] = if plans[child].block {
                let (mut triangles, mut subtrees) = (Vec::with_capacity(WIDTH), vec![child]);
                while let Some(node) = subtrees.pop() {
                    if binary.nodes[node].is_leaf() {
                        triangles.push(binary.primitive_indices[binary.nodes[node].first_index as usize]);
                    } else {
                        subtrees.extend(children(node));
                    }
                }
                parts.block(&triangles)
            } else {
                let node = parts.node();
                open.push((child, node));
                node
            };
        }
    }
    parts
}

/// The levels of nodes of a tree.
pub(super) fn levels(nodes: &[Node]) -> usize {
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
pub(super) fn balanced(order: &[u32]) -> Parts {
    let mut parts = Parts::default();
    let mut open = vec![(order, parts.node())];
    while let Some((order, to)) = open.pop() {
        let part = max(order.len().div_ceil(WIDTH), WIDTH);
        for (lane, order) in order.chunks(part).enumerate() {
            parts.nodes[to as usize].children[lane] = if part == WIDTH {
                parts.block(order)
            } else {
                let node = parts.node();
                open.push((order, node));
                node
            };
        }
    }
    parts
}

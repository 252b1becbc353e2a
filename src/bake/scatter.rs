//! Multiple scattering in a translucent solid: the dipole integrated over the mesh.
//!
//! B(x) = ∫ R_d(|x − x'|) E(x') dA' (Jensen, Marschner, Levoy and Hanrahan 2001, Eq. 4 and 5; as transfer:
//! Wang, Tran and Luebke 2005), where E is the transfer of the irradiance that enters
//! ([`super::irradiance`]). A vertex stands for a third of each triangle around it. To other vertices this
//! area is a point. To the vertex itself it is a disc of that area, over which the kernel has a closed
//! integral. So where light spreads less than the mesh resolves, each vertex returns R_d of what it receives,
//! as it should, and not the kernel's peak times some area.
//!
//! So the middle of an evenly lit sheet returns R_d where the vertices' cells are far below a mean free path
//! 1/σ't, or far above. In between, a point stands badly for a cell, and up to a ninth is missing: most at
//! two to three mean free paths, and with little absorption still a twentieth at ten.
//!
//! The sum over all pairs is quadratic. Far vertices can be taken together in an octree (Jensen and Buhler
//! 2002): a node of area A at distance d whose A/d² is less than `spread` counts as one point, its irradiance
//! weighted by area. `spread` = 0 opens every node and is the sum over all pairs.

use super::RUN;
use crate::numeric::lanes::wide;
use crate::numeric::order::max;
use crate::numeric::parallel;
use crate::numeric::single::exp;
use crate::world::medium::{Dipole, Medium};
use crate::world::mesh::Mesh;
use glam::{DVec3, Vec3};
use std::f64::consts::FRAC_1_PI;

/// The most vertices of a leaf that could be split.
const LEAF: usize = 8;

/// Levels of the octree: bits of a coordinate.
const LEVELS: u32 = 21;

/// What leaves each vertex after multiple scattering, RGB, `[vertices][bands²][3]`: B/π, so that times L, and
/// times Fresnel's transmittance towards the eye, it is radiance.
///
/// `irradiance` has `functions` = bands² items a vertex; `medium` is in the mesh's unit. `spread` is the
/// largest solid angle of a node that counts as one point, 0 for none; about 0.1 keeps the error below a
/// percent.
///
/// # Panics
/// Where `irradiance` has another length, or `spread` is negative or no number.
pub fn multiple_scattering(
    mesh: &Mesh,
    irradiance: &[f32],
    functions: usize,
    medium: &Medium,
    spread: f32,
) -> Vec<f32> {
    assert_eq!(irradiance.len(), mesh.positions.len() * functions, "{functions} items a vertex");
    assert!(spread >= 0.0, "a solid angle");
    let areas = areas(mesh);
    let tree = Tree::new(mesh, &areas, irradiance, functions);
    let mut result = vec![0.0; irradiance.len() * 3];
    parallel::for_each_chunk(&mut result, RUN * functions * 3, |run, rows| {
        let mut sums = vec![0.0; functions * 3];
        for (index, row) in rows.chunks_exact_mut(functions * 3).enumerate() {
            let vertex = run * RUN + index;
            if areas[vertex] == 0.0 {
                continue; // no surface
            }
            sums.fill(0.0);
            tree.gather(vertex, medium, spread, &mut sums);
            for (channel, sums) in sums.chunks_exact(functions).enumerate() {
                for (function, sum) in sums.iter().enumerate() {
                    row[function * 3 + channel] = (sum * FRAC_1_PI) as f32;
                }
            }
        }
    });
    result
}

/// A third of the area of the triangles around each vertex.
fn areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize].as_dvec3());
        let area = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|&corner| areas[corner as usize] += area);
    }
    areas
}

/// The integral of a dipole's kernel over a disc of area `area` about the point itself.
///
/// With s² = r² + z², z e^(−σs)/s is an antiderivative of −z (σs + 1) e^(−σs)/s³ in r²/2.
fn disc(dipole: &Dipole, area: f64) -> f64 {
    let square = area * FRAC_1_PI;
    let source = |z: f32| {
        let (z, sigma) = (f64::from(z), f64::from(dipole.extinction));
        let s = (square + z * z).sqrt();
        let decay = |s: f64| f64::from(exp((-sigma * s) as f32));
        decay(z) - z / s * decay(s)
    };
    0.5 * f64::from(dipole.albedo) * (source(dipole.real) + source(dipole.virtual_))
}

/// A cube of the octree, or a vertex.
struct Node {
    /// Mean position of the area.
    position: Vec3,
    area: f32,
    /// The cube around the vertices of the node: its middle and half its diagonal.
    middle: Vec3,
    reach: f32,
    /// The vertices below, as a range of the tree's order.
    first: u32,
    last: u32,
    /// The nodes below; none for a leaf.
    children: Vec<u32>,
}

struct Tree {
    nodes: Vec<Node>,
    /// Area times irradiance of each node, `[nodes][functions]`.
    power: Vec<f32>,
    /// The vertices with an area along the Morton curve.
    order: Vec<u32>,
    /// Area times irradiance of those, `[order][functions]`.
    own: Vec<f32>,
    positions: Vec<Vec3>,
    areas: Vec<f64>,
    functions: usize,
}

impl Tree {
    fn new(mesh: &Mesh, areas: &[f64], irradiance: &[f32], functions: usize) -> Self {
        let bounds = mesh.bounds();
        let size = bounds.high - bounds.low;
        let side = f64::from(max(max(size.x, size.y), size.z));
        let key = |vertex: u32| {
            let p = (mesh.positions[vertex as usize].as_dvec3() - bounds.low.as_dvec3()) / side;
            let most = f64::from((1_u32 << LEVELS) - 1);
            p.to_array().iter().enumerate().fold(0, |key, (axis, x)| key | spaced((x * most) as u64) << axis)
        };
        let mut keyed: Vec<(u64, u32)> = (0..mesh.positions.len() as u32)
            .filter(|vertex| areas[*vertex as usize] > 0.0)
            .map(|vertex| (key(vertex), vertex))
            .collect();
        keyed.sort_unstable();
        let order: Vec<u32> = keyed.iter().map(|(_, vertex)| *vertex).collect();
        let row = |vertex: u32| {
            let start = vertex as usize * functions;
            let area = areas[vertex as usize] as f32;
            irradiance[start..start + functions].iter().map(move |e| area * e)
        };
        let own = order.iter().flat_map(|vertex| row(*vertex)).collect();
        let mut tree = Self {
            nodes: Vec::new(),
            power: Vec::new(),
            order,
            own,
            positions: mesh.positions.clone(),
            areas: areas.to_vec(),
            functions,
        };
        tree.grow(&keyed, 0, keyed.len(), LEVELS);
        tree
    }

    /// Makes the node of the keys from `first` to `last`, which agree above `level`, and those below it.
    fn grow(&mut self, keys: &[(u64, u32)], first: usize, last: usize, level: u32) -> u32 {
        let index = self.nodes.len();
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (mut mean, mut area) = (DVec3::ZERO, 0.0);
        let mut power = vec![0.0; self.functions];
        for at in first..last {
            let vertex = self.order[at] as usize;
            let position = self.positions[vertex];
            low = crate::numeric::order::min3(low, position);
            high = crate::numeric::order::max3(high, position);
            mean += position.as_dvec3() * self.areas[vertex];
            area += self.areas[vertex];
            let own = &self.own[at * self.functions..(at + 1) * self.functions];
            power.iter_mut().zip(own).for_each(|(sum, e)| *sum += f64::from(*e));
        }
        self.nodes.push(Node {
            position: (mean / area).as_vec3(),
            area: area as f32,
            middle: (low + high) * 0.5,
            reach: (high - low).length() * 0.5,
            first: first as u32,
            last: last as u32,
            children: Vec::new(),
        });
        self.power.extend(power.iter().map(|sum| *sum as f32));
        if last - first > LEAF && level > 0 {
            let digit = |key: u64| key >> (3 * (level - 1)) & 7;
            let mut children = Vec::new();
            let mut start = first;
            for eighth in 0..8 {
                let end = start + keys[start..last].partition_point(|(key, _)| digit(*key) <= eighth);
                if end > start {
                    children.push(self.grow(keys, start, end, level - 1));
                }
                start = end;
            }
            self.nodes[index].children = children;
        }
        index as u32
    }

    /// Adds what `vertex` receives, `[3][functions]`.
    fn gather(&self, vertex: usize, medium: &Medium, spread: f32, sums: &mut [f64]) {
        let at = self.positions[vertex];
        let functions = self.functions;
        let mut open = vec![0_u32];
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            let square = (node.position - at).length_squared();
            let outside = (node.middle - at).length_squared() > node.reach * node.reach;
            if outside && node.area < spread * square {
                let start = index as usize * functions;
                let kernel = medium.dipoles.map(|dipole| dipole.kernel(square.sqrt()));
                add(sums, kernel, &self.power[start..start + functions]);
            } else if node.children.is_empty() {
                for place in node.first as usize..node.last as usize {
                    let other = self.order[place] as usize;
                    let kernel = if other == vertex {
                        let area = self.areas[vertex];
                        medium.dipoles.map(|dipole| (disc(&dipole, area) / area) as f32)
                    } else {
                        let d = (self.positions[other] - at).length();
                        medium.dipoles.map(|dipole| dipole.kernel(d))
                    };
                    add(sums, kernel, &self.own[place * functions..(place + 1) * functions]);
                }
            } else {
                // In reverse, since the last that is pushed is visited first: so children come in their
                // order.
                open.extend(node.children.iter().rev());
            }
        }
    }
}

/// The bits of a coordinate, with two zeros between neighbours.
fn spaced(x: u64) -> u64 {
    (0..LEVELS).fold(0, |spaced, bit| spaced | (x >> bit & 1) << (3 * bit))
}

wide! {
    /// Adds a row to each of three sums, times that sum's weight.
    fn add(sums: &mut [f64], weights: [f32; 3], row: &[f32]) {
        for (sums, weight) in sums.chunks_exact_mut(row.len()).zip(weights) {
            for (sum, x) in sums.iter_mut().zip(row) {
                *sum += f64::from(weight) * f64::from(*x);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn the_disc_is_the_kernel_integrated() {
        let dipole = Dipole::new(2.62, 0.0041, 1.5);
        for radius in [0.1, 1.0, 10.0, 1000.0] {
            let steps = 100_000;
            let sum = (0..steps).fold(0.0, |sum, i| {
                let r = radius * (f64::from(i) + 0.5) / f64::from(steps);
                sum + f64::from(dipole.kernel(r as f32)) * 2.0 * PI * r * radius / f64::from(steps)
            });
            let found = disc(&dipole, PI * radius * radius);
            assert!((found / sum - 1.0).abs() < 1e-4, "radius {radius}: {found} against {sum}");
        }
        assert!((disc(&dipole, 1e12) - f64::from(dipole.reflectance())).abs() < 1e-5);
    }
}

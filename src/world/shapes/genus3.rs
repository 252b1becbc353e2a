//! A smooth solid with three handles.

use glam::{DVec3, Vec3};

use super::{check, subdivide};
use crate::Error;
use crate::numeric::{double, parallel};
use crate::world::mesh::Mesh;

/// The finest [`genus3`]: 9 million triangles.
pub const MAX_GENUS3_RESOLUTION: usize = 64;

/// Point sources along each of the six arcs: at a spacing of half the kernel's width the sum ripples by
/// e^−4π, 3e-6 of itself, about the integral.
const SOURCES: usize = 24;

/// Width of a source's kernel.
const WIDTH: f64 = 0.16;

/// The field's value on the surface.
const LEVEL: f64 = 0.5;

/// Cells along each side of the grid that the base mesh is found on.
const CELLS: usize = 20;

/// Half the side of that grid: the solid lies well inside.
const HALF_SIDE: f64 = 1.5;

/// Rounds of evening out the base mesh.
const ROUNDS: usize = 30;

/// Newton steps onto the surface; each about doubles the digits of an offset that is at most a cell.
const STEPS: usize = 4;

/// Vertices projected at a time.
const CHUNK: usize = 256;

/// A smooth solid of genus 3: a hollow ball with four windows, the thickened edges of a tetrahedron that is
/// blown up to the unit sphere, blended smoothly where three meet.
///
/// The surface is a level set of the sum of Cauchy kernels 1/(1 + r²/w²)² along six great arcs (a convolution
/// surface: Bloomenthal and Shoemake 1991, with the kernel of McCormack and Sherstyuk 1998), so it has
/// derivatives of every order; the normals are the field's gradient. Naive surface nets (Gibson 1998) on a
/// fixed grid, evened out, make one base mesh of genus 3, whose triangles are then cut into `resolution`²
/// each and projected onto the surface: the genus is the same at every resolution.
///
/// The base mesh has 1,086 vertices and 2,180 triangles.
///
/// # Errors
/// If `resolution` is not in 1 to [`MAX_GENUS3_RESOLUTION`].
pub fn genus3(resolution: usize) -> Result<Mesh, Error> {
    check("genus-3 solid's resolution", resolution, 1, MAX_GENUS3_RESOLUTION)?;
    let field = Field::new();
    let (corners, faces) = base(&field);
    let (mut points, triangles) = subdivide(&corners, &faces, resolution);
    field.project(&mut points, STEPS);
    let normals = parallel::map(points.len(), |i| (field.at(points[i]).1 * -1.0).as_vec3());
    Mesh::new(points.into_iter().map(DVec3::as_vec3).collect::<Vec<Vec3>>(), Some(normals), triangles)
}

struct Field {
    sources: Vec<DVec3>,
}

impl Field {
    fn new() -> Self {
        // A tetrahedron in the unit sphere that stands on a face.
        let (low, wide) = (-1.0 / 3.0, 8.0_f64.sqrt() / 3.0);
        let half = wide * 3.0_f64.sqrt() / 2.0;
        let corners = [
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::new(0.0, low, wide),
            DVec3::new(half, low, -wide / 2.0),
            DVec3::new(-half, low, -wide / 2.0),
        ];
        let angle = double::acos(low);
        let mut sources = Vec::new();
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1)] {
            sources.extend((0..SOURCES).map(|k| {
                let t = (k as f64 + 0.5) / SOURCES as f64;
                let [from, to] = [(1.0 - t) * angle, t * angle].map(double::sin);
                (corners[a] * from + corners[b] * to) / double::sin(angle)
            }));
        }
        Self { sources }
    }

    /// The field at `point` less its level (positive inside), and its gradient.
    fn at(&self, point: DVec3) -> (f64, DVec3) {
        self.sources.iter().fold((-LEVEL, DVec3::ZERO), |(value, gradient), &source| {
            let offset = point - source;
            let inverse = 1.0 / (1.0 + offset.length_squared() / (WIDTH * WIDTH));
            let kernel = inverse * inverse;
            (value + kernel, gradient - offset * (4.0 / (WIDTH * WIDTH) * kernel * inverse))
        })
    }

    /// Moves the points onto the surface along the gradient.
    fn project(&self, points: &mut [DVec3], steps: usize) {
        parallel::for_each_chunk(points, CHUNK, |_, chunk| {
            for point in chunk {
                for _ in 0..steps {
                    let (value, gradient) = self.at(*point);
                    *point -= gradient * (value / gradient.length_squared());
                }
            }
        });
    }
}

/// The base mesh: surface nets, evened out.
fn base(field: &Field) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut points, quads) = surface_nets(field);
    for _ in 0..ROUNDS {
        let mut sums = vec![(DVec3::ZERO, 0.0); points.len()];
        for quad in &quads {
            for k in 0..4 {
                let sum = &mut sums[quad[k] as usize];
                sum.0 = sum.0 + points[quad[(k + 1) % 4] as usize] + points[quad[(k + 3) % 4] as usize];
                sum.1 += 2.0;
            }
        }
        points = sums.into_iter().map(|(sum, count)| sum / count).collect();
        field.project(&mut points, 2);
    }
    let mut triangles = Vec::with_capacity(2 * quads.len());
    for [a, b, c, d] in quads {
        let diagonal = |from: u32, to: u32| (points[from as usize] - points[to as usize]).length_squared();
        triangles.extend(if diagonal(a, c) <= diagonal(b, d) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        });
    }
    (points, triangles)
}

/// One vertex in each cell that the surface passes, at the mean of where it crosses the cell's edges; one
/// quad around each crossed edge of the grid, counter-clockwise seen from outside.
fn surface_nets(field: &Field) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let side = CELLS + 1;
    let strides = [1, side, side * side];
    let coordinates = |node: usize| strides.map(|stride| node / stride % side);
    let place = |node: usize| {
        let [x, y, z] = coordinates(node).map(|c| (2.0 * c as f64 / CELLS as f64 - 1.0) * HALF_SIDE);
        DVec3::new(x, y, z)
    };
    let values = parallel::map(side * side * side, |node| field.at(place(node)).0);
    // A cell is numbered by its lowest node.
    let mut crossings = vec![(DVec3::ZERO, 0.0); values.len()];
    let mut around = Vec::new();
    for node in 0..values.len() {
        for axis in 0..3 {
            // No crossing lies on the grid's border, so the four cells around the edge exist.
            if coordinates(node)[axis] == CELLS
                || (values[node] > 0.0) == (values[node + strides[axis]] > 0.0)
            {
                continue;
            }
            let next = node + strides[axis];
            let along = values[node] / (values[node] - values[next]);
            let crossing = place(node) + (place(next) - place(node)) * along;
            let [u, v] = [strides[(axis + 1) % 3], strides[(axis + 2) % 3]];
            let cells = [node - u - v, node - v, node, node - u];
            for cell in cells {
                crossings[cell].0 += crossing;
                crossings[cell].1 += 1.0;
            }
            let [a, b, c, d] = cells;
            around.push(if values[node] > 0.0 { cells } else { [d, c, b, a] });
        }
    }
    let mut vertex = vec![0; crossings.len()];
    let mut points = Vec::new();
    for (cell, (sum, count)) in crossings.into_iter().enumerate() {
        if count > 0.0 {
            vertex[cell] = points.len() as u32;
            points.push(sum / count);
        }
    }
    (points, around.into_iter().map(|cells| cells.map(|cell| vertex[cell])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn has_three_handles_at_every_resolution() {
        for resolution in [1, 2, 3, 5, 8] {
            let mesh = genus3(resolution).unwrap();
            super::super::tests::check_shape(&mesh, -4, 0.7);
            assert_eq!(mesh.triangles.len(), 2180 * resolution * resolution);
        }
    }

    #[test]
    fn lies_on_its_field_and_its_gradient_is_the_fields() {
        let field = Field::new();
        let mesh = genus3(3).unwrap();
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals).step_by(37) {
            let point = DVec3::from(*position);
            let (value, gradient) = field.at(point);
            assert!((value / gradient.length()).abs() < 1e-6, "{position} is off the surface by {value}");
            for axis in Vec3::AXES.map(DVec3::from) {
                let slope = (field.at(point + axis * 1e-5).0 - field.at(point - axis * 1e-5).0) / 2e-5;
                assert!((slope - gradient.dot(axis)).abs() < 1e-5 * gradient.length());
            }
            assert!(DVec3::from(*normal).dot(gradient) < 0.0);
        }
    }

    #[test]
    fn its_triangles_are_well_shaped() {
        let mesh = genus3(4).unwrap();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let sides = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
            // 1 for an equilateral triangle, 0 for a sliver (Bank and Smith 1997).
            let quality = 2.0 * 3.0_f32.sqrt() * (b - a).cross(c - a).length() / sides;
            assert!(quality > 0.3, "{triangle:?}: {quality}");
        }
    }
}

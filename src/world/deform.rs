//! Solids that move: the sine deformer of fig. 12 (Banterle and Chalmers).
//!
//! The paper calls it "a function of time and z coordinate" and says no more. Here a transverse wave runs along z and
//! displaces x, which leaves volumes as they are (the Jacobian's determinant is 1) and has normals in closed form.

use super::mesh::Mesh;
use crate::Error;
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::{parallel, turns::sin_cos};
use glam::Vec3;
use std::f64::consts::TAU;

/// Vertices that one thread deforms together.
const RUN: usize = 64 * BLOCK;

/// x′ = x + amplitude · sin 2π(z / length + time / period), in the world's own axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// The largest displacement, in the scene's unit; 0 leaves a solid as it is, to the bit.
    pub amplitude: f64,
    /// From crest to crest along z, in the scene's unit.
    pub length: f64,
    /// From crest to crest in time, in seconds; the crests run towards −z.
    pub period: f64,
}

impl Wave {
    /// The solid as the wave deforms it at `time`, in seconds.
    ///
    /// # Errors
    /// If a vertex leaves the range of coordinates or the solid loses its last area.
    pub fn apply(&self, solid: &Mesh, time: f64) -> Result<Mesh, Error> {
        if self.amplitude == 0.0 {
            return Ok(solid.clone());
        }
        let mut vertices: Vec<_> =
            solid.positions.iter().copied().zip(solid.normals.iter().copied()).collect();
        parallel::for_each_chunk(&mut vertices, RUN, |_, vertices| deform(self, time, vertices));
        let (positions, normals) = vertices.into_iter().unzip();
        Mesh::new(positions, Some(normals), solid.triangles.clone())
    }

    /// A vertex and its unit normal, deformed. The map's Jacobian has a 1 at each place of the diagonal and the slope
    /// s = ∂x′/∂z beside it; its inverse transpose takes (x, y, z) to (x, y, z − s x).
    #[inline(always)]
    fn vertex(&self, position: Vec3, normal: Vec3, time: f64) -> (Vec3, Vec3) {
        let (sin, cos) = sin_cos(f64::from(position.z) / self.length + time / self.period);
        let moved = (f64::from(position.x) + self.amplitude * sin) as f32;
        let slope = self.amplitude * (TAU / self.length) * cos;
        let [x, y] = [f64::from(normal.x), f64::from(normal.y)];
        let z = f64::from(normal.z) - slope * x;
        let shrunk = 1.0 / (x * x + y * y + z * z).sqrt();
        let turned = Vec3::new((x * shrunk) as f32, (y * shrunk) as f32, (z * shrunk) as f32);
        (Vec3 { x: moved, ..position }, turned)
    }
}

wide! {
    /// Deforms positions and normals.
    fn deform(wave: &Wave, time: f64, vertices: &mut [(Vec3, Vec3)]) {
        let mut lanes = [[0.0_f32; BLOCK]; 6];
        for vertices in vertices.chunks_mut(BLOCK) {
            for (lane, (p, n)) in vertices.iter().enumerate() {
                for (lanes, value) in lanes.iter_mut().zip([p.x, p.y, p.z, n.x, n.y, n.z]) {
                    lanes[lane] = value;
                }
            }
            for lane in 0..BLOCK {
                let three = |first: usize| Vec3::new(lanes[first][lane], lanes[first + 1][lane], lanes[first + 2][lane]);
                let (position, normal) = wave.vertex(three(0), three(3), time);
                lanes[0][lane] = position.x;
                (lanes[3][lane], lanes[4][lane], lanes[5][lane]) = normal.into();
            }
            for (lane, (p, n)) in vertices.iter_mut().enumerate() {
                p.x = lanes[0][lane];
                *n = Vec3::new(lanes[3][lane], lanes[4][lane], lanes[5][lane]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::shapes;

    const WAVE: Wave = Wave { amplitude: 0.3, length: 1.7, period: 2.5 };

    /// The deformed surface's tangents by central differences of the undeformed one's, at every vertex.
    #[test]
    fn normals_are_perpendicular_to_the_deformed_tangents() {
        let rest = shapes::sphere(12).unwrap();
        for time in [0.0, 0.4, -7.3, 1234.5] {
            let (step, mut turned) = (1e-3_f32, 0.0_f64);
            for (p, n) in rest.positions.iter().zip(&rest.normals) {
                let along = n.any_orthonormal_pair();
                let (_, found) = WAVE.vertex(*p, *n, time);
                assert!((found.length() - 1.0).abs() < 1e-6);
                let tangent = |t: Vec3| {
                    let [ahead, behind] = [*p + t * step, *p - t * step].map(|p| WAVE.vertex(p, *n, time).0);
                    (ahead - behind).normalize()
                };
                let tangents = [tangent(along.0), tangent(along.1)];
                for tangent in tangents {
                    // f32 places over a step of 10⁻³: 10⁻⁴.
                    assert!(found.dot(tangent).abs() < 5e-4, "{p} at {time}: {}", found.dot(tangent));
                }
                // And outward still.
                assert!(tangents[0].cross(tangents[1]).dot(found) * along.0.cross(along.1).dot(*n) > 0.5);
                turned = crate::numeric::order::max(turned, f64::from(found.distance(*n)));
            }
            assert!(turned > 0.3, "the wave turns normals by {turned}");
        }
    }

    #[test]
    fn a_wave_moves_x_alone_and_repeats_after_its_length_and_its_period() {
        let rest = shapes::sphere(6).unwrap();
        let at = |time: f64| WAVE.apply(&rest, time).unwrap();
        let (first, later) = (at(0.25), at(0.25 + 4.0 * WAVE.period));
        let mut widest = 0.0_f32;
        for (index, p) in rest.positions.iter().enumerate() {
            let moved = first.positions[index];
            assert_eq!((moved.y, moved.z), (p.y, p.z));
            let expected =
                p.x + 0.3 * crate::numeric::single::sin(std::f32::consts::TAU * (p.z / 1.7 + 0.25 / 2.5));
            assert!((moved.x - expected).abs() < 1e-6);
            assert!(moved.distance(later.positions[index]) < 1e-6);
            widest = crate::numeric::order::max(widest, (moved.x - p.x).abs());
        }
        assert!(widest > 0.29, "{widest}");
        let crest = Vec3::new(0.0, 0.0, 0.425); // a quarter of the length
        assert!((WAVE.vertex(crest, Vec3::X, 0.0).0.x - 0.3).abs() < 1e-6);
        assert!((WAVE.vertex(crest + Vec3::Z * 1.7, Vec3::X, 0.0).0.x - 0.3).abs() < 1e-6);
        let facts = (rest.facts(), first.facts());
        assert!((facts.0.signed_volume - facts.1.signed_volume).abs() < 0.01 * facts.0.signed_volume);
    }

    #[test]
    fn no_amplitude_changes_no_bit() {
        let mut rest = shapes::torus_knot(2, 3, 0.35, 40, 5).unwrap();
        rest.positions[0].x = -0.0; // plus 0 it would lose its sign
        let solid = Wave { amplitude: 0.0, ..WAVE }.apply(&rest, 0.7).unwrap();
        let bits = |of: &[Vec3]| of.iter().map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>();
        assert_eq!(bits(&solid.positions), bits(&rest.positions));
        assert_eq!(bits(&solid.normals), bits(&rest.normals));
    }

    #[test]
    fn a_wave_out_of_range_is_refused() {
        let rest = shapes::sphere(3).unwrap();
        assert!(Wave { amplitude: 1e19, ..WAVE }.apply(&rest, 0.1).is_err());
    }
}

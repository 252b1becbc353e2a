//! Solids that move: the sine deformer of fig. 12 (Banterle and Chalmers), and a bend, whose swing gives a
//! range of poses without a skeleton.
//!
//! The paper calls the deformer "a function of time and z coordinate" and says no more. Here a transverse
//! wave runs along z and displaces x. It leaves volumes as they are (the Jacobian's determinant is 1) and has
//! normals in closed form.

use super::mesh::Mesh;
use crate::Error;
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::{double, parallel, turns::sin_cos};
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

    /// A vertex and its unit normal, deformed. The map's Jacobian has a 1 at each place of the diagonal and
    /// the slope s = ∂x′/∂z beside it; its inverse transpose takes (x, y, z) to (x, y, z − s x).
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

/// Bends what stands along y into an arc of constant curvature κ in the plane of x and y.
///
/// With s = y − root and φ = κ s, the line of centres x = 0 becomes ((1 − cos φ) / κ, root + sin φ / κ), and
/// a point at x stays that far from it, across: x′ = (1 − cos φ) / κ + x cos φ, y′ = root + sin φ / κ − x sin
/// φ, z′ = z. Below the root it bends to the same side. κ(t) = angle / length · sin 2πt / period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// Degrees by which `length` is turned at the height of the swing; 0 leaves a solid as it is, to the bit.
    pub angle: f64,
    /// In the scene's unit.
    pub length: f64,
    /// The height y that stays where it is, in the scene's unit.
    pub root: f64,
    /// Seconds until the solid has swung to both sides and back.
    pub period: f64,
}

impl Bend {
    /// The solid as it is bent at `time`, in seconds.
    ///
    /// # Errors
    /// Where a vertex lies beyond the centre of the arc, so that the solid would be turned inside out there,
    /// and where one leaves the range of coordinates.
    pub fn apply(&self, solid: &Mesh, time: f64) -> Result<Mesh, Error> {
        let curvature = self.angle * (TAU / 360.0) / self.length * sin_cos(time / self.period).0;
        if self.angle == 0.0 {
            return Ok(solid.clone());
        }
        let mut vertices: Vec<_> =
            solid.positions.iter().copied().zip(solid.normals.iter().copied()).collect();
        if solid.used_positions().any(|p| 1.0 - curvature * f64::from(p.x) <= 0.0) {
            return Err(Error::new("bends the solid into itself: it reaches beyond the centre of the arc")
                .remedy("bend by a smaller angle, or over a greater bend.length"));
        }
        parallel::for_each_chunk(&mut vertices, RUN, |_, vertices| {
            vertices.iter_mut().for_each(|(p, n)| (*p, *n) = self.vertex(*p, *n, curvature));
        });
        let (positions, normals) = vertices.into_iter().unzip();
        Mesh::new(positions, Some(normals), solid.triangles.clone())
    }

    /// A vertex and its unit normal, bent. The map turns by φ and stretches along the arc by 1 − κx, so the
    /// normal's part along the arc shrinks by that.
    fn vertex(&self, position: Vec3, normal: Vec3, curvature: f64) -> (Vec3, Vec3) {
        let [x, s] = [f64::from(position.x), f64::from(position.y) - self.root];
        let phi = curvature * s;
        let (sin, cos) = (double::sin(phi), double::cos(phi));
        // sin φ / κ = s sin φ / φ, and (1 − cos φ) / κ = s sin²(φ/2) / (φ/2): which also hold without
        // curvature.
        let ratio = |angle: f64| if angle == 0.0 { 1.0 } else { double::sin(angle) / angle };
        let (along, across) = (s * ratio(phi), s * ratio(0.5 * phi) * double::sin(0.5 * phi));
        let bent = Vec3::new((across + x * cos) as f32, (self.root + along - x * sin) as f32, position.z);
        let stretch = 1.0 - curvature * x;
        let [nx, ny, nz] =
            [f64::from(normal.x) * stretch, f64::from(normal.y), f64::from(normal.z) * stretch];
        let turned = [nx * cos + ny * sin, ny * cos - nx * sin, nz];
        let length = (turned[0] * turned[0] + turned[1] * turned[1] + nz * nz).sqrt();
        // A normal of length 0, where corners cancel, stays 0.
        let shrunk = if length > 0.0 { 1.0 / length } else { 0.0 };
        (bent, Vec3::from_array(turned.map(|value| (value * shrunk) as f32)))
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

    const BEND: Bend = Bend { angle: 70.0, length: 1.3, root: -0.4, period: 2.5 };

    /// At a quarter of the period the swing is at its height.
    const HEIGHT: f64 = 0.625;

    #[test]
    fn bent_normals_are_perpendicular_to_the_bent_tangents() {
        let rest = shapes::sphere(12).unwrap();
        let curvature = BEND.angle.to_radians() / BEND.length;
        let (step, mut turned) = (1e-3_f32, 0.0_f64);
        for (p, n) in rest.positions.iter().zip(&rest.normals) {
            let (_, found) = BEND.vertex(*p, *n, curvature);
            let along = n.any_orthonormal_pair();
            let tangent = |t: Vec3| {
                let [ahead, behind] = [*p + t * step, *p - t * step].map(|p| BEND.vertex(p, *n, curvature).0);
                (ahead - behind).normalize()
            };
            let tangents = [tangent(along.0), tangent(along.1)];
            for tangent in tangents {
                assert!(found.dot(tangent).abs() < 1e-3, "{p}: {}", found.dot(tangent));
            }
            assert!(tangents[0].cross(tangents[1]).dot(found) * along.0.cross(along.1).dot(*n) > 0.5);
            turned = crate::numeric::order::max(turned, f64::from(found.distance(*n)));
        }
        assert!(turned > 0.7, "the bend turns normals by {turned}");
    }

    #[test]
    fn a_bend_is_an_arc_about_a_centre_that_swings_to_both_sides() {
        let beam = shapes::cuboid(Vec3::new(0.1, 1.0, 0.1), 8).unwrap();
        let [there, back, rest] =
            [HEIGHT, 3.0 * HEIGHT, 2.0 * HEIGHT].map(|time| BEND.apply(&beam, time).unwrap());
        let radius = 1.3 / 70.0_f32.to_radians();
        for (index, p) in beam.positions.iter().enumerate() {
            let center = Vec3::new(radius, -0.4, p.z);
            assert!((there.positions[index].distance(center) - (radius - p.x)).abs() < 1e-6);
            // The other side of the swing is the mirror image of the mirrored beam.
            let mirrored = beam.positions.iter().position(|q| *q == Vec3::new(-p.x, p.y, p.z)).unwrap();
            let image = back.positions[mirrored] * Vec3::new(-1.0, 1.0, 1.0);
            assert!(there.positions[index].distance(image) < 1e-6);
            assert!(rest.positions[index].distance(*p) < 1e-6);
        }
    }

    #[test]
    fn no_angle_changes_no_bit_and_too_great_a_one_is_refused() {
        let rest = shapes::sphere(6).unwrap();
        assert_eq!(Bend { angle: 0.0, ..BEND }.apply(&rest, 0.7).unwrap(), rest);
        let error = Bend { angle: 90.0, ..BEND }.apply(&rest, HEIGHT).unwrap_err().to_string();
        assert!(error.contains("into itself") && error.contains("smaller angle"), "{error}");
        // At rest nothing is bent, however great the angle.
        assert!(Bend { angle: 36e3, ..BEND }.apply(&rest, 0.0).is_ok());
        assert!(Bend { angle: 1.0, length: 1e-9, ..BEND }.apply(&rest, HEIGHT).is_err());
    }
}

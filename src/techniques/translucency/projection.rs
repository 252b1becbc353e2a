//! `translucency.projection`: the cubemap in nine spherical harmonics, E_lm = ∫ E Y_lm dω (Eq. 6, with the
//! basis of Eq. 7, 8 and 9 in the reading of errata T2: sin |m|φ, without the Condon-Shortley phase).
//!
//! To the letter of Eq. 9 the functions with m < 0 have −sin |m|φ, so E₁₋₁, E₂₋₂ and E₂₋₁ have the other
//! sign, which the constants of Eq. 11 do not expect.
//!
//! The integral is a sum over texels: E times the basis at the texel's centre times the texel's exact solid
//! angle. A row is summed from left to right and rows pairwise, in f64, so that the sum's error stays below
//! that of its terms at any size.
//!
//! Several accumulation points (`points`) see the same texels, each in directions and under solid angles of
//! its own.
//!
//! A texel that sees nothing counts as E = 0, as in the paper, so light is lost where the solid does not fill
//! its box: a constant irradiance on a sphere gives 0.879 of the c00 that it gives on a box.

use super::Frame;
use super::cubemap::FACES;
use crate::keys::Reading;
use crate::numeric::{double::atan2, parallel, sum::sum};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};
use crate::sphere::sh;
use glam::DVec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.projection",
        equation: "Eq. 6 with Eq. 7-9; T2",
        about: "nine spherical-harmonic coefficients of the entering irradiance for each accumulation point; a single point \
            has no axis",
        inputs: &["translucency.transmit"],
        axes: &[Axis::Light, Axis::Several("point"), Axis::Coefficient, RGB],
        unit: "irradiance",
        knob: "translucency.accumulation",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let transmit = inputs.get("translucency.transmit");
    let size = frame.settings.cubemap;
    let (lights, points) = (frame.stage.lights.len(), frame.points.count());
    let mut values = vec![0.0; lights * points * 27];
    for point in 0..points {
        let (scale, place) = (frame.points.scale().as_dvec3(), frame.points.place(point).as_dvec3());
        let basis = Basis::new(size, scale, place, frame.settings.reading);
        for light in 0..lights {
            let cube = transmit.slice(light).as_chunks::<3>().0;
            let rows = parallel::map(6 * size, |row| {
                let mut total = [0.0; 27];
                for (x, rgb) in cube[row * size..][..size].iter().enumerate() {
                    // Most texels of a solid lit from one side add nothing.
                    if *rgb == [0.0; 3] {
                        continue;
                    }
                    let rgb = rgb.map(f64::from);
                    for (total, weight) in total.as_chunks_mut::<3>().0.iter_mut().zip(basis.texel(row, x)) {
                        for (total, value) in total.iter_mut().zip(rgb) {
                            *total += weight * value;
                        }
                    }
                }
                total
            });
            for term in 0..27 {
                let column: Vec<f64> = rows.iter().map(|row| row[term]).collect();
                values[(light * points + point) * 27 + term] = sum(&column) as f32;
            }
        }
    }
    Buffer::f32(&frame.points.shape(lights, &[9, 3]), values)
}

/// The basis functions at the texels of the six faces, as an accumulation point sees them.
struct Basis {
    size: usize,
    /// The cube ±1 is scaled by `scale`, in which the point is at `place`.
    scale: DVec3,
    place: DVec3,
    evaluate: fn(usize, [f64; 3], &mut [f64]),
    /// For each face, or for all where they are alike, an antiderivative of the solid angle at the texels'
    /// corners.
    corners: Vec<Vec<f64>>,
}

impl Basis {
    fn new(size: usize, scale: DVec3, place: DVec3, reading: Reading) -> Self {
        let evaluate = match reading {
            Reading::Corrected => sh::evaluate,
            Reading::Paper => sh::evaluate_as_printed,
        };
        let corner = |index: usize| 2.0 * index as f64 / size as f64 - 1.0;
        let corners_of = |face: usize| -> Vec<f64> {
            let [right, up] = FACES[face].map(|axis| axis.as_dvec3());
            let ahead = right.cross(up);
            let extent = |axis: DVec3| scale.dot(axis.abs());
            // ∫∫ d (d² + u² + v²)^(−3/2) du dv at distance d, by which a rectangle's solid angle is four
            // differences.
            let d = extent(ahead) - place.dot(ahead);
            let integral = |u: f64, v: f64| atan2(u * v, d * (u * u + v * v + d * d).sqrt());
            let at = |x: usize, y: usize| {
                integral(extent(right) * corner(x) - place.dot(right), extent(up) * corner(y) + place.dot(up))
            };
            (0..(size + 1) * (size + 1)).map(|index| at(index % (size + 1), index / (size + 1))).collect()
        };
        // From the middle of a cube all faces look alike.
        let alike = scale == DVec3::ONE && place == DVec3::ZERO;
        let corners = parallel::map(if alike { 1 } else { 6 }, corners_of);
        Self { size, scale, place, evaluate, corners }
    }

    /// Y_lm of the direction from the point to the texel `x` of a row, counted over all faces, times the
    /// solid angle under which the point sees the texel.
    #[inline]
    fn texel(&self, row: usize, x: usize) -> [f64; 9] {
        let (face, y) = (row / self.size, row % self.size);
        let [right, up] = FACES[face].map(|axis| axis.as_dvec3());
        let corners = &self.corners[face % self.corners.len()];
        let at = |x: usize, y: usize| corners[y * (self.size + 1) + x];
        let solid_angle = at(x + 1, y + 1) - at(x, y + 1) - at(x + 1, y) + at(x, y);
        let centre = |index: usize| (2 * index + 1) as f64 / self.size as f64 - 1.0;
        let on_cube = right.cross(up) + right * centre(x) - up * centre(y);
        let direction = (on_cube * self.scale - self.place).normalize();
        let mut values = [0.0; 9];
        (self.evaluate)(3, direction.to_array(), &mut values);
        values.map(|value| value * solid_angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_angles_of_the_cube_are_those_of_the_sphere_from_any_point() {
        for size in [1, 2, 7, 64] {
            let y00 = 0.25 * std::f64::consts::FRAC_1_PI; // Y_00²: Σ Y_00 Ω · Y_00 = 4π Y_00² = 1
            let aside = (DVec3::new(1.0, 4.0, 3.0), DVec3::new(0.0, -3.0, 2.0));
            for (scale, place) in [(DVec3::ONE, DVec3::ZERO), aside] {
                let basis = Basis::new(size, scale, place, Reading::Corrected);
                let texels = (0..6 * size).flat_map(|row| (0..size).map(move |x| (row, x)));
                let total: f64 = texels.map(|(row, x)| basis.texel(row, x)[0]).sum();
                assert!((total * y00.sqrt() - 1.0).abs() < 1e-12, "{size}: {total} from {place}");
            }
        }
    }
}

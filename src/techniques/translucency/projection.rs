//! `translucency.projection`: the cubemap in nine spherical harmonics, E_lm = ∫ E Y_lm dω (Eq. 6, with the basis
//! of Eq. 7, 8 and 9 in the reading of errata T2: sin |m|φ, without the Condon-Shortley phase).
//!
//! To the letter of Eq. 9 the functions with m < 0 have −sin |m|φ, so E₁₋₁, E₂₋₂ and E₂₋₁ have the other sign, which
//! the constants of Eq. 11 do not expect.
//!
//! The integral is a sum over texels: E times the basis at the texel's centre times the texel's exact solid angle.
//! A row is summed from left to right and rows pairwise, in f64, so that the sum's error stays below that of its
//! terms at any size.
//!
//! A texel that sees nothing counts as E = 0, as in the paper, so light is lost where the solid does not fill its box:
//! a constant irradiance on a sphere gives 0.879 of the c00 that it gives on a box.

use super::cubemap::FACES;
use super::{Frame, Reading};
use crate::numeric::{double::atan2, parallel, sum::sum};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
use crate::sphere::sh;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.projection",
        equation: "Eq. 6 with Eq. 7-9; T2",
        about: "nine spherical-harmonic coefficients of the entering irradiance",
        inputs: &["translucency.transmit"],
        axes: &[Axis::Light, Axis::Coefficient, RGB],
        unit: "irradiance",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let transmit = inputs.get("translucency.transmit");
    let size = frame.settings.cubemap;
    let basis = basis(size, frame.settings.reading);
    let mut values = Vec::new();
    for light in 0..frame.lights.len() {
        let cube = transmit.slice(light);
        let rows: Vec<[f64; 27]> = parallel::map(6 * size, |row| {
            let mut total = [0.0; 27];
            for texel in row * size..(row + 1) * size {
                for (coefficient, weight) in basis[texel].iter().enumerate() {
                    for channel in 0..3 {
                        total[coefficient * 3 + channel] += weight * f64::from(cube[texel * 3 + channel]);
                    }
                }
            }
            total
        });
        for term in 0..27 {
            let column: Vec<f64> = rows.iter().map(|row| row[term]).collect();
            values.push(sum(&column) as f32);
        }
    }
    Buffer::f32(&[frame.lights.len(), 9, 3], values)
}

/// For each texel of the six faces, Y_lm of its direction times its solid angle.
fn basis(size: usize, reading: Reading) -> Vec<[f64; 9]> {
    let evaluate = match reading {
        Reading::Corrected => sh::evaluate,
        Reading::Paper => sh::evaluate_as_printed,
    };
    // ∫∫ (1 + u² + v²)^(−3/2) du dv, by which a rectangle's solid angle is four differences.
    let corner = |index: usize| 2.0 * index as f64 / size as f64 - 1.0;
    let integral = |u: f64, v: f64| atan2(u * v, (u * u + v * v + 1.0).sqrt());
    let corners: Vec<f64> = (0..(size + 1) * (size + 1))
        .map(|index| integral(corner(index % (size + 1)), corner(index / (size + 1))))
        .collect();
    let rows = parallel::map(6 * size, |row| {
        let ([right, up], y) = (FACES[row / size].map(|axis| axis.as_dvec3()), row % size);
        let texel = |x: usize| {
            let at = |x: usize, y: usize| corners[y * (size + 1) + x];
            let solid_angle = at(x + 1, y + 1) - at(x, y + 1) - at(x + 1, y) + at(x, y);
            let centre = |index: usize| (2 * index + 1) as f64 / size as f64 - 1.0;
            let direction = (right.cross(up) + right * centre(x) - up * centre(y)).normalize();
            let mut values = [0.0; 9];
            evaluate(3, direction.to_array(), &mut values);
            values.map(|value| value * solid_angle)
        };
        (0..size).map(texel).collect::<Vec<_>>()
    });
    rows.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_angles_of_the_cube_are_those_of_the_sphere() {
        for size in [1, 2, 7, 64] {
            let y00 = 0.25 * std::f64::consts::FRAC_1_PI; // Y_00²: Σ Y_00 Ω · Y_00 = 4π Y_00² = 1
            let total: f64 = basis(size, Reading::Corrected).iter().map(|values| values[0]).sum();
            assert!((total * y00.sqrt() - 1.0).abs() < 1e-12, "{size}: {total}");
        }
    }
}

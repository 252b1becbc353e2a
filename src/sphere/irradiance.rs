//! Irradiance from nine coefficients of radiance as a quadratic form (Banterle and Chalmers, Eq. 10 and Eq.
//! 11; Ramamoorthi and Hanrahan 2001, Eq. 11 and Eq. 12).
//!
//! The irradiance on a plane with the normal r is the convolution Σ A_l E_lm Y_lm(r) of radiance with the
//! clamped cosine, A_0 = π, A_1 = 2π/3, A_2 = π/4. Its polynomials of degree 2 make the form [r, 1]ᵗ M [r,
//! 1]. So the constants below already hold the clamped cosine and expect *radiance*: a constant E in gives πE
//! out. (The paper feeds them irradiance all the same.)

use glam::Vec3;

/// c₁ of Eq. 11: A_2 times the factor of x² − y² in Y_22, √(15π) / 16. Printed 0.429043.
pub const C1: f64 = 0.429_042_765_404_891_67;
/// c₂ of Eq. 11: half of A_1 times the factor of x in Y_11, √(3π) / 6. Printed 0.511664, its last digit too
/// large.
pub const C2: f64 = 0.511_663_353_973_244_3;
/// c₃ of Eq. 11: A_2 times the factor of 3z² in Y_20, 3√(5π) / 16. Printed 0.743125, its last digit too
/// large.
pub const C3: f64 = 0.743_123_868_301_127_1;
/// c₄ of Eq. 11: A_0 Y_00, √π / 2. Printed 0.886227.
pub const C4: f64 = 0.886_226_925_452_757_9;
/// c₅ of Eq. 11: A_2 times the constant of Y_20, √(5π) / 16. Printed 0.247708.
pub const C5: f64 = 0.247_707_956_100_375_7;

/// c₁ to c₅ as Eq. 11 prints them.
pub const AS_PRINTED: [f64; 5] = [0.429_043, 0.511_664, 0.743_125, 0.886_227, 0.247_708];

/// The symmetric matrix M of Eq. 11 for each of R, G, B.
///
/// `coefficients` are radiance E_lm in the order l² + l + m, real basis without Condon-Shortley phase and
/// with +sin(|m|φ) for m < 0. The last row is the last column's mirror, c₂E₁₁, c₂E₁₋₁, c₂E₁₀, c₄E₀₀ − c₅E₂₀;
/// the paper prints c₁E₁₁, c₂E₂₋₁ there. Source: Banterle and Chalmers, Eq. 11, corrected after Ramamoorthi
/// and Hanrahan 2001, Eq. 12. The letter of the print is [`matrix_as_printed`].
pub fn matrix(coefficients: &[[f32; 3]; 9]) -> [[[f32; 4]; 4]; 3] {
    matrix_of([C1, C2, C3, C4, C5], coefficients)
}

/// The matrix M of Eq. 11 for each of R, G, B to the letter: its last row is printed c₁E₁₁, c₂E₂₋₁, c₂E₁₀,
/// c₄E₀₀ − c₅E₂₀, which makes it asymmetric (errata T1), and the constants have the print's six digits (T9).
///
/// `coefficients` as in [`matrix`]. Source: Banterle and Chalmers, Eq. 11.
pub fn matrix_as_printed(coefficients: &[[f32; 3]; 9]) -> [[[f32; 4]; 4]; 3] {
    let mut matrices = matrix_of(AS_PRINTED, coefficients);
    for (channel, matrix) in matrices.iter_mut().enumerate() {
        matrix[3][0] = AS_PRINTED[0] as f32 * coefficients[3][channel];
        matrix[3][1] = AS_PRINTED[1] as f32 * coefficients[5][channel];
    }
    matrices
}

fn matrix_of(constants: [f64; 5], coefficients: &[[f32; 3]; 9]) -> [[[f32; 4]; 4]; 3] {
    let [c1, c2, c3, c4, c5] = constants.map(|c| c as f32);
    [0, 1, 2].map(|channel| {
        let [e00, e1m1, e10, e11, e2m2, e2m1, e20, e21, e22] = coefficients.map(|rgb| rgb[channel]);
        [
            [c1 * e22, c1 * e2m2, c1 * e21, c2 * e11],
            [c1 * e2m2, -c1 * e22, c1 * e2m1, c2 * e1m1],
            [c1 * e21, c1 * e2m1, c3 * e20, c2 * e10],
            [c2 * e11, c2 * e1m1, c2 * e10, c4 * e00 - c5 * e20],
        ]
    })
}

/// The quadratic form [r, 1]ᵗ M [r, 1] of Eq. 10: the irradiance for the normal `direction`, a unit vector.
///
/// The unit is the coefficients' radiance times sr. Nine coefficients may give a little below 0 where
/// radiance varies strongly. The order of the sum: each row of M times (x, y, z, 1) from left to right, then
/// the four products of a row's sum with x, y, z and 1 from left to right.
#[inline(always)]
pub fn evaluate(matrix: &[[f32; 4]; 4], direction: Vec3) -> f32 {
    let Vec3 { x, y, z } = direction;
    let row = |m: &[f32; 4]| m[0] * x + m[1] * y + m[2] * z + m[3];
    row(&matrix[0]) * x + row(&matrix[1]) * y + row(&matrix[2]) * z + row(&matrix[3])
}

#[cfg(test)]
mod tests {
    use super::super::probes::PROBES;
    use super::super::{environment, quadrature, sh};
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn constants_follow_from_the_definitions() {
        // A_l = ∫ max(0, cos) P_l dω; K_l as in Y_lm = K × polynomial.
        let [a0, a1, a2] = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let k0 = (1.0 / (4.0 * PI)).sqrt();
        let k1 = (3.0 / (4.0 * PI)).sqrt();
        let (k20, k22) = ((5.0 / (16.0 * PI)).sqrt(), (15.0 / (16.0 * PI)).sqrt());
        let derived = [a2 * k22, a1 * k1 / 2.0, a2 * 3.0 * k20, a0 * k0, a2 * k20];
        for (i, c) in [C1, C2, C3, C4, C5].into_iter().enumerate() {
            assert!((c - derived[i]).abs() < 2e-16, "c{}: {c} against {}", i + 1, derived[i]);
            assert!((c - AS_PRINTED[i]).abs() < 1.2e-6, "c{}: {c} against {}", i + 1, AS_PRINTED[i]);
        }
    }

    #[test]
    fn constant_radiance_gives_pi_times_as_much_irradiance() {
        let coefficients = environment::constant(3, Vec3::new(1.0, 0.25, 3.0));
        let matrices = matrix(coefficients[..].try_into().unwrap());
        for (matrix, radiance) in matrices.iter().zip([1.0, 0.25, 3.0]) {
            for d in quadrature::fibonacci(50) {
                let irradiance = evaluate(matrix, Vec3::from_array(d.map(|c| c as f32)));
                assert!((f64::from(irradiance) - PI * radiance).abs() < 1e-6 * radiance);
            }
        }
    }

    /// ∫ max(0, n·ω) L(ω) dω with L from nine coefficients, over the hemisphere about n: Gauss-Legendre in
    /// the cosine times equal azimuths, exact for these polynomials.
    fn hemisphere(coefficients: &[f64], n: [f64; 3]) -> f64 {
        let tangent = if n[2].abs() < 0.9 { [-n[1], n[0], 0.0] } else { [n[2], 0.0, -n[0]] };
        let length = tangent.iter().fold(0.0, |s, c| s + c * c).sqrt();
        let t = tangent.map(|c| c / length);
        let b = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
        let mut sum = 0.0;
        for (node, weight) in quadrature::gauss_legendre(8) {
            let cosine = 0.5 * (node + 1.0);
            let sine = (1.0 - cosine * cosine).sqrt();
            for step in 0..8 {
                let phi = 2.0 * PI * f64::from(step) / 8.0;
                let (s, c) =
                    (sine * crate::numeric::double::sin(phi), sine * crate::numeric::double::cos(phi));
                let direction = [0, 1, 2].map(|i| t[i] * c + b[i] * s + n[i] * cosine);
                let mut basis = [0.0; 9];
                sh::evaluate(3, direction, &mut basis);
                let radiance = basis.iter().zip(coefficients).fold(0.0, |s, (y, e)| s + y * e);
                sum += 0.5 * weight * (2.0 * PI / 8.0) * cosine * radiance;
            }
        }
        sum
    }

    #[test]
    fn agrees_with_the_cosine_integral_over_the_hemisphere() {
        for (name, probe) in &PROBES {
            for (channel, m) in matrix(probe).iter().enumerate() {
                let coefficients = probe.map(|rgb| f64::from(rgb[channel]));
                for n in quadrature::fibonacci(200) {
                    let form = f64::from(evaluate(m, Vec3::from_array(n.map(|c| c as f32))));
                    let integral = hemisphere(&coefficients, n);
                    assert!((form - integral).abs() < 1e-6, "{name}: {form} against {integral} at {n:?}");
                }
            }
        }
    }

    #[test]
    fn is_symmetric() {
        for (_, probe) in &PROBES {
            for m in matrix(probe) {
                for (i, row) in m.iter().enumerate() {
                    let column = m.map(|row| row[i]);
                    assert_eq!(row.map(f32::to_bits), column.map(f32::to_bits));
                }
            }
        }
    }
}

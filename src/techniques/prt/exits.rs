//! `prt.exits`: the surface's BRDF times the cosine, for a row of exit directions, each as coefficients over
//! the light's directions. This is B of Feng et al. 2007, Eq. 5: the paper too discretises the exits, in a
//! map of 32 × 32 by stereographic projection, before it projects.
//!
//! Exits lie at azimuth 0, evenly in the tangent of half their angle to the normal, as stereographic
//! projection puts them. The BRDF is isotropic, so for another azimuth φ the functions of order m turn by mφ.
//! The last exit lies just above the horizon and stands for all below it. So a vertex at a silhouette that
//! faces away from the camera is no dark spot.

use super::Frame;
use crate::bake::brdf;
use crate::numeric::order::min;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.exits",
        equation: "Feng et al. 2007, Eq. 5",
        about: "the BRDF for 65 exits from the normal to the horizon, by functions of the light in the vertex's frame; none \
            without a highlight",
        inputs: &[],
        axes: &[Axis::Of("exit"), Axis::Coefficient, RGB],
        unit: "1",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

/// Exits of the table.
pub const EXITS: usize = 65;

/// The tangent of half the last exit's angle to the normal.
const LAST: f64 = 0.999;

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let exits = if frame.computes("prt.exits") { EXITS } else { 0 };
    let exit = |index: usize| {
        let r = LAST * index as f64 / (EXITS - 1) as f64;
        Vec3::new((2.0 * r / (1.0 + r * r)) as f32, 0.0, ((1.0 - r * r) / (1.0 + r * r)) as f32)
    };
    let exits: Vec<_> = (0..exits).map(exit).collect();
    let rows = brdf::rows(&frame.stage.surface, frame.settings.bands, &exits);
    Buffer::f32(&[exits.len(), frame.functions(), 3], rows.into_flattened())
}

/// The coefficients for one exit, a unit vector in the vertex's frame: interpolated between its two
/// neighbours in the table, and turned to its azimuth.
pub(super) fn row(table: &[f32], bands: usize, exit: [f64; 3], row: &mut [[f64; 3]]) {
    let [x, y, z] = exit;
    let across = (x * x + y * y).sqrt();
    let radius = if z > 0.0 { across / (1.0 + z) } else { 1.0 };
    let place = min(radius / LAST, 1.0) * (EXITS - 1) as f64;
    let below = min(place as usize, EXITS - 2);
    let part = place - below as f64;
    let width = row.len() * 3;
    let (a, b) = (&table[below * width..][..width], &table[(below + 1) * width..][..width]);
    let (cos, sin) = if across > 0.0 { (x / across, y / across) } else { (1.0, 0.0) };
    // cos mφ and sin mφ
    let (mut real, mut imaginary) = (1.0, 0.0);
    for m in 0..bands {
        for l in m..bands {
            let at = l * l + l + m;
            for channel in 0..3 {
                let [a, b] = [a, b].map(|row| f64::from(row[at * 3 + channel]));
                let value = a + (b - a) * part;
                row[at][channel] = value * real;
                if m > 0 {
                    row[at - 2 * m][channel] = value * imaginary;
                }
            }
        }
        (real, imaginary) = (cos * real - sin * imaginary, cos * imaginary + sin * real);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;
    use crate::world::brdf::{Brdf, Gloss};

    #[test]
    fn a_row_between_two_exits_is_that_of_the_exit() {
        let exits: Vec<_> = (0..60)
            .map(|i| {
                // Nearer the horizon, the nodes of `brdf::rows` no longer resolve Cook and Torrance's
                // highlight.
                let z = 0.15 + 0.85 * unit(3, i, 0, 0);
                let (s, c) = crate::numeric::turns::sin_cos(f64::from(unit(3, i, 1, 0)));
                let across = (1.0 - z * z).sqrt();
                Vec3::new(across * c as f32, across * s as f32, z)
            })
            .collect();
        for gloss in [Gloss::Phong { exponent: 20.0 }, Gloss::CookTorrance { roughness: 0.35 }] {
            let surface = Brdf { albedo: Vec3::splat(0.3), specular: Vec3::new(0.9, 0.6, 0.4), gloss };
            let axis = |index: usize| LAST * index as f64 / (EXITS - 1) as f64;
            let table: Vec<_> = (0..EXITS)
                .map(axis)
                .map(|r| {
                    Vec3::new((2.0 * r / (1.0 + r * r)) as f32, 0.0, ((1.0 - r * r) / (1.0 + r * r)) as f32)
                })
                .collect();
            let table = brdf::rows(&surface, 5, &table).into_flattened();
            let exact = brdf::rows(&surface, 5, &exits);
            let (mut most, mut worst) = (0.0_f64, 0.0_f64);
            for (exit, exact) in exits.iter().zip(exact.chunks_exact(25)) {
                let mut found = vec![[0.0; 3]; 25];
                row(&table, 5, exit.as_dvec3().to_array(), &mut found);
                for (found, exact) in found.as_flattened().iter().zip(exact.as_flattened()) {
                    most = crate::numeric::order::max(most, f64::from(exact.abs()));
                    worst = crate::numeric::order::max(worst, (found - f64::from(*exact)).abs());
                }
            }
            assert!(worst < 2e-3 * most, "{gloss:?}: {worst} of {most}");
        }
    }
}

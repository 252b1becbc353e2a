//! `translucency.attenuation`: what is left of the radiosity at the surface, Eq. 12 without B.
//!
//! Decides errata T3, T8, T10 and T11. Eq. 12 is inspired by the dipole but leaves out its albedo and virtual source,
//! diverges at d = 0, and has the unit of a reciprocal area although B is not integrated over one. The corrected
//! reading is
//!
//! ```text
//! 1/π · F_t(η, ω_out) · T(d)/π,   T(d) = ∫ R_d(√(ρ² + d²)) 2πρ dρ
//!                                      = α'/2 (z_r e^(−σ_tr s_r)/s_r + z_v e^(−σ_tr s_v)/s_v),   s² = d² + z²
//! ```
//!
//! the dipole integrated over the wall through which the light came, at distance d: the area over which B is a mean.
//! T is a number without a unit, the same in metres and in millimetres (T11), at most the total reflectance R_d
//! (reached at d = 0), and what leaves a wall of thickness d that is lit evenly from behind under Eq. 1 and 2.
//! The second π is that of B = πE (T10). Coefficients are per scene unit (T8).
//!
//! T15: each light has its own thickness. An environment has none; for it d is the length of the refracted ray to
//! where it leaves the bounding box, the x*_in of Eq. 3, which is never less than the solid's own thickness there.

use super::Frame;
use super::gbuffer::shade;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
use std::f32::consts::FRAC_1_PI;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.attenuation",
        equation: "Eq. 12; T3, T8, T10, T11, T15",
        about: "the factor from radiosity to radiance: transmittance towards the eye times the dipole at the thickness",
        inputs: &["translucency.gbuffer", "translucency.thickness"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "1/sr",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let thickness = inputs.get("translucency.thickness");
    shade(
        frame,
        inputs.get("translucency.gbuffer"),
        frame.lights.len(),
        3,
        |light, index, point, normal, out| {
            let (d, receives) = match frame.caster(light) {
                Some(caster) => (thickness.slice(caster)[index * 2], thickness.slice(caster)[index * 2 + 1]),
                None => (frame.exit(point, frame.refracted(point, normal)).1, 1.0),
            };
            let leaving = receives * frame.medium.transmittance(normal.dot(frame.towards_camera(point)));
            for (out, dipole) in out.iter_mut().zip(&frame.medium.dipoles) {
                *out = FRAC_1_PI * leaving * (FRAC_1_PI * dipole.wall(d));
            }
        },
    )
}

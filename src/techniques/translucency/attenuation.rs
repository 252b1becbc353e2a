//! `translucency.attenuation`: what is left of the radiosity at the surface, Eq. 12 without B.
//!
//! Decides errata T3, T8, T10 and T11. Eq. 12 is inspired by the dipole but leaves out its albedo and virtual
//! source, diverges at d = 0, and has the unit of a reciprocal area although B is not integrated over one.
//! The corrected reading is
//!
//! ```text
//! 1/π · F_t(η, ω_out) · T(d)/π,
//! T(d) = ∫ R_d(√(ρ² + d²)) 2πρ dρ
//!      = α'/2 (z_r e^(−σ_tr s_r)/s_r + z_v e^(−σ_tr s_v)/s_v),   s² = d² + z²
//! ```
//!
//! This is the dipole integrated over the wall through which the light came, at distance d: B is a mean over
//! that area. T is a number without a unit, the same in metres and in millimetres (T11). It is at most the
//! total reflectance R_d, reached at d = 0. By Eq. 1 and 2 it is what leaves a wall of thickness d that is
//! lit evenly from behind. The second π is that of B = πE (T10). Coefficients are per scene unit (T8).
//!
//! To the letter ([`Reading::Paper`](crate::keys::Reading::Paper)) the factor is
//!
//! ```text
//! 1/π · F_t(η, ω_out) · (σ_tr d + 1) e^(−σ_tr d) / (σ'_t d³)
//! ```
//!
//! without any of this. It has the unit of a reciprocal area, so the same scene in metres is 10⁶ times as
//! bright as in millimetres, and it has no bound. A thickness below `smallest_d`, also a negative one that
//! blurring left, is replaced by `smallest_d`; `held` records where.
//!
//! T15: each light has its own thickness. An environment has none; for it d is the length of the refracted
//! ray to where it leaves the bounding box, the x*_in of Eq. 3, which is never less than the solid's own
//! thickness there.

use super::Frame;
use super::frame::exit;
use super::gbuffer::shade;
use crate::keys::Reading;
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::max;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};
use crate::raster::SurfacePoints;
use std::f32::consts::FRAC_1_PI;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.attenuation",
        equation: "Eq. 12; T3, T8, T10, T11, T15",
        about: "the factor from radiosity to radiance: transmittance towards the eye times the dipole at the thickness",
        inputs: &["translucency.gbuffer", "translucency.thickness"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "1/sr; as printed also a reciprocal area in the scene's unit",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Colour],
    },
    run,
};

/// The thickness at points, in the scene's unit and as it was measured, and the share that they receive.
pub(super) fn measured(
    frame: &Frame,
    thickness: &Buffer,
    light: usize,
    points: &SurfacePoints,
) -> [[f32; BLOCK]; 2] {
    let mut measured = [[0.0; BLOCK]; 2];
    match frame.caster(light) {
        Some(caster) => {
            let (texels, _) = thickness.slice(caster).as_chunks::<2>();
            for lane in 0..points.count {
                [measured[0][lane], measured[1][lane]] = texels[points.pixel[lane] as usize];
            }
        }
        None => to_the_box(frame, points, &mut measured),
    }
    measured
}

wide! {
    /// The length of the refracted ray up to the box. Light of an environment is received everywhere.
    fn to_the_box(frame: &Frame, points: &SurfacePoints, measured: &mut [[f32; BLOCK]; 2]) {
        for lane in 0..BLOCK {
            let (point, normal) = (points.position(lane), points.normal(lane));
            measured[0][lane] = exit(&frame.bounds, point, frame.refracted(point, normal)).1;
            measured[1][lane] = 1.0;
        }
    }
}

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let thickness = inputs.get("translucency.thickness");
    shade(frame, inputs.get("translucency.gbuffer"), frame.stage.lights.len(), |light, points, out| {
        attenuation(frame, points, &measured(frame, thickness, light, points), out);
    })
}

wide! {
    fn attenuation(
        frame: &Frame,
        points: &SurfacePoints,
        measured: &[[f32; BLOCK]; 2],
        out: &mut [[f32; BLOCK]; 3],
    ) {
        let mut leaving = [0.0; BLOCK];
        for lane in 0..BLOCK {
            let (point, normal) = (points.position(lane), points.normal(lane));
            let transmittance = frame.stage.medium.transmittance(normal.dot(frame.towards_camera(point)));
            leaving[lane] = FRAC_1_PI * (measured[1][lane] * transmittance);
        }
        for (out, dipole) in out.iter_mut().zip(frame.stage.medium.dipoles) {
            match frame.settings.reading {
                Reading::Corrected => {
                    for lane in 0..BLOCK {
                        out[lane] = leaving[lane] * (FRAC_1_PI * dipole.wall(measured[0][lane]));
                    }
                }
                Reading::Paper => {
                    let smallest = frame.smallest_d();
                    for lane in 0..BLOCK {
                        out[lane] = leaving[lane] * dipole.as_printed(max(measured[0][lane], smallest));
                    }
                }
            }
        }
    }
}

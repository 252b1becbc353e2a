//! `translucency.direct`: light that leaves where it entered (fig. 10a), which the accumulation of §2 leaves
//! out.
//!
//! The paper does not say how its directly lit surface is shaded. Here the same dipole tells how much light
//! leaves at once: the diffuse albedo is the total reflectance R_d, behind a Fresnel boundary, L = 1/π ·
//! F_t(η, ω_out) · R_d · F_t(η, ω_in) · E, shadowed by the first depth. A highlight of exponent `gloss` is
//! added, the normalised Blinn-Phong lobe with Schlick's reflectance. An environment gives its irradiance,
//! without shadow or highlight.

use super::gbuffer::shade;
use super::lookup::{Footprints, slack};
use super::{Caster, Frame};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::max;
use crate::numeric::single::pow;
use crate::numeric::vector::unit_or_zero;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};
use crate::raster::SurfacePoints;
use crate::sphere::irradiance;
use crate::world::medium::Medium;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.direct",
        equation: "fig. 10a",
        about: "radiance of the surface where the light falls on it: diffuse behind a Fresnel boundary, and a highlight",
        inputs: &["translucency.gbuffer", "translucency.shadow"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "radiance",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Colour],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadow = inputs.get("translucency.shadow");
    let albedo = Vec3::from_array(frame.stage.medium.dipoles.each_ref().map(|dipole| dipole.reflectance()));
    shade(frame, inputs.get("translucency.gbuffer"), frame.stage.lights.len(), |light, points, out| {
        match (&frame.irradiance[light], frame.caster(light)) {
            (Some(matrices), _) => around(frame, matrices, albedo, points, out),
            (None, Some(caster)) => {
                let mut highlights = [0.0; BLOCK];
                if frame.stage.gloss > 0.0 {
                    for lane in 0..points.count {
                        highlights[lane] =
                            highlight(frame, light, points.position(lane), points.normal(lane));
                    }
                }
                cast(frame, &frame.casters[caster], shadow.slice(caster), albedo, &highlights, points, out);
            }
            (None, None) => *out = [[0.0; BLOCK]; 3],
        }
    })
}

/// The factor from entering irradiance to radiance towards the eye: albedo / π times the transmittance.
#[inline(always)]
fn leaving(frame: &Frame, albedo: Vec3, point: Vec3, normal: Vec3) -> Vec3 {
    albedo * (FRAC_1_PI * frame.stage.medium.transmittance(normal.dot(frame.towards_camera(point))))
}

wide! {
    /// The radiance of an environment.
    fn around(
        frame: &Frame,
        matrices: &[[[f32; 4]; 4]; 3],
        albedo: Vec3,
        points: &SurfacePoints,
        out: &mut [[f32; BLOCK]; 3],
    ) {
        let entering = frame.stage.medium.transmittance(Medium::diffuse_cosine());
        for lane in 0..BLOCK {
            let (point, normal) = (points.position(lane), points.normal(lane));
            let irradiance = |channel: usize| max(irradiance::evaluate(&matrices[channel], normal), 0.0);
            let irradiance = Vec3::new(irradiance(0), irradiance(1), irradiance(2));
            let radiance = leaving(frame, albedo, point, normal) * entering * irradiance;
            (out[0][lane], out[1][lane], out[2][lane]) = radiance.into();
        }
    }
}

wide! {
    /// The radiance of a casting light; 0 in its shadow.
    fn cast(
        frame: &Frame,
        caster: &Caster,
        first: &[f32],
        albedo: Vec3,
        highlights: &[f32; BLOCK],
        points: &SurfacePoints,
        out: &mut [[f32; BLOCK]; 3],
    ) {
        let (shadow, light) = (&caster.shadow, frame.stage.lights[caster.light].casting());
        let footprints = Footprints::new(shadow, points);
        let first = footprints.gather(points.count, |texel| first[texel * 3]);
        for lane in 0..BLOCK {
            let (point, normal) = (points.position(lane), points.normal(lane));
            let (towards, facing) = light.arriving(point);
            let cosine = normal.dot(towards);
            let limit = shadow.distance(point) - slack(shadow, point, cosine);
            let lit = footprints.share(&first, lane, |first| (first == 0.0) | (limit <= first));
            let diffuse = leaving(frame, albedo, point, normal) * frame.stage.medium.transmittance(cosine);
            let radiance = (diffuse + Vec3::splat(highlights[lane])) * facing * (cosine * lit);
            let radiance = if cosine > 0.0 { radiance } else { Vec3::ZERO };
            (out[0][lane], out[1][lane], out[2][lane]) = radiance.into();
        }
    }
}

/// The normalised Blinn-Phong lobe, (n + 8) / 8π · (n·h)ⁿ, times Schlick's reflectance at the half vector.
fn highlight(frame: &Frame, light: usize, point: Vec3, normal: Vec3) -> f32 {
    let (towards, eye) = (frame.stage.lights[light].casting().arriving(point).0, frame.towards_camera(point));
    if normal.dot(towards) <= 0.0 {
        return 0.0;
    }
    let half = unit_or_zero(towards + eye);
    let reflectance = 1.0 - frame.stage.medium.transmittance(eye.dot(half));
    let lobe = pow(max(normal.dot(half), 0.0), frame.stage.gloss);
    (frame.stage.gloss + 8.0) * (0.125 * FRAC_1_PI) * lobe * reflectance
}

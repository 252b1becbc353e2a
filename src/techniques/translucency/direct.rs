//! `translucency.direct`: light that leaves where it entered (fig. 10a), which the accumulation of §2 leaves out.
//!
//! The paper does not say how its directly lit surface is shaded. Here it is what the same dipole says of light that
//! leaves at once: a diffuse albedo of the total reflectance R_d behind a Fresnel boundary,
//! L = 1/π · F_t(η, ω_out) · R_d · F_t(η, ω_in) · E, shadowed by the first depth; and a highlight of exponent
//! `gloss`, the normalised Blinn-Phong lobe with Schlick's reflectance. An environment gives its irradiance, without
//! shadow or highlight.

use super::gbuffer::shade;
use super::lookup::{Footprint, slack};
use super::{Caster, Frame};
use crate::numeric::order::max;
use crate::numeric::single::pow;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
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
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadow = inputs.get("translucency.shadow");
    let albedo = Vec3::from_array(frame.medium.dipoles.each_ref().map(|dipole| dipole.reflectance()));
    shade(frame, inputs.get("translucency.gbuffer"), frame.lights.len(), 3, |light, _, point, normal, out| {
        let eye = frame.towards_camera(point);
        let leaving = albedo * (FRAC_1_PI * frame.medium.transmittance(normal.dot(eye)));
        let radiance = if let Some(matrices) = &frame.irradiance[light] {
            let irradiance = matrices.each_ref().map(|matrix| max(irradiance::evaluate(matrix, normal), 0.0));
            leaving * frame.medium.transmittance(Medium::diffuse_cosine()) * Vec3::from_array(irradiance)
        } else {
            let caster = frame.caster(light).map(|number| (&frame.casters[number], shadow.slice(number)));
            caster
                .map_or(Vec3::ZERO, |(caster, first)| cast(frame, caster, first, point, normal, eye, leaving))
        };
        out.copy_from_slice(&radiance.to_array());
    })
}

/// The radiance of a casting light; 0 in its shadow.
fn cast(
    frame: &Frame,
    Caster { light, shadow }: &Caster,
    first: &[f32],
    point: Vec3,
    normal: Vec3,
    eye: Vec3,
    leaving: Vec3,
) -> Vec3 {
    let Some((towards, facing)) = frame.lights[*light].arriving(point) else { return Vec3::ZERO };
    let cosine = normal.dot(towards);
    if cosine <= 0.0 {
        return Vec3::ZERO;
    }
    let limit = shadow.distance(point) - slack(shadow, point, cosine);
    let lit =
        Footprint::new(shadow, point).share(|texel| first[texel * 2] == 0.0 || limit <= first[texel * 2]);
    let diffuse = leaving * frame.medium.transmittance(cosine);
    (diffuse + Vec3::splat(highlight(frame, normal, towards, eye))) * facing * (cosine * lit)
}

/// The normalised Blinn-Phong lobe, (n + 8) / 8π · (n·h)ⁿ, times Schlick's reflectance at the half vector.
fn highlight(frame: &Frame, normal: Vec3, towards: Vec3, eye: Vec3) -> f32 {
    if frame.gloss <= 0.0 {
        return 0.0;
    }
    let half = (towards + eye).normalize_or_zero();
    let reflectance = 1.0 - frame.medium.transmittance(eye.dot(half));
    let lobe = pow(max(normal.dot(half), 0.0), frame.gloss);
    (frame.gloss + 8.0) * (0.125 * FRAC_1_PI) * lobe * reflectance
}

//! `prt.light`: the distant radiance of each light as n² coefficients, Lᵢ = ∫ L(ω) yᵢ(ω) dω.
//!
//! An environment is projected when it is loaded. A directional light is a delta: its coefficients are E yᵢ
//! in the direction towards it. Their irradiance on a surface that faces it is E in the limit of many bands,
//! and rings with fewer.

use super::Frame;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};
use crate::sphere::sh;
use crate::world::light::Light;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.light",
        equation: "Sloan et al. 2002, §3",
        about: "the coefficients of each light's radiance",
        inputs: &[],
        axes: &[Axis::Light, Axis::Coefficient, RGB],
        unit: "radiance times the square root of steradians",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let bands = frame.settings.bands;
    let mut values = Vec::new();
    for light in &frame.stage.lights {
        match light {
            Light::Environment { coefficients, .. } => values.extend_from_slice(coefficients.as_flattened()),
            Light::Point { .. } => unreachable!("a light far away, as the technique's row says"),
            Light::Directional { direction, irradiance } => {
                let mut basis = vec![0.0; bands * bands];
                sh::evaluate(bands, (-direction.as_dvec3()).to_array(), &mut basis);
                let rgb = irradiance.as_dvec3().to_array();
                values.extend(basis.iter().flat_map(|basis| rgb.map(|channel| (channel * basis) as f32)));
            }
        }
    }
    Buffer::f32(&[frame.stage.lights.len(), bands * bands, 3], values)
}

//! `prt.shading`: the radiance of each vertex towards the camera. Its part from within the solid has not been
//! multiplied by Fresnel's transmittance yet.
//!
//! Let L be the sum of all lights, and o the direction towards the camera in the vertex's frame. A diffuse
//! surface reflects T·L, one with a highlight B(o)·M L (Feng et al. 2007, Eq. 5). Light that was scattered in
//! the solid is S·L. `final` multiplies it by the transmittance at each pixel: at vertices that face away
//! from the camera the transmittance is 0, and silhouettes would have a dark line. A few bands ring, so sums
//! can be negative. They are taken in `f64`, in the order of the functions.

use super::Frame;
use super::exits::row;
use crate::bake;
use crate::numeric::parallel;
use crate::numeric::vector::unit_or_zero;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Twin};
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.shading",
        equation: "Feng et al. 2007, Eq. 5",
        about: "of all lights, what the surface of each vertex reflects towards the camera, and what leaves it from within",
        inputs: &["prt.light", "prt.vectors", "prt.matrices", "prt.exits", "prt.bounced", "prt.scattered"],
        axes: &[Axis::Vertex, Axis::Channel(&["R", "G", "B", "within R", "within G", "within B"])],
        unit: "radiance",
        knob: "solid.triangles",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let functions = frame.functions();
    let [light, vectors, matrices, exits, bounced, scattered] =
        ["light", "vectors", "matrices", "exits", "bounced", "scattered"]
            .map(|pass| inputs.get(&format!("prt.{pass}")).as_f32());
    let light = sum(light, functions);
    let mut values = vec![0.0; frame.stage.solid.positions.len() * 6];
    parallel::for_each_chunk(&mut values, super::RUN * 6, |run, values| {
        let mut surface = vec![[0.0; 3]; functions];
        for (index, value) in values.chunks_exact_mut(6).enumerate() {
            let vertex = run * super::RUN + index;
            let (position, normal) = (frame.stage.solid.positions[vertex], frame.stage.solid.normals[vertex]);
            let towards = unit_or_zero(frame.stage.camera.position - position);
            let (mut radiance, mut within) = ([0.0; 3], [0.0; 3]);
            if frame.computes("prt.vectors") {
                radiance = dot(&vectors[vertex * functions * 3..], &light);
            }
            if frame.computes("prt.matrices") {
                let width = functions * functions;
                let arriving = if frame.computes("prt.bounced") {
                    transferred::<3>(&bounced[vertex * width * 3..], &light)
                } else {
                    transferred::<1>(&matrices[vertex * width..], &light)
                };
                row(exits, frame.settings.bands, local(normal, towards), &mut surface);
                for (arriving, surface) in arriving.iter().zip(&surface) {
                    (0..3).for_each(|channel| radiance[channel] += arriving[channel] * surface[channel]);
                }
            }
            if frame.computes("prt.scattered") {
                within = dot(&scattered[vertex * functions * 3..], &light);
            }
            for channel in 0..3 {
                (value[channel], value[3 + channel]) = (radiance[channel] as f32, within[channel] as f32);
            }
        }
    });
    Buffer::f32(&[frame.stage.solid.positions.len(), 6], values)
}

/// The coefficients of all lights together, RGB, added in the scene's order.
fn sum(lights: &[f32], functions: usize) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; functions];
    for light in lights.chunks_exact(functions * 3) {
        for (sum, rgb) in sum.as_flattened_mut().iter_mut().zip(light) {
            *sum += f64::from(*rgb);
        }
    }
    sum
}

/// T·L of each colour, where `transfer` begins with T.
fn dot(transfer: &[f32], light: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (transfer, light) in transfer.as_chunks::<3>().0.iter().zip(light) {
        (0..3).for_each(|channel| sum[channel] += f64::from(transfer[channel]) * light[channel]);
    }
    sum
}

/// M L of each colour, where `matrix` begins with M, whose entries have one channel or three.
fn transferred<const CHANNELS: usize>(matrix: &[f32], light: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let rows = matrix.chunks_exact(light.len() * CHANNELS).take(light.len());
    rows.map(|row| {
        let mut sum = [0.0; 3];
        for (entry, light) in row.as_chunks::<CHANNELS>().0.iter().zip(light) {
            (0..3).for_each(|channel| sum[channel] += f64::from(entry[channel % CHANNELS]) * light[channel]);
        }
        sum
    })
    .collect()
}

/// A direction of the world in the frame of a vertex.
fn local(normal: Vec3, direction: Vec3) -> [f64; 3] {
    let direction = direction.as_dvec3().to_array();
    bake::frame(normal).map(|axis| axis[0] * direction[0] + axis[1] * direction[1] + axis[2] * direction[2])
}

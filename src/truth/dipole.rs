//! The dipole integrated over a surface: Banterle and Chalmers, Eq. 1 and 2, after Jensen et al. 2001.
//!
//! L(x, o) = F_t(η, o) / π · ∫ E(y) R_d(|x − y|) dy over all triangles, with R_d of
//! [`Dipole::kernel`](crate::world::medium::Dipole::kernel) (errata T3: the distances are those from the two
//! sources) and E(y) = ∫ F_t(η, i) L(y, i) cos θ di: the irradiance that enters, by Schlick's transmittance
//! as in the techniques' passes, shadowed by the mesh.
//!
//! The integral is drawn as King, Kulla, Conty and Fajardo 2013 do. First an axis is drawn, the normal at x
//! or one of two tangents. Then a distance from it is drawn in proportion to the kernel of one source of one
//! channel without absorption, z / (2π s³), whose distribution inverts in closed form. Every point in which
//! the line there, parallel to the axis, meets the surface counts. All axes together find a point y with the
//! density ρ(y) = Σ q_a p(r_a) |n_y · a| per area, so it counts as 1/ρ. One of three orthogonal axes is never
//! far from a normal and r_a ≤ |x − y|, so the weight R_d / ρ has a bound.

use super::path::arriving;
use super::place::Place;
use super::{Estimator, Normals};
use crate::numeric::order::max;
use crate::numeric::random::Sample;
use crate::numeric::turns::sin_cos;
use crate::numeric::vector::{frame, length};
use crate::trace::Ray;
use crate::world::brdf::cosine;
use crate::world::medium::Medium;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// How often each axis is taken: the normal, and two tangents.
const OFTEN: [f32; 3] = [0.5, 0.25, 0.25];

/// One sample of the radiance that leaves `place` towards the unit vector `eye`.
pub(super) fn seen(
    scene: &Estimator,
    medium: &Medium,
    normals: Normals,
    place: Place,
    eye: Vec3,
    random: &mut Sample,
) -> Vec3 {
    let leaving = medium.transmittance(place.normal.dot(eye)) * FRAC_1_PI;
    if leaving > 0.0 { radiosity(scene, medium, normals, &place, random) * leaving } else { Vec3::ZERO }
}

/// One sample of B(x), Eq. 2.
fn radiosity(scene: &Estimator, medium: &Medium, normals: Normals, x: &Place, random: &mut Sample) -> Vec3 {
    let [u, v] = frame(x.face);
    let axes = [x.face, u, v];
    let choice = random.unit();
    let chosen = if choice < OFTEN[0] {
        0
    } else if choice < OFTEN[0] + OFTEN[1] {
        1
    } else {
        2
    };
    // The distance of one source of one channel.
    let source = (random.bits() % 6) as usize;
    let depth = depth(medium, source);
    let s = depth / (1.0 - random.unit());
    let radius = max(s * s - depth * depth, 0.0).sqrt();
    let (sine, cosine) = sin_cos(f64::from(random.unit()));
    let (across, along) = (axes[(chosen + 1) % 3], axes[(chosen + 2) % 3]);
    let lateral = (across * cosine as f32 + along * sine as f32) * radius;
    // From beyond the mesh on one side to beyond it on the other.
    let reach = 2.0 * scene.bounds.radius() + length(x.point - scene.bounds.center());
    let direction = -axes[chosen];
    let mut ray = Ray::new(x.point + lateral - direction * reach, direction);
    let mut total = Vec3::ZERO;
    while let Some(hit) = scene.bvh.nearest(&ray) {
        let y = Place::new(&scene.mesh, &scene.bvh, &hit, normals);
        ray = y.ray(direction);
        let to = y.point - x.point;
        let density = (0..3).fold(0.0, |sum, axis| {
            let beside = max(to.length_squared() - to.dot(axes[axis]) * to.dot(axes[axis]), 0.0);
            sum + OFTEN[axis] * y.face.dot(axes[axis]).abs() * spread(medium, beside)
        });
        if density > 0.0 {
            let distance = length(to);
            let kernel = Vec3::from_array(medium.dipoles.each_ref().map(|dipole| dipole.kernel(distance)));
            total += entering(scene, medium, &y, random) * kernel / density;
        }
    }
    total
}

/// How deep or high one of the six sources lies.
fn depth(medium: &Medium, source: usize) -> f32 {
    let dipole = &medium.dipoles[source % 3];
    if source < 3 { dipole.real } else { dipole.virtual_ }
}

/// The density per area with which a distance is drawn, by its square.
fn spread(medium: &Medium, squared: f32) -> f32 {
    let one = |source: usize| {
        let z = depth(medium, source);
        let s = (squared + z * z).sqrt();
        z / (s * s * s)
    };
    (0..6).fold(0.0, |sum, source| sum + one(source)) / (6.0 * 2.0 * PI)
}

/// One sample of the irradiance that enters at y: E of Eq. 2, RGB.
fn entering(scene: &Estimator, medium: &Medium, y: &Place, random: &mut Sample) -> Vec3 {
    let free = |direction: Vec3, ray: &Ray| direction.dot(y.face) > 0.0 && !scene.bvh.blocked(ray);
    let mut total = Vec3::ZERO;
    for caster in &scene.lights.lamps {
        let (ray, towards, irradiance) = arriving(caster, y);
        let cosine = towards.dot(y.normal);
        if cosine > 0.0 && free(towards, &ray) {
            total += irradiance * (cosine * medium.transmittance(cosine));
        }
    }
    if scene.lights.skies.is_empty() {
        return total;
    }
    let local = cosine(random.pair());
    let [u, v] = frame(y.normal);
    let direction = u * local.x + v * local.y + y.normal * local.z;
    if free(direction, &y.ray(direction)) {
        let pdf = local.z * FRAC_1_PI;
        total += scene.lights.weighted_radiance(direction, pdf) * (PI * medium.transmittance(local.z));
    }
    if scene.lights.draw {
        for environment in &scene.lights.skies {
            let Some((direction, pdf)) = environment.sample(random) else { continue };
            let cosine = direction.dot(y.normal);
            if cosine > 0.0 && free(direction, &y.ray(direction)) {
                let weight = cosine * medium.transmittance(cosine) / (pdf + cosine * FRAC_1_PI);
                total += environment.radiance(direction) * weight;
            }
        }
    }
    total
}

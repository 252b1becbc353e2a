//! Light in a homogeneous medium behind a smooth dielectric boundary: a walk from the eye into the medium and
//! out again.
//!
//! Inside the mesh this is the radiative transfer equation (Chandrasekhar 1950) with σs, σa and Henyey and
//! Greenstein's phase function (1941), on its triangles Fresnel's equations and Snell's law. The boundary is
//! the mesh as it is, without interpolated normals, so that no light is lost. A path that leaves for good
//! ends in the environment. Radiance changes by η² on the way in and back on the way out, so the factor
//! cancels.
//!
//! One walk serves all three colours. Its free paths are drawn for one channel, the *hero*, chosen with equal
//! chance. Let f_j be the path's measure in channel j, and p_k its density had channel k been chosen. Channel
//! j is then weighted by 3 f_j / Σ p_k: the balance heuristic over whole paths (hero wavelengths, Wilkie et
//! al. 2014), which is never above 3. Once absorption has left little, walks end by chance (Russian
//! roulette), which p_k includes.
//!
//! A light that is a point or a direction cannot be met by chance, nor be joined to a point inside through a
//! boundary that refracts. Where η is 1 the boundary does not refract: then such lights are joined to every
//! point of scattering by a straight ray.

use super::boundary::{fresnel, mirror, refract};
use super::path::arriving;
use super::place::Place;
use super::{Estimator, Normals};
use crate::Error;
use crate::numeric::order::{clamp, max};
use crate::numeric::random::Sample;
use crate::numeric::single::{exp, log};
use crate::numeric::vector::frame;
use crate::trace::Ray;
use crate::world::brdf::polar;
use crate::world::medium::Medium;
use crate::world::mesh::Bounds;
use glam::Vec3;
use std::f32::consts::PI;

/// The part of the light below which a walk may end by chance, and the part that a walk which then goes on
/// counts as.
const LITTLE: [f64; 2] = [0.25, 0.5];

/// A medium as a random walk sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// Scattering coefficient σs, RGB, per unit of length.
    pub scattering: [f32; 3],
    /// Absorption coefficient σa, RGB, per unit of length.
    pub absorption: [f32; 3],
    /// Mean cosine g of the phase function, between -1 and 1.
    pub anisotropy: f32,
    /// Index of refraction relative to the outside, at least 1.
    pub eta: f32,
}

impl Volume {
    /// The medium that a dipole stands for, in the scene's unit. The dipole knows its reduced scattering σs'
    /// = (1 − g) σs.
    pub fn new(medium: &Medium, anisotropy: f32) -> Self {
        let unit = medium.millimetres;
        Self {
            scattering: medium.scattering.map(|s| s * unit / (1.0 - anisotropy)),
            absorption: medium.absorption.map(|a| a * unit),
            anisotropy,
            eta: medium.eta,
        }
    }

    fn extinction(&self, channel: usize) -> f32 {
        self.scattering[channel] + self.absorption[channel]
    }
}

/// Henyey and Greenstein's phase function at a cosine between the directions of travel before and after, per
/// steradian.
pub fn henyey_greenstein(g: f32, cosine: f32) -> f32 {
    let d = 1.0 + g * g - 2.0 * g * cosine;
    (1.0 - g * g) / (4.0 * PI * d * d.sqrt())
}

/// Draws the direction of travel after scattering from [`henyey_greenstein`].
pub fn scatter(g: f32, direction: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    if g == 0.0 {
        return polar(1.0 - 2.0 * u, v); // alike in all directions, so also about z
    }
    // The inverse of the distribution in t = 1 - 2u, with the division by g cancelled.
    let t = 1.0 - 2.0 * u;
    let (squares, length) = (g * g, 1.0 - g * t);
    let cosine = 0.5 * g * (3.0 + t * t + squares * (t * t - 1.0)) - t * (1.0 + squares);
    let around = polar(clamp(cosine / (length * length), -1.0, 1.0), v);
    let [x, y] = frame(direction);
    x * around.x + y * around.y + direction * around.z
}

/// A path's measure f and densities p, each divided by the hero's density.
struct Path<'a> {
    volume: &'a Volume,
    /// σt of the hero.
    drawn: f32,
    hero: usize,
    /// σt of each channel less the hero's.
    beyond: [f32; 3],
    /// σs and σt of each channel over the hero's σt.
    scattering: [f64; 3],
    extinction: [f64; 3],
    measure: [f64; 3],
    density: [f64; 3],
}

impl<'a> Path<'a> {
    fn new(volume: &'a Volume, random: &mut Sample) -> Self {
        let hero = (random.bits() % 3) as usize;
        let drawn = volume.extinction(hero);
        let over = |coefficient: f32| f64::from(coefficient) / f64::from(drawn);
        Self {
            volume,
            drawn,
            hero,
            beyond: [0, 1, 2].map(|channel| volume.extinction(channel) - drawn),
            scattering: volume.scattering.map(over),
            extinction: [0, 1, 2].map(|channel| over(volume.extinction(channel))),
            measure: [1.0; 3],
            density: [1.0; 3],
        }
    }

    /// The path goes `length` through the medium. No exponential overflows, since no length that is drawn
    /// exceeds 17 of the hero's mean free paths.
    fn cross(&mut self, length: f32) {
        for channel in 0..3 {
            if self.beyond[channel] != 0.0 {
                let factor = f64::from(exp(-self.beyond[channel] * length));
                self.measure[channel] *= factor;
                self.density[channel] *= factor;
            }
        }
    }

    /// The path scatters.
    fn scatter(&mut self) {
        for channel in 0..3 {
            self.measure[channel] *= self.scattering[channel];
            self.density[channel] *= self.extinction[channel];
        }
    }

    /// Whether the path goes on.
    fn survives(&mut self, random: &mut Sample) -> bool {
        let little = |channel: usize| self.measure[channel] < LITTLE[0] * self.density[channel];
        if !(little(0) || little(1) || little(2)) {
            return true;
        }
        let mut chance = [1.0; 3];
        for channel in 0..3 {
            if little(channel) {
                chance[channel] = self.measure[channel] / self.density[channel] / LITTLE[1];
            }
        }
        let taken = chance[self.hero];
        if taken < 1.0 && f64::from(random.unit()) >= taken {
            return false;
        }
        for channel in 0..3 {
            self.measure[channel] /= taken;
            self.density[channel] *= chance[channel] / taken;
        }
        true
    }

    fn weight(&self) -> Vec3 {
        let density = self.density[0] + self.density[1] + self.density[2];
        Vec3::from_array(self.measure.map(|measure| (3.0 * measure / density) as f32))
    }
}

/// Refuses scenes that walks cannot render.
///
/// # Errors
/// A medium without scattering and absorption in some channel, a mesh that is not closed, and with η ≠ 1 a
/// light that is a point or a direction.
pub(super) fn check(scene: &Estimator, volume: &Volume) -> Result<(), Error> {
    if !(0..3).all(|channel| volume.extinction(channel) > 0.0) {
        return Err(Error::new("the medium neither scatters nor absorbs in some channel")
            .key("material.scattering")
            .remedy("give every channel some scattering"));
    }
    if !scene.mesh.facts().closed {
        return Err(Error::new("the solid is not closed, so nothing is inside it")
            .key("solid")
            .remedy("close its mesh, or use truth.model = \"dipole\" or \"surface\""));
    }
    if volume.eta != 1.0 && !scene.lights.lamps.is_empty() {
        return Err(Error::new(
            "a walk through a boundary that refracts never meets a light that is a point or a direction",
        )
        .remedy(
            "light the solid with an environment, or use truth.model = \"dipole\", or material.eta = 1",
        ));
    }
    Ok(())
}

/// One sample of the radiance that leaves the boundary at `place` towards the unit vector `eye`; the eye is
/// outside.
pub(super) fn seen(scene: &Estimator, volume: &Volume, place: Place, eye: Vec3, random: &mut Sample) -> Vec3 {
    let bounds = scene.bounds;
    let mut path = Path::new(volume, random);
    let mut total = Vec3::ZERO;
    let (mut place, mut direction) = (place, -eye);
    loop {
        // Outside, at the boundary.
        let facing = if direction.dot(place.face) > 0.0 { place.turned() } else { place };
        let inward = match refract(direction, facing.face, volume.eta) {
            Some(inward) if random.unit() >= fresnel(-direction.dot(facing.face), volume.eta) => inward,
            _ => {
                direction = mirror(direction, facing.face);
                match outside(scene, &facing, direction) {
                    Some(next) => place = next,
                    None => return total + path.weight() * scene.lights.radiance(direction),
                }
                continue;
            }
        };
        let Some((left, outward)) = inside(scene, &mut path, facing, inward, &bounds, &mut total, random)
        else {
            return total;
        };
        direction = outward;
        match outside(scene, &left, direction) {
            Some(next) => place = next,
            None => return total + path.weight() * scene.lights.radiance(direction),
        }
    }
}

/// Where a ray that leaves the solid meets it again.
fn outside(scene: &Estimator, place: &Place, direction: Vec3) -> Option<Place> {
    let hit = scene.bvh.nearest(&place.ray(direction))?;
    Some(Place::new(&scene.mesh, &scene.bvh, &hit, Normals::Face))
}

/// Walks inward from a place of the boundary. Returns where the path leaves and in which direction; `None`
/// where it ends inside.
fn inside(
    scene: &Estimator,
    path: &mut Path<'_>,
    place: Place,
    direction: Vec3,
    bounds: &Bounds,
    total: &mut Vec3,
    random: &mut Sample,
) -> Option<(Place, Vec3)> {
    let volume = path.volume;
    let mut direction = direction;
    let mut ray = place.ray(direction);
    // How far the next step can go without meeting anything, as far as is known.
    let mut clear = 0.0;
    loop {
        let free = -log(1.0 - random.unit()) / path.drawn;
        ray.far = free;
        let hit = if free < clear { None } else { scene.bvh.nearest(&ray) };
        let Some(hit) = hit else {
            let point = ray.at(free);
            path.cross(free);
            path.scatter();
            // A point is out of the box only where a ray has slipped out by rounding, in a point of
            // measure 0. Its walk would never end.
            let within = point.cmpge(bounds.low).all() && point.cmple(bounds.high).all();
            if !within || !path.survives(random) {
                return None;
            }
            if !scene.lights.lamps.is_empty() {
                *total += joined(scene, path, point, direction);
            }
            direction = scatter(volume.anisotropy, direction, random.pair());
            ray = Ray::new(point, direction);
            clear = scene.clearance.as_ref().map_or(0.0, |clearance| clearance.at(point));
            continue;
        };
        path.cross(hit.t);
        let place = Place::new(&scene.mesh, &scene.bvh, &hit, Normals::Face);
        let facing = if direction.dot(place.face) > 0.0 { place.turned() } else { place };
        if let Some(outward) = refract(direction, facing.face, 1.0 / volume.eta)
            && random.unit() >= fresnel(-direction.dot(facing.face), 1.0 / volume.eta)
        {
            return Some((facing, outward));
        }
        direction = mirror(direction, facing.face);
        ray = facing.ray(direction);
        clear = 0.0;
    }
}

/// The light of points and directions that `point` scatters back along the path, where η = 1.
fn joined(scene: &Estimator, path: &Path<'_>, point: Vec3, direction: Vec3) -> Vec3 {
    let mut total = Vec3::ZERO;
    for caster in &scene.lights.lamps {
        let (mut ray, towards, irradiance) = arriving(caster, &Place::free(point, Vec3::Z));
        let scale = ray.direction.length();
        // The length inside: every crossing changes sides, the last leads out.
        let (mut length, mut within) = (0.0, true);
        while let Some(hit) = scene.bvh.nearest(&ray) {
            let place = Place::new(&scene.mesh, &scene.bvh, &hit, Normals::Face);
            length += if within { hit.t * scale } else { 0.0 };
            within = !within;
            let far = ray.far - hit.t;
            ray = Ray { far: max(far, 0.0), ..place.ray(ray.direction) };
        }
        let phase = henyey_greenstein(path.volume.anisotropy, direction.dot(towards));
        let left = Vec3::from_array([0, 1, 2].map(|channel| exp(-path.volume.extinction(channel) * length)));
        total += path.weight() * left * irradiance * phase;
    }
    total
}

//! Light that surfaces reflect: paths from the eye (Kajiya 1986).
//!
//! L(x, o) = Σ over lights and ∫ over directions of f(i, o) L(x, i) cos θ di. The reflection's own sampling
//! draws the directions of the integral, at each point anew. At each point, shadow rays add the light of
//! points and directions. A map is drawn from too, and the balance heuristic combines the two strategies.
//! Constants and projections are smooth, and projections may be negative: these are met by the reflection's
//! draws alone. So no density depends on their sign, and the result is linear in the light, sample by sample.
//! Emitting triangles are met in the same way.

use super::place::Place;
use super::{Estimator, Lamp, Model};
use crate::numeric::order::{max, min};
use crate::numeric::random::Sample;
use crate::numeric::vector::{frame, unit_or_zero};
use crate::trace::Ray;
use crate::world::brdf::Brdf;
use glam::Vec3;

/// Reflections after which a path may end by chance, where nothing limits their number.
const SURE: u32 = 4;

/// The greatest chance that such a path goes on, so that the longest paths in white rooms end too.
const MOST: f32 = 0.95;

/// A reflecting point in its local frame, whose z axis is the normal.
struct Local {
    place: Place,
    axes: [Vec3; 3],
    eye: Vec3,
}

impl Local {
    /// The point turned to the side of the eye. Where the interpolated normal is averted from the eye, the
    /// eye is taken to be just above its horizon. The diffuse part then is that of the techniques, which do
    /// not depend on the eye.
    fn new(place: Place, eye: Vec3) -> Self {
        let place = if eye.dot(place.face) < 0.0 { place.turned() } else { place };
        let [x, y] = frame(place.normal);
        let z = place.normal;
        let local = Vec3::new(eye.dot(x), eye.dot(y), max(eye.dot(z), 1e-3));
        Self { place, axes: [x, y, z], eye: unit_or_zero(local) }
    }

    fn local(&self, direction: Vec3) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| direction.dot(axis)))
    }

    fn world(&self, local: Vec3) -> Vec3 {
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }

    /// Whether light from a world direction reaches the side of the triangle that is seen.
    fn above(&self, direction: Vec3) -> bool {
        self.place.face == Vec3::ZERO || direction.dot(self.place.face) > 0.0
    }
}

/// One sample of the radiance that a place reflects towards the unit vector `eye`, with at most `bounces`
/// reflections.
pub(super) fn reflected(
    scene: &Estimator,
    brdf: &Brdf,
    bounces: Option<u32>,
    place: Place,
    eye: Vec3,
    random: &mut Sample,
) -> Vec3 {
    let Model::Surface { normals, .. } = scene.model else { return Vec3::ZERO };
    let (mut total, mut through) = (Vec3::ZERO, Vec3::ONE);
    let (mut place, mut eye) = (place, eye);
    for bounce in 1..=bounces.unwrap_or(u32::MAX) {
        let local = Local::new(place, eye);
        total += through * direct(scene, brdf, &local, random);
        let (choice, uv) = (random.unit(), random.pair());
        let Some(light) = brdf.sample(local.eye, choice, uv) else { break };
        let direction = unit_or_zero(local.world(light));
        let pdf = brdf.pdf(light, local.eye);
        if !local.above(direction) || pdf <= 0.0 {
            break;
        }
        through *= brdf.value(light, local.eye) * (light.z / pdf);
        let Some(hit) = scene.bvh.nearest(&local.place.ray(direction)) else {
            total += through * scene.lights.weighted_radiance(direction, pdf);
            break;
        };
        total += through * scene.emitted(hit.triangle);
        if bounces.is_none() && bounce >= SURE {
            let chance = min(through.max_element(), MOST);
            if random.unit() >= chance {
                break;
            }
            through /= chance;
        }
        (place, eye) = (Place::new(&scene.mesh, &scene.bvh, &hit, normals), -direction);
    }
    total
}

/// Light that comes straight from points, directions and maps, reflected once.
fn direct(scene: &Estimator, brdf: &Brdf, at: &Local, random: &mut Sample) -> Vec3 {
    let mut total = Vec3::ZERO;
    for caster in &scene.lights.lamps {
        let (ray, towards, irradiance) = arriving(caster, &at.place);
        let light = at.local(towards);
        if light.z > 0.0 && at.above(towards) && !scene.bvh.blocked(&ray) {
            total += brdf.value(light, at.eye) * irradiance * light.z;
        }
    }
    if scene.lights.draw {
        for environment in &scene.lights.skies {
            let Some((direction, pdf)) = environment.sample(random) else { continue };
            let light = at.local(direction);
            if light.z > 0.0 && at.above(direction) && !scene.bvh.blocked(&at.place.ray(direction)) {
                let weight = light.z / (pdf + brdf.pdf(light, at.eye));
                total += brdf.value(light, at.eye) * environment.radiance(direction) * weight;
            }
        }
    }
    total
}

/// The shadow ray from a place to a light, the unit vector towards the light, and the irradiance there of a
/// surface that faces it.
pub(super) fn arriving(caster: &Lamp, place: &Place) -> (Ray, Vec3, Vec3) {
    match *caster {
        Lamp::Point { position, intensity } => {
            let to = position - place.point;
            (place.ray_to(position), unit_or_zero(to), intensity / to.length_squared())
        }
        Lamp::Directional { direction, irradiance } => (place.ray(-direction), -direction, irradiance),
    }
}

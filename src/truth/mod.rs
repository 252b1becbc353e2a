//! Light transport without a technique's approximations, by Monte Carlo: what the techniques are measured
//! against.
//!
//! Three models, each an estimator whose mean is the integral that its file states: light that surfaces
//! reflect ([`Model::Surface`], `path.rs`), light that walks through a homogeneous medium behind a smooth
//! dielectric boundary ([`Model::Medium`], `walk.rs`), and the dipole integrated over the surface
//! ([`Model::Dipole`], `dipole.rs`: Banterle and Chalmers, Eq. 1 and 2). A sample is a function of pixel,
//! number and scene alone (contract 5), and a pixel adds its samples in their order ([`Sums`]), so sums are
//! the same bits on any number of threads and however often a run stops.

mod alias;
mod boundary;
mod clearance;
mod dipole;
mod lights;
mod path;
mod place;
mod settings;
mod state;
mod sums;
mod walk;

pub use boundary::{fresnel, refract};
pub use lights::{Lamp, Lights, Map, Sky};
pub use settings::{KEYS, Settings, Transport};
pub use state::{ANEW, Identity, state_bytes};
pub use sums::Sums;
pub use walk::{Volume, henyey_greenstein, scatter};

use crate::Error;
use crate::numeric::random::Sample;
use crate::numeric::vector::unit_or_zero;
use crate::raster::Axes;
use crate::trace::{Bvh, Hit, Ray};
use crate::world::brdf::Brdf;
use crate::world::camera::Camera;
use crate::world::medium::Medium;
use crate::world::mesh::{Bounds, Mesh};
use clearance::Clearance;
use glam::Vec3;
use place::Place;
use std::sync::Arc;

/// Which normals reflection is computed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Normals {
    /// Those of the triangles: the mesh as it is, which keeps energy.
    Face,
    /// The vertices', interpolated, as the techniques shade. Light that would reach the back of the triangle
    /// or leave through it counts as none, so a little is lost where the two normals differ.
    Interpolated,
}

/// A model of light transport.
#[derive(Debug, Clone)]
pub enum Model {
    /// Surfaces reflect, on both sides.
    Surface {
        /// The reflection.
        brdf: Brdf,
        /// How many reflections a path may have; 1 is light reflected once, 0 what surfaces emit, `None` any
        /// number.
        bounces: Option<u32>,
        /// Normals of the reflections.
        normals: Normals,
    },
    /// The mesh, which must be closed, is the boundary of a medium.
    Medium(Volume),
    /// The dipole's integral over the mesh.
    Dipole {
        /// The medium.
        medium: Medium,
        /// Normals of irradiance and transmittance.
        normals: Normals,
    },
}

/// What samples of the radiance are drawn from: mesh, model and lights.
#[derive(Debug, Clone)]
pub struct Estimator {
    mesh: Arc<Mesh>,
    bvh: Bvh,
    bounds: Bounds,
    /// The clearance from a medium's boundary; `None` for other models.
    clearance: Option<Clearance>,
    model: Model,
    /// What shines from outside.
    pub lights: Lights,
    /// Radiance that each triangle emits on both sides, RGB; empty where none does. Read by
    /// [`Model::Surface`] alone.
    pub emission: Vec<Vec3>,
}

/// Where in a pixel its samples lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filter {
    /// In its centre, which the techniques' passes shade.
    Point,
    /// Evenly over its area.
    Box,
}

/// The camera and the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the image, in pixels.
    pub size: [usize; 2],
    /// Radiance of pixels that see no surface.
    pub background: Vec3,
    /// Where a pixel's samples lie.
    pub filter: Filter,
}

impl Sensor {
    /// Its rays.
    pub fn rays(&self) -> Rays {
        let Camera { position, target, up, .. } = self.camera;
        let tangents = self.camera.tangents(self.size[0], self.size[1]);
        Rays { eye: position, axes: Axes::looking(target - position, up), tangents, size: self.size }
    }
}

/// The rays of a view.
#[derive(Debug, Clone, Copy)]
pub struct Rays {
    eye: Vec3,
    axes: Axes,
    /// The tangents of half the view's angles, across and upward.
    tangents: [f32; 2],
    size: [usize; 2],
}

impl Rays {
    /// The ray through a place in a pixel, counted row by row from the top left as parts of its sides; its
    /// direction is a unit vector.
    pub fn through(&self, pixel: usize, [dx, dy]: [f32; 2]) -> Ray {
        let ([width, height], [across, along]) = (self.size, self.tangents);
        let x = 2.0 * ((pixel % width) as f32 + dx) / width as f32 - 1.0;
        let y = 1.0 - 2.0 * ((pixel / width) as f32 + dy) / height as f32;
        let direction = self.axes.forward + self.axes.right * (x * across) + self.axes.up * (y * along);
        Ray::new(self.eye, unit_or_zero(direction))
    }
}

impl Estimator {
    /// An estimator without emitting triangles.
    pub fn new(mesh: impl Into<Arc<Mesh>>, model: Model, lights: Lights) -> Self {
        let mesh = mesh.into();
        let (bvh, bounds) = (Bvh::new(&mesh), mesh.bounds());
        let walks = matches!(model, Model::Medium(_));
        let clearance = walks.then(|| Clearance::new(bvh.corners(), &bounds));
        Self { mesh, bvh, bounds, clearance, model, lights, emission: Vec::new() }
    }

    /// Refuses scenes that the model's samples would not estimate.
    ///
    /// # Errors
    /// [`Model::Medium`] of a mesh that is not closed, of a medium that is empty in some channel, and of η ≠
    /// 1 under a light that is a point or a direction: no path through a boundary that refracts can be joined
    /// to one.
    pub fn check(&self) -> Result<(), Error> {
        match &self.model {
            Model::Medium(volume) => walk::check(self, volume),
            _ => Ok(()),
        }
    }

    /// The model of light transport.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The BLAKE3 digest of the mesh and of the environments, as hexadecimal digits.
    pub fn digest(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut vectors = |vectors: &[Vec3]| {
            hasher.update(&(vectors.len() as u64).to_le_bytes());
            for x in vectors.iter().flat_map(Vec3::to_array) {
                hasher.update(&x.to_le_bytes());
            }
        };
        vectors(&self.mesh.positions);
        vectors(&self.mesh.normals);
        self.lights.skies.iter().for_each(|environment| vectors(&environment.values()));
        for corner in self.mesh.triangles.as_flattened() {
            hasher.update(&corner.to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Whether a closed mesh has a point inside: a ray from there leaves it through an odd number of
    /// triangles.
    pub fn encloses(&self, point: Vec3) -> bool {
        // A direction along which models hardly have edges or faces.
        let mut ray = Ray::new(point, Vec3::new(0.531, 0.683, 0.502));
        let mut crossings = 0;
        while let Some(hit) = self.bvh.nearest(&ray) {
            crossings += 1;
            ray = Place::new(&self.mesh, &self.bvh, &hit, Normals::Face).ray(ray.direction);
        }
        crossings % 2 == 1
    }

    /// Adds samples of the radiance that each pixel sees, until each has `samples`. `told` is called now and
    /// then with the number of pixels that have them. The sums' elements are pixels, row by row from the top
    /// left.
    pub fn pixels(&self, view: &Sensor, sums: &mut Sums, samples: u64, told: &mut dyn FnMut(usize)) {
        let rays = view.rays();
        let look = |pixel: usize, at: [f32; 2]| {
            let ray = rays.through(pixel, at);
            (-ray.direction, self.bvh.nearest(&ray))
        };
        let of = |pixel| {
            // Where all samples of a pixel look along one ray, it is traced once.
            let same = (view.filter == Filter::Point).then(|| look(pixel, [0.5; 2]));
            move |random: &mut Sample| {
                let (eye, hit) = same.unwrap_or_else(|| look(pixel, random.pair()));
                hit.map_or(view.background, |hit| self.sent(&hit, eye, random))
            }
        };
        sums.advance(samples, of, told);
    }

    /// One sample of the radiance that arrives at the ray's origin against its direction, a unit vector, RGB;
    /// none where the ray meets no surface. The origin of a ray towards a medium is outside of it.
    pub fn along(&self, ray: &Ray, random: &mut Sample) -> Option<Vec3> {
        let hit = self.bvh.nearest(ray)?;
        Some(self.sent(&hit, -ray.direction, random))
    }

    /// One sample of the radiance that leaves a hit towards the unit vector `eye`, RGB.
    fn sent(&self, hit: &Hit, eye: Vec3, random: &mut Sample) -> Vec3 {
        let place = |normals| Place::new(&self.mesh, &self.bvh, hit, normals);
        match &self.model {
            Model::Surface { brdf, bounces, normals } => {
                let place = place(*normals);
                self.emitted(place.triangle) + path::reflected(self, brdf, *bounces, place, eye, random)
            }
            Model::Medium(volume) => walk::seen(self, volume, place(Normals::Face), eye, random),
            Model::Dipole { medium, normals } => {
                dipole::seen(self, medium, *normals, place(*normals), eye, random)
            }
        }
    }

    /// One sample of the radiance that leaves a point with a normal of its own towards the unit vector `eye`,
    /// RGB, by reflection: what a technique that computes in vertices is compared with. Rays start exactly in
    /// `point`; one that starts in a vertex does not meet the triangles around it.
    ///
    /// # Panics
    /// Where the model is not [`Model::Surface`].
    pub fn leaving(&self, point: Vec3, normal: Vec3, eye: Vec3, random: &mut Sample) -> Vec3 {
        let Model::Surface { brdf, bounces, .. } = &self.model else {
            panic!("light leaves a point by reflection in Model::Surface alone")
        };
        path::reflected(self, brdf, *bounces, Place::free(point, normal), eye, random)
    }

    /// Adds samples of the radiance that leaves each vertex of the mesh along its normal, until each has
    /// `samples`. Of a diffuse surface this is the radiance in every direction, which techniques compute at
    /// vertices. The sums' elements are vertices.
    ///
    /// # Panics
    /// As [`Self::leaving`].
    pub fn vertices(&self, sums: &mut Sums, samples: u64) {
        let Mesh { positions, normals, .. } = &*self.mesh;
        let of = |vertex: usize| {
            let (point, normal) = (positions[vertex], normals[vertex]);
            move |random: &mut Sample| self.leaving(point, normal, normal, random)
        };
        sums.advance(samples, of, &mut |_| {});
    }

    fn emitted(&self, triangle: u32) -> Vec3 {
        self.emission.get(triangle as usize).copied().unwrap_or_default()
    }
}

//! What a frame is made of: meshes and the procedural shapes, cameras, lights and materials.

pub mod brdf;
pub mod camera;
pub mod decimate;
pub mod deform;
pub mod light;
pub mod medium;
pub mod mesh;
pub mod obj;
pub mod shapes;
mod stage;
pub mod write;

pub use stage::Stage;

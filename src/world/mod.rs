//! What a frame is made of: meshes and the procedural shapes, cameras, lights and materials.

pub mod mesh;

//! What is kept on disk: single files, read up to a length and written whole or not at all; the files of a
//! frame; and stores, folders of `.npy` files under a manifest ([`Store`]). Only this folder and the command
//! touch files.

pub mod file;
mod folder;
#[cfg(feature = "exr")]
mod frame;
mod manifest;

pub use folder::{Store, check, read};
#[cfg(feature = "exr")]
pub use frame::Files;
pub use manifest::Manifest;

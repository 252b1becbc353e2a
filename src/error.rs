//! The one error type: what is wrong, where (file, line, key), and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// What stopped a call, for a person: printed as `file:line: key: what; remedy`.
///
/// An error always means bad input or a refusing system (exit status 2 of the command), never a failed check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// What is wrong, in one sentence without a full stop.
    pub what: String,
    /// The file that it is wrong in.
    pub file: Option<PathBuf>,
    /// The line of the file, from 1.
    pub line: Option<usize>,
    /// The key of the scene, such as `camera.fov`.
    pub key: Option<String>,
    /// What would put it right.
    pub remedy: Option<String>,
}

impl Error {
    /// An error that says `what` and nothing else yet.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), file: None, line: None, key: None, remedy: None }
    }

    /// Names the file, unless one is named already.
    #[must_use]
    pub fn file(mut self, file: impl AsRef<Path>) -> Self {
        self.file.get_or_insert_with(|| file.as_ref().to_path_buf());
        self
    }

    /// Names the line, from 1, unless one is named already.
    #[must_use]
    pub fn line(mut self, line: usize) -> Self {
        self.line.get_or_insert(line);
        self
    }

    /// Names the scene's key, unless one is named already.
    #[must_use]
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.key.get_or_insert_with(|| key.into());
        self
    }

    /// Says what would put it right, unless that is said already.
    #[must_use]
    pub fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy.get_or_insert_with(|| remedy.into());
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(out, "{}:", file.display())?;
            if let Some(line) = self.line {
                write!(out, "{line}:")?;
            }
            out.write_str(" ")?;
        }
        if let Some(key) = &self.key {
            write!(out, "{key}: ")?;
        }
        out.write_str(&self.what)?;
        if let Some(remedy) = &self.remedy {
            write!(out, "; {remedy}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

//! The one error type: what is wrong, where (file, line, key), and what to do.

use std::fmt;
use std::path::{Path, PathBuf};

/// What stopped a call, in words for a person. It is printed as `file:line: key: what; remedy`.
///
/// An error always means bad input or a refusing system (exit status 2 of the command), never a failed check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// What is wrong, in one sentence without a full stop.
    pub what: String,
    /// The file that is wrong.
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
    /// Says what would put it right, in place of what was said before.
    #[must_use]
    pub fn cure(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = Some(remedy.into());
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

/// The known name that is nearest to `name`, if it is near enough to be what was meant.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = known.into_iter().map(|other| (edits(name, other), other)).min()?;
    (near.0 <= 2 + name.len() / 4).then_some(near.1)
}

/// The error for a `name` that is none of the `known` ones. It suggests the nearest and lists all.
pub(crate) fn unknown(kind: &str, name: &str, known: &[&str]) -> Error {
    let all = format!("there are {}", known.join(", "));
    Error::new(format!("there is no {kind} \"{name}\"")).remedy(match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"? {all}"),
        None => all,
    })
}

/// How many characters must be put in, taken out or changed to make `a` of `b` (Levenshtein 1966).
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_reads_from_the_place_to_the_remedy() {
        let error = Error::new("is no number").file("a.toml").line(3).key("camera.fov").remedy("write 45");
        assert_eq!(error.to_string(), "a.toml:3: camera.fov: is no number; write 45");
        assert_eq!(error.file("b.toml").to_string(), "a.toml:3: camera.fov: is no number; write 45");
    }

    #[test]
    fn the_nearest_name_is_found_or_none() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(nearest("widht", ["width", "height"]), Some("width"));
        assert_eq!(nearest("colour", ["width", "height"]), None);
        let error = unknown("probe", "grase", &["uffizi", "grace"]).to_string();
        assert_eq!(error, "there is no probe \"grase\"; did you mean \"grace\"? there are uffizi, grace");
    }
}

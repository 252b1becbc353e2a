//! Comparing two dumps: EXR or NPY files, or two folders of them, layer by layer.

use super::{Difference, Statistics, mismatch, picture, statistics};
use crate::Error;
use crate::pass::{Channel, Info, Layer};
use crate::store::file;
use crate::techniques::ALL;
use serde_json::{Value as Json, json};
use std::fmt;
use std::path::{Path, PathBuf};

/// What came of one layer, or of a file that one folder lacks.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The file's name, the same in both folders; empty where two files were compared.
    pub file: String,
    /// The layer: its name in the file, else the file's name without its ending.
    pub layer: String,
    /// The shape of an array (`.npy`), whose last axis is the layer's width; empty for an image.
    pub shape: Vec<usize>,
    /// The result.
    pub outcome: Outcome,
    /// The picture of the difference, where one was written.
    pub picture: Option<PathBuf>,
}

/// How a layer of A compares with that of B.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// They were compared value by value, and may be the same.
    Compared(Statistics),
    /// Size, channels or type differ; the text says how.
    Mismatch(String),
    /// B has no such layer or file.
    OnlyInA,
    /// A has no such layer or file.
    OnlyInB,
}

/// A layer of a file, and its shape if it is an array.
type Part = (Layer, Vec<usize>);

/// Compares two EXR or NPY files, or two folders of them, whose files are paired by name. Layers are paired
/// by name. Rows come in A's order, then those of layers that B alone has. Where each file has a single layer
/// and one of the two has no name, these two are a pair: an array has no name, and a foreign file's layer may
/// have none. EXR's half floats are compared as `f32`.
///
/// `tolerance` is that of [`statistics`]. `pictures` is a folder for a [`picture`] of each image that
/// differs.
///
/// # Errors
/// A file that cannot be read, a file beside a folder, a folder without such files; what the system refuses.
/// A difference is no error.
pub fn files(a: &Path, b: &Path, tolerance: f64, pictures: Option<&Path>) -> Result<Vec<Row>, Error> {
    let pair = |a: &Path, b: &Path, name: &str| {
        let mut rows = paired(parts(a)?, parts(b)?, tolerance, pictures, stem(a))?;
        rows.iter_mut().for_each(|row| row.file = name.into());
        Ok(rows)
    };
    for path in [a, b] {
        if !file::is_file(path) && !file::is_folder(path) {
            return Err(Error::new("cannot be read: there is no such file")
                .file(path)
                .remedy("check the path"));
        }
    }
    match (file::is_folder(a), file::is_folder(b)) {
        (false, false) => return pair(a, b, ""),
        (true, true) => {}
        (a_is_folder, _) => {
            let error = Error::new("is a folder, and the other is a file");
            let folder = if a_is_folder { a } else { b };
            return Err(error.file(folder).remedy("compare two files or two folders"));
        }
    }
    let (ours, theirs) = (names(a)?, names(b)?);
    let mut rows = Vec::new();
    let alone = |name: &String, outcome: Outcome| Row {
        file: name.clone(),
        layer: stem(Path::new(name)).into(),
        shape: Vec::new(),
        outcome,
        picture: None,
    };
    for name in &ours {
        if theirs.contains(name) {
            rows.extend(pair(&a.join(name), &b.join(name), name)?);
        } else {
            rows.push(alone(name, Outcome::OnlyInA));
        }
    }
    let only_b = theirs.iter().filter(|name| !ours.contains(name));
    rows.extend(only_b.map(|name| alone(name, Outcome::OnlyInB)));
    Ok(rows)
}

/// The pass that diverges first in flow order ([`crate::techniques::ALL`]), of those that both dumps have.
/// Layers of no known pass follow, in the order of `rows`, and are named themselves.
pub fn diverges_first(rows: &[Row]) -> Option<&str> {
    let both = |row: &&Row| !row.same() && !matches!(row.outcome, Outcome::OnlyInA | Outcome::OnlyInB);
    let first = rows.iter().filter(both).min_by_key(|row| row.pass().map_or(usize::MAX, |(order, _)| order));
    first.map(|row| row.pass().map_or(row.layer.as_str(), |(_, name)| name))
}

impl Row {
    /// Whether both have the layer and no value differs by more than the tolerance.
    pub fn same(&self) -> bool {
        matches!(&self.outcome, Outcome::Compared(statistics) if statistics.difference.is_none())
    }

    /// The place in flow order, and the name, of the layer's pass.
    fn pass(&self) -> Option<(usize, &'static str)> {
        let of = |name: &str| {
            let before = self.layer.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'));
            let behind = self.layer.strip_suffix(name).is_some_and(|rest| rest.ends_with('.'));
            self.layer == name || before || behind
        };
        passes().map(|info| info.name).enumerate().find(|(_, name)| of(name))
    }

    /// Where the first difference is: an array's indices, or column, row and channel of an image.
    fn place(&self, Difference { pixel: [x, y], channel, .. }: &Difference) -> String {
        match self.shape.last() {
            None => format!("pixel ({x}, {y}), channel {channel}"),
            Some(_) => format!("{:?}", self.indices([*x, *y])),
        }
    }

    fn indices(&self, [x, y]: [usize; 2]) -> Vec<usize> {
        let mut rest = y * self.shape.last().unwrap_or(&1) + x;
        let mut indices = vec![0; self.shape.len()];
        for (index, length) in indices.iter_mut().zip(&self.shape).rev() {
            (*index, rest) = (rest % length, rest / length);
        }
        indices
    }

    /// The row as an object of JSON: `file` and `layer`; `result`, which is one of `same`, `differs`,
    /// `mismatch`, `only in A` and `only in B`; what [`Statistics`] has; `first`, the first difference with
    /// `index` for an array, else `column`, `row` and `channel`; `picture`. A value that JSON has no number
    /// for is text, such as `"NaN"`.
    pub fn to_json(&self) -> Json {
        let mut json = json!({"layer": self.layer, "result": self.result()});
        if !self.file.is_empty() {
            json["file"] = json!(self.file);
        }
        match &self.outcome {
            Outcome::Compared(statistics) => {
                json["largest"] = json!(statistics.largest);
                json["mean"] = json!(statistics.mean);
                json["rmse"] = json!(statistics.rmse);
                json["not_finite"] = json!(statistics.not_finite);
                json["pixels"] = json!(statistics.difference.as_ref().map_or(0, |first| first.pixels));
                if let Some(first) = &statistics.difference {
                    json["first"] = self.first(first);
                }
            }
            Outcome::Mismatch(what) => json["mismatch"] = json!(what),
            Outcome::OnlyInA | Outcome::OnlyInB => {}
        }
        if let Some(path) = &self.picture {
            json["picture"] = json!(path.to_string_lossy());
        }
        json
    }

    fn first(&self, Difference { pixel: [x, y], channel, values, ulps, .. }: &Difference) -> Json {
        let [a, b] = values.map(|value| if value.is_finite() { json!(value) } else { json!(text(value)) });
        if self.shape.is_empty() {
            json!({"column": x, "row": y, "channel": channel, "a": a, "b": b, "ulps": ulps})
        } else {
            json!({"index": self.indices([*x, *y]), "a": a, "b": b, "ulps": ulps})
        }
    }

    fn result(&self) -> &'static str {
        match &self.outcome {
            Outcome::Compared(_) if self.same() => "same",
            Outcome::Compared(_) => "differs",
            Outcome::Mismatch(_) => "mismatch",
            Outcome::OnlyInA => "only in A",
            Outcome::OnlyInB => "only in B",
        }
    }
}

impl fmt::Display for Row {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:<9} ", self.result())?;
        if !self.file.is_empty() && matches!(self.outcome, Outcome::OnlyInA | Outcome::OnlyInB) {
            return out.write_str(&self.file);
        }
        if !self.file.is_empty() {
            write!(out, "{}: ", self.file)?;
        }
        out.write_str(&self.layer)?;
        let statistics = match &self.outcome {
            Outcome::Compared(statistics) => statistics,
            Outcome::Mismatch(what) => return write!(out, ": {what}"),
            Outcome::OnlyInA | Outcome::OnlyInB => return Ok(()),
        };
        let Statistics { largest, mean, rmse, not_finite, difference } = statistics;
        if difference.is_some() || *largest > 0.0 {
            write!(out, ": largest {largest:.3e}, mean {mean:.3e}, RMSE {rmse:.3e}")?;
        }
        if *not_finite > 0 {
            write!(out, "; {not_finite} values are not finite")?;
        }
        if let Some(first) = difference {
            let ([a, b], pixels) = (first.values.map(text), first.pixels);
            let things = if self.shape.is_empty() { "pixels" } else { "values" };
            write!(out, "; {pixels} {things} differ, first {}: ", self.place(first))?;
            write!(out, "{a} in A, {b} in B ({} ULP)", first.ulps)?;
        }
        if let Some(path) = &self.picture {
            write!(out, "; see {}", path.display())?;
        }
        Ok(())
    }
}

/// The shortest decimal that reads as this number; of a number that fits `f32`, the shortest that reads as
/// that `f32`.
fn text(value: f64) -> String {
    let short = value as f32;
    if f64::from(short) == value { format!("{short:?}") } else { format!("{value:?}") }
}

/// Every pass of every technique, in flow order.
fn passes() -> impl Iterator<Item = &'static Info> {
    ALL.iter().flat_map(|technique| technique.passes)
}

fn stem(path: &Path) -> &str {
    path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default()
}

/// The names of the EXR and NPY files of a folder, sorted.
fn names(folder: &Path) -> Result<Vec<String>, Error> {
    let mut names = Vec::new();
    for path in file::entries(folder)? {
        if path.extension().is_some_and(|ending| ending == "exr" || ending == "npy") {
            names.extend(path.file_name().map(|name| name.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    if names.is_empty() {
        let error = Error::new("has no .exr and no .npy file").file(folder);
        return Err(error.remedy("`bitlight render SCENE --passes all -o DIR` writes such a folder"));
    }
    Ok(names)
}

/// The layers of a file; an array is one without a name.
fn parts(path: &Path) -> Result<Vec<Part>, Error> {
    if path.extension().is_some_and(|ending| ending == "npy") {
        let buffer = file::read_npy(path).map_err(|error| error.remedy("name a file that can be read"))?;
        let width = buffer.shape.last().copied().unwrap_or(1);
        let height = buffer.data.len().checked_div(width).unwrap_or(0);
        let channels = vec![Channel { name: "Y".into(), data: buffer.data }];
        return Ok(vec![(Layer { name: String::new(), width, height, channels }, buffer.shape)]);
    }
    let layers =
        file::read_exr(path).map_err(|error| error.remedy("name an EXR file, or an NPY file (.npy)"))?;
    Ok(layers.into_iter().map(|layer| (layer, Vec::new())).collect())
}

/// Compares the layers of two files; `stem` is the name of a layer that has none.
fn paired(
    ours: Vec<Part>,
    theirs: Vec<Part>,
    tolerance: f64,
    pictures: Option<&Path>,
    stem: &str,
) -> Result<Vec<Row>, Error> {
    let single = ours.len() == 1 && theirs.len() == 1;
    let mut theirs: Vec<Option<Part>> = theirs.into_iter().map(Some).collect();
    let label = |names: [&str; 2]| names.into_iter().find(|name| !name.is_empty()).unwrap_or(stem).to_owned();
    let mut rows = Vec::new();
    for (a, shape) in ours {
        let unnamed = |b: &Layer| single && (a.name.is_empty() || b.name.is_empty());
        let place =
            theirs.iter().position(|part| part.as_ref().is_some_and(|(b, _)| b.name == a.name || unnamed(b)));
        let Some((b, other)) = place.and_then(|place| theirs[place].take()) else {
            let (layer, file) = (label([&a.name, ""]), String::new());
            rows.push(Row { file, layer, shape, outcome: Outcome::OnlyInA, picture: None });
            continue;
        };
        let layer = label([&a.name, &b.name]);
        let outcome = match mismatched(&shape, &other).or_else(|| mismatch(&a, &b)) {
            Some(what) => Outcome::Mismatch(what),
            None => Outcome::Compared(statistics(&a, &b, tolerance)),
        };
        let mut row = Row { file: String::new(), layer, shape, outcome, picture: None };
        if let (Some(folder), Outcome::Compared(_), true) = (pictures, &row.outcome, row.shape.is_empty())
            && !row.same()
        {
            let path = folder.join(format!("{stem}.{}.difference.png", plain(&row.layer)));
            picture(&path, &a, &b, tolerance)?;
            row.picture = Some(path);
        }
        rows.push(row);
    }
    rows.extend(theirs.into_iter().flatten().map(|(b, shape)| Row {
        file: String::new(),
        layer: label([&b.name, ""]),
        shape,
        outcome: Outcome::OnlyInB,
        picture: None,
    }));
    Ok(rows)
}

/// How the shapes of two arrays differ.
fn mismatched(a: &[usize], b: &[usize]) -> Option<String> {
    let kind = |shape: &[usize]| match shape {
        [] => "an image".to_owned(),
        shape => format!("an array of shape {shape:?}"),
    };
    (a != b).then(|| format!("{} in A, {} in B", kind(a), kind(b)))
}

/// A layer's name as part of a file's name: a foreign one may hold anything.
fn plain(name: &str) -> String {
    let allowed = |letter: char| letter.is_alphanumeric() || "._-".contains(letter);
    name.chars().map(|letter| if allowed(letter) { letter } else { '_' }).collect()
}

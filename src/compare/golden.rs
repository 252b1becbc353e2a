//! Golden buffers: what every pass of a scene must be, bit for bit.
//!
//! A golden is a manifest beside its pixels: `golden/<technique>/<scene>.json` has the settings and the
//! digest of every pass; one scene a technique also keeps its pixels in the folder `<scene>/`, so that the
//! first pixel that differs can be named. [`Golden::record`] is the only writer, and `bless` its only caller.

use crate::Error;
use crate::keys::difference as first_difference;
use crate::pass::{Buffer, Digests, Info, Kept, Record};
use crate::run;
use crate::scene::{Assets, Scene};
use crate::store::file;
use serde_json::{Map, Value as Json};
use std::path::{Path, PathBuf};

#[cfg(feature = "exr")]
use super::{Difference, difference};
#[cfg(feature = "exr")]
use crate::pass::{Layer, layers};
#[cfg(feature = "exr")]
use serde_json::json;
#[cfg(feature = "exr")]
use std::io::Write;

/// The longest manifest that is read, in bytes.
const MAX_BYTES: u64 = 16 << 20;

/// The manifest of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Golden {
    /// The manifest's file.
    pub file: PathBuf,
    /// Assignments under which the scene is rendered, mostly to make it smaller.
    pub set: Vec<String>,
    /// The settings of the scene when it was made.
    pub settings: Map<String, Json>,
    /// Every pass, in flow order.
    pub passes: Vec<Record>,
    /// Whether pixels are kept beside it.
    pub pixels: bool,
}

/// What the pixels beside a manifest say of a pass that differs.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// None are kept for this scene, or this build reads none.
    None,
    /// The first value of a pass that is no image: its place, what was expected and what was found.
    Value(Vec<usize>, f32, f32),
    /// The first pixel that differs, and both layers, of which a picture can be made.
    #[cfg(feature = "exr")]
    Image(Box<(Difference, Layer, Layer)>),
}

/// How a scene compares with its golden.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Every pass has the golden's bits; the number of passes.
    Same(usize),
    /// There is no golden; the path where it was looked for.
    Missing(PathBuf),
    /// An asset that the scene names is not there.
    Skipped(Error),
    /// A setting differs: the key, the golden's value and the scene's.
    Settings(String, Json, Json),
    /// The golden has other passes than the technique now has.
    Passes(String),
    /// The first pass that differs, and the first pixel if pixels are kept.
    Differs(String, Pixels),
}

impl Golden {
    /// The manifest's path for a scene: below `golden` as the scene is below its folder `scenes`.
    pub fn path(golden: &Path, scene: &Path) -> PathBuf {
        let parts: Vec<_> = scene.components().collect();
        let below = parts
            .iter()
            .rposition(|part| part.as_os_str() == "scenes")
            .map_or(parts.len().max(1) - 1, |at| at + 1);
        golden.join(parts[below..].iter().collect::<PathBuf>()).with_extension("json")
    }

    /// Reads the manifest of a scene, if there is one.
    ///
    /// # Errors
    /// A file that is no manifest, naming it.
    pub fn read(golden: &Path, scene: &Path) -> Result<Option<Self>, Error> {
        let path = Self::path(golden, scene);
        let read = file::read_if_there(&path, MAX_BYTES, "");
        let Some(bytes) = read.map_err(|error| error.cure("restore it from version control"))? else {
            return Ok(None);
        };
        let parsed = serde_json::from_slice::<Json>(&bytes).ok();
        let parsed = parsed.and_then(|json| Self::from_json(&json, &path));
        parsed.map(Some).ok_or_else(|| {
            Error::new("is no golden manifest").file(&path).remedy("restore it from version control")
        })
    }

    fn from_json(json: &Json, file: &Path) -> Option<Self> {
        let set = json["set"].as_array()?.iter().map(|set| set.as_str().map(str::to_owned));
        Some(Self {
            file: file.into(),
            set: set.collect::<Option<_>>()?,
            settings: json["settings"].as_object()?.clone(),
            passes: json["passes"].as_array()?.iter().map(Record::from_json).collect::<Option<_>>()?,
            pixels: json["pixels"].as_bool()?,
        })
    }

    /// Renders `scene` under the golden's settings and compares every pass with it.
    ///
    /// # Errors
    /// Bad input: a scene that cannot be read or rendered, a damaged golden. A difference is no error.
    pub fn verify(golden: &Path, scene: &Path, assets: &Assets) -> Result<Verdict, Error> {
        let Some(golden) = Self::read(golden, scene)? else {
            Scene::read(scene, &[])?; // a scene that is not there is bad input, not a missing golden
            return Ok(Verdict::Missing(Self::path(golden, scene)));
        };
        golden.check(&Scene::read(scene, &golden.set)?, assets)
    }

    /// Renders a scene that was read under the golden's assignments, and compares every pass with it.
    ///
    /// # Errors
    /// A scene that cannot be rendered, a damaged golden. A difference is no error.
    pub fn check(&self, scene: &Scene, assets: &Assets) -> Result<Verdict, Error> {
        if let Some(error) = scene.assets().into_iter().find_map(|name| assets.find(name).err()) {
            return Ok(Verdict::Skipped(error));
        }
        if let Some((key, golden, now)) = first_difference(&self.settings, &scene.settings()) {
            return Ok(Verdict::Settings(key.into(), golden.clone(), now.clone()));
        }
        let (kept, digests) = render(scene, assets)?;
        self.compare(&kept, &digests)
    }

    /// Compares passes that were rendered under the golden's settings.
    ///
    /// # Errors
    /// A damaged golden.
    pub fn compare(&self, kept: &Kept, digests: &[Record]) -> Result<Verdict, Error> {
        let names = |records: &[Record]| records.iter().map(|record| record.name.clone()).collect::<Vec<_>>();
        let (ours, theirs) = (names(digests), names(&self.passes));
        if ours != theirs {
            let odd = ours
                .iter()
                .find(|name| !theirs.contains(name))
                .or(theirs.iter().find(|name| !ours.contains(name)));
            let odd = odd.map_or("their order".to_owned(), Clone::clone);
            return Ok(Verdict::Passes(odd));
        }
        for (expected, found) in self.passes.iter().zip(digests) {
            if expected != found {
                let pixels = match kept.0.iter().find(|(info, ..)| info.name == found.name) {
                    Some((info, _, buffer)) => self.pixels(expected, info, buffer)?,
                    None => Pixels::None,
                };
                return Ok(Verdict::Differs(found.name.clone(), pixels));
            }
        }
        Ok(Verdict::Same(digests.len()))
    }

    /// The first pixel that differs from those that are kept.
    #[cfg(feature = "exr")]
    fn pixels(&self, expected: &Record, info: &Info, buffer: &Buffer) -> Result<Pixels, Error> {
        if !self.pixels || expected.shape != buffer.shape {
            return Ok(Pixels::None);
        }
        let folder = self.file.with_extension("");
        if !info.is_image() {
            let file = folder.join(format!("{}.npy", info.name));
            let kept = file::read_npy(&file)?;
            if kept.shape != buffer.shape || kept.data.type_name() != buffer.data.type_name() {
                return Err(damaged(&file));
            }
            let (a, b) = (kept.as_f32(), buffer.as_f32());
            let first = (0..a.len()).find(|index| a[*index] != b[*index]);
            return Ok(first.map_or(Pixels::None, |at| Pixels::Value(buffer.place(at), a[at], b[at])));
        }
        let file = folder.join("passes.exr");
        let kept = file::read_exr(&file)?;
        for mut found in layers(info, buffer) {
            found.channels.sort_by(|a, b| a.name.cmp(&b.name)); // as EXR does
            let Some(expected) = kept.iter().find(|layer| layer.name == found.name) else { continue };
            if !expected.same_form(&found) {
                return Err(damaged(&file));
            }
            if let Some(difference) = difference(expected, &found) {
                return Ok(Pixels::Image(Box::new((difference, expected.clone(), found))));
            }
        }
        Ok(Pixels::None)
    }

    #[cfg(not(feature = "exr"))]
    fn pixels(&self, _: &Record, _: &Info, _: &Buffer) -> Result<Pixels, Error> {
        Ok(Pixels::None)
    }

    /// Renders `scene` and puts the result in the golden's place. Returns what changed, a line a pass; where
    /// nothing changed, nothing is written. Beside the manifest, `<scene>.history` keeps `date`, `reason` and
    /// those lines.
    ///
    /// `set` and `pixels` replace what the golden has; where they are `None`, that stays.
    ///
    /// # Errors
    /// A scene that cannot be read or rendered; what the system refuses.
    #[cfg(feature = "exr")]
    pub fn record(
        golden: &Path,
        scene: &Path,
        assets: &Assets,
        set: Option<Vec<String>>,
        pixels: Option<bool>,
        [date, reason]: [&str; 2],
    ) -> Result<Vec<String>, Error> {
        let old = Self::read(golden, scene)?;
        let kept_set = old.as_ref().map(|old| old.set.clone()).unwrap_or_default();
        let set = set.unwrap_or(kept_set);
        let loaded = Scene::read(scene, &set)?;
        let (kept, passes) = render(&loaded, assets)?;
        let new = Self {
            file: Self::path(golden, scene),
            set,
            settings: loaded.settings(),
            passes,
            pixels: pixels.unwrap_or(old.as_ref().is_some_and(|old| old.pixels)),
        };
        if old.as_ref() == Some(&new) {
            return Ok(Vec::new());
        }
        let changes = new.changes(old.as_ref());
        new.write(&kept)?;
        let history = new.file.with_extension("history");
        let before = file::read_if_there(&history, MAX_BYTES, "begin another")?.unwrap_or_default();
        file::write(&history, |out| {
            out.write_all(&before)?;
            writeln!(out, "{date} {reason}")?;
            changes.iter().try_for_each(|change| writeln!(out, "  {change}"))
        })?;
        Ok(changes)
    }

    #[cfg(feature = "exr")]
    fn write(&self, kept: &Kept) -> Result<(), Error> {
        let folder = self.file.with_extension("");
        let made = if self.pixels { &folder } else { self.file.parent().unwrap_or(&folder) };
        file::make_folder(made)?;
        if self.pixels {
            let images: Vec<_> = kept.0.iter().filter(|(info, ..)| info.is_image()).collect();
            let images: Vec<Layer> =
                images.iter().flat_map(|(info, _, buffer)| layers(info, buffer)).collect();
            file::write_exr(&folder.join("passes.exr"), &images)?;
            for (info, _, buffer) in kept.0.iter().filter(|(info, ..)| !info.is_image()) {
                file::write_npy(&folder.join(format!("{}.npy", info.name)), buffer)?;
            }
        }
        let passes: Vec<_> = self.passes.iter().map(Record::to_json).collect();
        let json =
            json!({"set": self.set, "pixels": self.pixels, "settings": self.settings, "passes": passes});
        file::write(&self.file, |out| writeln!(out, "{json:#}"))
    }

    /// What differs from `old`: settings first, then passes.
    #[cfg(feature = "exr")]
    fn changes(&self, old: Option<&Self>) -> Vec<String> {
        let Some(old) = old else {
            return self.passes.iter().map(|pass| format!("{}: new, {}", pass.name, head(pass))).collect();
        };
        let mut changes = Vec::new();
        if let Some((key, ..)) = first_difference(&old.settings, &self.settings) {
            changes.push(format!("settings: {key} and perhaps others"));
        }
        if old.pixels != self.pixels {
            changes
                .push(format!("pixels: {}", if self.pixels { "kept from now on" } else { "no longer kept" }));
        }
        for pass in &self.passes {
            match old.passes.iter().find(|old| old.name == pass.name) {
                None => changes.push(format!("{}: new, {}", pass.name, head(pass))),
                Some(old) if old != pass => {
                    changes.push(format!("{}: {} to {}", pass.name, head(old), head(pass)));
                }
                Some(_) => {}
            }
        }
        let gone = old.passes.iter().filter(|old| self.passes.iter().all(|pass| pass.name != old.name));
        changes.extend(gone.map(|old| format!("{}: gone", old.name)));
        changes
    }
}

/// The error for kept pixels of another shape or type than the manifest beside them says.
#[cfg(feature = "exr")]
fn damaged(file: &Path) -> Error {
    Error::new("does not fit its manifest").file(file).remedy("restore both from version control")
}

/// The start of a pass's digest, to tell it from others.
#[cfg(feature = "exr")]
fn head(pass: &Record) -> &str {
    pass.digest.get(..16).unwrap_or(&pass.digest)
}

/// Every pass of a scene, with its digest.
fn render(scene: &Scene, assets: &Assets) -> Result<(Kept, Vec<Record>), Error> {
    let (mut kept, mut digests) = (Kept::default(), Digests::default());
    let all = scene.technique.wanted("all")?;
    run::render(scene, assets, &all, &mut vec![&mut kept as &mut dyn crate::pass::Recorder, &mut digests])?;
    Ok((kept, digests.0))
}

//! What was baked, on disk: a folder of `.npy` files, a chunk of each pose a file, and what each must be.
//!
//! ```text
//! manifest.json            what was baked, and for each finished pose its chunks: shape, type, digest
//! pose.0007.vectors.npy    the chunk `vectors` of pose 7; NumPy opens it
//! .writers .lock           empty files that processes lock
//! ```
//!
//! A pose's chunks are written first, each whole or not at all, and its lines of the manifest after them. So a process may be
//! killed at any time, and the next goes on behind the last finished pose. Several processes may write into one store, at the same time too:
//! the manifest is read anew and rewritten under the lock of `.lock`, with its poses in their order, and no time, path, host
//! or number of threads in it, so the same poses give the same bytes whoever baked them in what order.
//!
//! A killed process leaves its temporary files (`.….tmp`). Whoever opens the store for writing while nobody else has it open,
//! which the lock of `.writers` tells, removes them; a reader ignores them.
//!
//! The manifest ends with a digest of its own, and must be, as each chunk's header, to the byte what is written here: a
//! flipped byte shows wherever it is.

use crate::Error;
use crate::pass::file;
use crate::pass::{Buffer, Record, npy};
use serde_json::{Map, Value as Json, json};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The most of a manifest that is read, in bytes.
const MAX_BYTES: u64 = 256 << 20;

/// What the manifest says that it is. Changes with the meaning of the files and with every change of the bits that are
/// baked, so that no store mixes them; `tests/store.rs` knows a digest.
const FORMAT: &str = "bitlight store 1";

const MANIFEST: &str = "manifest.json";

/// What a store must be.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// What the poses were baked from: texts by key, since a number need not survive JSON to the bit.
    pub scene: Map<String, Json>,
    /// The chunks of each finished pose.
    pub poses: BTreeMap<u32, Vec<Record>>,
}

impl Manifest {
    /// Reads the manifest of the store in `folder`; none where the folder has no such file.
    ///
    /// # Errors
    /// A file that cannot be read, or is in any byte other than a store writes it, naming it.
    pub fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(MANIFEST);
        match fs::symlink_metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            _ => {}
        }
        let bytes = file::read(&path, MAX_BYTES, "check that it is the manifest of a store")?;
        let parsed = serde_json::from_slice(&bytes).ok().and_then(|json| Self::from_json(&json));
        match parsed.filter(|manifest| manifest.text().as_bytes() == bytes) {
            Some(manifest) => Ok(Some(manifest)),
            None => Err(Error::new("is damaged, or no manifest of a store").file(path).remedy(
                "restore it from a copy, or delete the store and bake it again; nothing else knows the digests",
            )),
        }
    }

    /// BLAKE3 over what the manifest says, as hexadecimal digits: that of the whole store.
    pub fn digest(&self) -> String {
        blake3::hash(self.json().to_string().as_bytes()).to_hex().to_string()
    }

    fn json(&self) -> Json {
        let chunks = |records: &[Record]| records.iter().map(Record::to_json).collect::<Json>();
        let poses = self.poses.iter().map(|(pose, records)| json!({"pose": pose, "chunks": chunks(records)}));
        json!({"format": FORMAT, "scene": self.scene, "poses": poses.collect::<Json>()})
    }

    fn text(&self) -> String {
        let mut json = self.json();
        json["digest"] = json!(self.digest());
        format!("{json:#}\n")
    }

    fn from_json(json: &Json) -> Option<Self> {
        let mut poses = BTreeMap::new();
        for pose in json["poses"].as_array()? {
            let records: Option<Vec<_>> = pose["chunks"].as_array()?.iter().map(Record::from_json).collect();
            // A name is a part of a file's name, never a path.
            let records = records?;
            if !records.iter().all(|record| is_name(&record.name)) {
                return None;
            }
            poses.insert(u32::try_from(pose["pose"].as_u64()?).ok()?, records);
        }
        Some(Self { scene: json["scene"].as_object()?.clone(), poses })
    }
}

fn is_name(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|letter| letter.is_ascii_lowercase())
}

/// The file of a chunk.
fn place(folder: &Path, pose: u32, name: &str) -> PathBuf {
    folder.join(format!("pose.{pose:04}.{name}.npy"))
}

/// A chunk of a pose, held against what the manifest says of it.
///
/// # Errors
/// A file that is missing, is no such array, or differs from the manifest in any byte, naming it.
fn chunk(folder: &Path, pose: u32, record: &Record) -> Result<Buffer, Error> {
    let path = place(folder, pose, &record.name);
    let damaged = |what: &str| {
        Error::new(format!("{what}: pose {pose} is damaged"))
            .file(&path)
            .remedy("restore it from a copy, or bake the store again with --repair, which redoes such poses")
    };
    if !path.is_file() {
        return Err(damaged("is not there"));
    }
    let bytes = file::read(&path, npy::MAX_BYTES, "restore it from a copy")?;
    let buffer = npy::parse(&bytes).map_err(|error| damaged(&error.what))?;
    let form = (buffer.shape == record.shape) && buffer.data.type_name() == record.element;
    if !form || !bytes.starts_with(&npy::header(&buffer)) {
        return Err(damaged("has another shape, type or header than it was written with"));
    }
    if buffer.digest().to_string() != record.digest {
        return Err(damaged("has other values than it was written with"));
    }
    Ok(buffer)
}

/// Reads a chunk of a store and verifies it.
///
/// # Errors
/// A folder that is no store, a pose or chunk that it does not have, and a damaged one, naming the file.
pub fn read(folder: &Path, pose: u32, name: &str) -> Result<Buffer, Error> {
    let manifest = existing(folder)?;
    let record = manifest.poses.get(&pose).and_then(|chunks| chunks.iter().find(|chunk| chunk.name == name));
    match record {
        Some(record) => chunk(folder, pose, record),
        None => Err(Error::new(format!("has no {name} of pose {pose}"))
            .file(folder.join(MANIFEST))
            .remedy("bake that pose with `bitlight bake --poses`")),
    }
}

/// Verifies every chunk of a store.
///
/// # Errors
/// A folder that is no store; the first file that is missing or damaged, by name.
pub fn check(folder: &Path) -> Result<Manifest, Error> {
    let manifest = existing(folder)?;
    for (pose, records) in &manifest.poses {
        records.iter().try_for_each(|record| chunk(folder, *pose, record).map(drop))?;
    }
    Ok(manifest)
}

fn existing(folder: &Path) -> Result<Manifest, Error> {
    Manifest::read(folder)?.ok_or_else(|| {
        Error::new("is no store: it has no manifest.json")
            .file(folder)
            .remedy("name the folder that `bitlight bake SCENE -o STORE` wrote")
    })
}

/// A store that is open for writing.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    scene: Map<String, Json>,
    /// Held shared while the store is open: a process that gets it alone knows that nobody writes.
    _writers: File,
}

impl Store {
    /// Opens the store in `folder`, made where it is not there, for poses that are baked from `scene`.
    ///
    /// # Errors
    /// A store that was baked from something else, naming the first key that differs; a damaged manifest; what the
    /// system refuses.
    pub fn open(folder: &Path, scene: Map<String, Json>) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(|error| refused("made", &error, folder))?;
        let path = folder.join(".writers");
        let writers = lock_file(&path)?;
        if writers.try_lock().is_ok() {
            clean(folder);
            writers.unlock().map_err(|error| refused("unlocked", &error, &path))?;
        }
        writers.lock_shared().map_err(|error| refused("locked", &error, &path))?;
        let store = Self { folder: folder.into(), scene, _writers: writers };
        let fresh = Manifest { scene: store.scene.clone(), poses: BTreeMap::new() };
        store.rewrite(Some(fresh), |_| {})?;
        Ok(store)
    }

    /// The poses of `wanted` that are still to be baked: all that the manifest does not have. Those that it has are
    /// verified; damaged ones are to be baked again with `repair`.
    ///
    /// # Errors
    /// A damaged pose, by its file, without `repair`.
    pub fn missing(&self, wanted: impl Iterator<Item = u32>, repair: bool) -> Result<Vec<u32>, Error> {
        let manifest = existing(&self.folder)?;
        let mut missing = Vec::new();
        for pose in wanted {
            let whole = match manifest.poses.get(&pose) {
                None => false,
                Some(records) => {
                    match records.iter().try_for_each(|record| chunk(&self.folder, pose, record).map(drop)) {
                        Ok(()) => true,
                        Err(_) if repair => false,
                        Err(error) => return Err(error),
                    }
                }
            };
            if !whole {
                missing.push(pose);
            }
        }
        Ok(missing)
    }

    /// Writes the chunks of a pose, by names of small letters, and then its lines of the manifest.
    ///
    /// # Errors
    /// What the system refuses; a manifest that somebody has changed or removed in the meantime.
    ///
    /// # Panics
    /// For a name of other letters.
    pub fn put(&self, pose: u32, chunks: &[(&str, &Buffer)]) -> Result<(), Error> {
        let mut records = Vec::new();
        for (name, buffer) in chunks {
            assert!(is_name(name), "{name} is no name of a chunk");
            npy::write(&place(&self.folder, pose, name), buffer)?;
            records.push(Record {
                name: (*name).into(),
                shape: buffer.shape.clone(),
                element: buffer.data.type_name().into(),
                digest: buffer.digest().to_string(),
            });
        }
        self.rewrite(None, |manifest| drop(manifest.poses.insert(pose, records)))
    }

    /// Reads the manifest, changes it and puts it in its place, while no other process does; `fresh` is what it is where
    /// there is none.
    fn rewrite(&self, fresh: Option<Manifest>, change: impl FnOnce(&mut Manifest)) -> Result<(), Error> {
        let path = self.folder.join(".lock");
        let lock = lock_file(&path)?;
        lock.lock().map_err(|error| refused("locked", &error, &path))?;
        let manifest = Manifest::read(&self.folder)?;
        let Some(mut changed) = manifest.clone().or(fresh) else {
            return Err(Error::new("has lost its manifest while it was written")
                .file(&self.folder)
                .remedy("bake it again; the poses that were there count for nothing without it"));
        };
        self.same_scene(&changed)?;
        change(&mut changed);
        if manifest.as_ref() != Some(&changed) {
            let text = changed.text();
            file::write(&self.folder.join(MANIFEST), |out| out.write_all(text.as_bytes()))?;
        }
        Ok(()) // closing the file unlocks it
    }

    fn same_scene(&self, manifest: &Manifest) -> Result<(), Error> {
        let keys = self.scene.keys().chain(manifest.scene.keys());
        for key in keys {
            let value =
                |of: &Map<String, Json>| of.get(key).and_then(Json::as_str).unwrap_or("nothing").to_owned();
            let [ours, theirs] = [&self.scene, &manifest.scene].map(value);
            if ours != theirs {
                return Err(Error::new(format!("was baked with {key} = {theirs}, and the scene has {ours}"))
                    .file(self.folder.join(MANIFEST))
                    .remedy("choose another folder with -o, or delete this store"));
            }
        }
        Ok(())
    }
}

/// Removes what killed processes have left.
fn clean(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let ours = name.starts_with(".pose.") || name.starts_with(".manifest.json.");
        if ours && name.ends_with(".tmp") {
            let _ = fs::remove_file(entry.path()); // it is ignored where it cannot be removed
        }
    }
}

fn lock_file(path: &Path) -> Result<File, Error> {
    let opened = OpenOptions::new().write(true).create(true).truncate(false).open(path);
    opened.map_err(|error| refused("opened", &error, path))
}

fn refused(what: &str, error: &std::io::Error, path: &Path) -> Error {
    let remedy = match error.kind() {
        ErrorKind::AlreadyExists | ErrorKind::NotADirectory | ErrorKind::IsADirectory => {
            "something else of that name is in the way: move it, or choose another folder with -o"
        }
        _ => "choose a folder that can be written, on a disk that knows locks",
    };
    Error::new(format!("cannot be {what}: {error}")).file(path).remedy(remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(bands: u32) -> Map<String, Json> {
        json!({"prt.bands": bands.to_string(), "solid.size": "2"}).as_object().unwrap().clone()
    }

    fn array(pose: u32) -> Buffer {
        Buffer::f32(&[2, 3], (0..6).map(|i| (i + pose) as f32 * 0.5).collect())
    }

    fn put(store: &Store, pose: u32) {
        let bits = Buffer::u32(&[2], vec![pose, 7]);
        store.put(pose, &[("visibility", &bits), ("vectors", &array(pose))]).unwrap();
    }

    fn bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        entries
            .map(|path| (path.to_string_lossy().rsplit('/').next().unwrap().into(), fs::read(path).unwrap()))
            .collect()
    }

    #[test]
    fn the_order_of_poses_does_not_show() {
        let [one, two] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let store = Store::open(one.path(), scene(5)).unwrap();
        [0, 1, 2, 12_345].iter().for_each(|pose| put(&store, *pose));
        let [a, b] = [(); 2].map(|()| Store::open(two.path(), scene(5)).unwrap());
        [12_345, 1].iter().for_each(|pose| put(&a, *pose));
        [2, 0, 1].iter().for_each(|pose| put(&b, *pose));
        assert_eq!(bytes(one.path()), bytes(two.path()));
        assert_eq!(b.missing(0..4, false).unwrap(), [3]);
        assert_eq!(read(one.path(), 1, "vectors").unwrap(), array(1));
        assert!(read(one.path(), 1, "matrices").unwrap_err().to_string().contains("no matrices of pose 1"));
        assert_eq!(check(one.path()).unwrap().poses.len(), 4);
    }

    #[test]
    fn another_scene_is_refused_by_its_key() {
        let folder = tempfile::tempdir().unwrap();
        drop(Store::open(folder.path(), scene(5)).unwrap());
        let error = Store::open(folder.path(), scene(6)).unwrap_err().to_string();
        assert!(
            error.contains("manifest.json: was baked with prt.bands = 5, and the scene has 6"),
            "{error}"
        );
        assert!(check(&folder.path().join("none")).unwrap_err().to_string().contains("is no store"));
    }

    /// Every byte of every file, one after the other.
    #[test]
    fn a_flipped_byte_is_noticed_wherever_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), scene(5)).unwrap();
        put(&store, 3);
        let whole = bytes(folder.path());
        assert_eq!(whole.len(), 5, "{:?}", whole.keys());
        for (name, bytes) in whole.iter().filter(|(name, _)| !name.starts_with('.')) {
            let path = folder.path().join(name);
            for at in 0..bytes.len() {
                let mut damaged = bytes.clone();
                damaged[at] ^= 1 << (at % 8);
                fs::write(&path, &damaged).unwrap();
                let error = check(folder.path()).expect_err(name);
                assert!(
                    error.file.as_ref() == Some(&path) && error.remedy.is_some(),
                    "{name} at {at}: {error}"
                );
            }
            fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
            assert!(check(folder.path()).is_err(), "{name} cut short");
            fs::remove_file(&path).unwrap();
            let error = check(folder.path()).unwrap_err().to_string();
            assert!(error.contains(&**name), "{name} removed: {error}");
            fs::write(&path, bytes).unwrap();
        }
        assert_eq!(check(folder.path()).unwrap().poses.len(), 1);
    }

    #[test]
    fn a_damaged_pose_is_refused_and_repaired_when_that_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), scene(5)).unwrap();
        (0..3).for_each(|pose| put(&store, pose));
        fs::remove_file(folder.path().join("pose.0001.vectors.npy")).unwrap();
        let error = store.missing(0..3, false).unwrap_err().to_string();
        assert!(
            error.contains("pose.0001.vectors.npy: is not there") && error.contains("--repair"),
            "{error}"
        );
        assert_eq!(store.missing(0..3, true).unwrap(), [1]);
        put(&store, 1);
        assert!(store.missing(0..3, false).unwrap().is_empty());
    }

    #[test]
    fn a_manifest_that_goes_while_poses_are_written_is_missed() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), scene(5)).unwrap();
        put(&store, 0);
        fs::remove_file(folder.path().join(MANIFEST)).unwrap();
        let error = store.put(1, &[("vectors", &array(1))]).unwrap_err().to_string();
        assert!(error.contains("has lost its manifest"), "{error}");
        assert!(Manifest::read(folder.path()).unwrap().is_none());
    }

    #[test]
    fn leftovers_are_removed_unless_somebody_writes() {
        let folder = tempfile::tempdir().unwrap();
        let left = folder.path().join(".pose.0000.vectors.npy.99.0.tmp");
        let other = folder.path().join(".mine.tmp");
        let store = Store::open(folder.path(), scene(5)).unwrap();
        [&left, &other].iter().for_each(|path| fs::write(path, "half").unwrap());
        drop(Store::open(folder.path(), scene(5)).unwrap());
        assert!(left.exists(), "it could be the other's");
        drop(store);
        drop(Store::open(folder.path(), scene(5)).unwrap());
        assert!(!left.exists() && other.exists());
    }
}

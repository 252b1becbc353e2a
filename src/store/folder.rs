//! A store: a folder with a manifest and `.npy` files, one for each chunk of an entry. Entries are the poses
//! of a bake (`pose.0007`), or whatever else is worth keeping under a name.
//!
//! ```text
//! manifest.json            what the entries were made of, and for each its chunks: shape, type, digest
//! pose.0007.vectors.npy    the chunk `vectors` of the entry `pose.0007`; NumPy opens it
//! .writers .lock           empty files that processes lock
//! ```
//!
//! An entry's chunks are written first, each whole or not at all, and its lines of the manifest after them.
//! So a process may be killed at any time, and the next goes on behind the last finished entry. Several
//! processes may write into one store, at the same time too: the manifest is read anew and rewritten under
//! the lock of `.lock`. Its entries stand in the order of their names, and no time, path, host or number of
//! threads is in it. So the same entries give the same bytes, whoever made them in what order.
//!
//! A killed process leaves its temporary files (`.….tmp`). A process that opens the store for writing removes
//! them while nobody else has it open, which the lock of `.writers` tells; a reader ignores them.
//!
//! The manifest ends with a digest of its own. It and each chunk's header must be, to the byte, what this
//! module writes, so a flipped byte is found wherever it is.

use super::file;
use super::manifest::{MANIFEST, Manifest, is_chunk, is_entry};
use crate::Error;
use crate::keys::difference;
use crate::pass::{Buffer, Record, npy};
use serde_json::{Map, Value as Json};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The file of a chunk.
fn place(folder: &Path, entry: &str, chunk: &str) -> PathBuf {
    folder.join(format!("{entry}.{chunk}.npy"))
}

/// Reads a chunk of an entry and compares it with what the manifest says.
///
/// # Errors
/// A file that is missing, is no such array, or differs from the manifest in any byte, naming it.
fn chunk(folder: &Path, entry: &str, record: &Record) -> Result<Buffer, Error> {
    let path = place(folder, entry, &record.name);
    let damaged = |what: &str| {
        Error::new(format!("{what}: {entry} is damaged"))
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

/// Reads and verifies the chunks of an entry, by their names. `made_of` is what the store must have been made
/// of.
///
/// # Errors
/// A folder that is no store; a store that was made of something else, where the first key that differs is
/// named; a missing entry; a damaged chunk, naming the file.
pub fn read(
    folder: &Path,
    made_of: &Map<String, Json>,
    entry: &str,
) -> Result<BTreeMap<String, Buffer>, Error> {
    let manifest = existing(folder)?;
    same(folder, made_of, &manifest, "name the store of this scene, or bake one")?;
    let Some(records) = manifest.entries.get(entry) else {
        return Err(Error::new(format!("has no {entry}"))
            .file(folder.join(MANIFEST))
            .remedy("bake that pose with `bitlight bake --poses`"));
    };
    records.iter().map(|record| Ok((record.name.clone(), chunk(folder, entry, record)?))).collect()
}

/// Refuses a store that was made of something else than `made_of`.
fn same(folder: &Path, made_of: &Map<String, Json>, manifest: &Manifest, remedy: &str) -> Result<(), Error> {
    let Some((key, ours, theirs)) = difference(made_of, &manifest.made_of) else { return Ok(()) };
    let [ours, theirs] = [ours, theirs].map(|value| value.as_str().unwrap_or("nothing"));
    let what = format!("was baked with {key} = {theirs}, and the scene has {ours}");
    Err(Error::new(what).file(folder.join(MANIFEST)).remedy(remedy))
}

/// Verifies every chunk of a store.
///
/// # Errors
/// A folder that is no store; the first file that is missing or damaged, by name.
pub fn check(folder: &Path) -> Result<Manifest, Error> {
    let manifest = existing(folder)?;
    for (entry, records) in &manifest.entries {
        records.iter().try_for_each(|record| chunk(folder, entry, record).map(drop))?;
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
    made_of: Map<String, Json>,
    /// Locked shared while the store is open. A process that can lock it exclusively knows that nobody
    /// writes.
    _writers: File,
}

impl Store {
    /// Opens the store in `folder`, for entries that are made of `made_of`. A store that is not there is
    /// created.
    ///
    /// # Errors
    /// A store that was made of something else, naming the first key that differs; a damaged manifest; what
    /// the system refuses.
    pub fn open(folder: &Path, made_of: Map<String, Json>) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(|error| refused("made", &error, folder))?;
        let path = folder.join(".writers");
        let writers = lock_file(&path)?;
        if writers.try_lock().is_ok() {
            clean(folder);
            writers.unlock().map_err(|error| refused("unlocked", &error, &path))?;
        }
        writers.lock_shared().map_err(|error| refused("locked", &error, &path))?;
        let store = Self { folder: folder.into(), made_of, _writers: writers };
        let fresh = Manifest { made_of: store.made_of.clone(), entries: BTreeMap::new() };
        store.rewrite(Some(fresh), |_| {})?;
        Ok(store)
    }

    /// Which entries are still to be made: those that the manifest does not have, and with `repair` damaged
    /// ones. All entries that are there are verified.
    ///
    /// # Errors
    /// A damaged entry, by its file, without `repair`.
    pub fn missing(&self, entries: &[String], repair: bool) -> Result<Vec<bool>, Error> {
        let manifest = self.manifest()?;
        let missing = |entry: &String| {
            let Some(records) = manifest.entries.get(entry) else { return Ok(true) };
            match records.iter().try_for_each(|record| chunk(&self.folder, entry, record).map(drop)) {
                Ok(()) => Ok(false),
                Err(_) if repair => Ok(true),
                Err(error) => Err(error),
            }
        };
        entries.iter().map(missing).collect()
    }

    /// Writes the chunks of an entry, and then its lines of the manifest.
    ///
    /// # Errors
    /// What the system refuses; a manifest that somebody has changed or removed in the meantime.
    ///
    /// # Panics
    /// Where an entry's name has anything but small letters and digits between dots, or a chunk's name
    /// anything but small letters.
    pub fn put(&self, entry: &str, chunks: &[(&str, &Buffer)]) -> Result<(), Error> {
        assert!(is_entry(entry), "{entry} is no name of an entry");
        let mut records = Vec::new();
        for (name, buffer) in chunks {
            assert!(is_chunk(name), "{name} is no name of a chunk");
            file::write(&place(&self.folder, entry, name), |out| npy::write(out, buffer))?;
            records.push(Record::new(name, buffer));
        }
        self.rewrite(None, |manifest| drop(manifest.entries.insert(entry.to_owned(), records)))
    }

    /// The manifest as it is now.
    ///
    /// # Errors
    /// A manifest that is damaged or has gone.
    pub fn manifest(&self) -> Result<Manifest, Error> {
        existing(&self.folder)
    }

    /// Reads, changes and rewrites the manifest under the lock, so that no other process does so meanwhile.
    /// Where there is no manifest, `fresh` is changed and written.
    fn rewrite(&self, fresh: Option<Manifest>, change: impl FnOnce(&mut Manifest)) -> Result<(), Error> {
        let path = self.folder.join(".lock");
        let lock = lock_file(&path)?;
        lock.lock().map_err(|error| refused("locked", &error, &path))?;
        let manifest = Manifest::read(&self.folder)?;
        let Some(mut changed) = manifest.clone().or(fresh) else {
            return Err(Error::new("has lost its manifest while it was written")
                .file(&self.folder)
                .remedy("bake it again: its poses cannot be used without it"));
        };
        same(&self.folder, &self.made_of, &changed, "choose another folder with -o, or delete this store")?;
        change(&mut changed);
        if manifest.as_ref() != Some(&changed) {
            let text = changed.text();
            file::write(&self.folder.join(MANIFEST), |out| out.write_all(text.as_bytes()))?;
        }
        Ok(()) // closing the file unlocks it
    }
}

/// Removes what killed processes have left.
fn clean(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let ours = name.contains(".npy.") || name.starts_with(".manifest.json.");
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
    use serde_json::json;

    fn scene(bands: u32) -> Map<String, Json> {
        json!({"prt.bands": bands.to_string(), "solid.size": "2"}).as_object().unwrap().clone()
    }

    fn name(pose: u32) -> String {
        format!("pose.{pose:04}")
    }

    fn missing(store: &Store, repair: bool) -> Result<Vec<bool>, Error> {
        store.missing(&[0, 1, 2, 3].map(name), repair)
    }

    fn array(pose: u32) -> Buffer {
        Buffer::f32(&[2, 3], (0..6).map(|i| (i + pose) as f32 * 0.5).collect())
    }

    fn put(store: &Store, pose: u32) {
        let bits = Buffer::u32(&[2], vec![pose, 7]);
        store.put(&name(pose), &[("visibility", &bits), ("vectors", &array(pose))]).unwrap();
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
        assert_eq!(missing(&b, false).unwrap(), [false, false, false, true]);
        assert_eq!(read(one.path(), &scene(5), &name(1)).unwrap()["vectors"], array(1));
        let refusal = |bands, pose| read(one.path(), &scene(bands), &name(pose)).unwrap_err().to_string();
        assert!(refusal(5, 3).contains("manifest.json: has no pose.0003"), "{}", refusal(5, 3));
        assert!(refusal(6, 1).contains("was baked with prt.bands = 5, and the scene has 6"));
        assert_eq!(check(one.path()).unwrap().entries.len(), 4);
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
        assert_eq!(check(folder.path()).unwrap().entries.len(), 1);
    }

    #[test]
    fn a_damaged_pose_is_refused_and_repaired_when_that_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), scene(5)).unwrap();
        (0..4).for_each(|pose| put(&store, pose));
        fs::remove_file(folder.path().join("pose.0001.vectors.npy")).unwrap();
        let error = missing(&store, false).unwrap_err().to_string();
        assert!(
            error.contains("pose.0001.vectors.npy: is not there") && error.contains("--repair"),
            "{error}"
        );
        assert_eq!(missing(&store, true).unwrap(), [false, true, false, false]);
        put(&store, 1);
        assert_eq!(missing(&store, false).unwrap(), [false; 4]);
    }

    #[test]
    fn a_manifest_that_goes_while_poses_are_written_is_missed() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), scene(5)).unwrap();
        put(&store, 0);
        fs::remove_file(folder.path().join(MANIFEST)).unwrap();
        let error = store.put(&name(1), &[("vectors", &array(1))]).unwrap_err().to_string();
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

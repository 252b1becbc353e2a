//! Files read up to a length, and written whole or not at all, one by one or several together.

use crate::Error;
use crate::pass::{Buffer, npy, png};
use crate::sphere::environment::{self, LatLong};
use crate::world::mesh::Mesh;
use crate::world::obj;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// The bytes of the file at `path`, at most `most`; `shorter` says what to do about a longer one.
///
/// # Errors
/// A file that cannot be read, and a longer one, found before it is held in memory; both name it.
pub fn read(path: &Path, most: u64, shorter: &str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let length = File::open(path).and_then(|file| match file.metadata()?.len() {
        // A file that is not a plain one reports no length, so at most one byte beyond the limit is read.
        length if length <= most => file.take(most + 1).read_to_end(&mut bytes).map(|length| length as u64),
        length => Ok(length),
    });
    match length {
        Ok(length) if length <= most => Ok(bytes),
        Ok(_) => Err(Error::new(format!("is longer than {most} bytes")).file(path).remedy(shorter)),
        Err(error) => Err(Error::new(format!("cannot be read: {error}")).file(path).remedy("check the path")),
    }
}

/// Writes `path` through `write` into a temporary file beside it, then puts that in its place: a failure
/// leaves the old file as it was.
///
/// # Errors
/// What the system or `write` refuses, naming the file.
pub fn write(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), Error> {
    let refused = |error| refused(&error, path);
    let (temporary, file) = temporary(path, |temporary| File::create_new(temporary)).map_err(refused)?;
    let mut out = BufWriter::new(file);
    let written = write(&mut out)
        .and_then(|()| out.flush())
        .and_then(|()| out.get_ref().sync_all())
        .and_then(|()| fs::rename(&temporary, path));
    drop(out.into_parts()); // closed without another attempt to write
    written.map_err(|error| {
        let _ = fs::remove_file(&temporary); // if this fails too, nothing more can be done
        refused(error)
    })
}

/// The buffer of an `.npy` file.
///
/// # Errors
/// Those of [`npy::parse`], a missing file, and one that is longer than [`npy::MAX_BYTES`], naming the file.
pub fn read_npy(path: &Path) -> Result<Buffer, Error> {
    npy::parse(&read(path, npy::MAX_BYTES, "save it in several files")?).map_err(|error| error.file(path))
}

/// Writes a buffer as an `.npy` file.
///
/// # Errors
/// What the system refuses, naming the file.
pub fn write_npy(path: &Path, buffer: &Buffer) -> Result<(), Error> {
    write(path, |out| npy::write(out, buffer))
}

/// Writes `width × height` RGB bytes as a PNG file, the top row first.
///
/// # Errors
/// What the system refuses, naming the file.
pub fn write_png(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<(), Error> {
    write(path, |out| png::write(out, width, height, rgb))
}

/// Every layer of an EXR file.
///
/// # Errors
/// Those of [`crate::pass::exr::parse`], a missing file, and one that is too long, found before it is held in
/// memory.
#[cfg(feature = "exr")]
pub fn read_exr(path: &Path) -> Result<Vec<crate::pass::Layer>, Error> {
    use crate::pass::exr;
    let bytes = read(path, exr::MAX_BYTES, "save its layers in several files")?;
    exr::parse(&bytes).map_err(|error| error.file(path))
}

/// Writes layers as an EXR file, in their order.
///
/// # Errors
/// What the system refuses, naming the file; no layers at all.
#[cfg(feature = "exr")]
pub fn write_exr(path: &Path, layers: &[crate::pass::Layer]) -> Result<(), Error> {
    write(path, |out| crate::pass::exr::write(out, layers))
}

/// The mesh of an OBJ file.
///
/// # Errors
/// Those of [`obj::parse`], a missing file, and one that is longer than [`obj::MAX_BYTES`], naming the file.
pub fn read_obj(path: impl AsRef<Path>) -> Result<Mesh, Error> {
    let path = path.as_ref();
    obj::parse(&read(path, obj::MAX_BYTES, obj::SHORTER)?, path)
}

/// The map of a Radiance HDR file.
///
/// # Errors
/// Those of [`LatLong::from_hdr`], a missing file, and one that is longer than [`environment::MAX_BYTES`],
/// naming the file.
pub fn read_hdr(path: impl AsRef<Path>) -> Result<LatLong, Error> {
    let path = path.as_ref();
    let bytes = read(path, environment::MAX_BYTES, environment::SMALLER)?;
    LatLong::from_hdr(&bytes).map_err(|error| error.file(path))
}

/// [`read`], or `None` where there is no such file.
///
/// # Errors
/// Those of [`read`].
pub fn read_if_there(path: &Path, most: u64, shorter: &str) -> Result<Option<Vec<u8>>, Error> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        _ => read(path, most, shorter).map(Some),
    }
}

/// Whether there is a file of this path.
pub fn is_file(path: &Path) -> bool {
    path.is_file()
}

/// Whether there is a folder of this path.
pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// Makes a folder and those above it, where they are not there.
///
/// # Errors
/// What the system refuses, naming the folder.
pub fn make_folder(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| {
        Error::new(format!("cannot be made: {error}")).file(folder).remedy("choose another folder with -o")
    })
}

/// The files and folders in a folder, sorted.
///
/// # Errors
/// A folder that cannot be read, naming it.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let refused = |error: io::Error| {
        Error::new(format!("cannot be read: {error}")).file(folder).remedy("name a folder that can be read")
    };
    let entries = fs::read_dir(folder).map_err(refused)?;
    let mut paths = entries.map(|entry| Ok(entry.map_err(refused)?.path())).collect::<Result<Vec<_>, _>>()?;
    paths.sort();
    Ok(paths)
}

/// Every file of an ending below a folder, in the order of their paths.
///
/// # Errors
/// A folder that cannot be read, naming it.
pub fn below(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() {
            found.extend(below(&path, ending)?);
        } else if path.extension().is_some_and(|own| own == ending) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Files of one folder that appear in it together: all are written in a folder of their own inside it, and
/// [`Batch::commit`] puts each in its place when every one is complete. Dropped before that, it leaves the
/// folder as it was. (A process that is killed leaves its `.….tmp` behind; such a folder may be deleted.)
#[derive(Debug)]
pub struct Batch {
    folder: PathBuf,
    stage: PathBuf,
    names: Vec<String>,
}

impl Batch {
    /// A batch of files of the frame `name` in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// Where the folder cannot be made or written into, naming it.
    pub fn new(folder: &Path, name: &str) -> Result<Self, Error> {
        let refused = |what: &str, error: io::Error| {
            Error::new(format!("cannot be {what}: {error}"))
                .file(folder)
                .remedy("choose another folder with -o")
        };
        fs::create_dir_all(folder).map_err(|error| refused("made", error))?;
        let (stage, ()) = temporary(&folder.join(name), |stage| fs::create_dir(stage))
            .map_err(|error| refused("written into", error))?;
        Ok(Self { folder: folder.into(), stage, names: Vec::new() })
    }

    /// Writes the file `name` through `write`, which is told a path to write to.
    ///
    /// # Errors
    /// What `write` refuses, naming the file by its place in the folder.
    pub fn write(
        &mut self,
        name: String,
        write: impl FnOnce(&Path) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (staged, place) = (self.stage.join(&name), self.folder.join(&name));
        write(&staged).map_err(|error| match &error.file {
            Some(file) if *file == staged => Error { file: Some(place), ..error },
            _ => error,
        })?;
        self.names.push(name);
        Ok(())
    }

    /// Puts every file in its place and returns their paths, in the order of writing.
    ///
    /// # Errors
    /// What the system refuses, naming the file. A folder that has a file's name is found before any file is
    /// replaced.
    pub fn commit(mut self) -> Result<Vec<PathBuf>, Error> {
        let names = std::mem::take(&mut self.names);
        let places: Vec<_> = names.iter().map(|name| self.folder.join(name)).collect();
        if let Some(place) = places.iter().find(|place| place.is_dir()) {
            return Err(Error::new("cannot be written: a folder has its name")
                .file(place)
                .remedy("move that folder away, or choose another with -o"));
        }
        for (name, place) in names.iter().zip(&places) {
            fs::rename(self.stage.join(name), place).map_err(|error| refused(&error, place))?;
        }
        Ok(places)
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.stage); // what cannot be removed is left; it hides nothing
    }
}

fn refused(error: &io::Error, path: &Path) -> Error {
    let remedy = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "make room, or choose another folder"
        }
        ErrorKind::IsADirectory => "move the folder of that name away",
        _ => "choose a folder that can be written",
    };
    Error::new(format!("cannot be written: {error}")).file(path).remedy(remedy)
}

/// Makes something under a new name beside `path`, `.NAME.PROCESS.NUMBER.tmp`, that no other thread or
/// process has, not even one that was killed.
fn temporary<T>(path: &Path, make: impl Fn(&Path) -> io::Result<T>) -> io::Result<(PathBuf, T)> {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".{name}.{}.{number}.tmp", std::process::id()));
        match make(&temporary) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((temporary, made?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_names_the_file_and_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let [wrong, absent, huge] = ["wrong", "absent", "huge"].map(|name| folder.path().join(name));
        fs::write(&wrong, b"v/1\x01 no such file").unwrap();
        File::create(&huge).unwrap().set_len(npy::MAX_BYTES + 1).unwrap(); // sparse
        for path in [folder.path(), &wrong, &absent, &huge] {
            let errors = [
                read_npy(path).map(drop).unwrap_err(),
                read_obj(path).map(drop).unwrap_err(),
                read_hdr(path).map(drop).unwrap_err(),
                #[cfg(feature = "exr")]
                read_exr(path).map(drop).unwrap_err(),
            ];
            for error in errors {
                assert!(error.file.as_deref() == Some(path) && error.remedy.is_some(), "{error}");
                assert!(*path != huge || error.what.contains("longer than"), "{error}");
            }
        }
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_whole_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, |out| out.write_all(b"old")).unwrap();
        let error = write(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("the disk is full"))
        });
        assert!(error.unwrap_err().to_string().contains("the disk is full"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn threads_that_write_one_file_leave_one_of_theirs_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        std::thread::scope(|scope| {
            for letter in b'a'..b'e' {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..20 {
                        write(path, |out| (0..64).try_for_each(|_| out.write_all(&[letter; 999]))).unwrap();
                    }
                });
            }
        });
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() == 64 * 999 && bytes.iter().all(|byte| *byte == bytes[0]));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_batch_appears_at_once_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let names = || {
            let entries = fs::read_dir(folder.path()).unwrap();
            let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let text = |text: &'static [u8]| move |path: &Path| write(path, |out| out.write_all(text));
        let mut batch = Batch::new(folder.path(), "a").unwrap();
        batch.write("a.txt".into(), text(b"one")).unwrap();
        batch.write("b.txt".into(), text(b"two")).unwrap();
        assert!(!folder.path().join("a.txt").exists());
        let places = batch.commit().unwrap();
        assert_eq!(places, [folder.path().join("a.txt"), folder.path().join("b.txt")]);
        assert_eq!(names(), ["a.txt", "b.txt"]);

        let mut batch = Batch::new(folder.path(), "a").unwrap();
        batch.write("a.txt".into(), text(b"new")).unwrap();
        let full = |path: &Path| write(path, |_| Err(ErrorKind::StorageFull.into()));
        let error = batch.write("b.txt".into(), full).unwrap_err();
        assert_eq!(error.file, Some(folder.path().join("b.txt")));
        assert!(error.to_string().ends_with("make room, or choose another folder"), "{error}");
        drop(batch);
        assert_eq!(fs::read(folder.path().join("a.txt")).unwrap(), b"one");
        assert_eq!(names(), ["a.txt", "b.txt"]);

        fs::create_dir(folder.path().join("c.txt")).unwrap();
        let mut batch = Batch::new(folder.path(), "a").unwrap();
        batch.write("a.txt".into(), text(b"new")).unwrap();
        batch.write("c.txt".into(), text(b"new")).unwrap();
        let error = batch.commit().unwrap_err().to_string();
        assert!(error.contains("a folder has its name"), "{error}");
        assert_eq!(fs::read(folder.path().join("a.txt")).unwrap(), b"one");
    }
}

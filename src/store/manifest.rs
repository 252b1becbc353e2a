//! The manifest of a store: what its entries were made of, and what each file must be.

use super::file;
use crate::Error;
use crate::pass::Record;
use serde_json::{Map, Value as Json, json};
use std::collections::BTreeMap;
use std::path::Path;

/// The longest manifest that is read, in bytes.
const MAX_BYTES: u64 = 256 << 20;

/// The manifest's format. It changes with the meaning of the files and with every change of the baked bits,
/// so that no store mixes two; `tests/store.rs` has a digest by which a change shows.
const FORMAT: &str = "bitlight store 2";

/// How the formats of all stores begin.
const FAMILY: &str = "bitlight store ";

/// Its file in the store.
pub(super) const MANIFEST: &str = "manifest.json";

/// What a store was made of, and what its files must be.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// What the entries were made of: texts by key, since a number need not survive JSON to the bit.
    pub made_of: Map<String, Json>,
    /// The chunks of each finished entry, by the entry's name, such as `pose.0007`.
    pub entries: BTreeMap<String, Vec<Record>>,
}

impl Manifest {
    /// Reads the manifest of the store in `folder`; none where the folder has no such file.
    ///
    /// # Errors
    /// A file that cannot be read, or that differs in any byte from what a store writes, naming it.
    pub fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(MANIFEST);
        if path.exists() && !path.is_file() {
            return Err(Error::new("is no file")
                .file(path)
                .remedy("name the folder that `bitlight bake` wrote"));
        }
        let Some(bytes) = file::read_if_there(&path, MAX_BYTES, "check that it is the manifest of a store")?
        else {
            return Ok(None);
        };
        let json: Option<Json> = serde_json::from_slice(&bytes).ok();
        let format = json.as_ref().and_then(|json| json["format"].as_str());
        if let Some(other) = format.filter(|format| format.starts_with(FAMILY) && *format != FORMAT) {
            let what = format!("is a store of another format, \"{other}\", and this is \"{FORMAT}\"");
            return Err(Error::new(what).file(path).remedy("bake the scene again into another folder"));
        }
        let parsed = json.and_then(|json| Self::from_json(&json));
        match parsed.filter(|manifest| manifest.text().as_bytes() == bytes) {
            Some(manifest) => Ok(Some(manifest)),
            None => Err(Error::new("is damaged, or no manifest of a store").file(path).remedy(
                "restore it from a copy, or delete the store and bake it again; nothing else knows the digests",
            )),
        }
    }

    /// BLAKE3 over what the manifest says, as hexadecimal digits: the digest of the whole store.
    pub fn digest(&self) -> String {
        blake3::hash(self.json().to_string().as_bytes()).to_hex().to_string()
    }

    fn json(&self) -> Json {
        let chunks = |records: &[Record]| records.iter().map(Record::to_json).collect::<Json>();
        let entries =
            self.entries.iter().map(|(name, records)| json!({"name": name, "chunks": chunks(records)}));
        json!({"format": FORMAT, "made_of": self.made_of, "entries": entries.collect::<Json>()})
    }

    pub(super) fn text(&self) -> String {
        let mut json = self.json();
        json["digest"] = json!(self.digest());
        format!("{json:#}\n")
    }

    fn from_json(json: &Json) -> Option<Self> {
        let mut entries = BTreeMap::new();
        for entry in json["entries"].as_array()? {
            let records: Option<Vec<_>> = entry["chunks"].as_array()?.iter().map(Record::from_json).collect();
            let (name, records) = (entry["name"].as_str()?, records?);
            // A name is a part of a file's name, never a path.
            if !is_entry(name) || !records.iter().all(|record| is_chunk(&record.name)) {
                return None;
            }
            entries.insert(name.to_owned(), records);
        }
        Some(Self { made_of: json["made_of"].as_object()?.clone(), entries })
    }
}

/// Whether a chunk may have this name: small letters.
pub(super) fn is_chunk(name: &str) -> bool {
    !name.is_empty() && name.bytes().all(|letter| letter.is_ascii_lowercase())
}

/// Whether an entry may have this name: small letters and digits, in parts between dots.
pub(super) fn is_entry(name: &str) -> bool {
    let part = |part: &str| {
        !part.is_empty() && part.bytes().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit())
    };
    name.split('.').all(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Option<Manifest>, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(MANIFEST), text).unwrap();
        Manifest::read(folder.path()).map_err(|error| error.to_string())
    }

    /// A manifest that is whole and has this entry and chunk.
    fn whole(entry: &str, chunk: &str) -> String {
        let record =
            Record { name: chunk.into(), shape: vec![1], element: "f32".into(), digest: "0".repeat(64) };
        Manifest { made_of: Map::new(), entries: [(entry.to_owned(), vec![record])].into() }.text()
    }

    #[test]
    fn names_are_parts_of_file_names_and_never_paths() {
        assert!(read(&whole("pose.0001", "vectors")).unwrap().is_some());
        for (entry, chunk) in [
            ("../x", "vectors"),
            ("pose..1", "a"),
            ("", "a"),
            ("Pose", "a"),
            ("a", "../b"),
            ("a", ""),
            ("a", "b.c"),
        ] {
            let refused = read(&whole(entry, chunk)).unwrap_err();
            assert!(refused.contains("is damaged, or no manifest"), "{entry} {chunk}: {refused}");
        }
    }

    #[test]
    fn another_format_is_told_from_damage() {
        let other = whole("pose.0001", "vectors").replace(FORMAT, "bitlight store 1");
        assert!(read(&other).unwrap_err().contains("is a store of another format, \"bitlight store 1\""));
        assert!(read("{\"format\": \"something\"}").unwrap_err().contains("is damaged, or no manifest"));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_refused_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        std::os::unix::fs::symlink("/dev/zero", folder.path().join(MANIFEST)).unwrap();
        let refused = Manifest::read(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("manifest.json: is no file"), "{refused}");
    }
}

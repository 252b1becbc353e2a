//! What a stopped estimate goes on from: a file with the sums so far, and of which scene they are.
//!
//! One line of JSON, then for each pixel six `f64`, little-endian: the sums of R, G, B and those of their squares.

use super::Sums;
use crate::Error;
use crate::pass::file;
use serde_json::{Map, Value as Json, json};
use std::io::Write;
use std::path::Path;

/// Changes with the meaning of the file and with every change of an estimator that changes its samples.
const FORMAT: &str = "bitlight truth 2";

/// The most bytes of the first line.
const MAX_HEADER: u64 = 1 << 20;

/// What must be the same for sums to be of the same estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The settings that matter, by their keys.
    pub settings: Map<String, Json>,
    /// The digest of what the settings name: mesh and lights ([`super::Scene::digest`]).
    pub data: String,
}

impl Identity {
    /// Writes the sums so far, whole or not at all.
    ///
    /// # Errors
    /// What the system refuses, naming the file.
    pub fn write(&self, path: &Path, sums: &Sums) -> Result<(), Error> {
        let bytes: Vec<u8> =
            sums.values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let header = json!({
            "format": FORMAT,
            "samples": sums.samples,
            "sums": digest(sums.samples, &bytes),
            "data": self.data,
            "settings": self.settings,
        });
        file::write(path, |out| {
            writeln!(out, "{header}")?;
            out.write_all(&bytes)
        })
    }

    /// The sums of `count` pixels that an earlier run left at `path`; `None` where there is no such file.
    ///
    /// # Errors
    /// A file that is none or is damaged, and the sums of another scene or other settings: what differs is named.
    pub fn read(&self, path: &Path, count: usize) -> Result<Option<Sums>, Error> {
        if !path.exists() {
            return Ok(None);
        }
        let length = count as u64 * 48;
        let bytes = file::read(path, length + MAX_HEADER, ANEW)?;
        let refused = |what: String| Err(Error::new(what).file(path).remedy(ANEW));
        let end = bytes.iter().position(|byte| *byte == b'\n');
        let header: Option<Json> = end.and_then(|end| serde_json::from_slice(&bytes[..end]).ok());
        let (Some(end), Some(header)) = (end, header) else {
            return refused("is no state of a ground truth".into());
        };
        if header["format"] != FORMAT {
            return refused(format!(
                "is a state of another format, {}, and this is \"{FORMAT}\"",
                header["format"]
            ));
        }
        if let Some(difference) = self.difference(&header["settings"]) {
            return refused(format!("is a state of other settings: {difference}"));
        }
        if header["data"] != self.data.as_str() {
            return refused("is a state of another scene: a model or an environment was another then".into());
        }
        let sums = &bytes[end + 1..];
        let samples = header["samples"].as_u64().filter(|_| sums.len() as u64 == length);
        let Some(samples) = samples.filter(|samples| header["sums"] == digest(*samples, sums).as_str())
        else {
            return refused("is a damaged state of a ground truth".into());
        };
        let numbers = sums.as_chunks::<8>().0.as_chunks::<6>().0;
        let values = numbers.iter().map(|pixel| pixel.map(f64::from_le_bytes)).collect();
        Ok(Some(Sums { samples, values }))
    }

    /// The first setting that is another there.
    fn difference(&self, there: &Json) -> Option<String> {
        let empty = Map::new();
        let there = there.as_object().unwrap_or(&empty);
        let says = |map: &Map<String, Json>, key: &str| {
            map.get(key).map_or_else(|| "absent".to_owned(), ToString::to_string)
        };
        let keys = self.settings.keys().chain(there.keys());
        keys.into_iter()
            .find(|key| self.settings.get(*key) != there.get(*key))
            .map(|key| format!("{key} is {} there and {} here", says(there, key), says(&self.settings, key)))
    }
}

/// BLAKE3 over the number of samples and the sums.
fn digest(samples: u64, sums: &[u8]) -> String {
    blake3::Hasher::new().update(&samples.to_le_bytes()).update(sums).finalize().to_hex().to_string()
}

const ANEW: &str = "give another folder with -o, or delete it to begin anew";

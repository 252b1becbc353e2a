//! The file from which a stopped estimate goes on: the sums so far, and which scene they belong to.
//!
//! One line of JSON, then for each pixel six `f64`, little-endian: the sums of R, G, B and those of their
//! squares.

use super::Sums;
use crate::Error;
use crate::keys::difference;
use serde_json::{Map, Value as Json, json};
use std::io::{self, Write};

/// Changes with the meaning of the file and with every change of an estimator that changes its samples.
const FORMAT: &str = "bitlight truth 3";

/// The most bytes of the first line.
const MAX_HEADER: u64 = 1 << 20;

/// What must be the same for two runs to add to one estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The settings that matter, by their keys.
    pub settings: Map<String, Json>,
    /// The digest of what the settings name: mesh and lights ([`super::Estimator::digest`]).
    pub data: String,
}

impl Identity {
    /// Writes the sums so far.
    ///
    /// # Errors
    /// What the writer refuses.
    pub fn write(&self, out: &mut impl Write, sums: &Sums) -> io::Result<()> {
        let bytes: Vec<u8> =
            sums.values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        let header = json!({
            "format": FORMAT,
            "samples": sums.samples,
            "sums": digest(sums.samples, &bytes),
            "data": self.data,
            "settings": self.settings,
        });
        writeln!(out, "{header}")?;
        out.write_all(&bytes)
    }

    /// The sums of `count` pixels that [`Self::write`] wrote.
    ///
    /// # Errors
    /// Bytes that are no state or are damaged, and the sums of another scene or other settings: what differs
    /// is named.
    pub fn parse(&self, bytes: &[u8], count: usize) -> Result<Sums, Error> {
        let length = count * 48;
        let refused = |what: String| Err(Error::new(what).remedy(ANEW));
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
        let empty = Map::new();
        let there = header["settings"].as_object().unwrap_or(&empty);
        if let Some((key, here, there)) = difference(&self.settings, there) {
            let says = |value: &Json| if value.is_null() { "absent".into() } else { value.to_string() };
            let what = format!("{key} is {} there and {} here", says(there), says(here));
            return refused(format!("is a state of other settings: {what}"));
        }
        if header["data"] != self.data.as_str() {
            return refused("is a state of another scene: a model or an environment was another then".into());
        }
        let sums = &bytes[end + 1..];
        let samples = header["samples"].as_u64().filter(|_| sums.len() == length);
        let Some(samples) = samples.filter(|samples| header["sums"] == digest(*samples, sums).as_str())
        else {
            return refused("is a damaged state of a ground truth".into());
        };
        let numbers = sums.as_chunks::<8>().0.as_chunks::<6>().0;
        let values = numbers.iter().map(|pixel| pixel.map(f64::from_le_bytes)).collect();
        Ok(Sums { samples, values })
    }
}

/// The most bytes of a state of `count` pixels.
pub fn state_bytes(count: usize) -> u64 {
    count as u64 * 48 + MAX_HEADER
}

/// BLAKE3 over the number of samples and the sums.
fn digest(samples: u64, sums: &[u8]) -> String {
    blake3::Hasher::new().update(&samples.to_le_bytes()).update(sums).finalize().to_hex().to_string()
}

/// What to do about a state from which no run can go on.
pub const ANEW: &str = "give another folder with -o, or delete it to begin anew";

//! The sink that writes a frame's passes into a folder: `NAME.exr`, `.npy` files, `NAME.png` and `NAME.json`.

use super::file::{self, Batch};
use crate::Error;
use crate::numeric::single::pow;
use crate::pass::{Buffer, Clock, Digests, Info, Layer, Recorder, Timings, layers, png};
use serde_json::{Map, Value as Json, json};
use std::io::Write;
use std::path::Path;

/// Collects the wanted passes; [`Files::write`] writes them, so that a failing frame leaves no file.
#[derive(Debug)]
pub struct Files {
    batch: Batch,
    name: String,
    kept: Vec<(Info, Buffer)>,
    digests: Digests,
    timings: Timings,
}

impl Files {
    /// A sink for the frame `name` in `folder`, which is made if it is not there; passes are timed by
    /// the clock.
    ///
    /// # Errors
    /// Where the folder cannot be made or written into, naming it: before a pass runs, not after.
    pub fn new(folder: &Path, name: &str, clock: Clock) -> Result<Self, Error> {
        let (digests, timings) = (Digests::default(), Timings::new(clock));
        Ok(Self { batch: Batch::new(folder, name)?, name: name.into(), kept: Vec::new(), digests, timings })
    }

    /// Writes everything, the picture first, and returns the batch: [`Batch::commit`] puts the files in their
    /// places. `exposure` brightens the PNG by that many stops.
    ///
    /// # Errors
    /// What the system refuses, naming the file.
    pub fn write(
        mut self,
        scene: &Path,
        settings: &Map<String, Json>,
        exposure: f32,
    ) -> Result<Batch, Error> {
        let images: Vec<Layer> = self.images().flat_map(|(info, buffer)| layers(info, buffer)).collect();
        let report = json!({"scene": scene.to_string_lossy(), "settings": settings, "passes": self.passes()});
        let name = |ending: &str| format!("{}.{ending}", self.name);
        let batch = &mut self.batch;
        if let Some((_, picture)) = self.kept.iter().find(|(info, _)| info.is_picture()) {
            batch.write(name("png"), |path| preview(path, picture, exposure))?;
        }
        if !images.is_empty() {
            batch.write(name("exr"), |path| file::write_exr(path, &images))?;
        }
        for (info, buffer) in self.kept.iter().filter(|(info, _)| !info.is_image()) {
            batch.write(name(&format!("{}.npy", info.name)), |path| file::write_npy(path, buffer))?;
        }
        batch.write(name("json"), |path| file::write(path, |out| writeln!(out, "{report:#}")))?;
        Ok(self.batch)
    }

    /// The image passes, `final` first: viewers show a file's first part.
    fn images(&self) -> impl Iterator<Item = &(Info, Buffer)> {
        let (last, others): (Vec<_>, Vec<_>) =
            self.kept.iter().filter(|(info, _)| info.is_image()).partition(|(info, _)| info.is_picture());
        last.into_iter().chain(others)
    }

    /// The wanted passes, in flow order.
    pub fn kept(&self) -> &[(Info, Buffer)] {
        &self.kept
    }

    /// The time that all passes together took, in seconds.
    pub fn seconds(&self) -> f64 {
        self.timings.passes.iter().map(|(_, seconds)| seconds).sum()
    }

    fn passes(&self) -> Vec<Json> {
        let rows = self.digests.0.iter().zip(&self.timings.passes);
        rows.map(|(record, (_, seconds))| {
            let mut row = record.to_json();
            row["seconds"] = json!(seconds);
            row
        })
        .collect()
    }
}

impl Recorder for Files {
    fn begin(&mut self, pass: &Info) {
        self.timings.begin(pass);
    }

    fn record(&mut self, pass: &Info, wanted: bool, buffer: &Buffer) -> Result<(), Error> {
        self.timings.record(pass, wanted, buffer)?;
        self.digests.record(pass, wanted, buffer)?;
        if wanted {
            self.kept.push((*pass, buffer.clone()));
        }
        Ok(())
    }
}

/// Writes the preview of an RGB image.
fn preview(path: &Path, image: &Buffer, exposure: f32) -> Result<(), Error> {
    let gain = pow(2.0, exposure);
    let codes: Vec<u8> = image.as_f32().iter().map(|value| png::srgb8(value * gain)).collect();
    file::write_png(path, image.shape[1], image.shape[0], &codes)
}

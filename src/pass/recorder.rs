//! Recorders: the sinks that receive the results of all passes, as one stream.

use super::{Buffer, Info};
use crate::Error;
use serde_json::{Value as Json, json};

/// Receives every pass that runs, in order.
pub trait Recorder {
    /// The pass is about to run.
    fn begin(&mut self, _pass: &Info) {}

    /// The pass has run. `wanted` is true of a pass that was asked for, and false of one that others only
    /// needed.
    ///
    /// # Errors
    /// An error of the sink; it stops the run.
    fn record(&mut self, pass: &Info, wanted: bool, buffer: &Buffer) -> Result<(), Error>;
}

/// Several sinks as one: each is told in turn.
impl Recorder for Vec<&mut dyn Recorder> {
    fn begin(&mut self, pass: &Info) {
        self.iter_mut().for_each(|sink| sink.begin(pass));
    }

    fn record(&mut self, pass: &Info, wanted: bool, buffer: &Buffer) -> Result<(), Error> {
        self.iter_mut().try_for_each(|sink| sink.record(pass, wanted, buffer))
    }
}

/// What is written of a pass beside its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// `technique.pass`.
    pub name: String,
    /// The length of each axis, the slowest first.
    pub shape: Vec<usize>,
    /// `"f32"` or `"u32"`.
    pub element: String,
    /// The digest, as hexadecimal digits.
    pub digest: String,
}

impl Record {
    /// The record of a buffer.
    pub fn new(name: &str, buffer: &Buffer) -> Self {
        Self {
            name: name.into(),
            shape: buffer.shape.clone(),
            element: buffer.data.type_name().into(),
            digest: buffer.digest().to_string(),
        }
    }

    /// The record as an object of JSON: `name`, `shape`, `type`, `digest`.
    pub fn to_json(&self) -> Json {
        json!({"name": self.name, "shape": self.shape, "type": self.element, "digest": self.digest})
    }

    /// What [`Self::to_json`] wrote; `None` where it is anything else.
    pub fn from_json(json: &Json) -> Option<Self> {
        let text = |key: &str| json[key].as_str().map(str::to_owned);
        let shape =
            json["shape"].as_array()?.iter().map(|length| length.as_u64().map(|length| length as usize));
        Some(Self {
            name: text("name")?,
            shape: shape.collect::<Option<_>>()?,
            element: text("type")?,
            digest: text("digest")?,
        })
    }
}

/// Keeps the digest of every pass that ran.
#[derive(Debug, Default)]
pub struct Digests(pub Vec<Record>);

impl Recorder for Digests {
    fn record(&mut self, pass: &Info, _: bool, buffer: &Buffer) -> Result<(), Error> {
        self.0.push(Record::new(pass.name, buffer));
        Ok(())
    }
}

/// Keeps every buffer.
#[derive(Debug, Default)]
pub struct Kept(pub Vec<(Info, bool, Buffer)>);

impl Kept {
    /// The buffer of the pass `name`, if it ran.
    pub fn get(&self, name: &str) -> Option<&Buffer> {
        self.0.iter().find(|(info, ..)| info.name == name).map(|(_, _, buffer)| buffer)
    }
}

impl Recorder for Kept {
    fn record(&mut self, pass: &Info, wanted: bool, buffer: &Buffer) -> Result<(), Error> {
        self.0.push((*pass, wanted, buffer.clone()));
        Ok(())
    }
}

/// Seconds since some fixed moment. The caller provides the clock: this library reads none.
pub type Clock = fn() -> f64;

/// Keeps how long every pass took, by a clock.
#[derive(Debug)]
pub struct Timings {
    /// Name and seconds, in the order of running.
    pub passes: Vec<(&'static str, f64)>,
    clock: Clock,
    begun: f64,
}

impl Timings {
    /// None yet.
    pub fn new(clock: Clock) -> Self {
        Self { passes: Vec::new(), clock, begun: clock() }
    }
}

impl Recorder for Timings {
    fn begin(&mut self, _: &Info) {
        self.begun = (self.clock)();
    }

    fn record(&mut self, pass: &Info, _: bool, _: &Buffer) -> Result<(), Error> {
        self.passes.push((pass.name, (self.clock)() - self.begun));
        Ok(())
    }
}

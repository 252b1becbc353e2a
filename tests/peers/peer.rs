//! What the programs of the peers share: the other half's process, and the measure of CPU time.

#![allow(dead_code, reason = "each program takes what it needs")]

use std::error::Error;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// The peer's process: it names itself in a line, and then answers each line by one.
pub(crate) struct Peer {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// What it calls itself.
    pub(crate) name: String,
}

impl Peer {
    /// Starts it.
    ///
    /// # Errors
    /// If it cannot start, or its name does not begin as it should.
    pub(crate) fn start(command: &mut Command, name: &str) -> Result<Self, Box<dyn Error>> {
        let mut process = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let input = process.stdin.take().ok_or("no input")?;
        let output = BufReader::new(process.stdout.take().ok_or("no output")?);
        let mut peer = Self { process, input, output, name: String::new() };
        peer.name = peer.answer()?;
        if !peer.name.starts_with(name) {
            return Err(format!("the peer is {}, not {name}", peer.name).into());
        }
        Ok(peer)
    }

    fn answer(&mut self) -> Result<String, Box<dyn Error>> {
        let mut line = String::new();
        match self.output.read_line(&mut line)? {
            0 => Err("the peer has ended".into()),
            _ => Ok(line.trim().into()),
        }
    }

    /// Sends a line and waits for the answer.
    pub(crate) fn ask(&mut self, what: &str) -> Result<(), Box<dyn Error>> {
        writeln!(self.input, "{what}")?;
        self.answer().map(drop)
    }

    /// As [`Self::ask`]; CPU time and time of it.
    pub(crate) fn measure(&mut self, what: &str) -> Result<[Duration; 2], Box<dyn Error>> {
        measure(self.process.id(), || self.ask(what))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It only ever waits for the next line; that it has ended already is no matter.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// CPU time and time of what a process does meanwhile.
pub(crate) fn measure(
    process: u32,
    work: impl FnOnce() -> Result<(), Box<dyn Error>>,
) -> Result<[Duration; 2], Box<dyn Error>> {
    let (used, begun) = (cpu_time(process)?, Instant::now());
    work()?;
    let passed = begun.elapsed();
    Ok([cpu_time(process)? - used, passed])
}

/// CPU time of all threads that a process has, in user and system mode.
fn cpu_time(process: u32) -> Result<Duration, Box<dyn Error>> {
    let mut total = 0;
    for thread in fs::read_dir(format!("/proc/{process}/task"))? {
        let text = fs::read_to_string(thread?.path().join("schedstat"))?;
        total += text.split(' ').next().ok_or("an empty schedstat")?.parse::<u64>()?;
    }
    Ok(Duration::from_nanos(total))
}

/// The middle one of each of the two times.
pub(crate) fn medians(turns: &[[Duration; 2]]) -> [f64; 2] {
    [0, 1].map(|which| {
        let mut times: Vec<_> = turns.iter().map(|turn| turn[which]).collect();
        times.sort();
        times[times.len() / 2].as_secs_f64()
    })
}

/// The bytes of numbers, as the other half reads them.
pub(crate) fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_ne_bytes).collect()
}

/// As [`floats`].
pub(crate) fn words(values: impl IntoIterator<Item = u32>) -> Vec<u8> {
    values.into_iter().flat_map(u32::to_ne_bytes).collect()
}

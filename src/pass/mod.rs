//! Named passes: what a technique is made of, what runs when something is asked for, and who is told.
//!
//! A technique is a table of [`Pass`]es in flow order. [`closure`] finds what a request needs, [`execute`] runs
//! it and hands every result to a [`Recorder`].

mod buffer;
pub mod file;
mod layer;
pub mod npy;
pub mod png;
mod recorder;

#[cfg(feature = "exr")]
pub mod exr;
#[cfg(feature = "exr")]
mod files;

pub use buffer::{Buffer, Data, Digest};
#[cfg(feature = "exr")]
pub use files::Files;
pub use layer::{Channel, Layer, layers};
pub use recorder::{Digests, Kept, Record, Recorder, Timings};

use crate::Error;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// What one axis of a buffer counts, the slowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The scene's lights, in the scene's order.
    Light,
    /// The lights that cast: points and directions, in the scene's order; an environment does not.
    Caster,
    /// The six faces +x −x +y −y +z −z.
    Face,
    /// Accumulation points of a solid's box, x counting fastest and z slowest. A single one has no axis.
    Point,
    /// Rows of an image, from the top.
    Row,
    /// Columns of an image, from the left.
    Column,
    /// The solid's vertices.
    Vertex,
    /// Directions of exit, from the normal to the horizon.
    Exit,
    /// Words of 32 bits, a bit a direction, the lowest first.
    Word,
    /// Spherical-harmonic coefficients in order l² + l + m.
    Coefficient,
    /// Rows of a matrix.
    MatrixRow,
    /// Columns of a matrix.
    MatrixColumn,
    /// Named channels, as many as there are names.
    Channel(&'static [&'static str]),
}

impl Axis {
    /// The axis in one word, or the names of its channels.
    pub fn label(self) -> String {
        match self {
            Self::Light => "light".into(),
            Self::Caster => "caster".into(),
            Self::Face => "face".into(),
            Self::Point => "point".into(),
            Self::Row => "row".into(),
            Self::Column => "column".into(),
            Self::Vertex => "vertex".into(),
            Self::Exit => "exit".into(),
            Self::Word => "word".into(),
            Self::Coefficient => "coefficient".into(),
            Self::MatrixRow => "row of matrix".into(),
            Self::MatrixColumn => "column of matrix".into(),
            Self::Channel(names) => names.join("|"),
        }
    }
}

/// The channels of a colour: linear, Rec. 709 primaries.
pub const RGB: Axis = Axis::Channel(&["R", "G", "B"]);

/// What a pass is, without its function: the row that `bitlight passes` prints.
#[derive(Debug, Clone, Copy)]
pub struct Info {
    /// `technique.pass`.
    pub name: &'static str,
    /// The equation or section of the paper that it computes, and the errata that it decides.
    pub equation: &'static str,
    /// What it computes from what, in one sentence.
    pub about: &'static str,
    /// The passes that it reads.
    pub inputs: &'static [&'static str],
    /// The axes of its buffer, the slowest first; of a certain buffer [`Self::axes_of`].
    pub axes: &'static [Axis],
    /// The unit of its values.
    pub unit: &'static str,
}

impl Info {
    /// Whether the buffer is made of images (it has rows and columns), so goes to EXR rather than NPY.
    pub fn is_image(&self) -> bool {
        self.axes.contains(&Axis::Row)
    }

    /// The axes of a buffer of the pass that has `rank` of them: all, or all but [`Axis::Point`].
    pub fn axes_of(&self, rank: usize) -> impl Iterator<Item = Axis> {
        let all = rank == self.axes.len();
        self.axes.iter().copied().filter(move |axis| all || *axis != Axis::Point)
    }
}

/// A row of a technique's table: a plain pure function from the frame and earlier buffers to one buffer.
#[derive(Debug, Clone, Copy)]
pub struct Pass<F> {
    /// Its name, equation, inputs and outputs.
    pub info: Info,
    /// The function. It reads no file, clock or environment.
    pub run: fn(&F, &Inputs<'_>) -> Buffer,
}

/// The buffers that a running pass may read: those that its row declares.
#[derive(Debug)]
pub struct Inputs<'a> {
    pass: &'a Info,
    done: &'a BTreeMap<&'static str, Buffer>,
    read: RefCell<BTreeSet<&'static str>>,
}

impl Inputs<'_> {
    /// The buffer of the pass `name`.
    ///
    /// # Panics
    /// Where the pass's row does not declare `name`: a mistake in the table.
    pub fn get(&self, name: &str) -> &Buffer {
        let Some(declared) = self.pass.inputs.iter().find(|input| **input == name) else {
            panic!("{} reads {name}, which its row does not declare", self.pass.name)
        };
        self.read.borrow_mut().insert(declared);
        &self.done[declared]
    }
}

/// Which passes of `table` must run so that `wanted` can: the wanted ones and all that they read, directly or
/// not. One flag a row of the table.
///
/// # Errors
/// An unknown name, with the nearest known one.
pub fn closure<F>(table: &[Pass<F>], wanted: &[&str]) -> Result<Vec<bool>, Error> {
    let mut needed = vec![false; table.len()];
    for name in wanted {
        let names = || table.iter().map(|pass| pass.info.name);
        let Some(row) = names().position(|known| known == *name) else {
            return Err(unknown_pass(name, names()));
        };
        needed[row] = true;
    }
    // Rows read earlier rows only, so one walk from the end finds all.
    for row in (0..table.len()).rev().filter(|row| needed[*row]).collect::<Vec<_>>() {
        mark_inputs(table, row, &mut needed);
    }
    Ok(needed)
}

fn mark_inputs<F>(table: &[Pass<F>], row: usize, needed: &mut [bool]) {
    for input in table[row].info.inputs {
        let position = table[..row].iter().position(|pass| pass.info.name == *input);
        let position =
            position.unwrap_or_else(|| panic!("{} reads {input}, not above it", table[row].info.name));
        needed[position] = true;
        mark_inputs(table, position, needed);
    }
}

fn unknown_pass<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Error {
    let error = Error::new(format!("there is no pass \"{name}\""));
    match crate::nearest(name, known) {
        Some(near) => error.remedy(format!("did you mean \"{near}\"? `bitlight passes` lists all")),
        None => error.remedy("`bitlight passes` lists all"),
    }
}

/// Runs the passes that `wanted` needs, in the table's order, and hands each result to `recorder`.
///
/// # Errors
/// An unknown name, what the recorder refuses, and a value that is not finite (contract 9), by pass and index.
pub fn execute<F>(
    table: &[Pass<F>],
    frame: &F,
    wanted: &[&str],
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    let needed = closure(table, wanted)?;
    let rows: Vec<_> = table.iter().zip(needed).filter(|(_, needed)| *needed).map(|(pass, _)| pass).collect();
    let mut done = BTreeMap::new();
    for (row, pass) in rows.iter().enumerate() {
        // What no pass reads any more makes room, and memory that is still in the cache, for the next.
        done.retain(|name, _| rows[row..].iter().any(|later| later.info.inputs.contains(name)));
        let info = &pass.info;
        recorder.begin(info);
        let inputs = Inputs { pass: info, done: &done, read: RefCell::default() };
        let buffer = (pass.run)(frame, &inputs);
        let read = inputs.read.into_inner();
        // What has nothing to compute reads nothing.
        debug_assert!(
            buffer.shape.contains(&0) || info.inputs.iter().all(|input| read.contains(input)),
            "{} declares {:?} and reads {read:?}",
            info.name,
            info.inputs
        );
        check(info, &buffer)?;
        recorder.record(info, wanted.contains(&info.name), &buffer)?;
        done.insert(info.name, buffer);
    }
    Ok(())
}

fn check(info: &Info, buffer: &Buffer) -> Result<(), Error> {
    let rank = buffer.shape.len();
    assert_eq!(rank, info.axes_of(rank).count(), "{}: a buffer with other axes than declared", info.name);
    if let Some(Axis::Channel(names)) = info.axes.last() {
        assert_eq!(buffer.shape.last(), Some(&names.len()), "{}: other channels than declared", info.name);
    }
    match buffer.first_not_finite() {
        None => Ok(()),
        Some(index) => Err(Error::new(format!(
            "{} is not finite at {:?}: the scene's numbers are too large or too small",
            info.name,
            buffer.place(index)
        ))
        .remedy("bring sizes, distances and intensities nearer to 1")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn row(
        name: &'static str,
        inputs: &'static [&'static str],
        run: fn(&f32, &Inputs<'_>) -> Buffer,
    ) -> Pass<f32> {
        let axes = &[Axis::Coefficient];
        Pass { info: Info { name, equation: "", about: "", inputs, axes, unit: "" }, run }
    }

    const TABLE: [Pass<f32>; 4] = [
        row("t.a", &[], |frame, _| Buffer::f32(&[1], vec![*frame])),
        row("t.b", &[], |_, _| Buffer::f32(&[1], vec![2.0])),
        row("t.c", &["t.a"], |_, inputs| Buffer::f32(&[1], vec![inputs.get("t.a").as_f32()[0] + 1.0])),
        row("t.d", &["t.c"], |_, inputs| Buffer::f32(&[1], inputs.get("t.c").as_f32().to_vec())),
    ];

    #[test]
    fn only_what_the_request_needs_is_run() {
        let mut kept = Kept::default();
        execute(&TABLE, &5.0, &["t.d"], &mut kept).unwrap();
        let names: Vec<_> = kept.0.iter().map(|(info, wanted, _)| (info.name, *wanted)).collect();
        assert_eq!(names, [("t.a", false), ("t.c", false), ("t.d", true)]);
        assert_eq!(kept.0[2].2.as_f32(), [6.0]);
    }

    #[test]
    fn an_unknown_pass_is_refused_with_the_nearest() {
        let error = closure(&TABLE, &["t.dd"]).unwrap_err().to_string();
        assert!(error.contains("\"t.dd\"") && error.contains("did you mean \"t.d\""), "{error}");
    }

    #[test]
    fn a_value_that_is_not_finite_is_an_error_that_names_pass_and_place() {
        let error = execute(&TABLE, &f32::NAN, &["t.a"], &mut Kept::default()).unwrap_err().to_string();
        assert!(error.contains("t.a is not finite at [0]"), "{error}");
    }

    #[test]
    fn a_single_point_has_no_axis() {
        let axes = &[Axis::Light, Axis::Point, Axis::Coefficient];
        let info = Info { axes, ..TABLE[0].info };
        assert!(info.axes_of(3).eq(axes.iter().copied()));
        assert!(info.axes_of(2).eq([Axis::Light, Axis::Coefficient]));
        assert!(check(&info, &Buffer::f32(&[1, 2, 1], vec![0.0; 2])).is_ok());
        assert!(check(&info, &Buffer::f32(&[1, 1], vec![0.0])).is_ok());
        let one = |shape: &[usize]| check(&info, &Buffer::f32(shape, vec![0.0]));
        assert!(std::panic::catch_unwind(|| one(&[1, 1, 1, 1])).is_err());
        assert!(std::panic::catch_unwind(|| one(&[1])).is_err());
    }

    #[test]
    #[should_panic(expected = "which its row does not declare")]
    fn an_undeclared_read_panics() {
        let table = [TABLE[0], row("t.x", &[], |_, inputs| inputs.get("t.a").clone())];
        let _ = execute(&table, &1.0, &["t.x"], &mut Kept::default());
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "declares")]
    fn a_declared_input_that_is_not_read_panics() {
        let table = [TABLE[0], row("t.x", &["t.a"], |_, _| Buffer::f32(&[1], vec![1.0]))];
        let _ = execute(&table, &1.0, &["t.x"], &mut Kept::default());
    }
}

//! Named passes: the tables that techniques are made of, which passes a request runs, and who receives the
//! results.
//!
//! A technique is a table of [`Pass`]es in flow order. [`needed`] finds what a request needs, [`execute`]
//! runs it and hands every result to a [`Recorder`].

mod buffer;
mod layer;
pub mod npy;
pub mod png;
mod recorder;

#[cfg(feature = "exr")]
pub mod exr;

pub use buffer::{Buffer, Data, Digest};
pub use layer::{Channel, Layer, layers};
pub use recorder::{Clock, Digests, Kept, Record, Recorder, Timings};

use crate::Error;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// What one axis of a buffer counts. Axes that any technique may have stand here. An axis that only some have
/// is an [`Axis::Of`], whose length the technique's row gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The scene's lights, in the scene's order.
    Light,
    /// The lights that cast: points and directions, in the scene's order; an environment does not.
    Caster,
    /// The six faces +x −x +y −y +z −z.
    Face,
    /// Rows of an image, from the top.
    Row,
    /// Columns of an image, from the left.
    Column,
    /// The solid's vertices.
    Vertex,
    /// Spherical-harmonic coefficients in order l² + l + m.
    Coefficient,
    /// Named channels, as many as there are names.
    Channel(&'static [&'static str]),
    /// What this word names.
    Of(&'static str),
    /// What this word names, where there are several; a buffer with a single one has no such axis.
    Several(&'static str),
}

impl Axis {
    /// The axis in one word, or the names of its channels.
    pub fn label(self) -> String {
        match self {
            Self::Light => "light".into(),
            Self::Caster => "caster".into(),
            Self::Face => "face".into(),
            Self::Row => "row".into(),
            Self::Column => "column".into(),
            Self::Vertex => "vertex".into(),
            Self::Coefficient => "coefficient".into(),
            Self::Channel(names) => names.join("|"),
            Self::Of(what) | Self::Several(what) => what.into(),
        }
    }
}

/// How channels of an image are shown to eyes. A pass names one for each group of channels, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preview {
    /// Three channels: the technique's picture, which the scene's exposure brightens.
    Picture,
    /// Three channels of colour, scaled so that all but the brightest hundredth of their values fit.
    Colour,
    /// Three channels of a unit vector, from −1 to 1.
    Direction,
    /// Three channels of a place, each from its least to its greatest.
    Place,
    /// One channel, from its least to its greatest value other than 0.
    Value,
    /// One channel of indices, told apart by colour.
    Index,
}

impl Preview {
    /// How many channels it shows.
    pub fn channels(self) -> usize {
        match self {
            Self::Picture | Self::Colour | Self::Direction | Self::Place => 3,
            Self::Value | Self::Index => 1,
        }
    }
}

/// The pass's twin on the GPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Twin {
    /// The file beside the pass, of the pass's name, such as `gbuffer.wgsl`.
    Wgsl(&'static str),
    /// There is none, for this reason.
    Absent(&'static str),
}

impl Twin {
    /// There is none yet.
    pub const PLANNED: Self = Self::Absent("the GPU backend is not written yet");
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
    /// The axes of its buffer, the slowest first. Those of a certain buffer are [`Self::axes_of`].
    pub axes: &'static [Axis],
    /// The unit of its values.
    pub unit: &'static str,
    /// The key that sets the buffer's size: where memory is short, it is the one to make smaller.
    pub knob: &'static str,
    /// Its twin on the GPU.
    pub twin: Twin,
    /// How an image is shown, one entry for each group of channels. Empty for a buffer that is no image.
    pub preview: &'static [Preview],
}

impl Info {
    /// A row that says nothing yet.
    pub const BLANK: Self = Self {
        name: "",
        equation: "-",
        about: "",
        inputs: &[],
        axes: &[],
        unit: "1",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[],
    };

    /// Its name without the technique.
    pub fn short(&self) -> &'static str {
        self.name.split_once('.').map_or(self.name, |(_, short)| short)
    }

    /// Whether its values are whole numbers (`u32`): the units `index` and `bits` say so.
    pub fn is_whole(&self) -> bool {
        ["index", "bits"].contains(&self.unit)
    }

    /// Whether it is the technique's picture.
    pub fn is_picture(&self) -> bool {
        self.preview.contains(&Preview::Picture)
    }

    /// Whether the buffer is made of images (it has rows and columns), so goes to EXR rather than NPY.
    pub fn is_image(&self) -> bool {
        self.axes.contains(&Axis::Row)
    }

    /// The axes of a buffer of the pass with `rank` axes: all, or all but an [`Axis::Several`].
    pub fn axes_of(&self, rank: usize) -> impl Iterator<Item = Axis> {
        let all = rank == self.axes.len();
        self.axes.iter().copied().filter(move |axis| all || !matches!(axis, Axis::Several(_)))
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

/// The rows of a table of passes without their functions.
pub const fn infos<F, const N: usize>(table: &[Pass<F>; N]) -> [Info; N] {
    let mut infos = [Info::BLANK; N];
    let mut at = 0;
    while at < N {
        infos[at] = table[at].info;
        at += 1;
    }
    infos
}

/// Passes that do not run, by their names: with the buffer that is there already, or `None` where nothing of
/// the request uses its values.
pub type Given = BTreeMap<&'static str, Option<Buffer>>;

/// Which passes of a table a request needs: the wanted ones and all that they read, directly or not. A given
/// pass needs no inputs. The result has one flag a row.
///
/// # Errors
/// An unknown name, with the nearest known one.
pub fn needed(table: &[Info], wanted: &[&str], given: &[&str]) -> Result<Vec<bool>, Error> {
    let mut needed = vec![false; table.len()];
    for name in wanted {
        let names = || table.iter().map(|info| info.name);
        let Some(row) = names().position(|known| known == *name) else {
            return Err(unknown_pass(name, names(), ""));
        };
        needed[row] = true;
    }
    // Rows read earlier rows only, so one walk from the end finds all.
    for row in (0..table.len()).rev() {
        if !needed[row] || given.contains(&table[row].name) {
            continue;
        }
        for input in table[row].inputs {
            let position = table[..row].iter().position(|info| info.name == *input);
            let position =
                position.unwrap_or_else(|| panic!("{} reads {input}, not above it", table[row].name));
            needed[position] = true;
        }
    }
    Ok(needed)
}

/// The error for a pass that is not there, of a technique or of none in particular.
pub(crate) fn unknown_pass<'a>(name: &str, known: impl Iterator<Item = &'a str>, technique: &str) -> Error {
    let of = if technique.is_empty() { String::new() } else { format!(" of {technique}") };
    let near =
        crate::nearest(name, known).map(|near| format!("did you mean \"{near}\"? ")).unwrap_or_default();
    let list = format!("`bitlight passes {technique}").trim_end().to_owned();
    Error::new(format!("there is no pass \"{name}\"{of}")).remedy(format!("{near}{list}` lists all"))
}

/// Runs the passes that `wanted` needs, in the table's order, except those whose buffers are given. Every
/// buffer goes to `recorder`, given ones too.
///
/// # Errors
/// An unknown name, what the recorder refuses, and a value that is not finite (contract 9), by pass and
/// index.
pub fn execute<F>(
    table: &[Pass<F>],
    frame: &F,
    wanted: &[&str],
    mut given: Given,
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    let infos: Vec<_> = table.iter().map(|pass| pass.info).collect();
    let needed = needed(&infos, wanted, &given.keys().copied().collect::<Vec<_>>())?;
    let rows: Vec<_> = table.iter().zip(needed).filter(|(_, needed)| *needed).map(|(pass, _)| pass).collect();
    let mut done = BTreeMap::new();
    for (row, pass) in rows.iter().enumerate() {
        // A buffer that no pass reads any more is freed. The next one can take its memory, which is still in
        // the cache.
        done.retain(|name, _| rows[row..].iter().any(|later| later.info.inputs.contains(name)));
        let info = &pass.info;
        let there = given.remove(info.name);
        if matches!(there, Some(None)) {
            done.insert(info.name, Buffer::f32(&[0], Vec::new()));
            continue;
        }
        recorder.begin(info);
        let buffer = match there.flatten() {
            Some(buffer) => buffer,
            None => run(pass, frame, &done)?,
        };
        recorder.record(info, wanted.contains(&info.name), &buffer)?;
        done.insert(info.name, buffer);
    }
    Ok(())
}

fn run<F>(pass: &Pass<F>, frame: &F, done: &BTreeMap<&'static str, Buffer>) -> Result<Buffer, Error> {
    let info = &pass.info;
    let inputs = Inputs { pass: info, done, read: RefCell::default() };
    let buffer = (pass.run)(frame, &inputs);
    let read = inputs.read.into_inner();
    // A pass that has nothing to compute reads nothing.
    debug_assert!(
        buffer.shape.contains(&0) || info.inputs.iter().all(|input| read.contains(input)),
        "{} declares {:?} and reads {read:?}",
        info.name,
        info.inputs
    );
    check(info, &buffer)?;
    Ok(buffer)
}

fn check(info: &Info, buffer: &Buffer) -> Result<(), Error> {
    let rank = buffer.shape.len();
    assert_eq!(rank, info.axes_of(rank).count(), "{}: a buffer with other axes than declared", info.name);
    if let Some(Axis::Channel(names)) = info.axes.last() {
        assert_eq!(buffer.shape.last(), Some(&names.len()), "{}: other channels than declared", info.name);
    }
    let whole = matches!(buffer.data, Data::U32(_));
    assert_eq!(whole, info.is_whole(), "{}: values of another type than the unit says", info.name);
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
        Pass { info: Info { name, inputs, axes: &[Axis::Coefficient], ..Info::BLANK }, run }
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
        execute(&TABLE, &5.0, &["t.d"], Given::new(), &mut kept).unwrap();
        let names: Vec<_> = kept.0.iter().map(|(info, wanted, _)| (info.name, *wanted)).collect();
        assert_eq!(names, [("t.a", false), ("t.c", false), ("t.d", true)]);
        assert_eq!(kept.0[2].2.as_f32(), [6.0]);
    }

    #[test]
    fn what_is_given_is_not_run_and_needs_nothing() {
        let mut kept = Kept::default();
        let given = Given::from([("t.c", Some(Buffer::f32(&[1], vec![40.0])))]);
        execute(&TABLE, &5.0, &["t.d"], given, &mut kept).unwrap();
        let values: Vec<_> = kept.0.iter().map(|(info, _, buffer)| (info.name, buffer.as_f32()[0])).collect();
        assert_eq!(values, [("t.c", 40.0), ("t.d", 40.0)]);
        assert_eq!(needed(&infos(&TABLE), &["t.d", "t.a"], &["t.c"]).unwrap(), [true, false, true, true]);
        // Without a buffer it is not recorded either.
        let table = [TABLE[0], row("t.x", &["t.a"], |_, inputs| inputs.get("t.a").clone())];
        let mut kept = Kept::default();
        execute(&table, &1.0, &["t.x"], Given::from([("t.a", None)]), &mut kept).unwrap();
        assert_eq!((kept.0.len(), kept.0[0].2.data.len()), (1, 0));
    }

    #[test]
    fn an_unknown_pass_is_refused_with_the_nearest() {
        let error = needed(&infos(&TABLE), &["t.dd"], &[]).unwrap_err().to_string();
        assert!(error.contains("\"t.dd\"") && error.contains("did you mean \"t.d\""), "{error}");
    }

    #[test]
    fn a_value_that_is_not_finite_is_an_error_that_names_pass_and_place() {
        let error =
            execute(&TABLE, &f32::NAN, &["t.a"], Given::new(), &mut Kept::default()).unwrap_err().to_string();
        assert!(error.contains("t.a is not finite at [0]"), "{error}");
    }

    #[test]
    fn what_is_single_has_no_axis() {
        let axes = &[Axis::Light, Axis::Several("point"), Axis::Coefficient];
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
        let _ = execute(&table, &1.0, &["t.x"], Given::new(), &mut Kept::default());
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "declares")]
    fn a_declared_input_that_is_not_read_panics() {
        let table = [TABLE[0], row("t.x", &["t.a"], |_, _| Buffer::f32(&[1], vec![1.0]))];
        let _ = execute(&table, &1.0, &["t.x"], Given::new(), &mut Kept::default());
    }
}

//! Keys of a scene: what each takes, what it means and what it bears on. A key stands beside what it sets:
//! those of a technique in its folder, shared ones in `scene/`. The same row serves reading, hints at unknown
//! keys, defaults, `--set`, the JSON Schema and the scene to start from.

mod value;
mod values;

pub use value::Value;
pub use values::{Values, difference};

use serde_json::{Value as Json, json};

/// What values a key takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Any text.
    Text,
    /// The name of a technique. This module does not know the list of techniques.
    Technique,
    /// One of these words. They are the names of a table, from which the key is read too ([`names`],
    /// [`Values::word`]).
    Choice(&'static [&'static str]),
    /// True or false.
    Flag,
    /// A whole number in this range, ends included.
    Whole(f64, f64),
    /// A finite number in this range, ends included.
    Number(f64, f64),
    /// Three finite numbers, each in this range, ends included.
    Triple(f64, f64),
}

/// What a key can bear on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bears {
    /// Some pass of the technique: goldens compare it, and dumps list it.
    Picture,
    /// What a bake stores.
    Transfer,
    /// The samples of the ground truth.
    Truth,
}

/// What a key of the frame alone bears on.
pub const PICTURE: &[Bears] = &[Bears::Picture];
/// What a key of the bake bears on.
pub const PICTURE_AND_TRANSFER: &[Bears] = &[Bears::Picture, Bears::Transfer];
/// What a key of camera or lights bears on.
pub const PICTURE_AND_TRUTH: &[Bears] = &[Bears::Picture, Bears::Truth];
/// What a key of the solid bears on.
pub const ALL: &[Bears] = &[Bears::Picture, Bears::Transfer, Bears::Truth];

/// When a key counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Only {
    /// Always.
    Always,
    /// Where the scene has the key's table.
    Given,
    /// Where another key, `table.name`, has one of these words. Bakes and truths heed this; a picture's
    /// settings have the key in any case.
    With(&'static str, &'static [&'static str]),
}

/// One key.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its table: empty for the top level; a kind of light after a colon.
    pub table: &'static str,
    /// Its name in the table.
    pub name: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What it bears on.
    pub bears: &'static [Bears],
    /// When it counts.
    pub only: Only,
    /// What stands where the file says nothing, as TOML; `None` where the key must be given or may be absent.
    pub default: Option<&'static str>,
    /// A value to start from, as TOML, where there is no default or another is better to start from.
    pub example: &'static str,
    /// Whether the scene to start from shows it behind a `#`, though it has no default.
    pub aside: bool,
    /// What it means, with its unit.
    pub about: &'static str,
}

impl Key {
    /// A key without default and example.
    pub const fn new(
        table: &'static str,
        name: &'static str,
        kind: Kind,
        bears: &'static [Bears],
        about: &'static str,
    ) -> Self {
        Self { table, name, kind, bears, only: Only::Always, default: None, example: "", aside: false, about }
    }

    /// With a default, as TOML.
    pub const fn or(self, default: &'static str) -> Self {
        Self { default: Some(default), ..self }
    }

    /// With a value to start from, as TOML.
    pub const fn example(self, example: &'static str) -> Self {
        Self { example, ..self }
    }

    /// Behind a `#` in the scene to start from.
    pub const fn aside(self) -> Self {
        Self { aside: true, ..self }
    }

    /// Counting in some cases only.
    pub const fn only(self, only: Only) -> Self {
        Self { only, ..self }
    }

    /// Its table without the kind of light.
    pub fn base(&self) -> &'static str {
        self.table.split(':').next().unwrap_or_default()
    }

    /// The kind of light that has it, if only one kind does.
    pub fn light(&self) -> Option<&'static str> {
        self.table.split_once(':').map(|(_, kind)| kind)
    }
}

/// The names of a table of words: what [`Kind::Choice`] takes, so that a key and its reader share one table.
pub const fn names<T: Copy, const N: usize>(table: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut at = 0;
    while at < N {
        names[at] = table[at].0;
        at += 1;
    }
    names
}

/// How an equation is read where print and correction differ. Whatever computes it documents both readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// As the errata correct it.
    Corrected,
    /// To the letter of the paper, errors included.
    Paper,
}

impl Reading {
    /// The words of `reading` keys.
    pub const WORDS: [(&'static str, Self); 2] = [("corrected", Self::Corrected), ("paper", Self::Paper)];
    /// Their names.
    pub const NAMES: [&'static str; 2] = names(&Self::WORDS);
}

impl Kind {
    /// What the key takes, for a person.
    pub fn describe(self) -> String {
        let range = |low: f64, high: f64| match (low, high) {
            (low, high) if low == -high && high >= 1e12 => String::new(),
            (low, high) if high >= 1e6 => format!(" from {low} to {high:e}"),
            _ => format!(" from {low} to {high}"),
        };
        match self {
            Self::Text => "a text in quotes".into(),
            Self::Technique => "the name of a technique in quotes".into(),
            Self::Flag => "true or false".into(),
            Self::Choice(words) => format!("one of \"{}\"", words.join("\", \"")),
            Self::Whole(low, high) => format!("a whole number{}", range(low, high)),
            Self::Number(low, high) => format!("a number{}", range(low, high)),
            Self::Triple(low, high) => format!("three numbers{} in brackets", range(low, high)),
        }
    }

    /// Whether `value` is of this kind.
    pub fn accepts(self, value: &Value) -> bool {
        let within = |x: f64, low: f64, high: f64| low <= x && x <= high; // false for a NaN
        match (self, value) {
            (Self::Text | Self::Technique, Value::Text(_)) | (Self::Flag, Value::Flag(_)) => true,
            (Self::Choice(words), Value::Text(text)) => words.contains(&text.as_str()),
            (Self::Whole(low, high), Value::Number(x)) => x.fract() == 0.0 && within(*x, low, high),
            (Self::Number(low, high), Value::Number(x)) => within(*x, low, high),
            (Self::Triple(low, high), Value::Numbers(all)) => {
                all.len() == 3 && all.iter().all(|x| within(*x, low, high))
            }
            _ => false,
        }
    }

    /// The kind as JSON Schema has it.
    pub fn schema(self) -> Json {
        match self {
            Self::Text | Self::Technique => json!({"type": "string"}),
            Self::Flag => json!({"type": "boolean"}),
            Self::Choice(words) => json!({"enum": words}),
            Self::Whole(low, high) => {
                json!({"type": "integer", "minimum": low as i64, "maximum": high as i64})
            }
            Self::Number(low, high) => json!({"type": "number", "minimum": low, "maximum": high}),
            Self::Triple(low, high) => json!({"type": "array", "minItems": 3, "maxItems": 3,
                "items": {"type": "number", "minimum": low, "maximum": high}}),
        }
    }
}

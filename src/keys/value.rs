//! The few kinds of value that a scene needs, read from TOML.

use crate::Error;
use serde_json::{Value as Json, json};
use std::fmt;
use toml::de::{DeTable, DeValue};

/// The most lights of a scene.
const MAX_LIGHTS: usize = 1000;

/// A value of a scene file.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Text.
    Text(String),
    /// A number, whole or not.
    Number(f64),
    /// True or false.
    Flag(bool),
    /// Numbers in brackets.
    Numbers(Vec<f64>),
}

/// A value at its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    /// The table, such as `camera` or `light[0]`; empty for the top level.
    pub(super) table: String,
    /// The key in the table.
    pub(super) name: String,
    /// What it is set to.
    pub(super) value: Value,
    /// The line of the file, from 1; none for what `--set` says.
    pub(super) line: Option<usize>,
}

impl Entry {
    /// The whole key, such as `camera.fov`.
    pub(super) fn path(&self) -> String {
        path(&self.table, &self.name)
    }
}

/// Table and name as one key.
pub(super) fn path(table: &str, name: &str) -> String {
    if table.is_empty() { name.into() } else { format!("{table}.{name}") }
}

impl Value {
    /// Reads one TOML value.
    ///
    /// # Errors
    /// Text that is no TOML value, or one of a kind that no scene needs.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let value = DeValue::parse(text).map_err(|error| Error::new(error.message()))?;
        Self::from_toml(value.get_ref()).ok_or_else(|| Error::new("a value of a kind that no key takes"))
    }

    fn from_toml(value: &DeValue<'_>) -> Option<Self> {
        Some(match value {
            DeValue::String(text) => Self::Text(text.to_string()),
            DeValue::Boolean(flag) => Self::Flag(*flag),
            DeValue::Array(items) => {
                Self::Numbers(items.iter().map(|item| number(item.get_ref())).collect::<Option<_>>()?)
            }
            other => Self::Number(number(other)?),
        })
    }

    /// The value as JSON; a whole number without a fraction.
    pub fn to_json(&self) -> Json {
        let number = |x: f64| if x.fract() == 0.0 && x.abs() < 1e15 { json!(x as i64) } else { json!(x) };
        match self {
            Self::Text(text) => json!(text),
            Self::Number(x) => number(*x),
            Self::Flag(flag) => json!(flag),
            Self::Numbers(all) => all.iter().map(|x| number(*x)).collect(),
        }
    }
}

/// As a person would write it; long texts are cut.
impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => write!(out, "{:?}", brief(text)),
            Self::Number(x) => write!(out, "{x}"),
            Self::Flag(flag) => write!(out, "{flag}"),
            Self::Numbers(all) => {
                let shown: Vec<_> = all.iter().take(8).map(f64::to_string).collect();
                write!(out, "[{}{}]", shown.join(", "), if all.len() > 8 { ", ..." } else { "" })
            }
        }
    }
}

/// A text as far as a message should quote it.
pub(super) fn brief(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.into(),
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        // A decimal number beyond the integers is still a number, that its key's range can refuse.
        DeValue::Integer(whole) => match i64::from_str_radix(whole.as_str(), whole.radix()) {
            Ok(whole) => Some(whole as f64),
            Err(_) if whole.radix() == 10 => whole.as_str().parse().ok(),
            Err(_) => None,
        },
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

/// Every value of a scene file, in the file's order of tables.
///
/// # Errors
/// What is no TOML, tables or values of a kind that no scene has, and more than [`MAX_LIGHTS`] lights; each
/// names its line.
pub(super) fn entries(text: &str) -> Result<Vec<Entry>, Error> {
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let line = |at: usize| ends.partition_point(|end| *end < at) + 1;
    let root = DeTable::parse(text).map_err(|error| {
        let error_line = error.span().map_or(1, |span| line(span.start));
        Error::new(format!("is no TOML: {}", error.message().replace('\n', ", ")))
            .line(error_line)
            .remedy("`bitlight init TECHNIQUE` writes a scene to compare with")
    })?;
    let mut entries = Vec::new();
    for (key, value) in root.get_ref() {
        let (name, at) = (key.get_ref().as_ref(), key.span().start);
        match value.get_ref() {
            DeValue::Table(table) => {
                // The brackets that number the lights are no part of a name.
                if name.contains('[') {
                    return Err(Error::new("there is no such table")
                        .line(line(at))
                        .key(brief(name))
                        .remedy("write [[light]], once for each light"));
                }
                add(&mut entries, name, table, &line)?;
            }
            DeValue::Array(items)
                if !items.is_empty() && items.iter().all(|item| item.get_ref().is_table()) =>
            {
                for (index, item) in items.iter().enumerate() {
                    if index == MAX_LIGHTS {
                        return Err(Error::new(format!("there are {} of them", items.len()))
                            .line(line(item.span().start))
                            .key(brief(name))
                            .remedy(format!("keep {MAX_LIGHTS}; many distant lights make an environment")));
                    }
                    if let DeValue::Table(table) = item.get_ref() {
                        if table.is_empty() {
                            return Err(Error::new("has no key")
                                .line(line(item.span().start))
                                .key(format!("{}[{index}]", brief(name)))
                                .remedy("write for example kind = \"point\", or leave it out"));
                        }
                        add(&mut entries, &format!("{name}[{index}]"), table, &line)?;
                    }
                }
            }
            value => entries.push(entry("", name, value, line(at))?),
        }
    }
    Ok(entries)
}

fn add(
    entries: &mut Vec<Entry>,
    table: &str,
    content: &DeTable<'_>,
    line: &impl Fn(usize) -> usize,
) -> Result<(), Error> {
    for (key, value) in content {
        entries.push(entry(table, key.get_ref(), value.get_ref(), line(key.span().start))?);
    }
    Ok(())
}

fn entry(table: &str, name: &str, value: &DeValue<'_>, line: usize) -> Result<Entry, Error> {
    let value = Value::from_toml(value).ok_or_else(|| {
        let what = match value {
            DeValue::Datetime(_) => "is a date or a time",
            DeValue::Table(_) => "is a table",
            DeValue::Array(_) => "is a list of other things than numbers",
            _ => "is a number out of range",
        };
        Error::new(what)
            .line(line)
            .key(brief(&path(table, name)))
            .remedy("keys take a text in quotes, a number, true or false, or numbers in brackets")
    })?;
    Ok(Entry { table: table.into(), name: name.into(), value, line: Some(line) })
}

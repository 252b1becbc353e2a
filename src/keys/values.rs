//! The checked values of a scene file and of what is set beside it.

use super::value::{self, Entry, brief, path};
use super::{Bears, Key, Only, Value};
use crate::Error;
use glam::Vec3;
use serde_json::{Map, Value as Json};

/// A value in force: given, or by default.
#[derive(Debug, Clone)]
struct Setting {
    entry: Entry,
    key: &'static Key,
    given: bool,
}

/// Every value in force, by its key. Each is of its key's kind.
///
/// The getters panic for a key that no table has, or that is of another kind: that is a mistake of the
/// program, which every scene shows.
#[derive(Debug, Clone)]
pub struct Values {
    keys: Vec<&'static Key>,
    /// In the order of the keys, lights last; what is absent and has no default is not here.
    settings: Vec<Setting>,
}

/// Two are equal where the same values are in force, on whatever lines they stand.
impl PartialEq for Values {
    fn eq(&self, other: &Self) -> bool {
        let all = |of: &Self| -> Vec<_> {
            let settings = of.settings.iter();
            settings.map(|setting| (setting.entry.path(), setting.entry.value.clone())).collect()
        };
        all(self) == all(other)
    }
}

impl Values {
    /// The values of a scene's text, and of the assignments `key=value` beside it, which override it.
    ///
    /// # Errors
    /// What is no TOML, an unknown table or key, with the nearest known one, and a value that its key does
    /// not take; each names line, key and remedy.
    pub fn new(keys: Vec<&'static Key>, text: &str, set: &[String]) -> Result<Self, Error> {
        let mut entries = value::entries(text)?;
        for assignment in set {
            let override_ = assigned(assignment)?;
            if override_.table.starts_with("light[")
                && !entries.iter().any(|entry| entry.table == override_.table)
            {
                return Err(Error::new("the scene has no such light")
                    .key(override_.path())
                    .remedy("lights count from light[0]"));
            }
            entries.retain(|entry| entry.path() != override_.path());
            entries.push(override_);
        }
        let mut given = Vec::new();
        for entry in &entries {
            given.push(check(&keys, &entries, entry)?);
        }
        let mut settings = Vec::new();
        let known = |key: &Key, table: &str| {
            entries.iter().position(|entry| entry.table == table && entry.name == key.name)
        };
        let mut add = |key: &'static Key, table: &str| match (known(key, table), key.default) {
            (Some(at), _) => {
                settings.push(Setting { entry: entries[at].clone(), key: given[at], given: true });
            }
            (None, Some(default)) => {
                if let Ok(value) = Value::parse(default) {
                    let entry = Entry { table: table.into(), name: key.name.into(), value, line: None };
                    settings.push(Setting { entry, key, given: false });
                }
            }
            (None, None) => {}
        };
        for key in keys.iter().filter(|key| key.base() != "light") {
            add(key, key.table);
        }
        for number in 0.. {
            let table = format!("light[{number}]");
            if !entries.iter().any(|entry| entry.table == table) {
                break;
            }
            let kind = kind(&entries, &table);
            for key in keys.iter().filter(|key| key.base() == "light") {
                if key.light().is_none_or(|light| Some(light) == kind) {
                    add(key, &table);
                }
            }
        }
        Ok(Self { keys, settings })
    }

    fn setting(&self, table: &str, name: &str) -> Option<&Setting> {
        let found =
            self.settings.iter().find(|setting| setting.entry.table == table && setting.entry.name == name);
        debug_assert!(found.is_some() || self.key(table, name).name == name);
        found
    }

    /// The row of a key.
    fn key(&self, table: &str, name: &str) -> &'static Key {
        let base = table.split('[').next().unwrap_or_default();
        let key = self.keys.iter().find(|key| key.base() == base && key.name == name);
        key.unwrap_or_else(|| panic!("{table}.{name} is read, and no table of keys has it"))
    }

    /// Puts an error at a key, with its line if the file has it.
    #[must_use]
    pub fn at(&self, table: &str, name: &str, error: Error) -> Error {
        let error = error.key(path(table, name));
        match self.setting(table, name).and_then(|setting| setting.entry.line) {
            Some(line) => error.line(line),
            None => error,
        }
    }

    /// An error at a key.
    #[must_use]
    pub fn error(&self, table: &str, name: &str, what: &str) -> Error {
        self.at(table, name, Error::new(what))
    }

    /// The error for a key that must be given and is not.
    fn missing(&self, table: &str, name: &str) -> Error {
        let remedy = format!("write for example {name} = {}", self.key(table, name).example);
        self.error(table, name, "is missing").remedy(remedy)
    }

    /// Whether the file or an assignment has a key.
    pub fn given(&self, table: &str, name: &str) -> bool {
        self.setting(table, name).is_some_and(|setting| setting.given)
    }

    /// Whether the file or an assignment has a key of a table.
    pub fn has(&self, table: &str) -> bool {
        self.settings.iter().any(|setting| setting.given && setting.entry.table == table)
    }

    fn value(&self, table: &str, name: &str) -> Option<&Value> {
        self.setting(table, name).map(|setting| &setting.entry.value)
    }

    /// A text, if there is one.
    pub fn text(&self, table: &str, name: &str) -> Option<&str> {
        match self.value(table, name)? {
            Value::Text(text) => Some(text),
            _ => panic!("{table}.{name} is read as a text, and takes none"),
        }
    }

    /// A number, if there is one.
    pub fn number(&self, table: &str, name: &str) -> Option<f64> {
        match self.value(table, name)? {
            Value::Number(number) => Some(*number),
            _ => panic!("{table}.{name} is read as a number, and takes none"),
        }
    }

    /// The number of a key that has a default.
    pub fn real(&self, table: &str, name: &str) -> f32 {
        self.double(table, name) as f32
    }

    /// The number of a key that has a default.
    pub fn double(&self, table: &str, name: &str) -> f64 {
        self.number(table, name).unwrap_or_else(|| panic!("{table}.{name} is read as if it had a default"))
    }

    /// The whole number of a key that has a default.
    pub fn whole(&self, table: &str, name: &str) -> usize {
        self.double(table, name) as usize
    }

    /// Yes or no of a key that has a default.
    pub fn flag(&self, table: &str, name: &str) -> bool {
        match self.value(table, name) {
            Some(Value::Flag(flag)) => *flag,
            _ => panic!("{table}.{name} is read as if it were yes or no by default"),
        }
    }

    /// Three numbers.
    ///
    /// # Errors
    /// Where they must be given and are not.
    pub fn vector(&self, table: &str, name: &str) -> Result<Vec3, Error> {
        match self.value(table, name) {
            Some(Value::Numbers(all)) if all.len() == 3 => {
                Ok(Vec3::new(all[0] as f32, all[1] as f32, all[2] as f32))
            }
            Some(_) => panic!("{table}.{name} is read as three numbers, and takes others"),
            None => Err(self.missing(table, name)),
        }
    }

    /// What the word of a key means, from the table that also gives the key its words ([`super::names`]);
    /// `None` where the key is absent.
    pub fn word_if<T: Copy>(&self, table: &str, name: &str, words: &[(&'static str, T)]) -> Option<T> {
        let text = self.text(table, name)?;
        let found = words.iter().find(|(word, _)| *word == text).map(|(_, meaning)| *meaning);
        Some(found.unwrap_or_else(|| panic!("{table}.{name} is read by a table without the word {text}")))
    }

    /// [`Self::word_if`] for a key that has a default.
    pub fn word<T: Copy>(&self, table: &str, name: &str, words: &[(&'static str, T)]) -> T {
        let word = self.word_if(table, name, words);
        word.unwrap_or_else(|| panic!("{table}.{name} is read as if it had a default"))
    }

    /// A text that must be given.
    ///
    /// # Errors
    /// Where it is not.
    pub fn required(&self, table: &str, name: &str) -> Result<&str, Error> {
        self.text(table, name).ok_or_else(|| self.missing(table, name))
    }

    /// Sets a number of the top level, as `--set` does.
    pub fn set(&mut self, name: &str, number: f64) {
        for setting in &mut self.settings {
            if setting.entry.table.is_empty() && setting.entry.name == name {
                setting.entry.value = Value::Number(number);
            }
        }
    }

    /// The line of the file, from 1, that has a key such as `camera.fov`; of a whole table such as
    /// `light[0]`, its first.
    pub fn line(&self, key: &str) -> Option<usize> {
        let of = |entry: &Entry| entry.path() == key || entry.table == key;
        self.settings
            .iter()
            .filter(|setting| of(&setting.entry))
            .filter_map(|setting| setting.entry.line)
            .min()
    }

    /// Every value that bears on `on`, by its key. Of lights these are the given ones, of other tables those
    /// whose keys `read` accepts.
    pub fn bearing(&self, on: Bears, read: impl Fn(&Key) -> bool) -> Map<String, Json> {
        let counts = |setting: &&Setting| {
            let Setting { key, given, .. } = setting;
            let when = match key.only {
                Only::Always => true,
                Only::Given => self.has(key.table),
                Only::With(..) if on == Bears::Picture => true,
                Only::With(other, words) => {
                    let (table, name) = other.split_once('.').unwrap_or(("", other));
                    self.text(table, name).is_some_and(|word| words.contains(&word))
                }
            };
            when && key.bears.contains(&on) && if key.base() == "light" { *given } else { read(key) }
        };
        let settings = self.settings.iter().filter(counts);
        settings.map(|setting| (setting.entry.path(), setting.entry.value.to_json())).collect()
    }
}

/// The first key at which two sets of values differ, with its value in each, as JSON; `null` where it is
/// absent.
pub fn difference<'a>(
    a: &'a Map<String, Json>,
    b: &'a Map<String, Json>,
) -> Option<(&'a str, &'a Json, &'a Json)> {
    let value = |of: &'a Map<String, Json>, key: &str| of.get(key).unwrap_or(&Json::Null);
    let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
    keys.map(|key| (key.as_str(), value(a, key), value(b, key))).find(|(_, a, b)| a != b)
}

/// The kind of the light whose table it is.
fn kind<'a>(entries: &'a [Entry], table: &str) -> Option<&'a str> {
    let kind = entries.iter().find(|entry| entry.table == table && entry.name == "kind")?;
    match &kind.value {
        Value::Text(kind) => Some(kind),
        _ => None,
    }
}

/// The row of an entry's key.
///
/// # Errors
/// Where there is none, or it does not take the entry's value.
fn check(keys: &[&'static Key], entries: &[Entry], entry: &Entry) -> Result<&'static Key, Error> {
    let error = |what: String| {
        let error = Error::new(what).key(brief(&entry.path()));
        if let Some(line) = entry.line { error.line(line) } else { error }
    };
    let table = entry.table.split('[').next().unwrap_or_default();
    let indexed = entry.table != table;
    let known = |name: &str| keys.iter().any(|key| key.base() == name);
    if indexed != (table == "light") || (!table.is_empty() && !known(table)) {
        let mut tables: Vec<_> = keys.iter().map(|key| key.base()).filter(|name| !name.is_empty()).collect();
        tables.dedup();
        let remedy = match (table, crate::nearest(table, tables.iter().copied())) {
            ("light", _) => "write [[light]], with two brackets: there can be several".to_owned(),
            (_, Some(near)) => format!("did you mean [{near}]?"),
            _ => format!("the tables are [{}]", tables.join("], [")).replace("[light]", "[[light]]"),
        };
        return Err(error(format!("there is no table {}", brief(&entry.table))).remedy(remedy));
    }
    if entry.table.is_empty() && !entry.name.is_empty() && known(&entry.name) {
        let brackets =
            if entry.name == "light" { "[[light]], once for each light" } else { "it in brackets" };
        return Err(
            error("is a table of keys".into()).remedy(format!("write {brackets}, and its keys below"))
        );
    }
    if indexed && entry.name != "kind" {
        // Which keys a light has depends on its kind.
        match entries.iter().find(|other| other.table == entry.table && other.name == "kind") {
            Some(kind) => drop(check(keys, entries, kind)?),
            None => {
                let error = Error::new("is missing").key(path(&entry.table, "kind"));
                let error = if let Some(line) = entry.line { error.line(line) } else { error };
                return Err(
                    error.remedy("say first what kind of light it is, such as kind = \"directional\"")
                );
            }
        }
    }
    let light = kind(entries, &entry.table);
    let own = || {
        let of_light = move |key: &Key| key.light().is_none_or(|kind| Some(kind) == light);
        keys.iter().copied().filter(move |key| key.base() == table && of_light(key))
    };
    let Some(key) = own().find(|key| key.name == entry.name) else {
        let remedy = match crate::nearest(&entry.name, own().map(|key| key.name)) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("the keys here are {}", own().map(|key| key.name).collect::<Vec<_>>().join(", ")),
        };
        return Err(error("there is no such key".into()).remedy(remedy));
    };
    if key.kind.accepts(&entry.value) {
        Ok(key)
    } else {
        Err(error(format!("is {}, and takes {}", entry.value, key.kind.describe())).remedy(key.about))
    }
}

/// Reads `table.key=value` as `--set` has it; a value that is no TOML is taken for text.
fn assigned(assignment: &str) -> Result<Entry, Error> {
    let Some((key, text)) = assignment.split_once('=') else {
        return Err(Error::new(format!("--set {}: there is no =", brief(assignment)))
            .remedy("write for example --set image.width=256"));
    };
    let (table, name) = key.trim().rsplit_once('.').unwrap_or(("", key.trim()));
    let value = Value::parse(text.trim()).unwrap_or_else(|_| Value::Text(text.trim().into()));
    Ok(Entry { table: table.into(), name: name.into(), value, line: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::{ALL, Kind, PICTURE};
    use serde_json::json;

    const KEYS: &[Key] = &[
        Key::new("", "time", Kind::Number(-9.0, 9.0), ALL, "").or("0"),
        Key::new("a", "word", Kind::Choice(&["one", "two"]), ALL, "").or("\"one\""),
        Key::new("a", "only", Kind::Whole(0.0, 9.0), ALL, "").or("3").only(Only::With("a.word", &["two"])),
        Key::new("b", "given", Kind::Flag, PICTURE, "").or("true").only(Only::Given),
        Key::new("light", "kind", Kind::Choice(&["sun"]), PICTURE, "").example("\"sun\""),
        Key::new("light:sun", "power", Kind::Triple(0.0, 9.0), PICTURE, "").or("[1, 2, 3]"),
    ];

    fn values(text: &str, set: &[&str]) -> Result<Values, Error> {
        let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
        Values::new(KEYS.iter().collect(), text, &set)
    }

    fn keys(values: &Values, on: Bears) -> Vec<String> {
        values.bearing(on, |_| true).keys().cloned().collect()
    }

    #[test]
    fn what_bears_on_something_is_told_by_the_keys_rows() {
        let small = values("", &[]).unwrap();
        assert_eq!(keys(&small, Bears::Picture), ["time", "a.word", "a.only"]);
        assert_eq!(keys(&small, Bears::Transfer), ["time", "a.word"]);
        let two = values("[a]\nword = \"two\"\n[b]\ngiven = false\n", &[]).unwrap();
        assert_eq!(keys(&two, Bears::Transfer), ["time", "a.word", "a.only"]);
        assert_eq!(keys(&two, Bears::Picture), ["time", "a.word", "a.only", "b.given"]);
        assert_eq!(
            keys(&values("", &["b.given=true"]).unwrap(), Bears::Picture).len(),
            4,
            "--set gives a table too"
        );
        let unread = two.bearing(Bears::Picture, |key| key.table != "a");
        assert_eq!(unread.keys().collect::<Vec<_>>(), ["time", "b.given"]);
    }

    #[test]
    fn lights_are_counted_and_their_defaults_hold_unlisted() {
        let lit =
            values("[[light]]\nkind = \"sun\"\n[[light]]\nkind = \"sun\"\npower = [1, 1, 1]\n", &[]).unwrap();
        assert!(lit.has("light[0]") && lit.has("light[1]") && !lit.has("light[2]"));
        assert_eq!(lit.vector("light[0]", "power"), Ok(Vec3::new(1.0, 2.0, 3.0)));
        assert_eq!(lit.vector("light[1]", "power"), Ok(Vec3::ONE));
        assert_eq!(keys(&lit, Bears::Picture)[3..], ["light[0].kind", "light[1].kind", "light[1].power"]);
        assert_eq!(
            (lit.line("light[1].power"), lit.line("light[1]"), lit.line("a.word")),
            (Some(5), Some(4), None)
        );
        let refused = values("[[light]]\nkind = \"sun\"\n", &["light[1].power=[1,1,1]"]).unwrap_err();
        assert!(refused.to_string().contains("the scene has no such light"), "{refused}");
    }

    #[test]
    fn a_value_that_is_set_holds_and_equal_values_are_equal_wherever_they_stand() {
        let mut one = values("", &[]).unwrap();
        let two = values("time = 2\n", &[]).unwrap();
        assert!(one != two);
        one.set("time", 2.0);
        assert!(one == two && one.double("", "time") == 2.0);
    }

    #[test]
    fn the_first_difference_is_found_on_either_side() {
        let map = |json: Json| json.as_object().unwrap().clone();
        let (a, b) = (map(json!({"x": 1, "y": 2})), map(json!({"x": 1, "y": 3, "z": 4})));
        assert_eq!(difference(&a, &b), Some(("y", &json!(2), &json!(3))));
        let (c, null) = (map(json!({"x": 1})), Json::Null);
        assert_eq!(difference(&c, &a), Some(("y", &null, &json!(2))));
        assert_eq!(difference(&a, &c), Some(("y", &json!(2), &null)));
        assert_eq!(difference(&a, &a), None);
    }

    #[test]
    #[should_panic(expected = "a.wrod is read, and no table of keys has it")]
    fn a_key_that_no_table_has_is_a_mistake_of_the_program() {
        values("", &[]).unwrap().whole("a", "wrod");
    }
}

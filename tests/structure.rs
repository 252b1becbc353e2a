//! What the source may not do, read from the source: imports run downward, files and clocks are reached from
//! two places, and nothing outside their folder knows a technique by its name.

use std::path::{Path, PathBuf};

/// The folders of `src/` from the top down (ARCHITECTURE.md, "Folders").
const FLOORS: [&str; 14] = [
    "cli",
    "compare",
    "run",
    "scene",
    "techniques",
    "truth",
    "bake",
    "store",
    "trace",
    "raster",
    "world",
    "sphere",
    "keys",
    "pass",
];

fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = bitlight::store::file::below(&root, "rs").unwrap();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path.strip_prefix(&root).unwrap().to_owned(), text)
    };
    files.into_iter().map(read).collect()
}

/// The code of a file: without its tests and without comments. Tests stand last.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    let lines = text[..end].lines().enumerate();
    lines.filter(|(_, line)| !line.trim_start().starts_with("//")).map(|(number, line)| (number + 1, line))
}

fn folder(path: &Path) -> &str {
    path.components().next().and_then(|part| part.as_os_str().to_str()).unwrap_or_default()
}

/// Every place of the code that names another folder of the crate.
fn named(line: &str) -> impl Iterator<Item = &str> {
    line.match_indices("crate::").map(|(at, found)| {
        let rest = &line[at + found.len()..];
        let end =
            rest.find(|letter: char| !letter.is_ascii_lowercase() && letter != '_').unwrap_or(rest.len());
        &rest[..end]
    })
}

#[test]
fn imports_run_downward() {
    let floor = |name: &str| FLOORS.iter().position(|floor| *floor == name);
    let (mut upward, mut seen) = (Vec::new(), 0);
    for (path, text) in sources() {
        let Some(own) = floor(folder(&path)) else { continue };
        for (number, line) in code(&text) {
            for other in named(line).filter_map(floor) {
                seen += 1;
                if other < own {
                    upward.push(format!("{}:{number}: {}", path.display(), line.trim()));
                }
            }
        }
    }
    assert!(seen > 200, "only {seen} imports were found");
    assert!(upward.is_empty(), "imports that run up:\n{}", upward.join("\n"));
}

#[test]
fn no_technique_imports_another() {
    for (path, text) in sources().into_iter().filter(|(path, _)| path.starts_with("techniques")) {
        let Some(own) = path.iter().nth(1).and_then(|own| own.to_str()).filter(|own| !own.ends_with(".rs"))
        else {
            continue;
        };
        for (number, line) in code(&text) {
            for other in
                bitlight::techniques::ALL.iter().map(|technique| technique.name).filter(|name| *name != own)
            {
                assert!(
                    !line.contains(&format!("techniques::{other}")),
                    "{}:{number}: {line}",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn files_and_clocks_are_reached_from_store_and_command_alone() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let forbidden: &[&str] = match folder(&path) {
            // What asks a path asks the disk.
            "cli" => &[],
            "store" => &["std::time", "std::env"],
            _ => &[
                "std::fs",
                "std::time",
                "std::net",
                "std::process",
                ".is_file()",
                ".is_dir()",
                ".exists()",
                ".metadata()",
            ],
        };
        for (number, line) in code(&text) {
            if forbidden.iter().any(|name| line.contains(name)) && path != Path::new("main.rs") {
                wrong.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_technique_is_named_in_its_folder_alone() {
    let mut named = Vec::new();
    for (path, text) in sources().into_iter().filter(|(path, _)| !path.starts_with("techniques")) {
        for (number, line) in code(&text) {
            for technique in bitlight::techniques::ALL {
                let word = |at: usize| {
                    let letter = |letter: Option<char>| {
                        letter.is_some_and(|letter| letter.is_alphanumeric() || letter == '_')
                    };
                    let end = at + technique.name.len();
                    !letter(line[..at].chars().next_back()) && !letter(line[end..].chars().next())
                };
                if line.match_indices(technique.name).any(|(at, _)| word(at)) {
                    named.push(format!("{}:{number}: {}", path.display(), line.trim()));
                }
            }
        }
    }
    assert!(named.is_empty(), "{} lines name a technique:\n{}", named.len(), named.join("\n"));
}

#[test]
fn lines_keep_rustfmts_width() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut long = Vec::new();
    for folder in ["src", "reference", "tests", "benches", "examples"] {
        for path in bitlight::store::file::below(&root.join(folder), "rs").unwrap() {
            let text = std::fs::read_to_string(&path).unwrap();
            let comments = text.lines().enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
            for (number, _) in comments.filter(|(_, line)| line.chars().count() > 110) {
                long.push(format!("{}:{}", path.strip_prefix(root).unwrap().display(), number + 1));
            }
        }
    }
    assert!(long.is_empty(), "{} comments are wider than 110 columns:\n{}", long.len(), long.join("\n"));
}

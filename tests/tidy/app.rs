//! House rules of the window: its floors, no circles, and nothing that draws looks at the disk.

use super::{expect_none, files_below, is_of_tests, names_below_crate, product, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every floor of the window from the ground up, and the floors that it may use. `app` is the window itself, with the table of
/// rooms; a floor that is not here fails.
const APP_FLOORS: &[(&str, &[&str])] = &[
    ("model", &[]),
    ("texts", &["model"]),
    ("ui", &["model", "texts"]),
    ("viewer", &["model", "texts", "ui"]),
    ("jobs", &["model", "texts", "ui", "viewer"]),
    ("rooms", &["model", "texts", "ui", "viewer", "jobs"]),
    ("app", &["model", "texts", "ui", "viewer", "jobs", "rooms"]),
];

/// Files of the window's product code: path below `app/src`, and the code.
fn app_files() -> Vec<(PathBuf, String)> {
    let files = files_below("app/src", "rs").into_iter();
    let read = |file: PathBuf| {
        let code = product(&fs::read_to_string(&file).unwrap());
        (file.strip_prefix(root().join("app/src")).unwrap().to_owned(), code)
    };
    files.map(read).filter(|(path, _)| !is_of_tests(path)).collect()
}

#[test]
fn floors_of_the_window_use_only_those_below() {
    let mut found = Vec::new();
    for (path, code) in app_files() {
        let first = path.components().next().unwrap().as_os_str().to_string_lossy().into_owned();
        let floor = first.trim_end_matches(".rs");
        if ["lib", "main"].contains(&floor) {
            continue;
        }
        let Some((_, allowed)) = APP_FLOORS.iter().find(|(name, _)| *name == floor) else {
            panic!("app/src/{floor} is not in the table of floors")
        };
        for name in names_below_crate(&code) {
            let known = APP_FLOORS.iter().any(|(other, _)| *other == name);
            if name != floor && (!known || !allowed.contains(&name.as_str())) {
                found.push(format!("{} uses {name}", path.display()));
            }
        }
    }
    expect_none("floors of the window that use others than their row allows", &found);
}

/// What two rooms share belongs to a floor below.
#[test]
fn rooms_of_the_window_do_not_use_each_other() {
    let mut found = Vec::new();
    for (path, code) in app_files().into_iter().filter(|(path, _)| path.starts_with("rooms")) {
        let name = path.components().nth(1).unwrap().as_os_str().to_string_lossy().into_owned();
        let own = name.trim_end_matches(".rs");
        let others = paths_of(&code, &module_of(&path)).into_iter().filter_map(|used| {
            let room = used.strip_prefix("rooms/")?.split('/').next()?.to_owned();
            let is_room = room.starts_with(|c: char| c.is_lowercase());
            (is_room && room != own && own != "mod").then_some(room)
        });
        found.extend(others.map(|room| format!("{} uses {room}", path.display())));
    }
    expect_none("rooms of the window that use another room", &found);
}

/// On a network share a look at the disk takes seconds, and the window would stand still.
#[test]
fn nothing_that_draws_looks_at_the_disk() {
    let words = [
        "std::fs",
        "fs::",
        ".exists()",
        ".is_file()",
        ".is_dir()",
        ".metadata()",
        ".canonicalize()",
        "read_dir",
        "File::",
    ];
    let mut found = Vec::new();
    for (path, code) in app_files() {
        let draws = ["rooms", "ui", "viewer", "app.rs"].iter().any(|floor| path.starts_with(floor));
        for line in code.lines().filter(|_| draws) {
            if words.iter().any(|word| line.contains(word)) {
                found.push(format!("{}: {}", path.display(), line.trim()));
            }
        }
    }
    expect_none("a job looks at the disk, and the room draws what it found", &found);
}

/// The module of a file below `app/src`, as `rooms/look`.
fn module_of(path: &Path) -> String {
    let path = path.with_extension("").to_string_lossy().into_owned();
    path.strip_suffix("/mod").unwrap_or(&path).to_owned()
}

/// Every path that code names, as `rooms/look/Look`: `crate::` and `super::` paths, and imports from a module's children.
fn paths_of(code: &str, module: &str) -> Vec<String> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let uses = code.split("use ").skip(1).filter_map(|rest| rest.split_once(';'));
    let mut paths: Vec<String> = uses.flat_map(|(tree, _)| leaves(tree)).collect();
    for start in ["crate::", "super::"] {
        let named = code.match_indices(start).map(|(at, _)| &code[at..]);
        let named = named.map(|rest| rest.chars().take_while(|c| is_path(*c)).collect::<String>());
        // What is in braces was read as an import.
        paths.extend(named.filter(|path| !path.ends_with(':')));
    }
    paths.iter().map(|path| absolute(path, module)).collect()
}

/// The single paths of a tree of imports.
fn leaves(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((prefix, list)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap().to_owned()];
    };
    let list = list.strip_suffix('}').unwrap_or(list);
    let (mut depth, mut begin, mut found) = (0, 0, Vec::new());
    for (at, c) in list.char_indices().chain([(list.len(), ',')]) {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 && c == ',' {
            found.extend(leaves(&list[begin..at]).iter().map(|leaf| format!("{prefix}{leaf}")));
            begin = at + 1;
        }
    }
    found
}

fn absolute(path: &str, module: &str) -> String {
    let mut parts: Vec<&str> = path.split("::").collect();
    if parts[0] == "crate" {
        return parts[1..].join("/");
    }
    let mut base: Vec<&str> = module.split('/').collect();
    while parts.first() == Some(&"super") {
        base.pop();
        parts.remove(0);
    }
    [base, parts].concat().join("/")
}

/// Files of the window that a file imports from; the files of one room are one.
fn app_imports() -> Vec<(String, BTreeSet<String>)> {
    let files = app_files();
    let modules: BTreeSet<String> = files.iter().map(|(path, _)| module_of(path)).collect();
    let node = |module: &str| {
        let parts: Vec<&str> = module.split('/').collect();
        if parts[0] == "rooms" { parts[..parts.len().min(2)].join("/") } else { module.to_owned() }
    };
    let used = |path: String| {
        let parts: Vec<&str> = path.split('/').collect();
        let prefixes = (1..=parts.len()).rev().map(|count| parts[..count].join("/"));
        prefixes.into_iter().find(|prefix| modules.contains(prefix))
    };
    let mut all = Vec::new();
    for (path, code) in &files {
        let module = module_of(path);
        let found = paths_of(code, &module).into_iter().filter_map(used);
        let found = found.map(|other| node(&other)).filter(|other| *other != node(&module));
        all.push((node(&module), found.collect()));
    }
    all
}

/// What is left when modules that use nothing of the rest are taken away again and again.
fn circles(mut edges: Vec<(String, BTreeSet<String>)>) -> Vec<String> {
    loop {
        let left: BTreeSet<String> = edges.iter().map(|(from, _)| from.clone()).collect();
        let before = edges.len();
        let leads_on: BTreeSet<String> = edges
            .iter()
            .filter(|(_, to)| to.iter().any(|other| left.contains(other)))
            .map(|(from, _)| from.clone())
            .collect();
        edges.retain(|(from, _)| leads_on.contains(from));
        if edges.len() == before {
            return leads_on.into_iter().collect();
        }
    }
}

#[test]
fn no_files_of_the_window_import_each_other() {
    let edges = app_imports();
    assert!(edges.iter().map(|(_, to)| to.len()).sum::<usize>() > 200, "imports are not read");
    expect_none("modules of the window in a circle, or above one", &circles(edges));
}

#[test]
fn circles_are_found() {
    let edges = |pairs: &[(&str, &[&str])]| -> Vec<(String, BTreeSet<String>)> {
        let row = |(from, to): &(&str, &[&str])| {
            ((*from).to_owned(), to.iter().map(|to| (*to).to_owned()).collect())
        };
        pairs.iter().map(row).collect()
    };
    assert!(circles(edges(&[("a", &["b", "c"]), ("b", &["c"]), ("c", &[])])).is_empty());
    assert_eq!(circles(edges(&[("a", &["b"]), ("b", &["c"]), ("c", &["b"])])), ["a", "b", "c"]);
    let code = "use super::{a::{self, B}, c as d};\nuse crate::x::Y;\nlet _ = crate::z::f();";
    let paths = paths_of(code, "rooms/look/side");
    let expected = ["rooms/look/a/self", "rooms/look/a/B", "rooms/look/c", "x/Y", "x/Y", "z/f"];
    assert_eq!(paths, expected);
}

//! The folders of `src` are layers: a file imports only from its own layer and lower ones, and files do not import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The layers, lowest first.
const LAYERS: [&str; 17] = [
    "error",
    "numeric",
    "model",
    "system",
    "excitation",
    "equations",
    "contacts",
    "output",
    "life",
    "integrate",
    "variation",
    "sensitivity",
    "smoother",
    "bands",
    "batch",
    "machine",
    "live",
];

/// Files without a layer: the root, and those of unit tests.
const NO_LAYER: [&str; 3] = ["lib.rs", "tests.rs", "yardstick.rs"];

fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        if entry.is_dir() {
            files(&entry, out);
        } else if entry.file_name().is_some_and(|name| !NO_LAYER.iter().any(|other| name == *other)) {
            out.push(entry);
        }
    }
}

/// The module of a file, `["batch", "lanes", "step"]` for one; a `mod.rs` is its folder.
fn module(root: &Path, file: &Path) -> Vec<String> {
    let path = file.strip_prefix(root).expect("within src").with_extension("");
    let mut parts: Vec<_> = path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|last| last == "mod") {
        parts.pop();
    }
    parts
}

/// The modules that a file imports from, by its private `use` lines outside of tests; re-exports do not count.
fn imports(own: &[String], is_folder: bool, text: &str) -> Vec<Vec<String>> {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let mut found = Vec::new();
    for line in text.lines().filter_map(|line| line.strip_prefix("use ")) {
        let path = line.split(['{', ';']).next().unwrap_or_default();
        let parts: Vec<&str> = path.split("::").filter(|part| !part.is_empty()).collect();
        let mut base: Vec<String> = if is_folder { own.to_vec() } else { own[..own.len() - 1].to_vec() };
        let mut rest = &parts[..];
        match parts[0] {
            "crate" => base.clear(),
            "super" if is_folder => drop(base.pop()),
            "super" => {}
            _ if is_folder => rest = &parts[..],
            _ => continue,
        }
        if matches!(parts[0], "crate" | "super") {
            rest = &parts[1..];
        }
        if rest.first() == Some(&"super") {
            base.pop();
            rest = &rest[1..];
        }
        base.extend(rest.iter().map(|part| part.to_string()));
        found.push(base);
    }
    found
}

#[test]
fn imports_go_one_way() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    files(&root, &mut all);
    let modules: BTreeSet<Vec<String>> = all.iter().map(|file| module(&root, file)).collect();
    let layer = |path: &[String]| LAYERS.iter().position(|layer| path.first().is_some_and(|p| p == layer));
    let mut graph: BTreeMap<Vec<String>, BTreeSet<Vec<String>>> = BTreeMap::new();
    for file in &all {
        let own = module(&root, file);
        let text = std::fs::read_to_string(file).expect("text");
        let here = layer(&own).unwrap_or_else(|| panic!("{own:?} is in no layer"));
        for mut import in imports(&own, file.ends_with("mod.rs"), &text) {
            // The module of an imported item.
            while !import.is_empty() && !modules.contains(&import) {
                import.pop();
            }
            let Some(there) = layer(&import) else { continue };
            assert!(there <= here, "{own:?} imports from the later layer {import:?}");
            if import != own {
                graph.entry(own.clone()).or_default().insert(import);
            }
        }
    }
    // Remove modules that import no remaining module; only circles remain.
    let mut left: BTreeSet<_> = modules;
    loop {
        let free: Vec<_> = left
            .iter()
            .filter(|module| graph.get(*module).is_none_or(|to| to.iter().all(|to| !left.contains(to))))
            .cloned()
            .collect();
        if free.is_empty() {
            break;
        }
        for module in free {
            left.remove(&module);
        }
    }
    assert!(left.is_empty(), "these files import from each other: {left:?}");
}

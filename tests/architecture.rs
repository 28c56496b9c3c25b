//! The house's laws, kept by reading the source.

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every Rust file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            all.push(path);
        }
    }
    all
}

/// Text without its unit tests and comments.
fn code(path: &Path) -> String {
    if path.ends_with("tests.rs") {
        return String::new();
    }
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]").next().unwrap_or_default();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Room → rooms it may name.
const ARROWS: [(&str, &[&str]); 13] = [
    ("main.rs", &["cli"]),
    ("cli", &["render", "scene", "film", "report", "reference", "stress", "study", "bvh", "vulkan", "error"]),
    ("study", &["render", "scene", "film", "report", "bvh", "error"]),
    ("stress", &["render", "scene", "reference", "film", "report", "layout", "error"]),
    ("render", &["scene", "bvh", "vulkan", "layout", "film", "report", "error"]),
    ("reference", &["scene", "film", "error"]),
    ("scene", &["error", "layout", "srgb"]),
    ("bvh", &["layout", "error"]),
    ("vulkan", &["error"]),
    ("film", &["error", "srgb"]),
    ("layout", &[]),
    ("report", &[]),
    ("srgb.rs", &[]),
];

/// Rooms that a file names as `crate::room` or, in the program, as `glimt::room`.
fn named(text: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for prefix in ["crate::", "glimt::"] {
        for after in text.split(prefix).skip(1) {
            let list =
                if let Some(list) = after.strip_prefix('{') { list.split("};").next().unwrap_or(list) } else { after };
            for part in if after.starts_with('{') { list.split(',').collect() } else { vec![list] } {
                let name: String = part.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if name.starts_with(char::is_lowercase) {
                    rooms.push(name);
                }
            }
        }
    }
    rooms
}

#[test]
fn rooms_know_only_whom_they_may() {
    let known: Vec<&str> = std::fs::read_dir(root().join("src"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .map(|name| Box::leak(name.into_boxed_str()) as &str)
        .map(|name| name.strip_suffix(".rs").unwrap_or(name))
        .collect();
    for (room, allowed) in ARROWS {
        let path = root().join("src").join(room);
        let own = room.strip_suffix(".rs").unwrap_or(room);
        for file in if path.is_dir() { files(&path) } else { vec![path] } {
            for name in named(&code(&file)) {
                let is_room = known.contains(&name.as_str());
                assert!(
                    !is_room || name == own || allowed.contains(&name.as_str()),
                    "{}: {room} must not know {name}",
                    file.display()
                );
            }
        }
    }
}

#[test]
fn unsafe_lives_in_vulkan_alone_and_each_block_is_argued() {
    for file in files(&root().join("src")) {
        let text = std::fs::read_to_string(&file).unwrap();
        let is_unsafe = |line: &&str| line.contains("unsafe {") || line.contains("unsafe impl");
        let blocks = text.lines().filter(is_unsafe).count();
        let arguments = text.lines().filter(|line| line.contains("// SAFETY:")).count();
        let inside = file.components().any(|part| part.as_os_str() == "vulkan");
        assert!(inside || blocks == 0, "{}: unsafe outside vulkan", file.display());
        assert_eq!(blocks, arguments, "{}: unsafe blocks and their arguments", file.display());
    }
}

#[test]
fn only_main_prints_and_exits() {
    for file in files(&root().join("src")) {
        let text = code(&file);
        for word in ["println!", "eprintln!", "print!", "process::exit"] {
            let found = text.contains(word) && !file.ends_with("main.rs");
            assert!(!found, "{}: {word}", file.display());
        }
    }
}

#[test]
fn kernels_are_small_and_take_their_bindings_from_one_place() {
    for entry in std::fs::read_dir(root().join("shaders")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "comp") {
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(text.lines().count() <= 100, "{}", path.display());
            assert!(!text.contains("binding ="), "{} declares a binding", path.display());
            assert!(text.contains("#include \"shared/kernel.glsl\""), "{}", path.display());
        }
    }
}

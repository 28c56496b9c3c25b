//! glTF 2.0 → [`Scene`].
//!
//! ```text
//! bytes ─ container ─→ JSON ─ check ─→ typed JSON (gltf crate) ─ buffers, meshopt, draco ─→ bytes of accessors
//!                      nodes, primitives, materials, images, skins, tracks ─→ Asset ─ a time ─→ Scene
//! ```
//! A file is opened once, and its [`Asset`] posed at any number of times: nodes moved by an animation, meshes morphed and skinned.
//!
//! Nothing is trusted: every index, size and count is checked against what is there before it is used. A fault that
//! leaves no sensible picture refuses the file; any other, and everything that is not shown, becomes a warning.

mod accessor;
mod animation;
mod asset;
mod buffers;
mod check;
mod choice;
mod container;
mod data;
mod draco;
mod extensions;
mod images;
mod materials;
mod meshes;
mod meshopt;
mod morph;
mod nodes;
mod pose;
mod skin;
mod spec_gloss;
mod textures;

pub use asset::Asset;
pub use choice::{AnimationSummary, Contents, ReadOptions};
pub use extensions::standing;

use super::Scene;
use crate::error::{Error, Result};
use ::gltf::json::Root;
use serde_json::Value;
use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::rc::Rc;

/// Reads a scene from a `.gltf` or `.glb` file, or from standard input for `-` (then without files beside it).
///
/// # Errors
/// `Read` when a file cannot be read; `Content` when it is not glTF, is broken, or requires an extension that is not
/// supported; `Usage` when there is no such scene, animation or variant.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Scene> {
    open(path, options)?.into_scene()
}

/// Reads a scene from the bytes of a `.gltf` or `.glb` file called `file` in messages. Files that it names are looked for
/// in `folder`; without one they are refused.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], name: String, file: &str, folder: Option<&Path>, options: &ReadOptions) -> Result<Scene> {
    open_bytes(bytes, name, file, folder, options)?.into_scene()
}

/// Opens a file, as [`read`] does, to show it at several times.
///
/// # Errors
/// As [`read`].
pub fn open(path: &Path, options: &ReadOptions) -> Result<Asset> {
    let is_stdin = path.as_os_str() == "-";
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let bytes = if is_stdin {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).map_err(failed)?;
        bytes
    } else {
        std::fs::read(path).map_err(failed)?
    };
    let folder = if is_stdin { None } else { Some(path.parent().unwrap_or(Path::new("."))) };
    let name =
        if is_stdin { "stdin".into() } else { path.file_stem().unwrap_or_default().to_string_lossy().into_owned() };
    let file = if is_stdin { "standard input".into() } else { path.display().to_string() };
    open_bytes(&bytes, name, &file, folder, options)
}

/// Opens the bytes of a file, as [`parse`] reads them.
///
/// # Errors
/// As [`read`].
pub fn open_bytes(
    bytes: &[u8],
    name: String,
    file: &str,
    folder: Option<&Path>,
    options: &ReadOptions,
) -> Result<Asset> {
    let container = container::split(bytes).map_err(|message| Error::content(file, message))?;
    let mut document = Document::new(container, file)?;
    document.most_numbers = options.max_memory.map_or(accessor::MOST_NUMBERS, |bytes| bytes / 4);
    document.load(container.binary, folder);
    document.check_data();
    document.asset(name, options).map_err(|error| with_faults(error, &document.warnings))
}

/// Most faults that are named beside the one that refuses a file.
const MOST_FAULTS: usize = 3;

/// An error, with the faults that were found before: they may be why.
fn with_faults(error: Error, warnings: &Warnings) -> Error {
    let Error::Content { file, mut message } = error else { return error };
    let is_fault = |text: &&String| {
        let is_remark = ["ignored:", "approximated:", "not played:"].iter().any(|start| text.starts_with(start));
        !is_remark && !message.contains(text.as_str())
    };
    let faults: Vec<&str> = warnings.order.iter().filter(is_fault).map(String::as_str).take(MOST_FAULTS).collect();
    if !faults.is_empty() {
        message = format!("{message} (also: {})", faults.join("; "));
    }
    Error::Content { file, message }
}

/// A parsed and checked document.
struct Document<'a> {
    /// The file, for messages.
    file: &'a str,
    /// As the `gltf` crate types it.
    root: Root,
    animations: Vec<animation::Declared>,
    skins: Vec<skin::Declared>,
    /// Content of each buffer, or why there is none.
    buffers: Vec<buffers::Content<'a>>,
    /// Content of the buffer views that are compressed.
    decompressed: meshopt::Decompressed,
    /// The compressed mesh that was read last: its attributes are asked for one by one.
    mesh: RefCell<Option<(usize, Rc<draco::Decoded>)>>,
    /// Where files lie that the document names.
    folder: Option<&'a Path>,
    warnings: Warnings,
    /// Numbers that accessors have been expanded to.
    spent: Cell<u64>,
    /// How many these may be.
    most_numbers: u64,
    /// Materials that wait for their pictures to become metallic-roughness ones.
    unconverted: Vec<spec_gloss::Unconverted>,
    /// Materials, textures and the like as they are in the file.
    raw: Rc<Value>,
}

impl<'a> Document<'a> {
    fn new(container: container::Container, file: &'a str) -> Result<Self> {
        let refuse = |message: String| Error::content(file, message);
        let mut value: Value = serde_json::from_slice(container.json)
            .map_err(|error| refuse(format!("the JSON is not valid: {error}")))?;
        check::normalise(&mut value);
        let mut warnings = Warnings::default();
        container.warnings.iter().for_each(|warning| warnings.add(*warning));
        check::version(&value).map_err(refuse)?;
        check::required_extensions(&value).map_err(refuse)?;
        check::document(&value, container.binary.is_some(), &mut warnings).map_err(refuse)?;
        let mut raw = serde_json::Map::new();
        for name in LOOSELY_READ {
            raw.insert(name.into(), value.get(name).cloned().unwrap_or_default());
        }
        let animations = animation::declared(&value, &mut warnings);
        let skins = skin::declared(&value);
        let root = typed(container.json, value).map_err(|error| refuse(format!("not a glTF document: {error}")))?;
        Ok(Self {
            file,
            root,
            animations,
            skins,
            buffers: Vec::new(),
            decompressed: BTreeMap::new(),
            mesh: RefCell::new(None),
            folder: None,
            warnings,
            spent: Cell::new(0),
            most_numbers: accessor::MOST_NUMBERS,
            unconverted: Vec::new(),
            raw: Rc::new(Value::Object(raw)),
        })
    }

    /// Loads all buffers and decompresses what is compressed.
    fn load(&mut self, binary: Option<&'a [u8]>, folder: Option<&'a Path>) {
        self.folder = folder;
        let most_bytes = self.most_numbers.saturating_mul(4);
        self.buffers = buffers::load(&self.root, binary, folder, most_bytes, &mut self.warnings);
        self.decompressed = meshopt::decompress(&self.root, &self.buffers, most_bytes, &mut self.warnings);
    }

    /// Number of textures.
    fn root_textures(&self) -> usize {
        check::list(&self.raw, "textures").len()
    }

    fn refuse(&self, message: impl ToString) -> Error {
        Error::content(self.file, message)
    }
}

/// What is read from the JSON itself, because the `gltf` crate knows too little of it or is too strict.
const LOOSELY_READ: [&str; 4] = ["materials", "textures", "samplers", "images"];

/// The document in the types of the `gltf` crate; if it is too strict for it, without what is not read from them anyway.
fn typed(json: &[u8], mut value: Value) -> serde_json::Result<Root> {
    serde_json::from_slice(json).or_else(|_| {
        for unused in ["animations", "skins", "textures", "images", "samplers"] {
            value.as_object_mut().and_then(|root| root.remove(unused));
        }
        // Through text, because the crate keeps extras as raw text.
        serde_json::from_str(&value.to_string())
    })
}

#[cfg(test)]
mod tests;

/// A name, cut off if it is very long: it may be repeated as often as something is in the file.
fn short(name: &str) -> Cow<'_, str> {
    const MOST: usize = 200;
    match name.char_indices().nth(MOST) {
        Some((end, _)) => Cow::Owned(format!("{}…", &name[..end])),
        None => Cow::Borrowed(name),
    }
}

/// Most texts of warnings: nobody reads more, and each element of a large file could have one of its own.
const MOST_WARNINGS: usize = 1000;

/// Warnings, each text once with the number of times it was given.
#[derive(Default)]
struct Warnings {
    order: Vec<String>,
    counts: BTreeMap<String, usize>,
    /// Those that came when there were enough.
    left_out: usize,
    /// The first that says that something is ignored.
    ignored: Option<String>,
}

impl Warnings {
    fn add(&mut self, text: impl Into<String>) {
        let text = text.into();
        if self.ignored.is_none() && text.starts_with("ignored:") {
            self.ignored = Some(text.clone());
        }
        if self.order.len() >= MOST_WARNINGS && !self.counts.contains_key(&text) {
            self.left_out += 1;
            return;
        }
        let count = self.counts.entry(text.clone()).or_default();
        *count += 1;
        if *count == 1 {
            self.order.push(text);
        }
    }

    fn into_lines(self) -> Vec<String> {
        let Self { order, counts, left_out, .. } = self;
        let line = |text: String| match counts.get(&text) {
            Some(count) if *count > 1 => format!("{text} ({count} times)"),
            _ => text,
        };
        let more = (left_out > 0).then(|| format!("and {left_out} more warnings"));
        order.into_iter().map(line).chain(more).collect()
    }
}

//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views whose bytes are compressed.
//!
//! Written from the extensions' text. The libraries there are either bindings to C++, whose decoder of attributes must know
//! the size of an element when it is compiled, or lack the second version of the attributes' format.

mod attributes;
mod filters;
mod indices;
mod input;

use super::buffers::Content;
use super::{buffers, Warnings};
use ::gltf::json::Root;
use filters::Filter;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The extensions' names; they differ in what their compressors write, not in what is read here.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];
/// Most bytes that a byte of compressed data can stand for: 256 elements of 4 bytes are a byte if all are alike.
const MOST_FROM_A_BYTE: usize = 1024;

/// What the extension says of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: usize,
    count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// The bytes of every compressed view by its index, or why there are none.
pub(super) type Decompressed = BTreeMap<usize, Result<Vec<u8>, String>>;

/// Decompresses every view that is compressed, all together to `left` bytes at most: many may name the same data. One that cannot be had refuses the file only when something that is drawn
/// needs it.
pub(super) fn decompress(root: &Root, buffers: &[Content], mut left: u64, warnings: &mut Warnings) -> Decompressed {
    let mut decompressed = Decompressed::new();
    for (index, view) in root.buffer_views.iter().enumerate() {
        let Some((name, extension)) = view.extensions.as_ref().and_then(|all| own(&all.others)) else { continue };
        let bytes = decompress_one(extension, buffers, &mut left);
        let bytes = bytes.map_err(|fault| format!("bufferViews[{index}].extensions.{name}: {fault}"));
        match &bytes {
            Err(fault) => warnings.add(fault.clone()),
            Ok(bytes) if bytes.len() as u64 != view.byte_length.0 => {
                let (declared, length) = (view.byte_length.0, bytes.len());
                warnings.add(format!("bufferViews[{index}]: byteLength is {declared}, decompressed it has {length}"));
            }
            Ok(_) => {}
        }
        decompressed.insert(index, bytes);
    }
    decompressed
}

/// Of each buffer, whether it only stands in for what is compressed elsewhere, and need not be there: it says so, or it has
/// no data of its own and all its views are compressed.
pub(super) fn fallbacks(root: &Root, has_binary: bool) -> Vec<bool> {
    let mut all_compressed = vec![None; root.buffers.len()];
    for view in &root.buffer_views {
        let is_compressed = view.extensions.as_ref().is_some_and(|all| own(&all.others).is_some());
        if let Some(all) = all_compressed.get_mut(view.buffer.value()) {
            *all = Some(all.unwrap_or(true) && is_compressed);
        }
    }
    let is_fallback = |(index, all): (usize, Option<bool>)| {
        let buffer = &root.buffers[index];
        let has_data = buffer.uri.is_some() || (has_binary && index == 0);
        let extension = buffer.extensions.as_ref().and_then(|all| own(&all.others));
        let says_so = extension.and_then(|(_, extension)| extension.get("fallback")?.as_bool());
        says_so == Some(true) || (!has_data && all == Some(true))
    };
    all_compressed.into_iter().enumerate().map(is_fallback).collect()
}

/// Either extension among others.
fn own(others: &Map<String, Value>) -> Option<(&'static str, &Value)> {
    NAMES.into_iter().find_map(|name| others.get(name).map(|value| (name, value)))
}

fn decompress_one(extension: &Value, buffers: &[Content], left: &mut u64) -> Result<Vec<u8>, String> {
    let view = Compressed::deserialize(extension).map_err(|error| error.to_string())?;
    let bytes = buffers::slice(buffers, view.buffer, view.byte_offset, view.byte_length)?;
    let (count, stride) = (view.count, view.byte_stride);
    let fits = match view.mode {
        Mode::Attributes => stride % 4 == 0 && (4..=256).contains(&stride) && view.filter.fits(stride),
        Mode::Triangles => (stride == 2 || stride == 4) && view.filter == Filter::None && count % 3 == 0,
        Mode::Indices => (stride == 2 || stride == 4) && view.filter == Filter::None,
    };
    if !fits {
        return Err(format!("{count} elements of {stride} bytes do not fit its mode and filter"));
    }
    let size = count.checked_mul(stride).filter(|size| *size <= bytes.len().saturating_mul(MOST_FROM_A_BYTE));
    let size = size.ok_or_else(|| format!("{count} elements cannot come from {} bytes", bytes.len()))?;
    *left = left.checked_sub(size as u64).ok_or("it takes more memory than is left (see --max-memory)")?;
    match view.mode {
        Mode::Attributes => {
            let mut decoded = attributes::decode(bytes, count, stride)?;
            view.filter.undo(&mut decoded, stride);
            Ok(decoded)
        }
        Mode::Triangles => indices::decode_triangles(bytes, count, stride),
        Mode::Indices => indices::decode_indices(bytes, count, stride),
    }
}

#[cfg(test)]
mod tests;

//! What the tests of several parts need.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout, clippy::print_stderr)]

use super::*;

#[path = "../../../tests/corpus_folder.rs"]
mod corpus_folder;
pub(super) use corpus_folder::corpus;

/// Opens a file with its buffers, whatever extensions it requires.
pub(super) fn with_document<T>(path: &Path, visit: impl FnOnce(&Document) -> T) -> T {
    let bytes = std::fs::read(path).unwrap();
    let container = container::split(&bytes).unwrap();
    let mut value: Value = serde_json::from_slice(container.json).unwrap();
    value.as_object_mut().unwrap().remove("extensionsRequired");
    let json = value.to_string();
    let file = path.display().to_string();
    let mut document = Document::new(container::Container { json: json.as_bytes(), ..container }, &file).unwrap();
    document.load(container.binary, path.parent());
    visit(&document)
}

/// Opens every model of the corpus' manifest.
pub(super) fn documents(corpus: &Path, mut visit: impl FnMut(&str, &Document)) {
    let table = std::fs::read_to_string(corpus.join("MANIFEST.tsv")).unwrap();
    for path in table.lines().skip(1).filter_map(|line| line.split('\t').nth(1)) {
        with_document(&corpus.join(path), |document| visit(path, document));
    }
}

/// Bytes written as hexadecimal digits.
pub(super) fn bytes_of(digits: &str) -> Vec<u8> {
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap()).collect()
}

/// Calls `read` with the data cut off at every byte (of long data, at 300 places) and with `times` random changes of up to
/// four bytes, always the same ones.
pub(super) fn hurt(bytes: &[u8], times: usize, mut read: impl FnMut(&[u8])) {
    for end in (0..bytes.len()).step_by(bytes.len().div_ceil(300)) {
        read(&bytes[..end]);
    }
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for _ in 0..times {
        let mut changed = bytes.to_vec();
        for _ in 0..=random(4) {
            let at = random(changed.len());
            changed[at] ^= if random(2) == 0 { 1 << random(8) } else { random(255) as u8 + 1 };
        }
        read(&changed);
    }
}

//! Files that are not what they should be: the validator's own, and what the fuzzer found.

use super::support::corpus;
use glimt::scene::{gltf, Instancing, Soup};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All files below a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { &mut folders } else { &mut found }.push(path);
        }
    }
    found.sort();
    found
}

/// Codes of the errors that the validator reports, each once.
fn codes(verdict: &Value) -> Vec<&str> {
    let messages = verdict["issues"]["messages"].as_array().unwrap();
    let errors = messages.iter().filter(|message| message["severity"] == 0);
    let mut codes: Vec<&str> = errors.map(|message| message["code"].as_str().unwrap()).collect();
    codes.dedup();
    codes
}

/// How warnings begin that are no answer to a fault.
const REMARKS: [&str; 6] = [
    "the file has no scene",
    "not played:",
    "approximated:",
    "ignored: extension",
    "ignored: points or lines",
    "ignored: textures[0] has no picture",
];

/// The validator's own files: what it calls an error is refused or warned of; what it accepts is accepted, unless its data are
/// missing or it needs what we lack.
#[test]
fn the_validators_verdicts_are_ours() {
    let Some(corpus) = corpus() else { return };
    let (mut counts, mut faults) = (BTreeMap::<&str, usize>::new(), Vec::new());
    let reports: Vec<PathBuf> = files(&corpus.join("invalid"))
        .into_iter()
        .filter(|path| path.to_string_lossy().ends_with(".report.json"))
        .collect();
    for report in &reports {
        let path = PathBuf::from(report.to_string_lossy().strip_suffix(".report.json").unwrap());
        let verdict: Value = serde_json::from_slice(&std::fs::read(report).unwrap()).unwrap();
        let is_error = verdict["issues"]["numErrors"].as_u64().unwrap() > 0;
        let scene = gltf::read(&path, &gltf::ReadOptions::default());
        // What is only a remark on what is shown names no fault.
        let is_fault = |text: &&String| !REMARKS.iter().any(|remark| text.starts_with(remark));
        let said = match &scene {
            Ok(scene) => scene.warnings.iter().filter(is_fault).cloned().collect(),
            Err(error) => vec![format!("refused: {error}")],
        };
        let outcome = match (is_error, &scene) {
            (true, Err(_)) => "an error, refused",
            (true, Ok(_)) if !said.is_empty() => "an error, warned of",
            (true, Ok(_)) => "an error, not mentioned",
            (false, Ok(_)) => "no error, accepted",
            (false, Err(_)) if said[0].contains("it requires") || said[0].contains("minVersion") => {
                "no error, needs what we lack"
            }
            (false, Err(_)) if said[0].contains("there is no BIN chunk for it") => "no error, its data are missing",
            (false, Err(_)) => "no error, refused",
        };
        let name = path.strip_prefix(&corpus).unwrap().display();
        println!("{name}\n    {outcome}: {:?}\n    {}", codes(&verdict), said.join("\n    "));
        *counts.entry(outcome).or_default() += 1;
        if ["an error, not mentioned", "no error, refused"].contains(&outcome) {
            faults.push(format!("{name}: {outcome}"));
        }
    }
    println!("{} files: {counts:#?}", reports.len());
    assert!(faults.is_empty(), "{faults:#?}");
}

/// What the fuzzer found is answered now. Kept small; their names say what was wrong.
#[test]
fn what_the_fuzzer_found_is_answered() {
    let found = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regression"));
    assert!(!found.is_empty());
    for path in found {
        let bytes = std::fs::read(&path).unwrap();
        let options = gltf::ReadOptions { max_memory: Some(16 << 20), ..gltf::ReadOptions::default() };
        let answer = gltf::parse(&bytes, "found".into(), "found", None, &options).map(|scene| {
            [Instancing::Flat, Instancing::Shared]
                .map(|instancing| Soup::with(&scene, instancing).map(|soup| soup.len()))
        });
        println!("{}: {answer:?}", path.display());
    }
}

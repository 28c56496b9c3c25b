//! Kernels compiled ahead, side by side: the driver's cache on disk shows which.

use super::cli::text;
use glimt::render::Renderer;
use glimt::scene::built_in;
use glimt::vulkan::{DeviceChoice, Habits};
use glimt::Options;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Where Mesa keeps machine code.
const FOLDER: &str = "MESA_SHADER_CACHE_DIR";

/// Cold runs until a twin has compiled something.
const ATTEMPTS: usize = 12;

/// Tells the test of validation that it is the process that renders.
const IS_CHILD: &str = "GLIMT_TEST_COMPILES_AHEAD";

/// What that process says when twins have compiled something.
const ON_TWINS: &str = "compiled on twins";

/// Names of all machine code below a folder.
fn compiled(folder: &Path) -> BTreeSet<OsString> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let names = entries.map(|entry| match entry.file_type().unwrap().is_dir() {
        true => compiled(&entry.path()),
        false => [entry.file_name()].into(),
    });
    names.flatten().filter(|name| name != "index" && name != "marker").collect()
}

/// Why this machine cannot show it, if it cannot.
fn reason_to_skip() -> Option<&'static str> {
    let info = &super::support::renderer().device().info;
    if !info.name.contains("llvmpipe") {
        return Some("the driver is not Mesa's software Vulkan");
    }
    (std::thread::available_parallelism().unwrap().get() == 1).then_some("there is one core")
}

/// Renders in a process of its own; the report.
fn cornell(folder: &Path, variables: &[(&str, &Path)], more: &[&str]) -> serde_json::Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glimt"));
    command.current_dir(folder).args(["render", "cornell", "--size", "40x30", "--json"]).args(more);
    let output = command.envs(variables.iter().copied()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn what_twins_compile_the_device_finds() {
    if let Some(reason) = reason_to_skip() {
        println!("skipped: {reason}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let ahead_of = |report: &serde_json::Value, what| report["compiled_ahead"][what].as_u64().unwrap();
    // Where cores are busy the driver may not come to write to disk what a twin is to find: then the device compiles all.
    let mut colds = (0..ATTEMPTS).map(|attempt| {
        let ahead = folder.path().join(attempt.to_string());
        let report = cornell(folder.path(), &[(FOLDER, &ahead)], &[]);
        (ahead, report)
    });
    let (ahead, cold) = colds.find(|(_, report)| ahead_of(report, "on_twins") > 0).expect("a twin that compiles");
    let one_by_one = folder.path().join("one by one");
    let expected = cornell(folder.path(), &[(FOLDER, &one_by_one)], &["--threads", "1"]);
    // All but `prepare`, which the device compiles to see whether it has to.
    assert_eq!((ahead_of(&cold, "kernels"), ahead_of(&expected, "kernels")), (5, 0));
    assert!(ahead_of(&cold, "on_twins") < 5, "{}", cold["compiled_ahead"]);
    // Had the device compiled a kernel again, because to the driver it was not the same, there would be more.
    let kernels = compiled(&one_by_one);
    assert_eq!(kernels.len(), 6, "primary, prepare, shade, shadow, reflection, resolve: {kernels:?}");
    assert_eq!(compiled(&ahead), kernels);
    let warm = cornell(folder.path(), &[(FOLDER, &ahead)], &[]);
    assert_eq!(compiled(&ahead), kernels);
    let without = cornell(folder.path(), &[("MESA_SHADER_CACHE_DISABLE", Path::new("true"))], &[]);
    assert_eq!(ahead_of(&without, "on_twins"), 0, "a twin does not find what is not kept");
    for report in [cold, warm, without] {
        assert_eq!(report["image"]["sha256"], expected["image"]["sha256"]);
    }
}

#[test]
fn validation_has_nothing_against_twins() {
    if std::env::var_os(IS_CHILD).is_some() {
        compile_ahead_and_validate();
        return;
    }
    if let Some(reason) = reason_to_skip() {
        println!("skipped: {reason}");
        return;
    }
    // This test once more, in a process of its own, with an empty cache.
    let has_used_twins = || {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "--nocapture", "ahead::validation_has_nothing_against_twins"]);
        let output = command.env(FOLDER, folder.path()).env(IS_CHILD, "1").output().unwrap();
        let said = text(&output.stdout);
        assert!(output.status.success() && said.contains("1 passed"), "{said}{}", text(&output.stderr));
        said.contains(ON_TWINS)
    };
    assert!((0..ATTEMPTS).any(|_| has_used_twins()), "a twin that compiles");
}

/// Any validation message fails.
fn compile_ahead_and_validate() {
    let habits = Habits { compile_ahead: Some(true), ..Habits::default() };
    let renderer = Renderer::with_habits(&DeviceChoice::Best, true, habits).unwrap();
    let options = Options { size: (40, 30), ..Options::default() };
    let report = renderer.render(&built_in("cornell").unwrap(), &options).unwrap().1;
    if report.compiled_ahead.on_twins > 0 {
        println!("{ON_TWINS}");
    }
}

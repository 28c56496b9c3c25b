//! The program as its users meet it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn glimt(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glimt"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    glimt(folder, arguments).output().unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Fails with this code, says one line that contains `needle`, and leaves no file behind.
pub fn assert_fails(arguments: &[&str], code: i32, needle: &str) {
    let folder = tempfile::tempdir().unwrap();
    assert_failed(&run(folder.path(), arguments), folder.path(), code, needle);
}

fn assert_failed(output: &Output, folder: &Path, code: i32, needle: &str) {
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert!(message.contains(needle), "'{needle}' is not in: {message}");
    assert!(!message.contains("panicked"), "{message}");
    assert!(message.trim().lines().count() == 1, "one line: {message}");
    assert!(output.stdout.is_empty(), "{}", text(&output.stdout));
    assert!(files(folder).is_empty(), "left behind: {:?}", files(folder));
}

const TINY: [&str; 3] = ["render", "--size", "32x24"];

fn tiny<'a>(more: &[&'a str]) -> Vec<&'a str> {
    TINY.iter().copied().chain(more.iter().copied()).collect()
}

#[test]
fn bad_usage() {
    assert_fails(&["render", "--size", "0x10"], 2, "each side must be 1 to");
    assert_fails(&["render", "--size", "100000x100000"], 2, "each side must be 1 to");
    assert_fails(&["render", "--size", "60000x60000"], 2, "at most");
    assert_fails(&tiny(&["--spp", "0"]), 2, "samples a pixel");
    assert_fails(&tiny(&["--max-depth", "100000"]), 2, "maximum depth");
    assert_fails(&tiny(&["--background", "mauve"]), 2, "mauve");
    assert_fails(&tiny(&["--camera", "left"]), 2, "no camera 'left'");
    assert_fails(&tiny(&["-o", "picture.bmp"]), 2, ".png, .exr or .hdr");
    assert_fails(&tiny(&["--eye", "0,0,0", "--target", "0,0,0"]), 2, "coincide");
    assert_fails(&["render", "--no-such-flag"], 2, "--no-such-flag");
}

#[test]
fn bad_input_files() {
    assert_fails(&tiny(&["missing.glb"]), 2, "missing.glb: no such file");
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    assert_fails(&tiny(&[&folder.path().display().to_string()]), 2, "cannot read");
    std::fs::write(path("empty.glb"), b"").unwrap();
    assert_fails(&tiny(&[&path("empty.glb")]), 2, "the file is empty");
    std::fs::write(path("cut.glb"), b"glTF\x02\0\0\0\x00\x10\0\0\x20\0\0\0JSON{\"asset\":").unwrap();
    assert_fails(&tiny(&[&path("cut.glb")]), 2, "it is cut off");
    std::fs::write(path("noise.glb"), [0x9d; 300]).unwrap();
    assert_fails(&tiny(&[&path("noise.glb")]), 2, "neither a .glb");
    std::fs::write(path("text.gltf"), "{\"asset\": {\"version\": \"2.0\"").unwrap();
    assert_fails(&tiny(&[&path("text.gltf")]), 2, "the JSON is not valid");
}

#[test]
fn no_loader_no_driver_no_such_device() {
    assert_fails(&tiny(&["--device", "voodoo"]), 3, "no device 'voodoo'");
    assert_fails(&tiny(&["--device", "99"]), 3, "no device '99'");
    let folder = tempfile::tempdir().unwrap();
    let output = glimt(folder.path(), &TINY)
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output();
    assert_failed(&output.unwrap(), folder.path(), 3, "finds no driver");
    // A file that is no library stands in for a machine without the loader.
    let libraries = tempfile::tempdir().unwrap();
    std::fs::write(libraries.path().join("libvulkan.so.1"), b"").unwrap();
    std::fs::write(libraries.path().join("libvulkan.so"), b"").unwrap();
    let output = glimt(folder.path(), &TINY).env("LD_LIBRARY_PATH", libraries.path()).output().unwrap();
    assert_failed(&output, folder.path(), 3, "no Vulkan loader");
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sub.png");
    std::fs::create_dir(&path).unwrap();
    assert_fails(&tiny(&["-o", &path.display().to_string()]), 4, "it is a folder");
    assert_fails(&tiny(&["-o", "/nonexistent/folder/a.png"]), 4, "cannot write /nonexistent/folder/a.png");
    assert_fails(&tiny(&["--background", "transparent", "-o", "a.hdr"]), 2, "has no alpha");
}

#[test]
fn a_picture_its_report_and_its_formats() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &tiny(&["--validate"]));
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(0), "table.png\n"), "{}", text(&output.stderr));
    let output = run(folder.path(), &tiny(&["cornell", "--json", "--validate"]));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    for pointer in [
        "/image/path",
        "/image/width",
        "/image/height",
        "/image/sha256",
        "/device/name",
        "/device/driver",
        "/device/api",
        "/device/type",
        "/device/subgroup_size",
        "/scene/triangles",
        "/scene/instances",
        "/scene/lights",
        "/scene/materials",
        "/scene/warnings",
        "/features/shadows",
        "/passes/0/name",
        "/passes/0/dispatches",
        "/passes/0/items",
        "/passes/0/ms",
        "/rays/primary",
        "/rays/shadow",
        "/rays/reflection",
        "/times_ms/load",
        "/times_ms/bvh",
        "/times_ms/device",
        "/times_ms/upload",
        "/times_ms/render",
        "/times_ms/save",
        "/times_ms/total",
        "/compiled_ahead/kernels",
        "/compiled_ahead/on_twins",
        "/compiled_ahead/ms",
        "/memory_bytes/device_peak",
        "/memory_bytes/queues",
    ] {
        assert!(report.pointer(pointer).is_some(), "{pointer} is not in {report}");
    }
    // The hash is of the decoded pixels.
    use sha2::Digest;
    let pixels = image::open(folder.path().join("cornell.png")).unwrap().into_rgb8();
    let hash: String = sha2::Sha256::digest(pixels.as_raw()).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(report["image"]["sha256"], hash);
    for name in ["a.exr", "a.hdr", "b.png"] {
        let more = if name == "b.png" { vec!["-o", name, "--bits", "16"] } else { vec!["-o", name] };
        assert_eq!(run(folder.path(), &tiny(&more)).status.code(), Some(0), "{name}");
        // 8 bits are 1/510 off at most; Radiance HDR has 8 bits of the largest channel, in linear light.
        let most = if name == "a.hdr" { "0.01" } else { "0.002" };
        let same = run(folder.path(), &["diff", "table.png", name, "--max-difference", most]);
        assert_eq!(same.status.code(), Some(0), "{name}: {}", text(&same.stderr));
    }
    let piped = run(folder.path(), &tiny(&["-o", "-"]));
    assert_eq!(piped.stdout, std::fs::read(folder.path().join("table.png")).unwrap());
    assert!(files(folder.path()).iter().all(|path| !path.display().to_string().contains(".glimt-")), "temporary files");
}

#[test]
fn standard_error_may_be_full_and_folders_may_bear_a_scene_s_name() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("table")).unwrap();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = glimt(folder.path(), &tiny(&["-o", "-"])).stderr(full).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stdout.starts_with(b"\x89PNG"), "the picture goes to standard output all the same");
    let output =
        glimt(folder.path(), &tiny(&["-o", "-"])).stdout(std::fs::File::create("/dev/full").unwrap()).output().unwrap();
    assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
}

#[cfg(unix)]
#[test]
fn the_picture_behind_a_link_is_replaced_not_the_link() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("real.png"), b"old").unwrap();
    std::os::unix::fs::symlink("real.png", folder.path().join("link.png")).unwrap();
    assert!(run(folder.path(), &tiny(&["-o", "link.png"])).status.success());
    assert!(folder.path().join("link.png").is_symlink());
    assert!(std::fs::read(folder.path().join("real.png")).unwrap().starts_with(b"\x89PNG"));
    glimt::film::write_whole(&folder.path().join("link.png"), b"text").unwrap();
    assert!(folder.path().join("link.png").is_symlink());
    assert_eq!(std::fs::read(folder.path().join("real.png")).unwrap(), b"text");
}

#[test]
fn a_scene_from_standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let document = br#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{}]}"#;
    let file = folder.path().join("in.gltf");
    std::fs::write(&file, document).unwrap();
    let output =
        glimt(folder.path(), &tiny(&["-", "--json"])).stdin(std::fs::File::open(&file).unwrap()).output().unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["image"]["path"], "stdin.png");
    assert!(report["scene"]["warnings"].to_string().contains("no triangle"), "{report}");
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let hash = |more: &[&str]| {
        let output =
            run(folder.path(), &[&["render", "table", "--size", "160x120", "--spp", "3", "--json"], more].concat());
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        report["image"]["sha256"].as_str().unwrap().to_owned()
    };
    let one = hash(&["--threads", "1"]);
    for more in [&["--threads", "2"][..], &["--threads", "5", "--samples-in-flight", "4096"], &["--all-features"], &[]]
    {
        assert_eq!(one, hash(more), "{more:?}");
    }
}

#[test]
fn diff_decides_by_its_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    for (name, depth) in [("a.png", "8"), ("b.png", "0")] {
        assert!(run(folder.path(), &tiny(&["--max-depth", depth, "-o", name])).status.success());
    }
    let code = |arguments: &[&str]| run(folder.path(), &[&["diff"], arguments].concat()).status.code();
    assert_eq!(
        code(&[
            "a.png",
            "a.png",
            "--max-rmse",
            "0",
            "--max-flip",
            "0",
            "--max-difference",
            "0",
            "--max-share",
            "0",
            "--min-ssim",
            "1",
            "--min-psnr",
            "100"
        ]),
        Some(0)
    );
    for threshold in ["--max-rmse", "--max-flip", "--max-difference", "--max-share"] {
        assert_eq!(code(&["a.png", "b.png", threshold, "0.0001"]), Some(1), "{threshold}");
    }
    for threshold in ["--min-ssim=0.9999", "--min-psnr=80"] {
        assert_eq!(code(&["a.png", "b.png", threshold]), Some(1), "{threshold}");
    }
    assert_eq!(code(&["a.png", "b.png", "-o", "heat.png"]), Some(0));
    assert!(folder.path().join("heat.png").exists());
    assert_eq!(code(&["a.png", "missing.png"]), Some(2));
    assert!(run(folder.path(), &["render", "--size", "16x16", "-o", "small.png"]).status.success());
    assert_eq!(code(&["a.png", "small.png"]), Some(2), "sizes differ");
}

#[test]
fn info_explain_devices_completions() {
    let folder = tempfile::tempdir().unwrap();
    let said = |arguments: &[&str]| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
        text(&output.stdout).to_owned()
    };
    assert!(said(&["info", "table"]).contains("in 8 instances of 4 meshes"));
    let teapot = said(&["explain", "teapot"]);
    assert!(teapot.contains("reflection pass   because no material mirrors"), "{teapot}");
    assert!(!teapot.contains("reflection_queue        "), "no bytes for it: {teapot}");
    assert!(said(&["explain", "table", "--format", "mermaid"]).starts_with("flowchart LR"));
    for arguments in [&["info", "cornell", "--json"][..], &["explain", "cornell", "--json"], &["devices", "--json"]] {
        assert!(serde_json::from_str::<serde_json::Value>(&said(arguments)).is_ok(), "{arguments:?}");
    }
    assert!(said(&["devices"]).contains("0: "));
    assert!(said(&["completions", "bash"]).contains("_glimt"));
    assert!(said(&["render", "--help"]).contains("--samples-in-flight"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut child =
        glimt(folder.path(), &["render", "--size", "2048x2048", "--spp", "256"]).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_millis(1500));
    Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(files(folder.path()).is_empty(), "{:?}", files(folder.path()));
}

#[test]
fn a_picture_until_an_error_is_reached_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "a.exr", "a.hdr"] {
        let output = run(folder.path(), &tiny(&["--target-error", "0.05", "--json", "-o", name]));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let reached = &told["convergence"];
        assert!(reached["error"].as_f64() <= Some(0.05) && reached["reached"] == "error", "{reached}");
        let bytes = std::fs::read(folder.path().join(name)).unwrap();
        let said = String::from_utf8_lossy(&bytes).into_owned();
        let rmse = format!("{:.6e}", reached["error"].as_f64().unwrap());
        assert!(said.contains("glimt:rmse") && said.contains(&rmse), "{name} does not say {rmse}");
        assert_eq!(glimt::film::read(&folder.path().join(name)).unwrap().width, 32);
    }
    assert_fails(&tiny(&["--target-error", "0"]), 2, "above 0");
    assert_fails(&tiny(&["--max-time", "inf"]), 2, "--max-time inf");
    assert_fails(&tiny(&["--max-time", "1", "--sampler", "stratified"]), 2, "stratified");
    assert_fails(&tiny(&["--max-time", "1", "--device", "reference"]), 2, "reference");
}

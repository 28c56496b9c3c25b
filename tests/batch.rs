//! Many pictures in one process.

use crate::cli::{run, text};
use serde_json::{json, Value};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A batch that waits for jobs.
fn start(folder: &Path, flags: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glimt"));
    command.current_dir(folder).arg("batch").args(flags);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The answers to all jobs, the exit code, and what was said on standard error.
fn answers(folder: &Path, flags: &[&str], jobs: &[u8]) -> (Vec<Value>, i32, String) {
    let mut child = start(folder, flags);
    child.stdin.take().unwrap().write_all(jobs).unwrap();
    let output = child.wait_with_output().unwrap();
    let answers = text(&output.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (answers, output.status.code().unwrap(), text(&output.stderr).to_owned())
}

fn files(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

/// A triangle as a file.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[]},{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

#[test]
fn pictures_are_those_of_render() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("triangle.gltf"), TRIANGLE).unwrap();
    let jobs: [(Value, &[&str]); 6] = [
        (json!({"id": 1, "scene": "table", "size": "48x32"}), &["table", "--size", "48x32"]),
        (
            json!({"id": "two", "scene": "cornell", "size": [40, 30], "spp": 3, "max_depth": 2, "no-default-light": false}),
            &["cornell", "--size", "40x30", "--spp", "3", "--max-depth", "2"],
        ),
        (
            json!({"scene": "triangle.gltf", "scene-choice": 1, "size": "32x32", "eye": [0.5, -0.5, 3],
                   "background": "transparent", "no_default_light": true, "bits": 16}),
            &[
                "triangle.gltf",
                "--scene",
                "1",
                "--size",
                "32x32",
                "--eye",
                "0.5,-0.5,3",
                "--background",
                "transparent",
                "--no-default-light",
                "--bits",
                "16",
            ],
        ),
        (
            json!({"id": null, "scene": "mirrors", "size": "32x32", "sampler": "independent", "filter": "tent", "spp": 2}),
            &["mirrors", "--size", "32x32", "--sampler", "independent", "--filter", "tent", "--spp", "2"],
        ),
        (
            json!({"id": {"a": [1]}, "scene": "teapot", "size": "32x32", "timeout": 1000, "max-memory": "1G",
                "max-triangles": 100_000}),
            &["teapot", "--size", "32x32"],
        ),
        (json!({"scene": "table", "size": "48x32"}), &["table", "--size", "48x32"]),
    ];
    let mut lines = String::new();
    for (number, (job, _)) in jobs.iter().enumerate() {
        let mut job = job.clone();
        job["output"] = format!("{number}.png").into();
        lines += &format!("{job}\n\n");
    }
    let (answers, code, said) = answers(folder.path(), &["--validate"], lines.as_bytes());
    assert_eq!((code, said.as_str(), answers.len()), (0, "", jobs.len()));
    let ids = [json!(1), json!("two"), Value::Null, Value::Null, json!({"a": [1]}), Value::Null];
    for (number, (((_, arguments), answer), id)) in jobs.iter().zip(&answers).zip(&ids).enumerate() {
        let name = format!("{number}.png");
        assert_eq!((&answer["id"], &answer["ok"], &answer["output"]), (id, &json!(true), &json!(name)), "{answer}");
        assert_eq!(answer["line"], 2 * number + 1);
        let output = run(folder.path(), &[&["render", "-o", "single.png", "--json"], *arguments].concat());
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        assert!(read(&name) == read("single.png"), "{name} is not the picture of {arguments:?}");
        let own = &answer["report"];
        for part in ["scene", "features", "rays", "bvh", "memory_bytes"] {
            assert_eq!(own[part], report[part], "{number}: {part}");
        }
        assert_eq!(own["image"]["sha256"], report["image"]["sha256"]);
    }
    // Each says what it is: no two of the first five are the same picture.
    let hashes: std::collections::BTreeSet<_> =
        answers.iter().map(|a| a["report"]["image"]["sha256"].as_str()).collect();
    assert_eq!(hashes.len(), 5);
}

#[test]
fn what_is_wrong_is_an_answer_and_the_batch_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("empty.glb"), b"").unwrap();
    let jobs = [
        ("nonsense", 2, "not JSON"),
        ("[1, 2]", 2, "must be a JSON object"),
        (r#"{"id": 3, "scene": "missing.glb"}"#, 2, "missing.glb: no such file"),
        (r#"{"scene": "empty.glb"}"#, 2, "the file is empty"),
        (r#"{"id": "x", "spp": 0, "output": "a.png"}"#, 2, "samples a pixel"),
        (r#"{"sp": 1}"#, 2, "'--sp'"),
        (r#"{"output": "a.bmp"}"#, 2, ".png, .exr or .hdr"),
        (r#"{"output": "nowhere/a.png"}"#, 4, "cannot write nowhere/a.png"),
        (r#"{"output": "-"}"#, 2, "standard output"),
        (r#"{"scene": "-"}"#, 2, "standard input"),
        (r#"{"device": "cpu"}"#, 2, "glimt batch --device"),
        (r#"{"frames": "0..4"}"#, 2, "one picture"),
        (r#"{"output": "t.png", "timeout": 0.000001}"#, 124, "timeout of 0.000001 s"),
        (r#"{"output": "n.png", "max-triangles": 10}"#, 2, "triangles: the limit is 10"),
    ];
    let mut lines: Vec<u8> = jobs.map(|(job, ..)| format!("{job}\n")).concat().into_bytes();
    lines.extend(b"\xff\xfe{\n");
    lines.extend(br#"{"id": "good", "size": "16x16", "output": "good.png"}"#);
    let (answers, code, said) = answers(folder.path(), &[], &lines);
    assert_eq!((code, said.as_str(), answers.len()), (1, "", jobs.len() + 2));
    for (number, ((job, exit_code, needle), answer)) in jobs.iter().zip(&answers).enumerate() {
        let error = answer["error"].as_str().unwrap();
        assert!(error.contains(needle) && !error.contains('\n'), "{job}: {error}");
        assert_eq!((&answer["ok"], &answer["exit_code"]), (&json!(false), &json!(exit_code)), "{answer}");
        assert_eq!(answer["line"], number + 1);
    }
    assert_eq!((&answers[2]["id"], &answers[4]["id"]), (&json!(3), &json!("x")));
    assert_eq!(answers[jobs.len() + 1]["ok"], true);
    assert_eq!(files(folder.path()), ["empty.glb", "good.png"], "nothing else was written");
}

#[test]
fn limits_for_all_jobs() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("triangle.gltf"), TRIANGLE).unwrap();
    let jobs = br#"{"scene": "triangle.gltf", "scene_choice": 1, "size": "8x8", "output": "a.png"}
        {"scene": "table", "size": "8x8", "output": "b.png"}
        {"scene": "table", "size": "8x8", "output": "c.png", "max_triangles": 1000000}
        {"scene": "triangle.gltf", "output": "d.png", "max-memory": 10}
        {"scene": "table", "size": "4096x4096", "spp": 64, "output": "e.png", "timeout": 0.5}"#;
    let (answers, code, _) = answers(folder.path(), &["--max-triangles", "1", "--timeout", "500"], jobs);
    let ok: Vec<bool> = answers.iter().map(|answer| answer["ok"].as_bool().unwrap()).collect();
    assert_eq!((ok.as_slice(), code), ([true, false, true, false, false].as_slice(), 1), "{answers:?}");
    assert!(answers[3]["error"].as_str().unwrap().contains("--max-memory"), "{}", answers[3]);
    assert_eq!(answers[4]["exit_code"], 2, "too many triangles comes first");
    assert_eq!(files(folder.path()), ["a.png", "c.png", "triangle.gltf"]);
    let refused = run(folder.path(), &["render", "table", "--max-triangles", "5"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("the limit is 5 (--max-triangles)"), "{}", text(&refused.stderr));
}

#[test]
fn a_conversation_line_by_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start(folder.path(), &[]);
    let (mut jobs, mut answers) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
    for number in 0..4 {
        let scene = ["table", "nothing.glb"][number % 2];
        writeln!(jobs, r#"{{"id": {number}, "scene": "{scene}", "size": "16x16", "output": "{number}.png"}}"#).unwrap();
        let mut line = String::new();
        answers.read_line(&mut line).unwrap();
        let answer: Value = serde_json::from_str(&line).unwrap();
        assert_eq!((&answer["id"], &answer["ok"]), (&json!(number), &json!(number % 2 == 0)), "{answer}");
        assert_eq!(folder.path().join(format!("{number}.png")).exists(), number % 2 == 0);
    }
    // A picture that takes too long is stopped, and the next job is done.
    writeln!(jobs, r#"{{"size": "4096x4096", "spp": 256, "output": "long.png", "timeout": 0.3}}"#).unwrap();
    writeln!(jobs, r#"{{"size": "16x16", "output": "short.png"}}"#).unwrap();
    let answer: Vec<Value> =
        answers.by_ref().lines().take(2).map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
    assert_eq!((&answer[0]["exit_code"], &answer[1]["ok"]), (&json!(124), &json!(true)), "{answer:?}");
    assert_eq!(files(folder.path()), ["0.png", "2.png", "short.png"]);
    // Whoever reads no more is no fault.
    drop(answers);
    let _ = writeln!(jobs, r#"{{"size": "16x16", "output": "unread.png"}}"#);
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(1), ""), "two jobs had failed");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_batch_that_works_and_one_that_waits() {
    for job in ["", "{\"size\": \"4096x4096\", \"spp\": 1024}\n"] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = start(folder.path(), &[]);
        let mut jobs = child.stdin.take().unwrap();
        jobs.write_all(job.as_bytes()).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(1500));
        Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), text(&output.stdout)), (Some(130), ""), "{}", text(&output.stderr));
        assert_eq!(files(folder.path()), Vec::<String>::new());
    }
}

#[test]
fn no_device_is_no_batch() {
    let folder = tempfile::tempdir().unwrap();
    let (said, code, why) = answers(folder.path(), &["--device", "voodoo"], b"");
    assert_eq!((said.len(), code), (0, 3));
    assert!(why.contains("no device 'voodoo'"), "{why}");
    let job = br#"{"scene": "table", "size": "16x12", "output": "a.png"}"#;
    let (said, code, _) = answers(folder.path(), &["--device", "reference"], job);
    assert_eq!((code, &said[0]["report"]["device"]["name"]), (0, &json!("reference")));
}

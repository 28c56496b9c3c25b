//! The commands that measure, as their users meet them.

use super::cli::{assert_fails, run, text};
use std::process::Output;

#[test]
fn a_benchmark_and_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let view = r#"{"eye": [3, 2, 4], "target": [0, 0.5, 0], "up": [0, 1, 0], "vfov_deg": 45, "width": 128, "height": 96,
                   "light_pos": [3, 5, 2], "bbox_min": [-2, 0, -2], "bbox_max": [2, 2, 2], "name": "other keys are ignored"}"#;
    std::fs::write(folder.path().join("view.json"), view).unwrap();
    let bench = |more: &[&str]| {
        let arguments = ["bench", "teapot", "--view", "view.json", "--runs", "2", "--validate", "--json"];
        run(folder.path(), &arguments.iter().chain(more).copied().collect::<Vec<_>>())
    };
    let json = |output: &Output| -> serde_json::Value {
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let told = json(&bench(&["--export", "rays"]));
    let names: Vec<&str> = told["sets"].as_array().unwrap().iter().map(|set| set["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["primary", "shadow", "mirror", "diffuse"]);
    // So many that a thread takes several.
    assert_eq!(told["sets"][0]["rays"], 128 * 96);
    let hits = told["sets"][0]["hits"].as_u64().unwrap();
    for set in &told["sets"].as_array().unwrap()[1..] {
        assert_eq!(set["rays"], hits, "one secondary ray a primary hit: {set}");
        let speed = &set["mrays_per_s"];
        let order = ["min", "median", "max"].map(|key| speed[key].as_f64().unwrap());
        assert!(0.0 < order[0] && order[0] <= order[1] && order[1] <= order[2], "{set}");
    }
    for key in ["builder", "build_ms", "nodes", "bytes", "sah_cost", "depth"] {
        assert!(told["bvh"].get(key).is_some(), "{key} is not in {told}");
    }
    assert!(told["device"]["name"].is_string());
    let size = |name: &str| std::fs::metadata(folder.path().join("rays").join(name)).unwrap().len();
    assert_eq!(size("teapot.bin"), 4 + 36 * told["triangles"].as_u64().unwrap());
    assert_eq!((size("teapot.shadow.rays"), size("teapot.shadow.ref")), (32 * 128 * 96, 4 * 128 * 96));

    // Counted on the host: in step rays take no fewer rounds than one of them takes steps, and no more than all together.
    assert!(told["sets"][0].get("work").is_none());
    for set in json(&bench(&["--work"]))["sets"].as_array().unwrap() {
        let figure = |key: &str| set["work"][key].as_f64().unwrap();
        assert_eq!(figure("lanes"), told["device"]["subgroup_size"].as_f64().unwrap());
        for (steps, rounds) in [("nodes", "node_rounds"), ("triangles", "triangle_rounds")] {
            let [steps, rounds] = [steps, rounds].map(figure);
            assert!(0.5 < steps && steps < rounds && rounds < steps * figure("lanes"), "{set}");
        }
    }

    // The same rays answered again; then one answer is spoilt.
    let compared = json(&bench(&["--compare", "rays", "--sets", "diffuse,shadow"]));
    for set in compared["sets"].as_array().unwrap() {
        assert_eq!(set["mismatches"]["count"], 0, "{set}");
    }
    let file = folder.path().join("rays/teapot.diffuse.ref");
    let mut answers: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(&file).unwrap());
    let hit = answers.iter().position(|t| *t > 0.0).unwrap();
    answers[hit] = -1.0;
    std::fs::write(&file, bytemuck::cast_slice::<f32, u8>(&answers)).unwrap();
    let mismatches = json(&bench(&["--compare", "rays", "--sets", "diffuse"]))["sets"][0]["mismatches"].clone();
    assert_eq!(mismatches, serde_json::json!({"count": 1, "missed": 0, "extra": 1, "wrong": 0}));

    assert_eq!(bench(&["--compare", "nowhere"]).status.code(), Some(2));
    std::fs::write(folder.path().join("view.json"), view.replace("\"width\": 128", "\"width\": 60")).unwrap();
    let refused = bench(&[]);
    assert!(refused.status.code() == Some(2) && text(&refused.stderr).contains("multiples of 8"));
}

#[test]
fn stress_prints_rows_and_says_no_when_one_does_not_hold() {
    let folder = tempfile::tempdir().unwrap();
    let stress = |more: &[&str]| {
        let arguments = ["stress", "--quick", "--case", "self-hit", "--json"];
        run(folder.path(), &arguments.iter().chain(more).copied().collect::<Vec<_>>())
    };
    let rows = |output: &Output| -> Vec<serde_json::Value> { serde_json::from_slice(&output.stdout).unwrap() };
    let good = stress(&["--validate", "--html", "page.html", "--export", "rays"]);
    assert_eq!(good.status.code(), Some(0), "{}", text(&good.stderr));
    for key in ["case", "parameter", "value", "rays", "wrong", "error", "bound", "ms", "holds"] {
        assert!(rows(&good).iter().all(|row| row.get(key).is_some()), "{key}");
    }
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("grazing angle") && !page.contains("class=bad"));
    let rays = std::fs::metadata(folder.path().join("rays/self-hit-outward-1e-4.rays")).unwrap();
    assert_eq!(rays.len(), 32 * 256 * 256);

    let bad = stress(&["--sabotage", "fixed-epsilon"]);
    assert_eq!(bad.status.code(), Some(1));
    assert!(rows(&bad).iter().any(|row| row["holds"] == false && row["wrong"].as_u64() > Some(0)));
    assert_fails(&["stress", "--case", "nothing"], 2, "no such case");
    assert_fails(&["stress", "--html", "no/folder/page.html"], 4, "no/folder/page.html");
}

#[test]
fn a_study_and_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["study", "teapot", "--size", "32x24", "--repeats", "2", "--knob", "spp=2,8", "--knob", "filter=box,mitchell"];
    let more = ["--reference", "64", "--target-rmse", "0.5", "-o", "out", "--json", "--validate"];
    let output = run(folder.path(), &[&arguments[..], &more[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((told["axis"].as_str(), told["series"][1]["name"].as_str()), (Some("spp"), Some("mitchell")));
    assert_eq!(told["series"][0]["settings"][1]["rmse_of_repeats"].as_array().map(Vec::len), Some(2));
    assert!(told["series"][0]["cheapest_for_target"].is_string() && told["device"]["name"].is_string());
    let file = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    assert_eq!(file("study.csv").lines().count(), 5);
    assert!(file("study.json").contains("\"command\": \"glimt study teapot"));
    let page = file("study.html");
    assert!(page.matches("<img").count() == 10 && page.contains("<svg") && page.contains("glimt study teapot"));

    assert_fails(&["study", "table", "--knob", "speed=1"], 2, "no knob 'speed'");
    assert_fails(&["study", "table", "--knob", "spp=1", "--knob", "spp=2"], 2, "given twice");
    assert_fails(&["study", "table", "--knob", "spp=2", "--reference", "nowhere.exr"], 2, "nowhere.exr");
}

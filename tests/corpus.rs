//! Real models, broken files and golden silhouettes of the shared corpus.

use super::support::{assert_alike, corpus, draw, draw_reference};
use glam::DVec3;
use glimt::scene::{gltf, Background, CameraChoice, Soup, Standing};
use glimt::{film, Options, Result, Scene};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn load(path: &Path) -> Result<Scene> {
    gltf::read(path, &gltf::ReadOptions::default())
}

/// A row of the manifest.
struct Model {
    path: String,
    bytes: u64,
    triangles: usize,
    required: String,
    used: String,
    features: String,
}

fn manifest(corpus: &Path) -> Vec<Model> {
    let table = std::fs::read_to_string(corpus.join("MANIFEST.tsv")).unwrap();
    let rows = table.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split('\t').collect();
        let [_, path, bytes, _, triangles, used, required, features, ..] = cells[..] else { panic!("{line}") };
        Model {
            path: path.into(),
            bytes: bytes.parse().unwrap(),
            triangles: triangles.parse().unwrap(),
            required: required.into(),
            used: used.into(),
            features: features.into(),
        }
    });
    rows.collect()
}

fn is_supported(model: &Model) -> bool {
    model.required.split(',').all(|name| name == "-" || gltf::standing(name) != Standing::Ignored)
}

/// Every model that requires nothing we lack renders, with all its triangles, and shows more than one colour; the others
/// are refused with the extension's name.
#[test]
fn models_render() {
    let Some(corpus) = corpus() else { return };
    let (mut drawn, mut refused) = (0, 0);
    let mut faults = Vec::new();
    for model in manifest(&corpus) {
        let scene = load(&corpus.join(&model.path));
        if !is_supported(&model) {
            let message = scene.err().map(|error| error.to_string()).unwrap_or_default();
            if !message.contains("it requires") {
                faults.push(format!("{}: {message}", model.path));
            }
            refused += 1;
            continue;
        }
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        let background = Background::Constant(DVec3::new(0.2, 0.4, 0.6));
        let (film, report) = draw(&scene, &Options { size: (128, 96), background, ..Options::default() });
        let first = film.srgb8(0);
        if (0..film.pixels.len()).all(|pixel| film.srgb8(pixel) == first) {
            faults.push(format!("{}: one colour only", model.path));
        }
        if report.scene.triangles != model.triangles {
            faults.push(format!("{}: {} triangles, not {}", model.path, report.scene.triangles, model.triangles));
        }
        drawn += 1;
    }
    println!("{drawn} models drawn, {refused} refused for an extension");
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Every animation of every model plays: the triangles stay as many, all of them finite, and something changes.
#[test]
fn animations_play() {
    let Some(corpus) = corpus() else { return };
    let (mut played, mut faults) = (0, Vec::new());
    for model in manifest(&corpus).iter().filter(|model| is_supported(model) && model.features.contains("anim")) {
        let open = |options: &gltf::ReadOptions| gltf::open(&corpus.join(&model.path), options).unwrap();
        for (index, animation) in open(&gltf::ReadOptions::default()).contents().animations.iter().enumerate() {
            let asset = open(&gltf::ReadOptions { animation: Some(index.to_string()), ..gltf::ReadOptions::default() });
            let shown = [0.0, 0.13, 0.37, 0.71, 1.0].map(|part| {
                let soup = Soup::of(&asset.scene(part * asset.duration()).unwrap()).unwrap();
                (soup.len(), soup.positions, soup.warnings)
            });
            let same = shown.iter().all(|(_, positions, _)| *positions == shown[0].1);
            let lost = shown.iter().any(|(count, ..)| *count != model.triangles);
            let place = format!("{} animation {index} '{}'", model.path, animation.name);
            let is_whole = asset.duration() == animation.duration;
            if same || lost || !is_whole {
                let warnings = &asset.scene(0.0).unwrap().warnings;
                faults.push(format!("{place}: same {same}, lost {lost}, {:?} {warnings:?}", shown[0].2));
            }
            played += 1;
        }
    }
    println!("{played} animations played");
    assert!(played > 20 && faults.is_empty(), "{faults:#?}");
}

#[test]
fn the_smallest_models_agree_with_the_reference() {
    let Some(corpus) = corpus() else { return };
    let mut models: Vec<Model> = manifest(&corpus).into_iter().filter(is_supported).collect();
    models.sort_by_key(|model| (model.bytes, model.path.clone()));
    for model in models.iter().take(20) {
        let scene = load(&corpus.join(&model.path)).unwrap();
        let options = Options { size: (160, 120), ..Options::default() };
        assert_alike(&model.path, &draw_reference(&scene, &options), &draw(&scene, &options).0);
    }
}

/// Share of the frame by which a silhouette differs from a golden's alpha.
fn silhouette_difference(alpha: &[f32], golden: &Path) -> Option<f64> {
    let golden = film::read(golden).unwrap();
    if !golden.has_alpha || golden.pixels.len() != alpha.len() {
        return None;
    }
    let differences = alpha.iter().zip(&golden.pixels).map(|(own, pixel)| f64::from((own - pixel[3]).abs()));
    Some(differences.sum::<f64>() / alpha.len() as f64)
}

/// How far from the others, median over them, the golden is that is nearest to them all.
fn disagreement(goldens: &[PathBuf]) -> f64 {
    let alphas: Vec<Vec<f32>> =
        goldens.iter().map(|path| film::read(path).unwrap().pixels.iter().map(|pixel| pixel[3]).collect()).collect();
    let median = |index: usize| {
        let others = goldens.iter().enumerate().filter(|(other, _)| *other != index);
        let mut distances: Vec<f64> =
            others.filter_map(|(_, golden)| silhouette_difference(&alphas[index], golden)).collect();
        distances.sort_by(f64::total_cmp);
        middle(&distances)
    };
    (0..goldens.len()).map(median).fold(f64::INFINITY, f64::min)
}

/// The median of sorted values.
fn middle(values: &[f64]) -> f64 {
    (values[values.len() / 2] + values[(values.len() - 1) / 2]) / 2.0
}

/// The camera, light and size of a golden, see the corpus' HOW.md.
fn scenario_options(scenario: &Value, golden: &Path) -> Options {
    let number = |name: &str| scenario[name].as_f64().unwrap();
    let target = Some(DVec3::new(number("tx"), number("ty"), number("tz")));
    let size = film::read(golden).map(|film| (film.width, film.height)).unwrap();
    Options {
        size,
        samples: 4,
        max_depth: 0,
        camera: CameraChoice::Orbit { theta: number("theta"), phi: number("phi"), radius: number("radius"), target },
        fov: Some(number("fov").to_radians()),
        background: Background::Transparent,
        ..Options::default()
    }
}

/// The silhouette of every scenario differs from the goldens' alpha by at most 0.01 of the frame, pixel by pixel, median over renderers.
#[test]
fn silhouettes_are_the_goldens() {
    let Some(corpus) = corpus() else { return };
    let scenarios: BTreeMap<String, Value> =
        serde_json::from_slice(&std::fs::read(corpus.join("goldens/scenarios.json")).unwrap()).unwrap();
    let models = manifest(&corpus);
    let (mut checked, mut faults) = (0, Vec::new());
    println!("{:<34} renderers  median difference", "scenario");
    for (name, scenario) in &scenarios {
        let own = |model: &&Model| model.path.starts_with(&format!("models/{}/", scenario["model"].as_str().unwrap()));
        let Some(model) = models.iter().filter(|model| is_supported(model)).find(own) else {
            println!("{name:<34} needs an extension");
            continue;
        };
        let needs = |feature: &str| model.features.split(',').any(|own| own == feature);
        let folder = corpus.join("goldens").join(name);
        let mut goldens: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        goldens.sort();
        if needs("skin") {
            // Blender shows skins as they were bound, the others at time 0.
            goldens.retain(|golden| !golden.to_string_lossy().contains("blender-cycles"));
        }
        let options = scenario_options(scenario, &goldens[0]);
        let shown_at = |at: Option<f64>| {
            let read = gltf::ReadOptions { at, ..gltf::ReadOptions::default() };
            let (film, _) = draw(&gltf::read(&corpus.join(&model.path), &read).unwrap(), &options);
            let alpha: Vec<f32> = film.pixels.iter().map(|pixel| pixel[3]).collect();
            let compared = goldens.iter().filter_map(|golden| silhouette_difference(&alpha, golden));
            let mut differences: Vec<f64> = compared.collect();
            differences.sort_by(f64::total_cmp);
            differences
        };
        let differences = shown_at(None);
        if scenario["skybox"].as_bool() == Some(true) || differences.is_empty() {
            println!("{name:<34} has no silhouette: its goldens show the sky");
            continue;
        }
        let median = middle(&differences);
        // Most renderers show what nothing moves, not the animation's first frame.
        let playing = if needs("anim") { format!("at 0 s {:.4}", middle(&shown_at(Some(0.0)))) } else { String::new() };
        println!("{name:<34} {:>9}  {median:.4}  {playing:<13} {}", differences.len(), model.used);
        checked += 1;
        // Of glass that hides nothing each renderer has its own opinion: nobody can be nearer to all than they are to each other.
        let among = if median > 0.01 { disagreement(&goldens) } else { 0.0 };
        if median > 0.01 {
            println!("{name:<34} the renderers themselves differ by {among:.4} at least");
        }
        if median > among.max(0.01) {
            faults.push(format!("{name}: {median:.4}"));
        }
    }
    println!("{checked} scenarios checked");
    assert!(checked >= 15 && faults.is_empty(), "{checked} checked, {faults:?}");
}

/// The corners of all triangles in world space, sorted, and the mean of all.
fn corners(scene: &Scene) -> (Vec<DVec3>, DVec3) {
    let mut all = Vec::new();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let place = |vertex: &u32| instance.world_from_object.transform_point3(mesh.positions[*vertex as usize].into());
        all.extend(mesh.triangles.iter().flatten().map(place));
    }
    let sum: DVec3 = all.iter().sum();
    let mean = sum / all.len() as f64;
    (all, mean)
}

/// Compressed models against the same ones uncompressed: as many triangles, no corner lost, extents and mean alike up to
/// the steps of quantisation (2 to the power of -11 of the extent).
#[test]
fn compressed_models_are_the_uncompressed_ones() {
    let Some(corpus) = corpus() else { return };
    let pairs = [
        ("Box/glTF-Draco/Box.gltf", "Box/glTF/Box.gltf"),
        ("CesiumMan/glTF-Draco/CesiumMan.gltf", "CesiumMan/glTF/CesiumMan.gltf"),
        ("RiggedFigure/glTF-Draco/RiggedFigure.gltf", "RiggedFigure/glTF/RiggedFigure.gltf"),
        ("RiggedSimple/glTF-Draco/RiggedSimple.gltf", "RiggedSimple/glTF/RiggedSimple.gltf"),
        (
            "MorphPrimitivesTest/glTF-Draco/MorphPrimitivesTest.gltf",
            "MorphPrimitivesTest/glTF/MorphPrimitivesTest.gltf",
        ),
        ("Box/meshopt-glb/BoxMeshopt.glb", "Box/glTF/Box.gltf"),
        ("BoxTextured/meshopt/BoxTextured_meshopt.glb", "BoxTextured/glTF/BoxTextured.gltf"),
    ];
    println!("{:<58} triangles vertices  extent error  mean error  farthest corner", "model");
    for (compressed, plain) in pairs {
        let scenes = [compressed, plain].map(|path| load(&corpus.join("models").join(path)).unwrap());
        let [own, other] = scenes.each_ref().map(corners);
        let bounds = |all: &[DVec3]| all.iter().fold((all[0], all[0]), |(a, b), p| (a.min(*p), b.max(*p)));
        let ((low, high), (other_low, other_high)) = (bounds(&own.0), bounds(&other.0));
        let extent = (other_high - other_low).max_element();
        let bounds_error = low.distance(other_low).max(high.distance(other_high)) / extent;
        let mean_error = own.1.distance(other.1) / extent;
        let nearest = |p: &DVec3, all: &[DVec3]| all.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
        // Both ways, for a part of the corners.
        let step = own.0.len().div_ceil(300);
        let farthest = |a: &[DVec3], b: &[DVec3]| a.iter().step_by(step).map(|p| nearest(p, b)).fold(0.0, f64::max);
        let far = farthest(&own.0, &other.0).max(farthest(&other.0, &own.0)) / extent;
        let vertices =
            scenes.each_ref().map(|scene| scene.meshes.iter().map(|mesh| mesh.positions.len()).sum::<usize>());
        println!(
            "{compressed:<58} {:>9} {:>4}/{:<4} {bounds_error:>12.2e} {mean_error:>11.2e} {far:>10.2e}",
            own.0.len() / 3,
            vertices[0],
            vertices[1]
        );
        assert_eq!(own.0.len(), other.0.len(), "{compressed}");
        let most = 1.0 / 2048.0;
        assert!(bounds_error < most && mean_error < most && far < most, "{compressed}");
        let decoder = ["Draco", "meshopt"].iter().find(|word| scenes[0].warnings.iter().any(|w| w.contains(*word)));
        assert!(decoder.is_none(), "{compressed}: {:?}", scenes[0].warnings);
    }
}

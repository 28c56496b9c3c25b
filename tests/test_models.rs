//! Models that show by themselves whether they are drawn right. Each was looked at once; what it looked like then is kept in
//! `assets/test-models` and compared with what it looks like now. `BLESS=1` keeps new pictures: look at them before they are committed.

use super::support::{assert_alike, corpus, draw};
use glimt::scene::gltf;
use glimt::{film, Options};
use std::path::Path;

/// Model, file below its folder, and the time at which it is shown.
const MODELS: [(&str, &str, Option<f64>); 18] = [
    ("AlphaBlendModeTest", "glTF-Binary/AlphaBlendModeTest.glb", None),
    ("AnimatedMorphCube", "glTF-Binary/AnimatedMorphCube.glb", Some(1.5)),
    ("EmissiveStrengthTest", "glTF-Binary/EmissiveStrengthTest.glb", None),
    ("InterpolationTest", "glTF-Binary/InterpolationTest.glb", Some(0.8)),
    ("MorphPrimitivesTest", "glTF-Draco/MorphPrimitivesTest.gltf", None),
    ("MultiUVTest", "glTF-Binary/MultiUVTest.glb", None),
    ("NegativeScaleTest", "glTF-Binary/NegativeScaleTest.glb", None),
    ("NormalTangentMirrorTest", "glTF-Binary/NormalTangentMirrorTest.glb", None),
    ("NormalTangentTest", "glTF-Binary/NormalTangentTest.glb", None),
    ("OrientationTest", "glTF-Binary/OrientationTest.glb", None),
    ("TextureCoordinateTest", "glTF-Binary/TextureCoordinateTest.glb", None),
    ("TextureEncodingTest", "glTF-Binary/TextureEncodingTest.glb", None),
    ("TextureLinearInterpolationTest", "glTF-Binary/TextureLinearInterpolationTest.glb", None),
    ("TextureSettingsTest", "glTF-Binary/TextureSettingsTest.glb", None),
    ("TextureTransformTest", "glTF/TextureTransformTest.gltf", None),
    ("TransmissionTest", "glTF-Binary/TransmissionTest.glb", None),
    ("UnlitTest", "glTF-Binary/UnlitTest.glb", None),
    ("VertexColorTest", "glTF-Binary/VertexColorTest.glb", None),
];

#[test]
fn test_models_look_as_they_did() {
    let Some(corpus) = corpus() else { return };
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/test-models");
    for (model, file, at) in MODELS {
        let read = gltf::ReadOptions { at, ..gltf::ReadOptions::default() };
        let scene = gltf::read(&corpus.join("models").join(model).join(file), &read).unwrap();
        let (mut picture, _) = draw(&scene, &Options { size: (160, 120), samples: 16, ..Options::default() });
        let path = kept.join(format!("{model}.png"));
        if std::env::var_os("BLESS").is_some() {
            picture.save(&path, film::Format::Png8, || Ok(())).unwrap();
        }
        // Through the same eight bits as the one that was kept.
        let now = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{model}.png"));
        picture.save(&now, film::Format::Png8, || Ok(())).unwrap();
        picture = film::read(&now).unwrap();
        assert_alike(model, &film::read(&path).unwrap(), &picture);
    }
}

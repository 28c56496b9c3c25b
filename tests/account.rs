//! What a file is said to be shown of: extensions, pictures, `--strict`.

use super::cli::{run, text};
use super::documents::{Builder, TRIANGLE};
use glimt::scene::{gltf, Pixels, Standing};
use glimt::Error;
use serde_json::{json, Value};
use std::io::Cursor;
use std::path::Path;

/// A PNG of one colour.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image::RgbaImage::from_pixel(width, height, image::Rgba([200, 100, 50, 255]))
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

/// A triangle with a picture that it shows and one that it does not, and an extension of each standing.
fn document() -> Value {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let corners: Vec<u8> = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let view = builder.view(&corners, None);
    let texcoords = builder.accessor(json!({"bufferView": view, "componentType": 5126, "type": "VEC2", "count": 3}));
    let pictures = [png(8, 4), png(2, 2)].map(|bytes| builder.view(&bytes, None));
    let primitive = json!({"attributes": {"POSITION": positions, "TEXCOORD_0": texcoords}, "material": 0});
    let more = json!({
        "extensionsUsed": ["KHR_materials_unlit", "KHR_materials_sheen", "ACME_wonder"],
        "materials": [
            {"name": "shown", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
            {"name": "hidden", "emissiveTexture": {"index": 1}, "extensions": {"KHR_materials_unlit": {}}},
            {"name": "cloth", "extensions": {"KHR_materials_sheen": {"sheenColorFactor": [1, 0.5, 0]}}},
        ],
        "textures": [{"source": 0}, {"source": 1}],
        "images": pictures.map(|view| json!({"bufferView": view, "mimeType": "image/png"})),
    });
    builder.document(primitive, more)
}

fn read(document: &Value, options: &gltf::ReadOptions) -> glimt::Result<glimt::Scene> {
    gltf::parse(document.to_string().as_bytes(), "test".into(), "test.gltf", None, options)
}

#[test]
fn extensions_have_their_standing_and_their_data_are_kept() {
    let scene = read(&document(), &gltf::ReadOptions::default()).unwrap();
    let standings: Vec<(&str, &str)> =
        scene.extensions.iter().map(|own| (own.name.as_str(), own.standing.name())).collect();
    let expected =
        [("KHR_materials_unlit", "exact"), ("KHR_materials_sheen", "approximated"), ("ACME_wonder", "ignored")];
    assert_eq!(standings, expected);
    assert_eq!(gltf::standing("ACME_wonder"), Standing::Ignored);
    let sheen = scene.materials[2].lobes.sheen.unwrap();
    assert_eq!(sheen.color, glam::DVec3::new(1.0, 0.5, 0.0));
    for needle in ["approximated: extension KHR_materials_sheen", "ignored: extension ACME_wonder"] {
        assert!(scene.warnings.iter().any(|warning| warning.starts_with(needle)), "{needle}: {:?}", scene.warnings);
    }
}

#[test]
fn strict_refuses_what_is_ignored_and_nothing_else() {
    let strict = gltf::ReadOptions { strict: true, ..gltf::ReadOptions::default() };
    let error = read(&document(), &strict).unwrap_err();
    assert!(matches!(error, Error::Content { .. }) && error.to_string().contains("ACME_wonder"), "{error}");
    let mut known = document();
    known["extensionsUsed"].as_array_mut().unwrap().pop();
    assert!(read(&known, &strict).is_ok());
    // Required, it is refused by name, strict or not.
    let mut required = document();
    required["extensionsRequired"] = json!(["ACME_wonder"]);
    let error = read(&required, &gltf::ReadOptions::default()).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("it requires ACME_wonder"), "{error}");
}

#[test]
fn pictures_are_decoded_where_they_are_seen_and_halved_where_that_is_asked() {
    let sizes = |options: &gltf::ReadOptions| {
        let scene = read(&document(), options).unwrap();
        let size = |image: &std::sync::Arc<glimt::scene::Image>| {
            let Pixels::Rgba8(pixels) = &image.pixels else { panic!("8 bits") };
            assert_eq!(pixels.len() as u32, image.width * image.height);
            (image.width, image.height)
        };
        scene.images.iter().map(|image| image.as_ref().map(size)).collect::<Vec<_>>()
    };
    assert_eq!(sizes(&gltf::ReadOptions::default()), [Some((8, 4)), None]);
    let most = gltf::ReadOptions { max_texture_size: Some(2), ..gltf::ReadOptions::default() };
    assert_eq!(sizes(&most), [Some((2, 1)), None]);
}

#[test]
fn info_says_all_of_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.gltf"), document().to_string()).unwrap();
    let info = |arguments: &[&str]| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout).to_owned()
    };
    let json: Value = serde_json::from_str(&info(&["info", "a.gltf", "--json"])).unwrap();
    assert_eq!(json["extensions"][1]["how"], "the sheen is left out");
    assert_eq!(json["extensions"][2], json!({"name": "ACME_wonder", "required": false, "standing": "ignored"}));
    let shown = &json["textures"][0];
    assert_eq!((&shown["width"], &shown["format"], &shown["bits"]), (&json!(8), &json!("PNG"), &json!(8)));
    assert_eq!(json["textures"][1]["is_used"], false);
    let words = info(&["info", "a.gltf"]);
    for needle in ["ACME_wonder: ignored", "PNG, 8 × 4, 8 bit", "nothing visible shows it"] {
        assert!(words.contains(needle), "'{needle}' is not in {words}");
    }
    let strict = run(folder.path(), &["render", "a.gltf", "--strict"]);
    assert_eq!(strict.status.code(), Some(2));
    assert!(text(&strict.stderr).contains("ACME_wonder") && !Path::new(&folder.path().join("a.png")).exists());
}

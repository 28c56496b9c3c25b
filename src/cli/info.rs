//! `glimt info`.

use super::reading::ReadArgs;
use super::{open_source, Outcome, Source};
use clap::{Args, ValueHint};
use glimt::scene::gltf::Contents;
use glimt::scene::{Image, Instancing, LightKind, Pixels, Projection, Soup, Standing};
use glimt::{Result, Scene};
use serde::Serialize;
use std::fmt::Write;

/// Flags of `glimt info`.
#[derive(Args)]
pub struct InfoArgs {
    /// A .gltf or .glb file, - for standard input, or a built-in scene
    #[arg(value_hint = ValueHint::FilePath)]
    scene: String,
    #[command(flatten)]
    read: ReadArgs,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What is in a scene.
#[derive(Serialize)]
struct Info {
    name: String,
    meshes: usize,
    instances: usize,
    triangles: usize,
    unique_triangles: usize,
    vertices: usize,
    bounds: Option<[[f64; 3]; 2]>,
    materials: Vec<String>,
    lights: Vec<String>,
    #[serde(skip)]
    without_lights: &'static str,
    cameras: Vec<String>,
    animations: Vec<Animation>,
    skins: Vec<Skin>,
    morph_targets: Vec<Morph>,
    variants: Vec<String>,
    extensions: Vec<Extension>,
    textures: Vec<Picture>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct Extension {
    name: String,
    required: bool,
    standing: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    how: Option<&'static str>,
}

/// A picture that textures show; its size and format where something visible uses it.
#[derive(Serialize)]
struct Picture {
    name: String,
    is_used: bool,
    format: String,
    width: u32,
    height: u32,
    bits: u32,
    /// In the file.
    bytes: usize,
    /// In memory, without its mipmap.
    decoded_bytes: usize,
}

impl Picture {
    fn of(index: usize, image: Option<&Image>) -> Self {
        let Some(image) = image else {
            let name = format!("images[{index}]");
            let format = String::new();
            return Self { name, is_used: false, format, width: 0, height: 0, bits: 0, bytes: 0, decoded_bytes: 0 };
        };
        let bits = if matches!(image.pixels, Pixels::Rgba16(_)) { 16 } else { 8 };
        Self {
            name: if image.name.is_empty() { format!("images[{index}]") } else { image.name.clone() },
            is_used: true,
            format: image.format.clone(),
            width: image.width,
            height: image.height,
            bits,
            bytes: image.bytes,
            decoded_bytes: image.width as usize * image.height as usize * bits as usize / 2,
        }
    }

    fn line(&self) -> String {
        if !self.is_used {
            return format!("{}: nothing visible shows it", self.name);
        }
        let Self { name, format, width, height, bits, bytes, decoded_bytes, .. } = self;
        format!("{name}: {format}, {width} × {height}, {bits} bit, {bytes} bytes, {decoded_bytes} decoded")
    }
}

#[derive(Serialize)]
struct Animation {
    name: String,
    duration_s: f64,
    channels: usize,
}

#[derive(Serialize)]
struct Skin {
    name: String,
    joints: usize,
}

#[derive(Serialize)]
struct Morph {
    mesh: String,
    targets: usize,
}

impl Info {
    fn of(scene: &Scene, contents: &Contents) -> Result<Self> {
        let soup = Soup::with(scene, Instancing::Auto)?;
        let rgb = |v: glam::DVec3| format!("{:.3} {:.3} {:.3}", v.x, v.y, v.z);
        let material = |material: &glimt::scene::Material| {
            let sides = if material.double_sided { "both sides" } else { "front only" };
            match &material.whitted {
                Some(w) => format!(
                    "{}: exact: diffuse {}, specular {} ^{}, mirror {}; {sides}",
                    material.name,
                    rgb(w.diffuse),
                    rgb(w.specular),
                    w.shininess,
                    rgb(w.mirror)
                ),
                None if material.unlit => format!("{}: unlit {}; {sides}", material.name, rgb(material.base_color)),
                None => format!(
                    "{}: base {}, metallic {:.2}, roughness {:.2}, emission {}; {sides}",
                    material.name,
                    rgb(material.base_color),
                    material.metallic,
                    material.roughness,
                    rgb(material.emission)
                ),
            }
        };
        let light = |light: &glimt::scene::Light| match light.kind {
            LightKind::Point => format!("point at {}, {} cd", rgb(light.position), rgb(light.intensity)),
            LightKind::Spot { .. } => format!("spot at {}, {} cd", rgb(light.position), rgb(light.intensity)),
            LightKind::Directional => {
                format!("directional along {}, {} lx", rgb(light.direction), rgb(light.intensity))
            }
        };
        let camera = |(name, camera): &(String, glimt::scene::Camera)| match camera.projection {
            Projection::Perspective { fov } => {
                format!("{name}: perspective, {:.2}° high, at {}", fov.to_degrees(), rgb(camera.eye))
            }
            Projection::Orthographic { half_height } => {
                format!("{name}: orthographic, {:.3} m high, at {}", 2.0 * half_height, rgb(camera.eye))
            }
        };
        Ok(Self {
            name: scene.name.clone(),
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            triangles: soup.placed,
            unique_triangles: scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum(),
            vertices: scene.meshes.iter().map(|mesh| mesh.positions.len()).sum(),
            bounds: soup.bounds().map(|(lo, hi)| [lo.to_array(), hi.to_array()]),
            materials: scene.materials.iter().map(material).collect(),
            lights: scene.lights.iter().map(light).collect(),
            without_lights: match scene.has_lights {
                true => "none that a node of this scene places",
                false => "none: a default light is used",
            },
            cameras: scene.cameras.iter().map(camera).collect(),
            animations: contents
                .animations
                .iter()
                .map(|own| Animation { name: own.name.clone(), duration_s: own.duration, channels: own.channels })
                .collect(),
            skins: contents.skins.iter().map(|(name, joints)| Skin { name: name.clone(), joints: *joints }).collect(),
            morph_targets: contents
                .morphs
                .iter()
                .map(|(mesh, targets)| Morph { mesh: mesh.clone(), targets: *targets })
                .collect(),
            variants: contents.variants.clone(),
            extensions: scene
                .extensions
                .iter()
                .map(|own| Extension {
                    name: own.name.clone(),
                    required: own.required,
                    standing: own.standing.name(),
                    how: match own.standing {
                        Standing::Approximated(how) => Some(how),
                        Standing::Exact | Standing::Ignored => None,
                    },
                })
                .collect(),
            textures: scene
                .images
                .iter()
                .enumerate()
                .map(|(index, image)| Picture::of(index, image.as_deref()))
                .collect(),
            warnings: scene.warnings.iter().chain(&soup.warnings).cloned().collect(),
        })
    }

    fn text(&self) -> String {
        let mut text = format!(
            "{}: {} triangles ({} stored once) in {} instances of {} meshes, {} vertices\n",
            self.name, self.triangles, self.unique_triangles, self.instances, self.meshes, self.vertices
        );
        if let Some([lo, hi]) = self.bounds {
            let _ = writeln!(text, "box: {lo:.4?} to {hi:.4?}");
        }
        // What most files have none of is not spoken of there.
        let numbered = |lines: Vec<String>| -> Vec<String> {
            lines.into_iter().enumerate().map(|(index, line)| format!("{index} {line}")).collect()
        };
        let animation = |own: &Animation| format!("'{}': {:.3} s, {} channels", own.name, own.duration_s, own.channels);
        let extension = |own: &Extension| {
            let required = if own.required { ", required" } else { "" };
            let how = own.how.map(|how| format!(": {how}")).unwrap_or_default();
            format!("{}{required}: {}{how}", own.name, own.standing)
        };
        let moving = [
            ("animations", numbered(self.animations.iter().map(animation).collect())),
            (
                "skins",
                numbered(self.skins.iter().map(|own| format!("'{}': {} joints", own.name, own.joints)).collect()),
            ),
            ("morph targets", self.morph_targets.iter().map(|own| format!("{}: {}", own.mesh, own.targets)).collect()),
            ("extensions", self.extensions.iter().map(extension).collect()),
            ("textures", self.textures.iter().map(Picture::line).collect()),
            ("variants", numbered(self.variants.iter().map(|own| format!("'{own}'")).collect())),
        ];
        for (title, lines) in moving.iter().filter(|(_, lines)| !lines.is_empty()) {
            let _ = writeln!(text, "{title}:");
            for line in lines {
                let _ = writeln!(text, "  {line}");
            }
        }
        let lists = [
            ("cameras", &self.cameras, "none: one that frames the scene is used"),
            ("lights", &self.lights, self.without_lights),
            ("materials", &self.materials, "none"),
            (
                "faults, and what is approximated or ignored",
                &self.warnings,
                "none: all of the file is shown as it says",
            ),
        ];
        for (title, lines, none) in lists {
            let _ = writeln!(text, "{title}:");
            if lines.is_empty() {
                let _ = writeln!(text, "  {none}");
            }
            for line in lines {
                let _ = writeln!(text, "  {line}");
            }
        }
        text
    }
}

impl InfoArgs {
    /// Reads the scene and describes it.
    pub fn run(self) -> Result<Outcome> {
        let (scene, contents) = match open_source(&self.scene, &self.read.options())? {
            Source::BuiltIn(scene) => (*scene, Contents::default()),
            Source::File(asset) => {
                let contents = asset.contents().clone();
                (asset.into_scene()?, contents)
            }
        };
        let info = Info::of(&scene, &contents)?;
        if self.json {
            Outcome::json(&info)
        } else {
            Ok(Outcome::text(info.text()))
        }
    }
}

//! The contract between host and device.

use glimt::layout::{self, kernels, translate, MEMBERS};
use std::collections::HashMap;

/// Names, offsets and strides of a SPIR-V module's structs.
#[derive(Default)]
struct Module {
    names: HashMap<u32, String>,
    members: HashMap<(u32, u32), String>,
    offsets: HashMap<(u32, u32), usize>,
    strides: HashMap<u32, usize>,
    /// Array type → element type.
    elements: HashMap<u32, u32>,
}

fn text(words: &[u32]) -> String {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    bytes.take_while(|byte| *byte != 0).map(char::from).collect()
}

impl Module {
    fn parse(code: &[u8]) -> Self {
        let words: Vec<u32> = code.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect();
        assert_eq!(words[0], 0x0723_0203, "SPIR-V magic");
        let mut module = Self::default();
        let mut at = 5;
        while at < words.len() {
            let (count, opcode) = ((words[at] >> 16) as usize, words[at] & 0xffff);
            let w = &words[at + 1..at + count];
            match opcode {
                5 => drop(module.names.insert(w[0], text(&w[1..]))),
                6 => drop(module.members.insert((w[0], w[1]), text(&w[2..]))),
                // OpMemberDecorate Offset, OpDecorate ArrayStride, OpTypeRuntimeArray
                72 if w[2] == 35 => drop(module.offsets.insert((w[0], w[1]), w[3] as usize)),
                71 if w[1] == 6 => drop(module.strides.insert(w[0], w[2] as usize)),
                29 => drop(module.elements.insert(w[0], w[1])),
                _ => {}
            }
            at += count;
        }
        module
    }
}

#[test]
fn rust_offsets_are_the_shaders_offsets() {
    let expected: HashMap<(String, String), usize> =
        MEMBERS.iter().map(|(s, m, offset)| (((*s).into(), (*m).into()), *offset)).collect();
    let mut checked = std::collections::HashSet::new();
    for kernel in kernels::ALL {
        for code in [kernel.texel_fetch, kernel.storage_fetch].map(|code| code.full) {
            let module = Module::parse(code);
            for ((structure, member), offset) in &module.offsets {
                let key = (module.names[structure].clone(), module.members[&(*structure, *member)].clone());
                if let Some(own) = expected.get(&key) {
                    assert_eq!(own, offset, "{}: {key:?}", kernel.name);
                    checked.insert(key);
                }
            }
        }
    }
    // These are read and written texel by texel: no kernel declares where their members lie.
    let in_texels = ["Material", "Look", "Texture", "Light", "Instance", "HitItem", "RayItem"];
    let missing: Vec<_> =
        expected.keys().filter(|key| !checked.contains(*key) && !in_texels.contains(&key.0.as_str())).collect();
    assert!(missing.is_empty(), "no kernel has {missing:?}");
}

#[test]
fn what_lies_in_texels_fills_them() {
    let texels = |count: u32| 16 * count as usize;
    assert_eq!(size_of::<layout::Material>(), texels(layout::LOOK_TEXEL));
    assert_eq!(size_of::<layout::Look>(), texels(layout::MATERIAL_TEXELS - layout::LOOK_TEXEL));
    assert_eq!(size_of::<layout::Texture>(), texels(layout::TEXTURE_TEXELS));
    assert_eq!(size_of::<layout::Light>(), texels(layout::LIGHT_TEXELS));
    assert_eq!(size_of::<layout::Instance>(), texels(layout::INSTANCE_TEXELS));
    assert_eq!(size_of::<layout::HitItem>(), texels(layout::ITEM_TEXELS));
    assert_eq!(size_of::<layout::RayItem>(), texels(layout::ITEM_TEXELS));
}

#[test]
fn rust_sizes_are_the_shaders_strides() {
    let sizes = HashMap::from([("Dispatch", size_of::<layout::Dispatch>())]);
    let mut checked = std::collections::HashSet::new();
    for kernel in kernels::ALL {
        let module = Module::parse(kernel.texel_fetch.full);
        for (array, stride) in &module.strides {
            let Some(name) = module.elements.get(array).and_then(|element| module.names.get(element)) else { continue };
            if let Some(size) = sizes.get(name.as_str()) {
                assert_eq!(size, stride, "{}: {name}", kernel.name);
                checked.insert(name.clone());
            }
        }
    }
    assert_eq!(checked.len(), sizes.len(), "checked {checked:?}");
}

#[test]
fn an_unknown_line_is_an_error() {
    for source in
        ["struct A {\n mat4 m;\n};", "int f() { return 1; }", "const uint X = 1u;", "struct A {\n Missing m;\n};"]
    {
        assert!(translate::layout(source).is_err(), "{source}");
    }
    for source in ["const double X = 1.0;", "uint X = 1u;", "struct A {"] {
        assert!(translate::constants(source).is_err(), "{source}");
    }
    for source in ["layout(binding = 1) buffer B { uint b[]; };", "IMAGE_BUFFER(1, a)"] {
        assert!(translate::bindings(source).is_err(), "{source}");
    }
    // Ids must be dense.
    assert!(translate::features("layout(constant_id = 1) const bool A = true;").is_err());
    let structs = translate::layout("/// Doc.\nstruct A {\n    /// M.\n    vec3 m;\n};").unwrap();
    assert!(structs.contains("pub m: [f32; 3]"), "{structs}");
    let constants = translate::constants("/// Doc.\nconst uint N = 3u;").unwrap();
    assert!(constants.contains("pub const N: u32 = 3;"), "{constants}");
}

//! Translates the contract's files of `shaders/shared/` into Rust. `build.rs` compiles this file too.
//!
//! The subset: `///` comments, `const` scalars, flat `struct`s of scalars, vectors and earlier structs, the buffer macros of
//! `bindings.glsl`, and boolean specialization constants. Anything else is an error that names file and line.

use std::fmt::Write;

/// A line that is not part of the subset: file, line from 1, text.
#[derive(Debug, PartialEq, Eq)]
pub struct Unknown(pub String);

/// Rust type and size in bytes of a GLSL scalar or vector under scalar block layout.
fn rust_type(glsl: &str) -> Option<&'static str> {
    Some(match glsl {
        "uint" => "u32",
        "int" => "i32",
        "float" => "f32",
        "vec2" => "[f32; 2]",
        "vec3" => "[f32; 3]",
        "vec4" => "[f32; 4]",
        "uvec2" => "[u32; 2]",
        "uvec3" => "[u32; 3]",
        "uvec4" => "[u32; 4]",
        _ => return None,
    })
}

/// Lines that carry no declaration: blank, comment, preprocessor.
fn is_passive(line: &str) -> bool {
    line.is_empty() || (line.starts_with("//") && !line.starts_with("///")) || line.starts_with('#')
}

/// Walks over declarations with their `///` comments: `declare(line, doc)` writes Rust or returns `None` for an unknown line.
fn walk(file: &str, source: &str, mut declare: impl FnMut(&str, &str) -> Option<()>) -> Result<(), Unknown> {
    let mut doc = String::new();
    for (index, raw) in source.lines().enumerate() {
        let line = raw.trim();
        if let Some(text) = line.strip_prefix("///") {
            if !doc.is_empty() {
                doc.push(' ');
            }
            doc.push_str(text.trim());
        } else if !is_passive(line) {
            declare(line, &doc).ok_or_else(|| Unknown(format!("{file}:{}: {line}", index + 1)))?;
            doc.clear();
        }
    }
    Ok(())
}

/// `constants.glsl` → constants.
pub fn constants(source: &str) -> Result<String, Unknown> {
    let mut out = String::new();
    walk("constants.glsl", source, |line, doc| {
        let (kind, rest) = line.strip_prefix("const ")?.strip_suffix(';')?.split_once(' ')?;
        let (name, value) = rest.split_once(" = ")?;
        let value = value.strip_suffix('u').unwrap_or(value);
        writeln!(out, "/// {doc}\npub const {name}: {} = {value};", rust_type(kind)?).ok()
    })?;
    Ok(out)
}

/// `layout.glsl` → `#[repr(C)]` structs and the list of their members.
pub fn layout(source: &str) -> Result<String, Unknown> {
    let mut out = String::new();
    let mut members = String::new();
    let mut structs: Vec<String> = Vec::new();
    let mut inside = false;
    walk("layout.glsl", source, |line, doc| {
        if inside {
            if line == "};" {
                inside = false;
                out.push_str("}\n");
                return Some(());
            }
            let (kind, name) = line.strip_suffix(';')?.split_once(' ')?;
            let known = structs.iter().find(|known| *known == kind).cloned();
            let kind = rust_type(kind).map(str::to_owned).or(known)?;
            let holder = structs.last()?;
            writeln!(members, "    (\"{holder}\", \"{name}\", std::mem::offset_of!({holder}, {name})),").ok()?;
            writeln!(out, "    /// {doc}\n    pub {name}: {kind},").ok()
        } else {
            let name = line.strip_prefix("struct ")?.strip_suffix(" {")?;
            inside = true;
            structs.push(name.to_owned());
            writeln!(out, "/// {doc}\n#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\n#[repr(C)]\npub struct {name} {{").ok()
        }
    })?;
    let doc = "/// Struct, member and byte offset of everything in the contract.";
    Ok(format!(
        "{out}{doc}
pub const MEMBERS: &[(&str, &str, usize)] = &[
{members}];
"
    ))
}

/// `bindings.glsl` → one constant a slot and the list of all bindings.
pub fn bindings(source: &str) -> Result<String, Unknown> {
    let mut constants = String::new();
    let mut list = String::new();
    let mut known: Vec<String> = Vec::new();
    walk("bindings.glsl", source, |line, doc| {
        let mut view_of = None;
        let (kind, arguments) = line.strip_suffix(')')?.split_once('(')?;
        let arguments: Vec<&str> = arguments.split(", ").collect();
        let (slot, name, kind) = match (kind, arguments[..].as_ref()) {
            ("FETCH_BUFFER", [slot, name]) => (slot, name, "Fetch"),
            ("FETCH_VIEW", [slot, name, of]) => {
                let number = known.iter().position(|known| known == of)?;
                view_of = Some(number);
                (slot, name, "Fetch")
            }
            ("STORAGE_BUFFER", [slot, _, name]) => (slot, name, "Storage"),
            ("UNIFORM_BUFFER", [slot, _, name]) => (slot, name, "Uniform"),
            ("PUSH_CONSTANTS", [_, _]) => return Some(()),
            _ => return None,
        };
        writeln!(constants, "/// Slot of `{name}`: {doc}\npub const {}: u32 = {slot};", name.to_uppercase()).ok()?;
        // Slots are dense, so that a slot is an index into the list.
        (*slot == known.len().to_string()).then_some(())?;
        known.push((*name).to_owned());
        writeln!(
            list,
            "    Binding {{ slot: {slot}, name: \"{name}\", kind: BindingKind::{kind}, view_of: {view_of:?} }},"
        )
        .ok()
    })?;
    Ok(format!("{constants}/// Every binding, by slot.\npub const ALL: &[Binding] = &[\n{list}];\n"))
}

/// `features.glsl` → `struct Features` of bools and its list of `(name, value)` in the order of constant ids from 0.
pub fn features(source: &str) -> Result<String, Unknown> {
    let mut fields = String::new();
    let mut list = String::new();
    let mut all = String::new();
    let mut id = 0;
    walk("features.glsl", source, |line, doc| {
        let rest = line.strip_prefix(&format!("layout(constant_id = {id}) const bool "))?;
        let (name, on) = rest.strip_suffix(';')?.split_once(" = ")?;
        let (name, on) = (name.to_lowercase(), on.parse::<bool>().ok()?);
        id += 1;
        writeln!(fields, "    /// {doc}\n    pub {name}: bool,").ok()?;
        writeln!(list, "            (\"{name}\", self.{name}),").ok()?;
        writeln!(all, "            {name}: {on},").ok()
    })?;
    Ok(format!(
        "/// What a scene needs, from `shaders/shared/features.glsl`.\n\
         #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]\npub struct Features {{\n{fields}}}\n\
         impl Features {{\n    /// How many there are.\n    pub const COUNT: usize = {id};\n\n\
         \x20   /// Every feature on, as the constants are when nothing is said.\n    pub const ALL: Self = Self {{\n{all}        }};\n\n\
         \x20   /// Names and values by specialization constant id.\n    pub fn list(&self) -> [(&'static str, bool); Self::COUNT] {{\n        [\n{list}        ]\n    }}\n}}\n"
    ))
}

//! `shaders/shared/{constants,layout,bindings,features}.glsl` → Rust; `shaders/*.comp` → SPIR-V 1.5, each for both ways of fetching,
//! plain, opaque and full (see `kernel.glsl`).

use std::fmt::Write;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::{env, error::Error, fs};

#[allow(dead_code, missing_docs)]
#[path = "src/layout/translate.rs"]
mod translate;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=shaders");
    println!("cargo:rerun-if-changed=src/layout/translate.rs");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let contract = |name: &str, translate: fn(&str) -> Result<String, translate::Unknown>| {
        let source = fs::read_to_string(format!("shaders/shared/{name}.glsl"))?;
        let rust = translate(&source).map_err(|unknown| format!("not in the contract's subset: {}", unknown.0))?;
        fs::write(out.join(format!("{name}.rs")), rust)?;
        Ok::<(), Box<dyn Error>>(())
    };
    contract("constants", translate::constants)?;
    contract("layout", translate::layout)?;
    contract("bindings", translate::bindings)?;
    contract("features", translate::features)?;
    compile_kernels(&out)
}

/// Compiles every kernel and writes `kernels.rs`, their list.
fn compile_kernels(out: &Path) -> Result<(), Box<dyn Error>> {
    let mut kernels: Vec<PathBuf> =
        fs::read_dir("shaders")?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
    kernels.retain(|path| path.extension().is_some_and(|extension| extension == "comp"));
    kernels.sort();
    let compiler = shaderc::Compiler::new()?;
    let mut list = String::new();
    let mut all = Vec::new();
    let mut hasher = std::hash::DefaultHasher::new();
    for path in &kernels {
        let name = path.file_stem().and_then(|stem| stem.to_str()).ok_or("kernel without a name")?;
        for (fetch, fetch_macro) in [("texel", None), ("storage", Some("FETCH_FROM_STORAGE"))] {
            for (variant, variant_macro) in [("plain", Some("PLAIN")), ("opaque", Some("OPAQUE")), ("full", None)] {
                let code = compile(&compiler, path, fetch_macro.into_iter().chain(variant_macro))?;
                code.hash(&mut hasher);
                fs::write(out.join(format!("{name}.{fetch}.{variant}.spv")), code)?;
            }
        }
        let code = |fetch: &str| {
            let file = |variant: &str| format!("{variant}: include_bytes!(\"{name}.{fetch}.{variant}.spv\")");
            format!("{fetch}_fetch: SpirV {{ {}, {}, {} }}", file("plain"), file("opaque"), file("full"))
        };
        let constant = name.to_uppercase();
        writeln!(
            list,
            "/// `shaders/{name}.comp`\npub const {constant}: KernelCode = KernelCode {{ name: \"{name}\", \
             {}, {} }};",
            code("texel"),
            code("storage")
        )?;
        all.push(constant);
    }
    writeln!(list, "/// Every kernel.\npub const ALL: &[KernelCode] = &[{}];", all.join(", "))?;
    let hash = hasher.finish();
    writeln!(list, "/// Stands for the code of every kernel.\npub const CODE_HASH: u64 = {hash:#x};")?;
    Ok(fs::write(out.join("kernels.rs"), list)?)
}

fn compile<'a>(
    compiler: &shaderc::Compiler,
    path: &Path,
    macros: impl Iterator<Item = &'a str>,
) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut options = shaderc::CompileOptions::new()?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_optimization_level(shaderc::OptimizationLevel::Performance);
    // Lines for debuggers make kernels five times as long to read.
    if env::var("PROFILE")? == "debug" {
        options.set_generate_debug_info();
    }
    options.set_warnings_as_errors();
    options.set_include_callback(|requested, _, requesting, _| {
        let folder = Path::new(requesting).parent().ok_or("no folder to include from")?;
        let file = folder.join(requested);
        let content = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        Ok(shaderc::ResolvedInclude { resolved_name: file.display().to_string(), content })
    });
    macros.for_each(|name| options.add_macro_definition(name, None));
    let source = fs::read_to_string(path)?;
    let file = path.display().to_string();
    let artifact = compiler.compile_into_spirv(&source, shaderc::ShaderKind::Compute, &file, "main", Some(&options))?;
    Ok(artifact.as_binary_u8().to_vec())
}

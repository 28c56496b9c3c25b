//! The room of Vulkan by itself.

use glimt::vulkan::{Access, Buffer, Commands, Device, DeviceChoice, Habits, Instance, Memory, Usage};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::process::Command;

/// Long enough that the device is still at it when the host's work has panicked.
const COPIES: usize = 32;

#[test]
fn what_was_submitted_is_waited_for_when_the_hosts_work_panics() {
    let instance = Instance::new(true).unwrap();
    let device = Device::open(&instance, &DeviceChoice::Best, Habits::default()).unwrap();
    let buffer = |name, memory| Buffer::new(&device, name, 32 << 20, Usage::Storage, memory).unwrap();
    let (from, to) = (buffer("from", Memory::Device), buffer("to", Memory::ReadBack));
    let submit = || {
        let mut commands = Commands::new(&device, 0).unwrap();
        commands.clear(&from);
        for _ in 0..COPIES {
            commands.barrier(Access::Transfer, Access::Transfer);
            commands.copy(&from, &to, 0, from.bytes);
        }
        commands.submit_and_wait_beside(|| panic!("on purpose")).unwrap();
    };
    assert!(catch_unwind(AssertUnwindSafe(submit)).is_err());
    drop((from, to));
    assert_eq!(instance.messages(), Vec::<String>::new());
}

#[test]
fn pictures_do_not_depend_on_how_many_rays_are_traced_side_by_side() {
    let name = &super::support::renderer().device().info.name;
    if !name.contains("llvmpipe") {
        println!("skipped: {name} is not Mesa's software Vulkan");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let picture = |bits: Option<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_glimt"));
        command.current_dir(folder.path()).args(["render", "table", "--size", "200x150", "--json"]);
        command.env_remove("LP_NATIVE_VECTOR_WIDTH").envs(bits.map(|bits| ("LP_NATIVE_VECTOR_WIDTH", bits)));
        command.env("MESA_SHADER_CACHE_DIR", folder.path().join("code"));
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{bits:?}: {}", super::cli::text(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let usual = picture(None);
    println!("as it comes: {}", usual["device"]["name"]);
    for bits in ["128", "256"] {
        let report = picture(Some(bits));
        let name = report["device"]["name"].as_str().unwrap();
        assert!(name.contains(&format!("{bits} bits")), "what the user has set stands: {name}");
        assert_eq!(report["image"]["sha256"], usual["image"]["sha256"], "{name}");
        // Mesa 25 would take code for other vectors for its own.
        let own_code = folder.path().join(format!("code/vectors of {bits} bits/mesa_shader_cache"));
        assert!(own_code.read_dir().is_ok_and(|mut code| code.next().is_some()), "{}", own_code.display());
    }
    // The kernel's word for what the processor has.
    let Ok(processor) = std::fs::read_to_string("/proc/cpuinfo") else { return };
    let flags: Vec<&str> = processor.lines().find(|line| line.starts_with("flags")).unwrap_or("").split(' ').collect();
    let needed = ["avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512_vp2intersect", "sse4a"];
    let is_wide = needed.iter().all(|flag| flags.contains(flag));
    assert_eq!(usual["device"]["name"].as_str().unwrap().contains("512 bits"), is_wide, "{}", usual["device"]["name"]);
}

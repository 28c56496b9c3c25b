//! The room of Vulkan by itself.

use glimt::vulkan::{Access, Buffer, Commands, Device, DeviceChoice, Habits, Instance, Memory, Usage};
use std::panic::{catch_unwind, AssertUnwindSafe};

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

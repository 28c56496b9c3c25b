//! Kernels compiled ahead of their first dispatch, side by side, where the driver compiles them one after the other.
//!
//! Mesa's software Vulkan makes a kernel's machine code when the kernel is first dispatched, on the queue's only thread: one core compiles and the
//! others wait. It keeps the code on disk for the next device, and that may be one of the same process. So the device and twins of it, one a core, compile
//! kernels at the same time by dispatches of no workgroups; what a twin has compiled the device finds on disk.
//!
//! Whether that helps is not known but tried, with a small kernel: if the device had to compile it, each twin must find it.

use super::device::lock;
use super::{Bindings, Buffer, Cache, Commands, Kernel, Layout, Memory, SlotKind, Source, Usage};
use crate::error::Result;
use std::cmp::Reverse;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Shorter than this a first dispatch has compiled nothing: a small kernel takes 15 to 40 ms to compile, 1 to 2 from disk.
const COMPILED: Duration = Duration::from_millis(6);

/// How long a twin sleeps before it looks for the small kernel, and after each kernel: the driver writes to disk when nobody else wants the core.
const PAUSE: Duration = Duration::from_millis(3);

/// Compiles kernels for a device.
pub struct Ahead {
    layout: Arc<Layout>,
    small: Source,
    /// How long the small kernel's first dispatch took, once it is over.
    trial: Mutex<Trial>,
}

enum Trial {
    Running(JoinHandle<Result<Duration>>),
    Over(Option<Duration>),
}

/// What was compiled ahead.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compiled {
    /// Kernels.
    pub kernels: usize,
    /// Of these, on twins of the device.
    pub on_twins: usize,
    /// How long it took.
    pub time: Duration,
}

impl Ahead {
    /// Begins with a small kernel, which will be needed, in a thread of its own.
    pub fn new(small: &Arc<Kernel>, source: Source) -> Self {
        let layout = small.layout.clone();
        let may_help = layout.device.compiles_ahead && cores() > 1;
        let small = small.clone();
        let first_dispatch = move || Nothing::new(&small.layout)?.dispatch(&small);
        let thread = may_help.then(|| thread::Builder::new().name("compile ahead".into()).spawn(first_dispatch));
        let trial = thread.and_then(|thread| thread.ok()).map_or(Trial::Over(None), Trial::Running);
        Self { layout, small: source, trial: Mutex::new(trial) }
    }

    /// Compiles kernels that will soon be dispatched, if that helps. One that fails here will fail, and say so, where it is needed.
    pub fn compile(&self, mut kernels: Vec<(Arc<Kernel>, Source)>) -> Compiled {
        let start = Instant::now();
        let small = if kernels.len() > 1 { lock(&self.trial).finish().unwrap_or_default() } else { Duration::ZERO };
        if small < COMPILED {
            return Compiled::default();
        }
        // The longest first, so that nobody is left with one of them at the end.
        kernels.sort_by_key(|(_, source)| Reverse(source.spirv.len()));
        let [next, on_twins, on_device] = [const { AtomicUsize::new(0) }; 3];
        let take = || kernels.get(next.fetch_add(1, Ordering::Relaxed));
        let compile_on_twin = || -> Result<()> {
            let layout = self.layout.of_twin()?;
            let (cache, nothing) = (Cache::empty(&layout.device), Nothing::new(&layout)?);
            let dispatch = |source| nothing.dispatch(&Kernel::new(&layout, &cache, source)?);
            let finds_small = |pause| {
                thread::sleep(pause);
                dispatch(&self.small).is_ok_and(|time| time < COMPILED.min(small / 2))
            };
            // Where it is not there yet, once more.
            if [PAUSE, 5 * PAUSE].into_iter().any(finds_small) {
                while let Some((_, source)) = take() {
                    dispatch(source)?;
                    thread::sleep(PAUSE);
                    on_twins.fetch_add(1, Ordering::Relaxed);
                }
            }
            Ok(())
        };
        let compile_here = || -> Result<()> {
            let nothing = Nothing::new(&self.layout)?;
            while let Some((kernel, _)) = take() {
                nothing.dispatch(kernel)?;
                on_device.fetch_add(1, Ordering::Relaxed);
            }
            Ok(())
        };
        thread::scope(|threads| {
            for _ in 1..cores().min(kernels.len()) {
                // One thread fewer is no loss.
                let _ = thread::Builder::new().spawn_scoped(threads, compile_on_twin);
            }
            let _ = compile_here();
        });
        let on_twins = on_twins.into_inner();
        Compiled { kernels: on_device.into_inner() + on_twins, on_twins, time: start.elapsed() }
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        lock(&self.trial).finish();
    }
}

impl Trial {
    /// Waits for its end.
    fn finish(&mut self) -> Option<Duration> {
        let over = match std::mem::replace(self, Self::Over(None)) {
            Self::Running(thread) => thread.join().ok().and_then(Result::ok),
            Self::Over(took) => took,
        };
        *self = Self::Over(over);
        over
    }
}

/// Cores that there are and that may be used.
fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from).min(rayon::current_num_threads())
}

/// Something in every slot, for dispatches that do nothing.
struct Nothing {
    // Before the buffers that it names.
    bindings: Bindings,
    _buffers: [Buffer; 3],
}

impl Nothing {
    fn new(layout: &Arc<Layout>) -> Result<Self> {
        let buffer = |usage| Buffer::new(&layout.device, "nothing", 0, usage, Memory::Device);
        let [fetch, storage, uniform] = [buffer(Usage::Fetch)?, buffer(Usage::Storage)?, buffer(Usage::Uniform)?];
        let bindings = Bindings::new(layout, |slot| match layout.kind(slot) {
            SlotKind::Fetch => &fetch,
            SlotKind::Storage => &storage,
            SlotKind::Uniform => &uniform,
        })?;
        Ok(Self { bindings, _buffers: [fetch, storage, uniform] })
    }

    /// Dispatches no workgroups; how long that takes.
    fn dispatch(&self, kernel: &Kernel) -> Result<Duration> {
        let mut commands = Commands::new(&kernel.layout.device, 0)?;
        commands.bind(kernel, &self.bindings);
        commands.dispatch(kernel, &vec![0; kernel.layout.push_bytes as usize], 0);
        let start = Instant::now();
        commands.submit_and_wait()?;
        Ok(start.elapsed())
    }
}

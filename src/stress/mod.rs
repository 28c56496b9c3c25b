//! Extreme and stiff cases: scenes made by code, each swept over a parameter and judged by f64 arithmetic or a closed form.
//!
//! A [`Case`] writes [`Row`]s, one a value of its parameter. A case must be able to fail: with the safeguard off that it is there for
//! ([`crate::render::Sabotage`]) it does.

pub mod failures;
mod numbers;
mod pictures;
mod rays;
mod scenes;
mod trees;

use crate::error::{Error, Result};
use crate::render::{Options, Renderer};
use crate::report::StressRow as Row;
use std::path::PathBuf;
use std::time::Instant;

/// A kind of scene that breaks renderers.
#[derive(Clone, Copy)]
pub struct Case {
    /// Lower-case name.
    pub name: &'static str,
    /// What is done and what must hold.
    pub about: &'static str,
    run: fn(&mut Stress) -> Result<()>,
}

/// All cases.
pub const CASES: [Case; 13] = [
    Case {
        name: "leaks",
        about: "rays from inside closed meshes, half of them at vertices and edge midpoints: each one hits",
        run: rays::leaks,
    },
    Case {
        name: "self-hit",
        about: "rays that leave a convex mesh outward meet nothing, inward always its other side",
        run: pictures::self_hit,
    },
    Case {
        name: "needles",
        about: "a square cut into slivers: every ray through it hits, where it should",
        run: rays::needles,
    },
    Case {
        name: "stiff-scales",
        about: "a millimetre beside a million kilometres, objects each ten times smaller: as in f64",
        run: pictures::stiff_scales,
    },
    Case {
        name: "far-away",
        about: "the same scene and camera elsewhere, or in other units: the same picture",
        run: pictures::far_away,
    },
    Case {
        name: "transforms",
        about: "flattening, shearing, mirroring transforms: as in f64; one without volume draws nothing and says so",
        run: pictures::transforms,
    },
    Case {
        name: "hall-of-mirrors",
        about: "a closed box that adds a and reflects s: radiance a·(1 − s^(N+1))/(1 − s)",
        run: numbers::hall_of_mirrors,
    },
    Case {
        name: "truncation",
        about: "the same box: what reflections beyond the N-th would add is the part s^(N+1) of the whole",
        run: numbers::truncation,
    },
    Case {
        name: "radiance",
        about: "lights from 1e-12 to 1e12, a million samples a pixel: to five digits, no infinity, no NaN",
        run: numbers::radiance,
    },
    Case {
        name: "coplanar",
        about: "copies of a surface: the same one is seen in whatever order they come",
        run: trees::coplanar,
    },
    Case {
        name: "trees",
        about: "triangles that make bad trees: bounded depth, no ray lost, no walk cut short",
        run: trees::trees_that_hurt,
    },
    Case {
        name: "cameras",
        about:
            "very narrow and very wide views, an eye on a surface and in a solid: as in f64; a view along up is refused",
        run: pictures::cameras,
    },
    Case {
        name: "input",
        about: "numbers that are none, indices past the end, triangles without area: refused or dropped, and said so",
        run: trees::bad_input,
    },
];

/// A run of cases on a device.
pub struct Stress<'a> {
    renderer: &'a Renderer,
    options: Options,
    settings: &'a Settings,
    case: &'static str,
    on_row: &'a mut dyn FnMut(&Row),
    rows: Vec<Row>,
}

/// How much is run, and what is left behind.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Fewer values and rays.
    pub quick: bool,
    /// Folder for the rays of cases that trace rays one by one, in the device's space, with the triangles they meet: `NAME.bin` (a u32 count,
    /// then nine f32 a triangle) and `NAME.rays` (eight f32 each: origin, 0, direction, farthest distance).
    pub export: Option<PathBuf>,
}

/// What a value of the parameter gave.
struct Finding {
    /// Rays, or pixels.
    rays: u64,
    /// Those that are wrong.
    wrong: u64,
    /// The figure that is judged.
    error: f64,
    /// The most it may be.
    bound: f64,
}

impl Finding {
    /// None may be wrong.
    fn none_of(rays: u64, wrong: u64) -> Self {
        Self { rays, wrong, error: wrong as f64 / (rays as f64).max(1.0), bound: 0.0 }
    }

    /// A figure with a bound.
    fn figure(rays: u64, error: f64, bound: f64) -> Self {
        Self { rays, wrong: exceeds(error, bound).into(), error, bound }
    }

    /// A yes or no.
    fn check(holds: bool) -> Self {
        Self::none_of(1, u64::from(!holds))
    }
}

/// Above a bound, or no number.
fn exceeds(value: f64, bound: f64) -> bool {
    value.is_nan() || value > bound
}

/// Runs cases; each row is also shown to `on_row` as soon as it is there. `options` gives the device's name, what interrupts, and the
/// safeguard that is off.
///
/// # Errors
/// What opening or running the device answers; a case that only does not hold is no error.
pub fn run(
    renderer: &Renderer,
    cases: &[Case],
    settings: &Settings,
    options: &Options,
    on_row: &mut dyn FnMut(&Row),
) -> Result<Vec<Row>> {
    let mut stress = Stress { renderer, options: options.clone(), settings, case: "", on_row, rows: Vec::new() };
    for case in cases {
        stress.case = case.name;
        (case.run)(&mut stress)?;
    }
    Ok(stress.rows)
}

impl Stress<'_> {
    /// Fewer of something where it must be quick.
    fn few<T: Clone>(&self, all: &[T], quick: &[T]) -> Vec<T> {
        if self.settings.quick { quick } else { all }.to_vec()
    }

    /// Judges one value of a parameter and writes its row. A device that cannot compute it does not hold.
    fn row(&mut self, parameter: &str, value: f64, find: impl FnOnce(&Self) -> Result<Finding>) -> Result<()> {
        self.options.go_on()?;
        let start = Instant::now();
        let (finding, note) = match find(self) {
            Ok(finding) => (finding, String::new()),
            Err(error @ (Error::Interrupted | Error::Vulkan { .. } | Error::Validation(_))) => return Err(error),
            Err(error) => (Finding { error: f64::INFINITY, ..Finding::check(false) }, error.to_string()),
        };
        let row = Row {
            case: self.case,
            parameter: parameter.into(),
            value,
            rays: finding.rays,
            wrong: finding.wrong,
            error: finding.error,
            bound: finding.bound,
            ms: start.elapsed().as_secs_f64() * 1e3,
            holds: !exceeds(finding.error, finding.bound),
            note,
        };
        (self.on_row)(&row);
        self.rows.push(row);
        Ok(())
    }
}

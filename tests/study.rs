//! Error against run time, and pictures that stop when an error or a time is reached.

use super::support::{draw, renderer};
use glimt::report::study::Study;
use glimt::scene::{built_in, Sampler, BUILT_IN};
use glimt::study::{run, Knob, Plan, Reference, Setting};
use glimt::{film, Film, Options};
use std::time::{Duration, Instant};

fn study(scene: &str, knobs: Vec<Knob>, reference: Reference) -> (Study, Vec<Film>) {
    let plan = Plan { knobs, reference, repeats: 3, target_rmse: Some(0.02) };
    let options = Options { size: (64, 48), ..Options::default() };
    let outcome = run(renderer(), &built_in(scene).unwrap(), &options, &plan, &mut |_, _| ()).unwrap();
    (outcome.study, outcome.references)
}

fn knob(name: &'static str, settings: &[Setting]) -> Knob {
    Knob { name, settings: settings.to_vec() }
}

#[test]
fn well_spread_samples_converge_faster_than_independent_ones() {
    let spp = knob("spp", &[4, 16, 64, 256].map(Setting::Samples));
    let samplers = knob("sampler", &[Sampler::Independent, Sampler::Stratified, Sampler::Sobol].map(Setting::Sampler));
    let (study, _) = study("table", vec![spp, samplers], Reference::Rendered);
    let slopes: Vec<f64> = study.series.iter().map(|series| series.slope_over_axis.unwrap().slope).collect();
    println!("slopes of independent, stratified, Sobol: {slopes:?}");
    assert!((slopes[0] + 0.5).abs() < 0.1, "independent samples: {}", slopes[0]);
    assert!(slopes[1] < slopes[0] - 0.1 && slopes[2] < slopes[0] - 0.1, "{slopes:?}");
    for series in &study.series {
        let first = &series.settings[0];
        assert!(series.noise_of_reference > 0.0 && series.noise_of_reference < first.rmse / 10.0);
        assert!(first.wall_ms.median > 0.0 && first.rays > 64 * 48 * 4 && first.flip > 0.0);
        let wall = |setting: &String| series.settings.iter().find(|m| m.setting == *setting).unwrap();
        if let Some(cheapest) = &series.cheapest_for_target {
            assert!(wall(cheapest).rmse <= 0.02);
        }
    }
    assert_eq!(study.csv().lines().count(), 13);
}

#[test]
fn depth_and_trees_are_knobs_too() {
    let depths = knob("max-depth", &[0, 1, 4].map(Setting::MaxDepth));
    let (study, references) = study("mirrors", vec![depths], Reference::Samples(64));
    let errors: Vec<f64> = study.series[0].settings.iter().map(|m| m.rmse).collect();
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "fewer reflections, more error: {errors:?}");
    let trees = knob("bvh", &[glimt::bvh::Quality::Fast, glimt::bvh::Quality::Best].map(Setting::Bvh));
    let given = Reference::Given(references[0].clone());
    let (study, _) = self::study("mirrors", vec![trees], given);
    let [fast, best] = &study.series[0].settings[..] else { panic!("{study:?}") };
    assert_eq!(fast.rmse_of_repeats, best.rmse_of_repeats, "the tree changes no pixel");
    assert!(study.reference_samples == 0 && study.series[0].slope_over_axis.is_none());
}

#[test]
fn the_estimated_error_is_the_true_one() {
    for (name, _) in BUILT_IN {
        let scene = built_in(name).unwrap();
        let size = (96, 72);
        let reference = draw(&scene, &Options { size, samples: 4096, seed: 1234, ..Options::default() }).0;
        for target in [1e-2, 2e-3] {
            let options = Options { size, target_error: Some(target), ..Options::default() };
            let (picture, report) = draw(&scene, &options);
            let reached = report.convergence.unwrap();
            let truth = film::compare_linear(&reference, &picture).unwrap().rmse;
            println!(
                "{name}, target {target:e}: {} samples, estimated {:.3e}, true {truth:.3e}, ratio {:.2}",
                reached.samples,
                reached.error,
                reached.error / truth
            );
            assert!(reached.reached == "error" && reached.error <= target);
            assert!((1.0 / 1.5..1.5).contains(&(reached.error / truth)), "{name}: {reached:?}, true {truth}");
        }
    }
}

#[test]
fn a_picture_ends_in_time() {
    let scene = built_in("cornell").unwrap();
    let options = Options { size: (64, 48), ..Options::default() };
    // Compiled before the clock runs.
    draw(&scene, &Options { target_error: Some(1.0), ..options.clone() });
    let start = Instant::now();
    let late = Options { deadline: Some(start), ..options.clone() };
    let (film, report) = draw(&scene, &late);
    assert_eq!(report.convergence.map(|reached| (reached.samples, reached.reached)), Some((4, "time")));
    assert!(film.pixels.iter().any(|pixel| pixel[0] > 0.0), "the first pass is always run");
    // However long other tests keep the device: with time enough there are more samples.
    let samples_within = |seconds: f64| {
        let deadline = Some(Instant::now() + Duration::from_secs_f64(seconds));
        draw(&scene, &Options { deadline, ..options.clone() }).1.convergence.unwrap().samples
    };
    assert!([0.4, 4.0, 40.0].into_iter().any(|seconds| samples_within(seconds) > 4));
    let stratified = Options { sampler: Sampler::Stratified, ..late };
    assert_eq!(renderer().render(&scene, &stratified).err().map(|error| error.exit_code()), Some(2));
}
